"""Links to Binder and Colab are there when the environment names the repository, and only then."""

from types import SimpleNamespace

import pytest

from tmalib.judging.book import launch

WORKFLOW = {"GITHUB_SERVER_URL": "https://github.com", "GITHUB_REPOSITORY": "somebody/book"}


@pytest.mark.parametrize(
    "environment", [{}, {"GITHUB_SERVER_URL": "https://github.com"}, WORKFLOW | {"GITHUB_REPOSITORY": ""}]
)
def test_no_address_no_links(environment):
    assert launch.repository(environment) is None
    assert launch.theme_options(environment) == {}


def test_what_the_theme_is_told():
    options = launch.theme_options(WORKFLOW)
    assert options["repository_url"] == "https://github.com/somebody/book"
    assert set(options["launch_buttons"]) == {"binderhub_url", "colab_url", "notebook_interface"}


def test_colab_opens_notebooks_of_one_server_only():
    options = launch.theme_options(WORKFLOW | {"GITHUB_SERVER_URL": "https://git.example.org"})
    assert options["repository_url"] == "https://git.example.org/somebody/book"
    assert "colab_url" not in options["launch_buttons"]


@pytest.mark.parametrize(("texts", "added"), [(["Binder"], 0), (["Binder", "Colab"], 1)])
def test_what_colab_must_run_first_stands_beside_the_link(texts, added):
    labels = {launch.FIRST_CELL: ("book/reproduce", "colab", "On Colab")}
    app = SimpleNamespace(env=SimpleNamespace(get_domain=lambda name: SimpleNamespace(labels=labels)))
    buttons = [{"text": text} for text in texts]
    groups = [{"label": "download-buttons", "buttons": []}, {"label": "launch-buttons", "buttons": buttons}]
    context = {"header_buttons": groups, "pathto": lambda page: f"../{page}.html"}
    launch.add_first_cell(app, "notebooks/use/x", "page.html", context, None)
    assert [button["url"] for button in buttons[len(texts) :]] == ["../book/reproduce.html#colab"] * added
    assert groups[0]["buttons"] == []
