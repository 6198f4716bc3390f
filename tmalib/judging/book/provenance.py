"""Where the figures and judged tables of a chapter come from: a folded list at its end, links to its cells.

Folded code is titled by what it draws: the start of the figure's caption.
"""

import re
from pathlib import Path

from docutils import nodes

from ..chapters import read
from ..collect import origins_in
from .ledger import cell_label, label_of, link, reference


def add_provenance(app, doctree):
    name_folded_code(doctree)
    name = f"{app.env.docname.removeprefix('notebooks/')}.ipynb"
    executed = Path(app.srcdir) / "build" / "executed" / name
    if executed.is_file() and (origins := origins_in(name, read(executed))):
        mark_cells(app.env, doctree, name, origins)
        sections = [node for node in doctree.children if isinstance(node, nodes.section)]
        (sections[0] if sections else doctree).append(listing(app.env, origins))


def name_folded_code(doctree):
    """«Code: the observer's path» instead of «Show code cell source», where a caption says what it draws."""
    for cell in doctree.findall(nodes.container):
        captions = list(cell.findall(nodes.caption)) if cell.get("nb_element") == "cell_code" else []
        if captions and cell.get("prompt_show", "").startswith("Show code cell"):
            words = re.split(r"[.:;,(]\s", captions[0].astext() + " ")[0]
            cell["prompt_show"] = cell["prompt_hide"] = f"Code: {words}"


def mark_cells(env, doctree, notebook, origins):
    """A label for every cell that is shown, and for one that is not, at the table it makes."""
    places = {}
    for cell in doctree.findall(nodes.container):
        if cell.get("nb_element") == "cell_code":
            places[cell["cell_index"]] = f"cell-{cell['cell_index']}"
            cell["ids"].append(places[cell["cell_index"]])
    for origin in origins:
        if origin.table:
            places.setdefault(origin.cell, label_of(origin.paper, origin.table))
    for cell, place in places.items():
        env.get_domain("std").note_hyperlink_target(cell_label(notebook, cell), env.docname, place)


def listing(env, origins):
    """The folded list."""
    items = nodes.bullet_list()
    for origin in sorted(origins, key=lambda origin: origin.cell):
        cell = f"cell {origin.cell}"
        if origin.table:
            what = link(env, label_of(origin.paper, origin.table), f"{origin.table}, judged")
            parts = [what, nodes.Text(": "), link(env, cell_label(origin.notebook, origin.cell), cell)]
        else:
            what = reference(env, origin.figure, nodes.literal("", origin.figure), kind="numref")
            parts = [what, nodes.Text(f": {cell}")]
        parts.append(nodes.Text("".join(f"; {source}" for source in origin.sources) + "."))
        items += nodes.list_item("", nodes.paragraph("", "", *parts))
    intro = nodes.paragraph("", "Made by ", nodes.literal("", f"notebooks/{origins[0].notebook}"))
    intro += nodes.Text(". For each: the cell and, where random numbers are in it, the runs behind it.")
    box = nodes.admonition(classes=["dropdown", "provenance"])
    box += [nodes.title("", "Where the figures and tables come from"), intro, items]
    return box


def setup(app):
    app.connect("doctree-read", add_provenance)
