"""Links that start a chapter elsewhere, on Binder or Colab, if the book knows where its repository is.

The address is that of the workflow that builds the book, in the environment, and is written nowhere else. A
book that is built elsewhere has no such links.
"""

import os

BINDER, COLAB = "https://mybinder.org", "https://colab.research.google.com"
BRANCH = "main"  # the one that is published
COLAB_READS = "https://github.com"  # Colab opens notebooks of no other server
FIRST_CELL = "colab"  # the label of the section that says what Colab needs first


def repository(environment):
    """Address of the repository, or None.

    Examples
    --------
    >>> repository({"GITHUB_SERVER_URL": "https://github.com", "GITHUB_REPOSITORY": "somebody/book"})
    'https://github.com/somebody/book'
    >>> repository({})
    """
    names = [environment.get(name) for name in ("GITHUB_SERVER_URL", "GITHUB_REPOSITORY")]
    return "/".join(names) if all(names) else None


def theme_options(environment):
    """What the theme has to know for its links; nothing without an address."""
    if not (address := repository(environment)):
        return {}
    buttons = {"binderhub_url": BINDER, "notebook_interface": "jupyterlab"}
    if environment["GITHUB_SERVER_URL"] == COLAB_READS:
        buttons["colab_url"] = COLAB
    return {
        "repository_url": address,
        "repository_provider": "github",
        "repository_branch": BRANCH,
        "use_repository_button": True,
        "launch_buttons": buttons,
    }


def set_theme_options(app, config):
    config.html_theme_options.update(theme_options(os.environ))


def add_first_cell(app, pagename, templatename, context, doctree):
    """Below the link to Colab, one that leads to the cell that must be run there first."""
    groups = [group for group in context.get("header_buttons", []) if group["label"] == "launch-buttons"]
    page, anchor, _ = app.env.get_domain("std").labels.get(FIRST_CELL, ("", "", ""))
    for buttons in (group["buttons"] for group in groups if page):
        if any(button["text"] == "Colab" for button in buttons):
            link = f"{context['pathto'](page)}#{anchor}"
            tip = "What Colab must run first"
            icon = "fas fa-circle-info"
            buttons.append(dict(type="link", text="Colab: first cell", tooltip=tip, icon=icon, url=link))
