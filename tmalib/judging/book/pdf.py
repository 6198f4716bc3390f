"""What the PDF of the book needs beyond Sphinx's own LaTeX: parts, and what paper shows in another way.

The captions of the table of contents become parts. Folded code is left out, for nobody runs it on paper; a
cell that shows nothing else leaves its title and number, so that verdicts lead somewhere. A live view leaves
its sentence. Wide tables get small type and widths for their columns.
"""

import re

from docutils import nodes
from sphinx import addnodes

import tmalib

FOLDED = {"tag_hide-input", "tag_hide-cell"}
WIDTHS = {  # of the columns of a table, by its class; those of other long tables follow from their words
    "in-words": (2, 3, 3, 6, 3),
    "errata-table": (6, 5, 9, 9, 10, 8, 6),
    "ledger-table": (6, 10, 6, 6, 5, 5, 7, 15),
    "phrase-table": (3, 4, 2, 6),
}
LONG = 30  # rows; Sphinx breaks such a table over pages
BREAK = "\u200b"  # where a line may break; ``pdf.tex`` gives it this meaning


def name_version(app, config):
    """The title page has the version of the library."""
    config.release = tmalib.__version__


def keep_captions(app, doctree):
    """Captions of the table of contents, which are gone when the files are put together."""
    if app.env.docname == app.config.root_doc:
        for toctree in doctree.findall(addnodes.toctree):
            toctree.parent["part"] = toctree["caption"] or ""
            toctree.parent["numbered"] = bool(toctree["numbered"])


def mark_live_views(app, doctree):
    """Cells with a live view, which only the web page can show."""
    for cell in cells_of(doctree):
        outputs = [raw.astext() for raw in cell.findall(nodes.raw)]
        cell["live"] = any('class="live"' in text for text in outputs)


def arrange(app, doctree, docname):
    """All changes, in the document of the whole book."""
    if app.builder.format != "latex":
        return
    add_labels(app.config.root_doc, doctree)
    make_parts(doctree)
    changes = (
        (nodes.container, is_cell, print_cell),
        (nodes.container, is_card, print_card),
        (nodes.math_block, has_tag, allow_tag),
        (nodes.table, bool, print_table),
        (nodes.admonition, is_provenance, print_provenance),
    )
    for kind, concerns, change in changes:
        for node in filter(concerns, list(doctree.findall(kind))):
            change(node)


def is_cell(node):
    return node.get("nb_element") == "cell_code"


def is_card(node):
    return node.get("design_component") == "card"


def has_tag(formula):
    return r"\tag" in formula.astext()


def is_provenance(box):
    return "provenance" in box["classes"]


def cells_of(doctree):
    return filter(is_cell, doctree.findall(nodes.container))


def tex(text):
    return nodes.raw("", text, format="latex")


def replace(node, *others):
    """Replace a node by others, of which it may be one."""
    parent, at = node.parent, node.parent.index(node)
    parent.remove(node)
    parent.insert(at, list(others))


def add_labels(root, doctree):
    """Labels of cells, rows and formulas that something leads to; Sphinx writes those of other nodes."""
    wanted = {ref["refuri"].partition("#")[2] for ref in doctree.findall(nodes.reference) if "refuri" in ref}
    for node in list(doctree.findall(nodes.Element)):
        if isinstance(node, nodes.container | nodes.row | nodes.math_block):
            for name in wanted.intersection(node["ids"]):
                label = tex(rf"\phantomsection\label{{\detokenize{{{docname_of(root, node)}:{name}}}}}")
                if isinstance(node, nodes.row):
                    next(node.findall(nodes.paragraph)).insert(0, label)
                elif isinstance(node, nodes.container):
                    node.insert(0, label)
                else:
                    replace(node, label, node)


def docname_of(root, node):
    """The file that a node of the whole book is from: Sphinx writes it into all sections but the first."""
    while node is not None and "docname" not in node:
        node = node.parent
    return node["docname"] if node is not None else root


