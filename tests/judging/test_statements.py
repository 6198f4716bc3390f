"""A statement's verdict follows from its marks, and no mark claims a computation that did not come out."""

import ast
import builtins
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from toy_paper import LEDGER, MANIFEST, write_paper

from tmalib.judging import (
    AMENDED,
    FALSE,
    HOLDS,
    OPEN,
    Marks,
    collect,
    judge_statements,
    read_paper,
    statements,
)
from tmalib.judging.chapters import notebooks_in, read
from tmalib.judging.verdict import CLAIMS

ROOT = Path(__file__).parents[2]
ROWS = "Statements,Theorem,claim,all is well,1,statement,\nStatements,Lemma,claim,it works,1,statement,\n"


@pytest.fixture
def paper(tmp_path):
    manifest = MANIFEST.replace("[rows]", 'Statements = "Statements"\n[rows]')
    manifest = manifest.replace("[streams]", 'claim = ""\n[streams]')
    return read_paper(write_paper(tmp_path / "toy", manifest, LEDGER + ROWS))


def verdict(paper, **marks):
    (claim,) = judge_statements(paper, {"Theorem": Marks(**marks)})
    return claim.verdict, claim.basis


@pytest.mark.parametrize(
    ("marks", "expected"),
    [
        (dict(proved={"a": True}), (HOLDS, "proved")),
        (dict(proved={"a": np.True_}, by_hand=["b"]), (HOLDS, "proved, steps by hand")),
        (dict(by_hand=["b"], measured={"c": True}), (HOLDS, "by hand")),
        (dict(measured={"c": True}), (HOLDS, "measured")),
        (dict(proved={"a": True}, erratum="e-1"), (AMENDED, "proved")),
        (dict(proved={"a": True}, refuted={"d": True}, erratum="e-1"), (AMENDED, "proved")),
        (dict(refuted={"d": True}), (FALSE, "false")),
        (dict(refuted={"d": True}, erratum="e-1"), (FALSE, "false")),
        (dict(proved={"a": True}, left_open=["f"]), (OPEN, "open")),
        (dict(left_open=["f"]), (OPEN, "open")),
    ],
)
def test_the_verdict_follows_from_the_marks(paper, marks, expected):
    assert verdict(paper, **marks) == expected


@pytest.mark.parametrize("shown", [False, np.False_, 1, "yes", [True], [], None, np.array([True, True])])
@pytest.mark.parametrize("kind", ["proved", "measured", "refuted"])
def test_a_mark_needs_a_computed_true(paper, kind, shown):
    with pytest.raises(ValueError, match=f"Theorem: {kind} 'a step' must be a computed True"):
        verdict(paper, **{kind: {"a step": shown}})


@pytest.mark.parametrize(
    ("marks", "message"),
    [
        ({}, "there is no mark"),
        (dict(rests_on=["Lemma"]), "there is no mark"),
        (dict(proved={"a": True}, refuted={"d": True}), "supported and contradicted"),
        (dict(by_hand="one step"), "by_hand must be a list"),
        (dict(by_hand=["a"], rests_on=["Conjecture"]), "no printed value"),
    ],
)
def test_marks_without_a_verdict_are_refused(paper, marks, message):
    with pytest.raises(ValueError, match=message):
        verdict(paper, **marks)


def test_only_statements_are_stated(paper):
    with pytest.raises(ValueError, match="no printed value"):
        judge_statements(paper, {"heads": Marks(by_hand=["a"])})


def test_a_statement_travels_as_other_claims_do(paper):
    found = judge_statements(paper, {"Theorem": Marks(proved={"a": True}, by_hand=["b"], rests_on=["Lemma"])})
    (row,) = found._repr_mimebundle_()[CLAIMS]
    assert statements.read_claim(row) == found.of("Theorem", "claim")
    assert "proved: a" in found._repr_mimebundle_()["text/plain"]


def judged(paper, **rests_on):
    marks = {row: Marks(by_hand=["a"], rests_on=below) for row, below in rests_on.items()}
    return list(judge_statements(paper, marks))


def test_a_statement_that_holds_rests_on_what_holds(paper):
    theorem, lemma = judged(paper, Theorem=["Lemma"], Lemma=[])
    assert statements.wrong_foundations([theorem, lemma]) == []
    assert statements.heights({c.key: c for c in (theorem, lemma)}) == {lemma.key: 0, theorem.key: 1}
    for word in (FALSE, OPEN):
        (problem,) = statements.wrong_foundations([theorem, replace(lemma, verdict=word)])
        assert problem == f"Theorem is said to hold, and rests on Lemma, which is {word}"
    assert statements.wrong_foundations([theorem]) == ["Theorem rests on Lemma, which is not judged"]
    circle = judged(paper, Theorem=["Lemma"], Lemma=["Theorem"])
    assert statements.wrong_foundations(circle) == ["Theorem rests on itself", "Lemma rests on itself"]


def test_an_unknown_verdict_on_a_statement_is_refused(paper):
    (theorem,) = judged(paper, Theorem=[])
    found = collect.problems([replace(theorem, verdict="reproduced")], {"toy": paper})
    assert any("unknown verdict 'reproduced'" in problem for problem in found)
    assert asdict(theorem)["verdict"] == HOLDS


CALLS = [
    (name, call)
    for name, path in notebooks_in(ROOT / "notebooks").items()
    for cell in read(path).cells
    if cell.cell_type == "code"
    for call in ast.walk(ast.parse(cell.source))
    if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "Marks"
]


def test_the_chapters_state_something():
    assert len(CALLS) > 50


@pytest.mark.parametrize(("name", "call"), CALLS, ids=[f"{name}:{call.lineno}" for name, call in CALLS])
def test_no_mark_of_a_chapter_is_a_constant(name, call):
    """A condition names something that its cell, or one before, has computed."""
    for keyword in call.keywords:
        if keyword.arg in ("proved", "measured", "refuted"):
            assert isinstance(keyword.value, ast.Dict), name
            for condition in keyword.value.values:
                names = {node.id for node in ast.walk(condition) if isinstance(node, ast.Name)}
                assert names - set(dir(builtins)), ast.unparse(condition)
