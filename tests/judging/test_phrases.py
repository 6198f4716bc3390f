"""Phrases as measures with limits: what the file must say, what holds, and how they are judged."""

import numpy as np
import pytest
from toy_paper import LEDGER, MANIFEST, write_paper

from tmalib.judging import (
    CORRECTED,
    DEPENDS,
    NOT_REPRODUCED,
    Ours,
    Phrase,
    judge_phrases,
    phrases_of,
    read_paper,
    read_papers,
)
from tmalib.judging.phrases import CHOSEN
from tmalib.montecarlo import Runs, Source

SAID = """
["Table 1".heads]
measure = "share of heads"
at_least = 0.4
at_most = 0.6
chosen = "before"
erratum = "toy-1"
"""
TEXT = LEDGER + "Table 1,heads,claim,fair,1,text,\n"
MADE_FROM = [Runs({}, Source("", "toy", 1, 0))]


def toy_of(folder, said=SAID, ledger=TEXT):
    manifest = MANIFEST.replace('bound = "bound"', 'bound = "bound"\nclaim = ""')
    manifest = manifest.replace("[rows]", '[rows]\ntails = "share of tails"')
    toy = write_paper(folder / f"toy{len(list(folder.iterdir()))}", manifest, ledger)
    (toy / "phrases.toml").write_text(said, encoding="utf-8")
    return read_paper(toy)


def test_every_phrase_of_every_ledger_has_a_measure_with_a_limit_and_says_who_set_it():
    for paper in read_papers().values():
        tables = {key[0] for key, row in paper.ledger.items() if row.kind == "text"}
        assert tables == paper.phrases.keys()
        for table in tables:
            for phrase in phrases_of(paper, table).values():
                assert phrase.measure
                assert phrase.chosen in CHOSEN
                wanted = filter(None, phrase.erratum.split(", "))
                assert paper.errata.keys() >= set(wanted)


def test_limits_and_margins():
    bad = Phrase("", "before", at_least=0.1)
    good = Phrase("", "before", at_most=0.1)
    between = Phrase("", "before", at_least=-0.5, at_most=0.5)
    values = np.array([0.05, 0.1, 0.2, np.inf, np.nan])
    assert bad.holds(values).tolist() == [False, True, True, True, False]
    assert good.holds(values).tolist() == [True, True, False, False, False]
    assert between.holds([-0.6, -0.5, 0.5, 0.6]).tolist() == [False, True, True, False]
    assert bad.margin(0.2) == pytest.approx(2)
    assert good.margin(0.05) == pytest.approx(2)
    for phrase in (bad, good, between):
        sweep = np.linspace(-2, 2, 401)[1::2] if phrase is between else np.linspace(0.001, 2, 400)
        assert np.array_equal(phrase.margin(sweep) >= 1, phrase.holds(sweep))


def test_decided_is_so_many_standard_errors_from_every_limit():
    between = Phrase("", "before", at_least=-0.5, at_most=0.5)
    assert between.decided(0.0, 0.1)
    assert between.decided(1.0, 0.1)
    assert between.decided(-1.0, 0.1)
    assert not between.decided(0.4, 0.1)
    assert not between.decided(0.6, 0.1)
    assert not between.decided(-0.6, 0.1)
    assert Phrase("", "before", at_most=0.5).decided(-0.5, 0.1)


def test_a_phrase_is_judged_by_the_limits_of_its_file(tmp_path):
    paper = toy_of(tmp_path)
    fair, unfair = (
        judge_phrases(paper, "Table 1", {"heads": ours}, made_from=MADE_FROM).of("heads", "claim")
        for ours in (0.45, Ours(0.7, se=0.01, note="by hand"))
    )
    assert (fair.verdict, fair.erratum, fair.ours) == (CORRECTED, "toy-1", 0.45)
    assert fair.note == f"holds: at least 0.4 and at most 0.6 was asked; share of heads; {CHOSEN['before']}"
    assert (unfair.verdict, unfair.se) == (NOT_REPRODUCED, 0.01)
    assert unfair.note.endswith("; by hand")
    shared = judge_phrases(paper, "Table 1", {"heads": Ours(0.5, among=(5, 10))}, made_from=MADE_FROM)
    assert shared.of("heads", "claim").verdict == DEPENDS


def test_what_is_missing_is_named(tmp_path):
    paper = toy_of(tmp_path)
    with pytest.raises(ValueError, match="must be of the rows"):
        judge_phrases(paper, "Table 1", {"tails": 0.5}, made_from=MADE_FROM)
    with pytest.raises(ValueError, match="no phrases in 'Table 2'"):
        phrases_of(paper, "Table 2")
    for said, ledger, message in (
        (SAID, LEDGER, "ledger differ in"),
        (SAID, TEXT + "Table 1,tails,claim,fair,1,text,\n", "ledger differ in"),
        (SAID.replace("before", "later"), TEXT, "chosen must be one of"),
        (SAID.replace("at_least = 0.4\nat_most = 0.6\n", ""), TEXT, "needs at_least, at_most or both"),
    ):
        with pytest.raises(ValueError, match=message):
            phrases_of(toy_of(tmp_path, said, ledger), "Table 1")