def make_parts(doctree):
    """The first page becomes a chapter, the captions of the table of contents parts."""
    book = next(doctree.findall(nodes.section))
    parts = [node for node in book.findall(nodes.compound) if "part" in node]
    for part in parts:
        part.parent.remove(part)
    front = nodes.section("", *book.children, ids=["front"])
    book.children = []
    book += [front[0].deepcopy(), front]
    for part in parts:
        command = "numberedpart" if part["numbered"] else "plainpart"
        book += [tex(f"\\{command}{{{part['part']}}}" if part["part"] else ""), part]


def print_cell(cell):
    """Without code that is folded, and with a sentence for a live view."""
    folded = FOLDED & set(cell["classes"])
    for code in [node for node in cell.children if folded and "cell_input" in node.get("classes", ())]:
        cell.remove(code)
    if cell.get("live"):
        for block in list(cell.findall(nodes.literal_block)):
            block.replace_self(nodes.paragraph("", "", nodes.emphasis("", block.astext())))
    elif folded and not any(isinstance(node, nodes.container) for node in cell.children):
        title = re.sub(r"^(Show code cell \S+|Code: )", "", cell.get("prompt_show", ""))
        words = f"{title}: cell {cell['cell_index']}" if title else f"cell {cell['cell_index']}"
        cell += nodes.paragraph("", "", tex(r"\unprinted{"), nodes.Text(words), tex("}"))


def print_card(card):
    """A paragraph, its title being the link."""
    parts = {node.get("design_component"): node for node in card.findall(nodes.container)}
    (link,) = card.findall(nodes.reference)
    link.children = [nodes.strong("", parts["card-title"].astext().strip())]
    words = [text for text in card.findall(nodes.paragraph) if "sd-card-text" in text["classes"]]
    replace(card, nodes.paragraph("", "", link, nodes.Text(": "), *(part for text in words for part in text)))


def allow_tag(formula):
    r"""``\tag`` is not allowed within ``split``, which Sphinx puts around every formula."""
    formula["nowrap"] = True
    formula.children = [nodes.Text(f"\\begin{{equation*}}\n{formula.astext().strip()}\n\\end{{equation*}}")]


def print_table(table):
    """Lines of a cell close to each other; a ledger in small type, broken over pages."""
    for block in list(table.findall(nodes.line_block)):
        parts = [part for line in block.children for part in (tex(r"\newline{}"), *line.children)][1:]
        block.replace_self(nodes.paragraph("", "", *parts))
    rows = list(table.findall(nodes.row))
    kind = next((kind for kind in WIDTHS if kind in table["classes"]), "")
    if kind or len(rows) > LONG:
        widths = WIDTHS.get(kind, ())
        widths = widths if len(widths) == len(rows[0]) else widths_of(rows)
        form = r">{{\RaggedRight\arraybackslash}}\X{{{}}}{{{}}}"
        columns = "".join(form.format(width, sum(widths)) for width in widths)
        table["classes"].append("longtable")
        start, end = tex(r"\begingroup\footnotesize"), tex(r"\endgroup")
        replace(table, start, addnodes.tabular_col_spec(spec=columns), table, end)


def widths_of(rows):
    """Shares of columns: their mean number of letters, at least those of the longest word."""
    by_column = zip(*(row.children for row in rows), strict=True)
    columns = [[cell.astext() for cell in column] for column in by_column]
    words = [[len(word) for text in column for word in text.split()] for column in columns]
    longest = [
        min(max(lengths, default=0), 20) for lengths in words
    ]  # a formula breaks, or is short when set
    mean = [sum(map(len, column)) // len(column) for column in columns]
    return [2 + max(pair) for pair in zip(longest, mean, strict=True)]


def print_provenance(box):
    """In small type, and names of tasks may break at every point."""
    for text in list(box.findall(nodes.Text)):
        text.parent.replace(text, nodes.Text(re.sub(r"(?<=\w[._(/])(?=\w)", BREAK, text.astext())))
    replace(box, tex(r"\begingroup\footnotesize\RaggedRight"), box, tex(r"\endgroup"))
