"""What the PDF changes in the document of the book, node by node; `test_toy_paper` has the whole."""

import pytest
from docutils import nodes
from sphinx import addnodes

from tmalib.judging.book import pdf


def cell(*tags, prompt="Show code cell source", outputs=()):
    code = nodes.container("", nodes.literal_block("", "x = 1"), classes=["cell_input"])
    classes = ["cell", *tags]
    return nodes.container(
        "", code, *outputs, nb_element="cell_code", classes=classes, prompt_show=prompt, cell_index=7
    )


def output(*children):
    return nodes.container("", *children, classes=["cell_output"])


@pytest.mark.parametrize(
    ("printed", "expected"),
    [
        (cell(), "x = 1"),
        (cell("tag_hide-input"), "cell 7"),
        (cell("tag_hide-input", prompt="Code: imports"), "imports: cell 7"),
        (cell("tag_hide-input", outputs=[output(nodes.paragraph("", "A figure."))]), "A figure."),
    ],
)
def test_folded_code_is_left_out_and_named_where_nothing_else_is_shown(printed, expected):
    pdf.print_cell(printed)
    (shown,) = printed.children
    assert "".join(text for text in shown.findall(nodes.Text) if text.parent.tagname != "raw") == expected


def test_a_live_view_leaves_its_sentence():
    html = nodes.raw("", '<div class="live" data-live="frames">', format="html")
    printed = cell("tag_hide-input", outputs=[output(html, nodes.literal_block("", "Title. Sentence."))])
    pdf.mark_live_views(None, nodes.section("", printed))
    pdf.print_cell(printed)
    (sentence,) = printed.findall(nodes.emphasis)
    assert sentence.astext() == "Title. Sentence."
    assert not list(printed.findall(nodes.literal_block))


def table(*rows, kind=""):
    body = [nodes.row("", *(nodes.entry("", nodes.paragraph("", text)) for text in row)) for row in rows]
    made = nodes.table("", nodes.tgroup("", nodes.tbody("", *body), cols=len(rows[0])), classes=[kind])
    nodes.section("", made)
    return made


@pytest.mark.parametrize("kind", pdf.WIDTHS)
def test_a_ledger_fills_the_width_of_the_page(kind):
    made = table(["word"] * len(pdf.WIDTHS[kind]), kind=kind)
    pdf.print_table(made)
    (columns,) = made.parent.findall(addnodes.tabular_col_spec)
    shares = [part.partition("}{") for part in columns["spec"].replace("}>", "}\n>").splitlines()]
    shares = [(int(left.rpartition("{")[2]), int(right.rstrip("}"))) for left, _, right in shares]
    assert sum(width / unit for width, unit in shares) == pytest.approx(1)
    assert len(shares) == len(pdf.WIDTHS[kind])


def test_a_short_table_is_left_alone_and_a_long_one_has_widths():
    short, long = table(["a", "b"]), table(*[["a", "many more words"]] * (pdf.LONG + 1))
    for made in (short, long):
        pdf.print_table(made)
    assert not list(short.parent.findall(addnodes.tabular_col_spec))
    narrow, wide = pdf.widths_of(list(long.findall(nodes.row)))
    assert 0 < narrow < wide
    assert "longtable" in long["classes"]


def test_what_is_linked_has_a_label_of_its_file():
    row, block = (
        nodes.row("", nodes.entry("", nodes.paragraph()), ids=["row-1"]),
        nodes.math_block("", "x", ids=["eq"]),
    )
    links = [nodes.reference("", "", refuri=f"%book/page#{name}") for name in ("row-1", "eq", "elsewhere")]
    page = nodes.section("", row, block, nodes.paragraph("", "", *links), docname="book/page")
    pdf.add_labels("book/root", nodes.document(None, None, "", nodes.section("", page)))
    labels = [raw.astext() for raw in page.findall(nodes.raw)]
    assert labels == [
        rf"\phantomsection\label{{\detokenize{{book/page:{name}}}}}" for name in ("row-1", "eq")
    ]
