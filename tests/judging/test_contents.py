"""Every item of every section of the papers is judged or shown, and every row of a ledger is in a section."""

import re
from pathlib import Path

import pytest
from toy_paper import CONTENTS, LEDGER, MANIFEST, write_paper

from tmalib.judging import read_paper, read_papers
from tmalib.judging.chapters import notebooks_in, read
from tmalib.judging.contents import NUMBERED, gaps
from tmalib.judging.prose import pages_of, texts_of

ROOT = Path(__file__).parents[2]
PAPERS = read_papers()
LABEL = re.compile(r"(?m)^\(([a-z0-9-]+)\)=$|^:name: (\S+)$|\$\$ \(([a-z0-9-]+)\)$")


def labels():
    """All labels of the book: of sections, formulas and figures."""
    found = set()
    for page in pages_of(ROOT / "book", ROOT / "notebooks"):
        found |= {"".join(match) for text in texts_of(page) for match in LABEL.findall(text)}
    for path in notebooks_in(ROOT / "notebooks").values():
        figures = [cell.metadata.get("mystnb", {}).get("figure", {}) for cell in read(path).cells]
        found |= {figure["name"] for figure in figures if "name" in figure}
    return found


@pytest.mark.parametrize("paper", PAPERS.values(), ids=PAPERS)
def test_nothing_is_missing(paper):
    assert gaps(paper) == []


@pytest.mark.parametrize("paper", PAPERS.values(), ids=PAPERS)
def test_every_label_is_one_of_the_book(paper):
    items = [item for section in paper.contents.sections for item in section.items]
    assert {label for item in items for label in item.see} - labels() == set()
    wrong = [
        i.name for i in items if i.kind in NUMBERED and not any(part[0] == "Statements" for part in i.judged)
    ]
    assert wrong == [], "a numbered item is judged as a statement"


@pytest.mark.parametrize("paper", PAPERS.values(), ids=PAPERS)
def test_the_page_of_verdicts_shows_every_group(paper):
    page = (ROOT / f"book/verdicts/{paper.folder.name}.md").read_text(encoding="utf-8")
    shown = re.findall(rf"```{{ledger-table}} {paper.key}\n:of: (\w+)\n", page)
    assert set(shown) == {row.group for row in paper.ledger.values()}


@pytest.mark.parametrize("paper", PAPERS.values(), ids=PAPERS)
def test_the_errata_in_short_lead_to_a_place_in_a_chapter(paper):
    """Not to a chapter as a whole, whose label is the first of its page."""
    page = (ROOT / f"book/errata/{paper.folder.name}.md").read_text(encoding="utf-8")
    assert page.count(f"```{{errata-table}} {paper.key}\n") == 1
    chapters = list(notebooks_in(ROOT / "notebooks").values())
    tops = {LABEL.match(read(path).cells[0].source)[1] for path in chapters}
    for name, short in paper.contents.errata.items():
        links = set(re.findall(r"\{(?:num)?(?:ref|eq)\}`(?:[^`<]*<)?([^`>]+)>?`", short["evidence"]))
        assert not links & tops, name


def test_the_numbered_items_are_all_there():
    """As the papers number them: 3 theorems and 2 remarks; 12 propositions and 3 theorems."""
    found = {
        key: {(i.kind, i.name) for s in p.contents.sections for i in s.items} for key, p in PAPERS.items()
    }
    expected = {("theorem", f"Theorem {n}") for n in (1, 2, 3)}
    expected |= {("remark", f"Remark {n}") for n in ("1.1", "1.2", "1.3", "1.4", "2")}
    assert expected <= found["conical-angles"]
    expected = {("theorem", f"Theorem {n}") for n in (1, 2, 3)}
    assert expected | {("proposition", f"Proposition {n}") for n in range(1, 13)} <= found["robustness"]
    assert {("equation", f"({n})") for n in range(1, 8)} <= found["emw-acoustic"]
    assert {("equation", f"({n})") for n in range(1, 16)} <= found["conical-angles"]
    assert {("equation", f"({n})") for n in range(1, 7)} <= found["robustness"]


def item(text):
    return CONTENTS.replace('{ kind = "table", name = "Table 1", judged = ["Table 1"] }', text)


@pytest.mark.parametrize(
    ("contents", "problem"),
    [
        (item('{ kind = "figure", name = "Figure 1", see = ["fig-toy"] }'), "in no section: toy; Table 1"),
        (item('{ kind = "table", name = "T", judged = ["Table 1; heads; mean"] }'), "Table 1; heads; std"),
        (item('{ kind = "table", name = "T", see = ["a"] }, { kind = "table", name = "T", see = ["b"] }'),
         "toy: listed 2 times: 1 table T"),
        (item('{ kind = "table", name = "T", judged = ["Table 1", "Table 2"] }'), "under Table 2, where"),
        (CONTENTS + '[errata.toy-1]\n' + "".join(f'{n} = "x"\n' for n in
         ("where", "printed", "corrected", "evidence", "consequence")), "not those of the manifest"),
    ],
)  # fmt: skip
def test_a_gap_is_found(tmp_path, contents, problem):
    found = gaps(read_paper(write_paper(tmp_path / "toy", MANIFEST, LEDGER, contents)))
    assert any(problem in line for line in found)


@pytest.mark.parametrize(
    ("contents", "message"),
    [
        (item('{ kind = "table", name = "Table 1" }'), "judged or seen somewhere"),
        (item('{ kind = "joke", name = "Table 1", judged = ["Table 1"] }'), "an item has a kind"),
        (CONTENTS + "[more]\n", "must have section and errata"),
        (CONTENTS + '[errata.toy-1]\nprinted = "x"\n', "erratum toy-1 must have"),
    ],
)
def test_contents_of_another_form_are_refused(tmp_path, contents, message):
    with pytest.raises(ValueError, match=message):
        read_paper(write_paper(tmp_path / "toy", MANIFEST, LEDGER, contents)).contents  # noqa: B018


def test_rows_stand_in_the_order_of_the_sections(toy):
    paper = read_paper(toy)
    row = paper.printed("Table 1", "heads", "mean")
    assert (paper.contents.order_of(row), paper.contents.place_of(row)) == ((0, 0), "1")
    with pytest.raises(ValueError, match="no section lists"):
        read_paper(write_paper(toy, contents=CONTENTS.replace('"Table 1"]', '"Table 2"]'))).contents.order_of(
            row
        )
