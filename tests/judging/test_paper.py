"""Manifests and ledgers: those of the book are complete, and a wrong one is refused with its place."""

from collections import Counter

import numpy as np
import pytest
from toy_paper import LEDGER, MANIFEST, write_paper

from tmalib.judging import read_paper, read_papers
from tmalib.judging.paper import KINDS, Printed

PAPERS = read_papers()


def test_the_ledgers_are_complete_and_readable():
    rows = [row for paper in PAPERS.values() for row in paper.ledger.values()]
    assert {row.kind for row in rows} == set(KINDS)
    assert len({row.key for row in rows}) == len(rows)
    assert all(row.runs for row in rows if row.kind == "monte-carlo")
    assert all(np.isfinite(row.value) for row in rows if not row.in_words)
    assert Counter(row.table for row in PAPERS["emw-acoustic"].ledger.values())["Table I"] == 28


def test_the_order_is_that_of_the_book():
    assert list(PAPERS) == ["emw-acoustic", "conical-angles", "robustness"]


def test_a_number_belongs_to_one_stream():
    """Two papers may share a stream, but then under one name."""
    numbers = {}
    for paper in PAPERS.values():
        for name, number in paper.streams.items():
            assert numbers.setdefault(number, name) == name
    assert len(set(numbers.values())) == len(numbers)


def test_a_paper_is_read(toy):
    paper = read_paper(toy)
    assert (paper.key, paper.folder, paper.chapters) == ("toy", toy, ["coins"])
    assert paper.printed("Table 1", "heads", "mean") == Printed(
        "toy", "Table 1", "heads", "mean", "0.49", "1", "monte-carlo", 500
    )
    assert paper.printed("Table 1", "heads", "bound").runs is None
    assert (paper.stream("toy/coins").name, paper.stream("toy/coins").number) == ("toy/coins", 40)


@pytest.mark.parametrize(
    ("text", "unit"),
    [("342.38", 0.01), ("17998", 1.0), ("1.16e6", 1e4), ("5e-3", 1e-3), ("-4.33", 0.01), ("0", 1.0)],
)
def test_unit_of_the_last_digit(text, unit):
    assert Printed("p", "t", "r", "c", text, "m", "input", None).last_digit == pytest.approx(unit, rel=1e-12)


@pytest.mark.parametrize(
    ("manifest", "ledger", "message"),
    [
        (MANIFEST.replace("part = 4", ""), LEDGER, "must have"),
        (MANIFEST + "\n[extra]\n", LEDGER, "must have"),
        (MANIFEST, LEDGER.replace("Table 1,heads,mean", "Table 2,heads,mean"), "line 2: table 'Table 2' is"),
        (MANIFEST, LEDGER.replace("heads,std", "tails,std"), "line 3: row 'tails'"),
        (MANIFEST, LEDGER.replace("bound,0.5", "limit,0.5"), "line 4: column 'limit'"),
        (MANIFEST, LEDGER.replace("deterministic", "certain"), "line 4: kind 'certain' is unknown"),
        (MANIFEST, LEDGER.replace("unit,", ""), "the columns must be"),
        (MANIFEST, LEDGER + "Table 1,heads,mean,0.5,1,input,\n", "two rows have the same"),
    ],
)
def test_a_wrong_paper_is_refused(tmp_path, manifest, ledger, message):
    with pytest.raises(ValueError, match=message):
        read_paper(write_paper(tmp_path / "toy", manifest, ledger)).ledger  # noqa: B018


def test_what_is_not_printed_may_be_in_the_manifest(tmp_path):
    plain = read_paper(write_paper(tmp_path / "plain", MANIFEST, LEDGER))
    drawn = read_paper(
        write_paper(tmp_path / "drawn", MANIFEST + "\n[plausible]\nbeta = [1.0, 2.0]\n", LEDGER)
    )
    assert (plain.plausible, drawn.plausible) == ({}, {"beta": [1.0, 2.0]})


def test_unknown_names_are_refused(toy):
    paper = read_paper(toy)
    with pytest.raises(ValueError, match="no printed value"):
        paper.printed("Table 1", "heads", "median")
    with pytest.raises(ValueError, match="stream must be one of"):
        paper.stream("emw/1")
