"""Where the figures and judged tables of a chapter come from: a folded list at its end, links to its cells.

Read from build/provenance.json, which tools/trace_notebooks.py makes from the code of the notebooks.
"""

from __future__ import annotations

from docutils import nodes
from ledger import cell_label, label_of, link, load_provenance
from sphinx import addnodes


class _Page:
    """What `ledger.link` needs of a directive."""

    def __init__(self, env):
        self.env = env


def add_provenance(app, doctree):
    env = app.env
    notebook = f"{env.docname}.ipynb"
    entries = [entry for entry in load_provenance(env) if entry["notebook"] == notebook]
    if not entries:
        return
    mark_cells(env, doctree, notebook, entries)
    sections = [node for node in doctree.children if isinstance(node, nodes.section)]
    (sections[0] if sections else doctree).append(listing(env, entries))


def mark_cells(env, doctree, notebook, entries):
    """A label for every cell that is shown, and for one that is not, at the table it makes."""
    places = {}
    for cell in doctree.findall(nodes.container):
        if cell.get("nb_element") == "cell_code":
            places[cell["cell_index"]] = f"cell-{cell['cell_index']}"
            cell["ids"].append(places[cell["cell_index"]])
    for entry in entries:
        if "table" in entry:
            places.setdefault(entry["cell"], label_of(entry["paper"], entry["table"]))
    for cell, place in places.items():
        env.get_domain("std").note_hyperlink_target(cell_label(notebook, cell), env.docname, place)


def listing(env, entries):
    """The folded list."""
    items = nodes.bullet_list()
    for entry in entries:
        item = nodes.paragraph()
        item += [what(env, entry), nodes.Text(": ")]
        if "table" in entry:
            cell = cell_label(entry["notebook"], entry["cell"])
            item += [link(_Page(env), cell, nodes.Text(f"cell {entry['cell']}"))]
        else:
            item += [nodes.Text(f"cell {entry['cell']}")]
        if entry["functions"]:
            item += [nodes.Text("; ")]
        for number, name in enumerate(entry["functions"]):
            item += [nodes.Text(", ")] * bool(number) + [nodes.literal("", name)]
        streams = ", ".join(entry["streams"])
        drawn = f"random stream {streams}, seed {entry['seed']}" if streams else "no random numbers"
        item += nodes.Text(f"; {drawn}.")
        items += nodes.list_item("", item)
    intro = nodes.paragraph("", "Made by ", nodes.literal("", entries[0]["notebook"]))
    intro += nodes.Text(". For each: the cell, what it and those before it use of the library, the dice.")
    box = nodes.admonition(classes=["dropdown", "provenance"])
    box += [nodes.title("", "Where the figures and tables come from"), intro, items]
    return box


def what(env, entry):
    """A reference to the figure or judged table."""
    if "table" in entry:
        label = label_of(entry["paper"], entry["table"])
        return link(_Page(env), label, nodes.Text(f"{entry['table']}, judged"))
    return addnodes.pending_xref(
        "", nodes.literal("", entry["figure"]), refdomain="std", reftype="numref", reftarget=entry["figure"],
        refexplicit=False, refwarn=True, refdoc=env.docname,
    )  # fmt: skip


def setup(app):
    app.connect("doctree-read", add_provenance)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
