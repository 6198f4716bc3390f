"""The notebook that a reader takes along: words where the chapter has roles and directives."""

from types import SimpleNamespace

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from tmalib.judging.book import downloads

DATA = "application/papermill.record/text/plain"


class Plain:
    """Words that show what was asked for; an unknown role has none."""

    def __call__(self, role, text):
        return None if role == "math" else f"<{role} {text}>"

    def directive(self, name, title, options, body):
        return f"[{name}|{title}|{options.strip()}|{body.strip()}]"


def test_roles_labels_and_directives_are_filled():
    prose = "(a-label)=\n# Title\nIn {ref}`one <two>` {math}`5` and {glue:text}`key:.2f`.\n\n"
    table = "```{table} A $x$\n:name: tab-a\n\n| {eq}`e` |\n```\n"
    wanted = "# Title\nIn <ref one <two>> {math}`5` and <glue:text key:.2f>.\n\n"
    assert downloads.filled(prose, Plain()) == wanted
    assert downloads.filled(table, Plain()) == "[table|A $x$|:name: tab-a|| <eq e> |]\n"


def test_captions_stand_below_their_figures_and_code_stays():
    picture = new_output(
        "display_data", {"image/svg+xml": "<svg/>", "application/pdf": "x", "text/plain": "Figure"}
    )
    figure = new_code_cell(
        "plot()",
        outputs=[picture],
        metadata={"mystnb": {"figure": {"caption": "Of {ref}`a`.", "name": "fig-a"}}},
    )
    made = downloads.readable(new_notebook(cells=[new_markdown_cell("{ref}`b`"), figure]), Plain(), None)
    assert [cell.source for cell in made.cells[1:]] == [
        "<ref b>",
        "plot()",
        "**<numref fig-a>.** Of <ref a>.",
    ]
    assert list(made.cells[2].outputs[0].data) == ["image/svg+xml", "text/plain"]
    nbformat.validate(made)


@pytest.mark.parametrize("address", [None, "https://git.example.org/somebody/book"])
def test_the_note_at_the_top_knows_the_repository_or_not(address):
    assert (str(address) in downloads.note(address)) == (address is not None)
    assert "make lab" in downloads.note(address)


@pytest.fixture
def words(tmp_path, monkeypatch):
    """Words of a page whose chapter has made two numbers known."""
    outputs = [
        new_output("display_data", {DATA: value}, metadata={"scrapbook": {"name": key}})
        for key, value in (("one", "1.2345"), ("two", "7"))
    ]
    folder = tmp_path / "build/executed/use"
    folder.mkdir(parents=True)
    nbformat.write(new_notebook(cells=[new_code_cell("", outputs=outputs)]), folder / "a.ipynb")
    domains = {
        "std": SimpleNamespace(
            labels={"here": ("p", "here", "The title")},
            anonlabels={"fig-x": ("p", "fig-x"), "tab-x": ("p", "tab-x")},
        ),
        "math": SimpleNamespace(equations={"e": ("p", 4)}),
    }
    numbers = {
        "p": {"figure": {"fig-x": (2, 1)}, "table": {"tab-x": (3,)}, "displaymath": {"equation-e": (5, 6)}}
    }
    env = SimpleNamespace(get_domain=domains.get, toc_fignumbers=numbers)
    return downloads.Words(SimpleNamespace(srcdir=tmp_path, env=env), "notebooks/use/a")


def test_words_for_roles(words):
    assert words("glue:text", "one:.2f") == "1.23"
    assert words("glue:text", "../use/a.ipynb::two:.0f") == "7"
    assert words("ref", "here") == "*The title*"
    assert words("ref", "this one <here>") == "*this one*"
    assert words("numref", "fig-x") == "Fig. 2.1"
    assert words("numref", "tab-x") == "Table 3"
    assert words("eq", "e") == "(5.6)"
    assert words("math", "5") is None


def test_words_for_directives(words):
    assert (
        words.directive("table", "Of two.", ":name: tab-x\n", "\n| a |\n|---|\n")
        == "**Table 3.** Of two.\n\n| a |\n|---|\n"
    )
    listed = words.directive("list-table", "Title", "", "\n* - a\n  - b\n* - 1\n  - 2|3\n")
    assert listed == "Title\n\n| a | b |\n|---|---|\n| 1 | 2\\|3 |"
    assert "x.py" in words.directive("literalinclude", "x.py", "", "")
