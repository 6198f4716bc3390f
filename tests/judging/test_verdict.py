"""The ledger, its verdicts, and what it refuses; `test_vector.py` is about the test of Monte-Carlo rows."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy.stats import binom

from tmalib import Stream, judging
from tmalib.judging import verdict as module
from tmalib.judging.paper import Printed

PAPERS = judging.read_papers()
PAPER, TABLE = PAPERS["emw-acoustic"], "Table I"
ROWS = ("xT", "yT", "vxT", "vyT")


@pytest.mark.parametrize(
    ("text", "unit"),
    [("342.38", 0.01), ("17998", 1.0), ("1.16e6", 1e4), ("5e-3", 1e-3), ("-4.33", 0.01), ("0", 1.0)],
)
def test_unit_of_the_last_digit(text, unit):
    row = Printed("p", "t", "r", "c", text, "m", "deterministic", None)
    assert row.last_digit == pytest.approx(unit, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "like", "text"),
    [
        (342.3781, "342.38", "342.38"),
        (1161234.0, "1.16e6", "1.16e6"),
        (0.00487, "5e-3", "5e-3"),
        (17997.5, "17998", "17998"),
    ],
)
def test_same_digits(value, like, text):
    assert judging.same_digits(value, like) == text


def judged(column, value, **changes):
    ours = judging.Ours(value, **changes)
    return judging.judge(PAPER, TABLE, {("xT", column): ours}).of("xT", column)


def runs_with(std, runs=20_000, heavy=0):
    """Gaussian runs with exactly this standard deviation; so many of them stray by fifty more."""
    found = np.random.default_rng(1).standard_normal(runs)
    found[:heavy] *= 50
    return found / found.std(ddof=1) * std


def judged_spread(std, **changes):
    ours = judging.of_runs(runs_with(std, **changes), "std")
    return judging.judge(PAPER, TABLE, {("xT", "std_mle"): ours}).of("xT", "std_mle")


def test_deterministic_verdicts():
    printed = PAPER.printed(TABLE, "xT", "std_crlb").value
    assert judged("std_crlb", printed + 0.004).verdict == judging.REPRODUCED
    assert judged("std_crlb", printed + 0.0099).verdict == judging.REPRODUCED
    assert judged("std_crlb", printed + 0.011).verdict == judging.NOT_REPRODUCED
    assert judged("std_crlb", printed - 0.011, erratum="emw-1").verdict == judging.NOT_REPRODUCED
    assert judged("std_crlb", printed, erratum="emw-1").verdict == judging.CORRECTED
    assert judged("std_crlb", printed, assumption="guessed").verdict == judging.UNSPECIFIED
    claim = judged("std_crlb", printed)
    assert (claim.probability, claim.detectable, claim.se) == (None, (), 0.0)


def test_a_count_must_be_the_same_integer():
    key = ("number of measurement couples", "value")
    printed = PAPERS["conical-angles"].printed("Section 5.2", *key).value
    for ours, expected in (
        (printed, judging.REPRODUCED),
        (printed + 1, judging.NOT_REPRODUCED),
        (printed - 1, judging.NOT_REPRODUCED),
    ):
        table = judging.judge(PAPERS["conical-angles"], "Section 5.2", {key: judging.Ours(ours)})
        assert table.of(*key).verdict == expected


def test_simulated_values_are_judged_like_printed_ones():
    row = PAPER.printed(TABLE, "xT", "std_crlb")
    simulated = replace(row, printed="350.00")
    (claim,) = judging.judge_rows([(simulated, judging.Ours(350.004))])
    assert (claim.printed, claim.verdict) == ("350.00", judging.REPRODUCED)
    assert judging.judge_rows([(row, judging.Ours(350.004))]).count(judging.NOT_REPRODUCED) == 1


def test_monte_carlo_verdicts():
    """The standard error of a spread of 500 Gaussian runs is ``s / sqrt(2 * 499)``, and ours adds."""
    printed = PAPER.printed(TABLE, "xT", "std_mle").value
    error = printed / np.sqrt(2) * np.sqrt(1 / 499 + 1 / 20_000)
    near = judged_spread(printed + error)
    assert near.verdict == judging.REPRODUCED
    ours = printed + error
    assert near.se == pytest.approx(error * ours / printed, rel=0.02)
    assert near.deviation == pytest.approx((error - 0.01) / near.se)
    assert near.probability == pytest.approx(0.32, abs=0.03)
    assert judged_spread(printed + 3 * error).verdict == judging.NOT_REPRODUCED
    assert judged_spread(printed - 3 * error).verdict == judging.NOT_REPRODUCED
    assert judged_spread(printed, runs=400).verdict == judging.INCONCLUSIVE, "fewer than the paper's"
    assert judged_spread(printed, heavy=30).verdict == judging.INCONCLUSIVE, "a few runs decide"
    assert judged_spread(printed).deviation == 0.0
    low, high = judged_spread(printed).accepted
    for end in (low, high):  # the printed value is as far from ours as the limit is
        at_limit = judged_spread(printed * printed / end)
        assert at_limit.verdict == judging.INCONCLUSIVE
        assert at_limit.note == module.AT_LIMIT


def test_rows_of_experiments_of_different_size_are_no_table():
    rows = [PAPER.printed(TABLE, row, "std_mle") for row in ("xT", "yT")]
    ours = [judging.of_runs(runs_with(row.value), "std") for row in rows]
    assert judging.judge_rows(zip(rows, ours, strict=True)).count(judging.REPRODUCED) == 2
    rows[1] = replace(rows[1], runs=100)
    with pytest.raises(ValueError, match="as many as the rest of its table"):
        judging.judge_rows(zip(rows, ours, strict=True))


def test_a_row_that_fails_with_the_others_only_says_so():
    """Two spreads of nearly the same errors, one printed larger than ours and one smaller."""
    rng, ours, rows = np.random.default_rng(3), {}, ("xT", "yT")
    common = rng.standard_normal(20_000)
    for row, factor in zip(rows, (1.05, 0.95), strict=True):
        errors = common + 0.05 * rng.standard_normal(20_000)
        wanted = PAPER.printed(TABLE, row, "std_mle").value / factor
        ours[row, "std_mle"] = judging.of_runs(errors / errors.std(ddof=1) * wanted, "std")
    table = judging.judge(PAPER, TABLE, ours)
    assert table.count(judging.INCONCLUSIVE) == table.count(judging.REPRODUCED) == 1
    (worst,) = (claim for claim in table if claim.verdict == judging.INCONCLUSIVE)
    assert worst.probability > worst.level
    assert worst.note.startswith(module.MISFIT)
    assert {claim.together for claim in table} == {table.found.together}
    assert table.found.together < table.found.level_together


def phrase(value, **changes):
    key = ("BLS, circular target", "claim")
    return judging.judge(PAPERS["robustness"], "Text", {key: judging.Ours(value, **changes)}).of(*key)


def test_what_a_consumer_needs_travels_with_the_claim():
    """Levels, range, shifts and the runs behind ours."""
    ours = {
        ("xT", "std_mle"): judging.of_runs(runs_with(340.0), "std"),
        ("xT", "std_crlb"): judging.Ours(342.38),
    }
    stream = Stream("own", 3)
    random, exact = judging.judge(PAPER, TABLE, ours, made_from=[stream, stream])
    assert random.level == pytest.approx(judging.ALPHA, abs=1e-3), "one row: all of the level"
    assert random.limit == pytest.approx(1.96, abs=0.01)
    low, high = random.accepted
    down, up = random.detectable
    assert low < 340 < high
    assert down > 340 - low
    assert up > high - 340
    assert (random.sources, exact.sources) == ((stream.source,), ())
    assert (exact.level, exact.together, exact.accepted) == (None, None, ())


@pytest.mark.parametrize(
    ("printed", "kind", "agreeing", "not_agreeing"),
    [
        ("342.38", "deterministic", (342.38, 342.3701, 342.3899), (342.3699, 342.3911)),
        ("1.16e6", "input", (1.15001e6, 1.1699e6), (1.1499e6, 1.18e6)),
        ("75", "count", (75,), (74, 76, 75.5)),
        ("0", "deterministic", (0.99, -0.99), (1.01, -1.01)),
    ],
)
def test_within_one_unit_of_the_last_digit(printed, kind, agreeing, not_agreeing):
    row = Printed("p", "t", "r", "c", printed, "m", kind, None)
    assert all(row.agrees(value) for value in agreeing)
    assert not any(row.agrees(value) for value in not_agreeing)


def test_verdicts_on_phrases():
    assert phrase(0.4, at_least=0.1).verdict == judging.REPRODUCED
    assert phrase(0.04, at_least=0.1).verdict == judging.NOT_REPRODUCED
    assert phrase(0.4, at_least=0.1, at_most=0.3).verdict == judging.NOT_REPRODUCED
    assumed = phrase(0.4, at_least=0.1, assumption="a geometry")
    assert assumed.verdict == judging.UNSPECIFIED
    assert assumed.note == "holds: at least 0.1 was asked; a geometry"
    assert phrase(0.04, at_least=0.1, assumption="a geometry").note.startswith("does not hold")
    assert judging.same_digits(0.12345, assumed.printed) == "0.123"


@pytest.mark.parametrize(
    ("among", "word"),
    [
        ((60, 60), judging.MOSTLY),
        ((52, 60), judging.MOSTLY),
        ((51, 60), judging.DEPENDS),  # 0.733 of them, at the least
        ((30, 60), judging.DEPENDS),
        ((9, 60), judging.DEPENDS),
        ((8, 60), judging.RARELY),
        ((3, 3), judging.DEPENDS),  # three scenarios say little
        ((0, 60), judging.RARELY),
    ],
)
def test_a_phrase_is_judged_by_the_share_of_plausible_scenarios(among, word):
    claim = phrase(0.4, at_least=0.1, among=among)
    assert claim.verdict == word == phrase(0.04, at_least=0.1, among=among).verdict
    assert claim.note.startswith(f"holds in {among[0]} of {among[1]} plausible scenarios (")
    low, high = judging.share_interval(*among)
    if among[0]:
        assert binom.sf(among[0] - 1, among[1], low) == pytest.approx(0.025, rel=1e-6)
    if among[0] < among[1]:
        assert binom.cdf(*among, high) == pytest.approx(0.025, rel=1e-6)


def test_verdicts_travel_as_json():
    table = judging.judge(
        PAPER, TABLE, {("xT", "std_crlb"): judging.Ours(342.38), ("yT", "std_crlb"): judging.Ours(0.0)}
    )
    random = judged_spread(340.0)
    (again,) = json.loads(json.dumps([asdict(random)], allow_nan=False))
    assert judging.Claim(**again) == random
    bundle = table._repr_mimebundle_()
    rows = json.loads(json.dumps(bundle[module.CLAIMS], allow_nan=False))
    wanted = {"paper", "table", "row", "column", "printed", "ours", "se", "probability", "verdict", "note"}
    assert all(wanted <= row.keys() for row in rows)
    assert table.count(judging.REPRODUCED) == table.count(judging.NOT_REPRODUCED) == 1
    assert "342.38" in bundle["text/plain"]
    assert len(table) == len(list(table)) == 2
    assert [judging.Claim(**row) for row in rows] == list(table), "the same dataclass where it is read"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PAPER.printed(TABLE, "xT", "nonsense"), "no printed value"),
        (lambda: judging.judge(PAPER, TABLE, {}), "nothing to judge"),
        (lambda: judging.judge(PAPER, "Table XX", {("xT", "true"): judging.Ours(1.0)}), "no printed value"),
        (lambda: judged("std_crlb", np.nan), "must be finite"),
        (lambda: judged("std_mle", 340.0), "needs runs"),
        (lambda: judging.of_runs([1.0, np.nan]), "runs must be two finite numbers"),
        (lambda: judged("std_crlb", 340.0, at_least=0.0), "are for text rows"),
        (lambda: phrase(0.4), "are for text rows"),
        (lambda: phrase(0.4, at_least=0.1, among=(4, 3)), "held and scenarios"),
        (lambda: judged("std_crlb", 340.0, among=(3, 4)), "among is for text rows"),
        (
            lambda: judging.judge(PAPER, TABLE, {("xT", "true"): judging.Ours(1.0)}).of("yT", "true"),
            "no claim on row",
        ),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
