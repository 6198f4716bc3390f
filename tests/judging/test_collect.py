"""What executed notebooks carry is read, and an incomplete or contradictory ledger is refused."""

from dataclasses import asdict, replace

import pytest
from nbformat import v4
from toy_paper import CONTENTS, LEDGER, MANIFEST, notebook, write_notebook, write_paper

from tmalib import Source
from tmalib.judging import HOLDS, Claim, Statement, chapter, collect, read_paper, read_papers, verdict

EMW = {"emw-acoustic": read_papers()["emw-acoustic"]}
ROWS = list(EMW["emw-acoustic"].ledger.values())
RUNS = Source("module.task(number=1)", "emw/1", 2016, 500)


def claim(row, /, **changes):
    fields = dict(ours=1.0, se=0.0, erratum="", note="")
    made = Claim(**vars(row), **fields, verdict=verdict.REPRODUCED, notebook="n.ipynb")
    return replace(made, **changes)


def statement(row):
    marks = dict(proved=(), by_hand=("a",), measured=(), refuted=(), left_open=(), rests_on=())
    return Statement(**vars(row), **marks, verdict=HOLDS, erratum="", note="", notebook="n.ipynb")


def complete():
    return [statement(row) if row.kind == "statement" else claim(row) for row in ROWS]


def test_a_complete_ledger_is_accepted():
    assert collect.problems(complete(), EMW) == []


def test_an_unjudged_number_is_refused():
    (problem,) = collect.problems(complete()[1:], EMW)
    assert problem == "unjudged: emw-acoustic | Table I | xT | true"
    assert len(collect.problems([], read_papers())) == sum(len(p.ledger) for p in read_papers().values())


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda row: [claim(row), claim(row)], "judged 2 times"),
        (lambda row: [claim(row, verdict="nearly")], "unknown verdict 'nearly'"),
        (lambda row: [claim(row, printed="1.0")], "printed value differs"),
        (lambda row: [claim(row), claim(row, row="wT")], "not a published value"),
    ],
)
def test_wrong_claims_are_refused(wrong, message):
    (found,) = collect.problems([*wrong(ROWS[0]), *complete()[1:]], EMW)
    assert message in found


def test_what_statements_rest_on_is_looked_at():
    found = complete()
    place = next(i for i, each in enumerate(found) if isinstance(each, Statement))
    found[place] = replace(found[place], rests_on=("Nothing",))
    (problem,) = collect.problems(found, EMW)
    assert problem == f"{found[place].row} rests on Nothing, which is not judged"


def test_what_the_contents_lack_is_looked_at(tmp_path):
    contents = CONTENTS.replace('["Table 1"]', '["Table 1; heads; mean"]')
    toy = read_paper(write_paper(tmp_path / "toy", MANIFEST, LEDGER, contents))
    found = collect.problems([claim(row) for row in toy.ledger.values()], {"toy": toy})
    assert found == [f"toy: in no section: toy; Table 1; heads; {column}" for column in ("std", "bound")]


def test_claims_are_read_from_outputs_in_the_order_of_the_ledger(tmp_path):
    rows = [asdict(c) for c in complete()[:2]]
    cells = ("first", ("table", [v4.new_output("display_data", {verdict.CLAIMS: rows[::-1]})]))
    write_notebook(tmp_path / "executed/emw/chapter.ipynb", *cells)
    found = collect.all_claims(tmp_path / "executed", EMW)
    assert [(c.key, c.notebook, c.cell) for c in found] == [
        (row.key, "emw/chapter.ipynb", 1) for row in ROWS[:2]
    ]
    collect.write_claims(found, tmp_path / "claims.json")
    assert collect.read_claims(tmp_path / "claims.json") == found


def test_a_figure_and_a_table_name_their_runs():
    shown = {"mystnb": {"figure": {"name": "fig-x"}}}
    claims = [asdict(claim(row, sources=(RUNS,))) for row in ROWS[:3]]
    made = notebook(
        ("draw", [v4.new_output("display_data", {}, metadata={chapter.SOURCES: [asdict(RUNS)]})]),
        ("judge", [v4.new_output("execute_result", {verdict.CLAIMS: claims}, execution_count=1)]),
        "neither",
    )
    made.cells[0].metadata = shown
    figure, table = collect.origins_in("n.ipynb", made)
    assert (figure.figure, figure.cell, figure.sources) == ("fig-x", 0, (RUNS,))
    assert (table.paper, table.table, table.cell, table.sources) == ("emw-acoustic", "Table I", 1, (RUNS,))


def test_the_score_counts_every_verdict(toy):
    paper = read_paper(toy)
    words = (verdict.REPRODUCED, verdict.NOT_REPRODUCED, verdict.REPRODUCED)
    found = [claim(row, verdict=word) for row, word in zip(paper.ledger.values(), words, strict=True)]
    assert list(collect.score(found, {"toy": paper})) == [
        "toy: 3 of 3 judged (2 reproduced, 1 not reproduced)"
    ]
