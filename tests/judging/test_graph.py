"""The graph of statements shows what their marks say: every statement once, every foundation by a line."""

import re
from types import SimpleNamespace

import pytest
from bs4 import BeautifulSoup
from sphinx.util import texescape

from tmalib.judging.book import errata, graph
from tmalib.judging.statements import BASES, COLUMN, TABLE, Statement


def statement(row, rests_on=(), verdict="holds", **marks):
    steps = dict.fromkeys(("proved", "by_hand", "measured", "refuted", "left_open"), ()) | marks
    printed = dict(paper="toy", table=TABLE, row=row, column=COLUMN, printed="x", unit="1", runs=None)
    found = dict(verdict=verdict, erratum="", note="", notebook="toy/coins.ipynb", cell=7)
    return Statement(kind="statement", rests_on=rests_on, **printed, **steps, **found)


CLAIMS = [
    statement("Lemma A", proved=("a",)),
    statement("Lemma B", by_hand=("b",)),
    statement("Theorem", ("Lemma A", "Lemma B"), proved=("c",), by_hand=("d",)),
    statement("Remark", ("Theorem",), verdict="open", left_open=("e",)),
    statement("Claim in words", measured=("f",)),
]
BY_ROW = {claim.row: claim for claim in CLAIMS}
NUMBERED = {"Theorem", "Remark"}


def paper():
    kind = {row: "theorem" if row in NUMBERED else "claim" for row in BY_ROW}
    items = SimpleNamespace(items_of=lambda claim: [SimpleNamespace(kind=kind[claim.row])])
    return SimpleNamespace(contents=items)


def drawn():
    stated = graph.numbered(paper(), CLAIMS)
    links = {key: f"link-{claim.row}" for key, claim in stated.items()}
    html = graph.drawing(stated, graph.places(stated), links, "What rests on what")
    return stated, BeautifulSoup(html, "html.parser")


def test_numbered_statements_and_what_they_rest_on_are_drawn():
    stated, html = drawn()
    assert {claim.row for claim in stated.values()} == {"Lemma A", "Lemma B", "Theorem", "Remark"}
    assert [box["href"] for box in html.select("a")] == [f"link-{claim.row}" for claim in stated.values()]
    assert len(html.select("path")) == 3, "a line a foundation"


@pytest.mark.parametrize(
    ("row", "basis"),
    [("Lemma A", "proved"), ("Lemma B", "by hand"), ("Theorem", "proved, steps by hand"), ("Remark", "open")],
)
def test_a_box_says_on_what_its_verdict_rests(row, basis):
    _, html = drawn()
    (box,) = (box for box in html.select("a") if box["href"] == f"link-{row}")
    assert box["class"] == [graph.kind(basis)]
    assert basis in box["aria-label"]
    assert box.select("text")[-1].get_text() == BASES[basis], "also without colour"
    assert [item for item in html.select(".statement-legend li") if item.get_text().endswith(basis)]


def test_a_statement_is_right_of_what_it_rests_on_and_no_two_share_a_place():
    stated, _ = drawn()
    at = graph.places(stated)
    assert len(set(at.values())) == len(at)
    for key, claim in stated.items():
        assert all(at[below][0] < at[key][0] for below in graph.foundations(claim))


def test_the_weakest_below_decides():
    lemma, measured = statement("Lemma", by_hand=("a",)), statement("Table", measured=("b",))
    claims = [lemma, measured]
    claims += [
        statement("By lemma", ("Lemma",), proved=("c",)),
        statement("By table", ("Table",), proved=("d",)),
    ]
    claims += [statement("Above", ("By table",), by_hand=("e",)), statement("Alone", proved=("f",))]
    found = graph.standing({claim.key: claim for claim in claims})
    assert {key[2]: basis for key, basis in found.items()} == {
        "Lemma": "by hand", "Table": "measured", "By lemma": "proved, steps by hand", "By table": "measured",
        "Above": "measured", "Alone": "proved",
    }  # fmt: skip


def test_boxes_do_not_overlap():
    _, html = drawn()
    corners = [(float(r["x"]), float(r["y"])) for r in html.select("rect")]
    for k, (x, y) in enumerate(corners):
        for other_x, other_y in corners[:k]:
            assert abs(x - other_x) >= graph.WIDTH or abs(y - other_y) >= graph.HEIGHT


def test_a_box_leads_to_the_cell():
    assert graph.page_of(CLAIMS[0]) == "notebooks/toy/coins.html#cell-7"
    assert re.fullmatch(r"basis-[a-z-]+", graph.kind("proved, steps by hand"))


def test_a_line_to_a_farther_column_runs_between_the_boxes():
    """In the column that it passes, halfway between two lines of boxes."""
    (height,) = re.findall(r"C[^C]* ([\d.]+)H", graph.curve((0, 0.0), (2, 3.0)))
    boxes = [graph.corner_of((1, line))[1] for line in range(5)]
    assert all(not top <= float(height) <= top + graph.HEIGHT for top in boxes)


def test_the_evidence_of_an_erratum_is_the_cells_that_name_it():
    """Of statements, if there are any; each cell once."""
    rows = [("a", 3, "text", "toy-1"), ("a", 3, "count", "toy-2, toy-1"), ("b", 1, "statement", "toy-2")]
    named = [SimpleNamespace(notebook=n, cell=c, kind=k, erratum=e) for n, c, k, e in rows]
    assert errata.cells_naming(named, "toy-1") == [("a", 3)]
    assert errata.cells_naming(named, "toy-2") == [("b", 1)]
    assert errata.cells_naming(named, "toy") == []


def test_on_paper_the_same_is_drawn():
    stated, html = drawn()
    tex = graph.on_paper(stated, graph.places(stated))
    paths = [path["d"] for path in html.select("path")]
    assert re.findall(r"\\draw svg\[yscale=-1\] \{(.*?)\};", tex) == paths
    boxes = re.findall(r"\\statement\{(.*?)\}\{(.*?)\}\{(.*?)\}\{\\detokenize\{(.*?)\}\}\{(.*?)\}", tex)
    rects = [(float(rect["x"]), -float(rect["y"])) for rect in html.select("rect")]
    assert [(float(x), float(y)) for _, x, y, *_ in boxes] == rects
    assert [name for *_, name in boxes] == [claim.row for claim in stated.values()]
    assert {label for *_, label, _ in boxes} == {"notebooks/toy/coins:cell-7"}


@pytest.mark.parametrize("row", ["A_1 & B", "100 % of #1"])
def test_on_paper_signs_of_tex_are_words(row):
    texescape.init()
    tex = graph.box_on_paper(statement(row), "open", (2, 3))
    assert not re.search(r"(?<!\\)[_&%#]", tex)
