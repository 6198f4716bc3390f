"""Outputs of a chapter come from its execution; a folded list at its end says what they were made from.

Folded code is titled by what it draws: the start of the figure's caption. A chapter's imports are folded.
"""

import json
import re
from pathlib import Path

from docutils import nodes

from ..chapters import read
from ..collect import origins_in
from ..statements import TABLE as STATEMENTS
from .ledger import cell_label, label_of, link


def executed(app, docname):
    """The execution of a chapter, a file; None for another page."""
    folder, _, name = docname.partition("/")
    return Path(app.srcdir) / "build" / "executed" / f"{name}.ipynb" if folder == "notebooks" else None


def take_outputs(app, docname, source):
    """A chapter is read as it was executed, so that the book executes nothing."""
    if path := executed(app, docname):
        chapter = json.loads(path.read_text(encoding="utf-8"))
        fold_imports(chapter["cells"])
        source[0] = json.dumps(chapter)


def fold_imports(cells):
    """Fold the first cell of code, if it begins with imports and nothing else is said of it."""
    first = next((cell for cell in cells if cell["cell_type"] == "code"), None)
    if (
        first
        and "".join(first["source"]).startswith(("from ", "import "))
        and not first["metadata"].get("tags")
    ):
        first["metadata"]["tags"] = ["hide-input"]
        first["metadata"]["mystnb"] = dict.fromkeys(("code_prompt_show", "code_prompt_hide"), "Code: imports")


def add_provenance(app, doctree):
    path, name = executed(app, app.env.docname), f"{app.env.docname.partition('/')[2]}.ipynb"
    if path and (origins := origins_in(name, read(path))):
        cells = [node for node in doctree.findall(nodes.container) if node.get("nb_element") == "cell_code"]
        name_folded_code(cells)
        mark_cells(app.env, cells, name, origins)
        sections = [node for node in doctree.children if isinstance(node, nodes.section)]
        (sections[0] if sections else doctree).append(listing(app.env, origins))


def name_folded_code(cells):
    """«Code: the observer's path» instead of «Show code cell source», where a caption says what it draws."""
    for cell in cells:
        captions = list(cell.findall(nodes.caption))
        if captions and cell.get("prompt_show", "").startswith("Show code cell"):
            words = re.split(r"[.:;,(]\s", captions[0].astext() + " ")[0]
            cell["prompt_show"] = cell["prompt_hide"] = f"Code: {words}"


def mark_cells(env, cells, notebook, origins):
    """A label for every cell that is shown, and for one that is not, at the table it makes."""
    tables = [
        origin for origin in reversed(origins) if origin.table not in ("", STATEMENTS)
    ]  # the first wins
    places = {origin.cell: label_of(origin.paper, origin.table) for origin in tables}
    for cell in cells:
        places[cell["cell_index"]] = f"cell-{cell['cell_index']}"
        cell["ids"].append(places[cell["cell_index"]])
    for index, place in places.items():
        env.get_domain("std").note_hyperlink_target(cell_label(notebook, index), env.docname, place)


def listing(env, origins):
    """The folded list."""
    items = nodes.bullet_list()
    for origin in sorted(origins, key=lambda origin: origin.cell):
        what, cell = link(env, origin.figure, origin.figure, kind="numref"), nodes.Text(f"cell {origin.cell}")
        if origin.table:
            place = label_of(origin.paper, origin.table)
            if origin.table == STATEMENTS:  # they have no table in the chapter
                place = cell_label(origin.notebook, origin.cell)
            what = link(env, place, f"{origin.table}, judged")
            cell = link(env, cell_label(origin.notebook, origin.cell), f"cell {origin.cell}")
        runs = nodes.Text("".join(f"; {source}" for source in origin.sources) + ".")
        items += nodes.list_item("", nodes.paragraph("", "", what, nodes.Text(": "), cell, runs))
    intro = nodes.paragraph("", "Made by ", nodes.literal("", f"notebooks/{origins[0].notebook}"))
    intro += nodes.Text(". For each: the cell and, where random numbers are in it, the runs behind it.")
    box = nodes.admonition(classes=["dropdown", "provenance"])
    box += [nodes.title("", "Where the figures and tables come from"), intro, items]
    return box
