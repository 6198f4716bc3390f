"""The ledger and its test: its false-alarm rate, its power, and what it refuses."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from tmalib import Stream, judging, statistics
from tmalib.judging import verdict as module
from tmalib.judging.paper import Printed

PAPERS = judging.read_papers()
PAPER, TABLE = PAPERS["emw-acoustic"], "Table I"
RUNS, OURS = 500, 20_000
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


def simulated_paper(rng, heavy=False):
    """Printed and own values of a table whose every number is right.

    Twelve errors; the paper prints bias and standard deviation of 500, rounded, we have those of 20 000.
    """
    found = []
    for _ in range(12):
        theirs, ours = (rng.standard_t(9, n) if heavy else rng.standard_normal(n) for n in (RUNS, OURS))
        own = statistics(ours[:, None] + 0.3)
        pairs = (
            (np.mean(theirs + 0.3), own.bias, own.bias_se),
            (np.std(theirs, ddof=1), own.std, own.std_se),
        )
        for printed, value, se in pairs:
            found.append((round(float(printed), 2), judging.Ours(value[0], se()[0], se(RUNS)[0])))
    return found


def rejected(table, limit, shift=0.0):
    """Whether any row of a table is beyond the limit; the first row's printed value may be shifted."""
    (first, ours), *others = table
    rows = [(first + shift, ours), *others]
    return any(judging.z_score(printed, 0.01, value) > limit for printed, value in rows)


@pytest.mark.parametrize("heavy", [False, True])
def test_false_alarm_rate_is_the_nominal_one(heavy):
    """Papers that are right are questioned in about one case of twenty, and not much more seldom."""
    rng = np.random.default_rng(12)
    limit = judging.sidak_limit(24)
    papers = 400
    rate = np.mean([rejected(simulated_paper(rng, heavy), limit) for _ in range(papers)])
    spread = np.sqrt(judging.ALPHA * (1 - judging.ALPHA) / papers)
    assert 0.01 < rate < judging.ALPHA + 3 * spread


def test_planted_errors_are_found():
    """An error of the stated detectable size is found with the stated power; a small one is not."""
    rng = np.random.default_rng(13)
    limit = judging.sidak_limit(24)
    tables = [simulated_paper(rng) for _ in range(300)]
    spread = np.hypot(1 / np.sqrt(OURS), 1 / np.sqrt(RUNS))
    detectable = 0.005 + (limit + 0.8416) * spread
    found = np.mean([judging.z_score(t[0][0] + detectable, 0.01, t[0][1]) > limit for t in tables])
    assert found == pytest.approx(module.POWER, abs=0.08)
    assert np.mean([judging.z_score(t[0][0] + spread, 0.01, t[0][1]) > limit for t in tables]) < 0.2


def test_sidak_limit_grows_with_the_family():
    assert judging.sidak_limit(1) == pytest.approx(1.959964, abs=1e-6)
    assert judging.sidak_limit(16) > judging.sidak_limit(4) > judging.sidak_limit(1)


def judged(column, value, **changes):
    ours = judging.Ours(value, **changes)
    return judging.judge(PAPER, TABLE, {("xT", column): ours}).of("xT", column)


def test_deterministic_verdicts():
    printed = PAPER.printed(TABLE, "xT", "std_crlb").value
    assert judged("std_crlb", printed + 0.004).verdict == judging.REPRODUCED
    assert judged("std_crlb", printed + 0.0099).verdict == judging.REPRODUCED
    assert judged("std_crlb", printed + 0.011).verdict == judging.NOT_REPRODUCED
    assert judged("std_crlb", printed - 0.011, erratum="emw-1").verdict == judging.NOT_REPRODUCED
    assert judged("std_crlb", printed, erratum="emw-1").verdict == judging.CORRECTED
    assert judged("std_crlb", printed, assumption="guessed").verdict == judging.UNSPECIFIED
    claim = judged("std_crlb", printed)
    assert (claim.z, claim.detectable, claim.se) == (None, None, 0.0)


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
    printed = PAPER.printed(TABLE, "xT", "std_mle").value
    errors = {"se": 1.7, "se_printed": 10.8, "spread": 340.0}
    assert judged("std_mle", printed + 10, **errors).verdict == judging.REPRODUCED
    far = judged("std_mle", printed + 60, **errors)
    assert far.verdict == judging.NOT_REPRODUCED
    assert far.z == pytest.approx((60 - 0.005) / np.hypot(1.7, 10.8))
    assert judged("std_mle", printed, se=20.0, se_printed=10.8, spread=340.0).verdict == judging.INCONCLUSIVE
    heavy = {"se": 20.0, "se_printed": 140.0, "spread": 340.0}
    assert judged("std_mle", printed + 150, **heavy).verdict == judging.INCONCLUSIVE
    assert judged("std_mle", printed + 600, **heavy).verdict == judging.NOT_REPRODUCED
    assert judged("std_mle", printed + 0.004, **errors).z == 0.0


def phrase(value, **changes):
    key = ("BLS, circular target", "claim")
    return judging.judge(PAPERS["robustness"], "Text", {key: judging.Ours(value, **changes)}).of(*key)


def test_what_a_consumer_needs_travels_with_the_claim():
    """Limit, rounding and the runs behind ours; rounding from its definition."""
    errors = {"se": 3.0, "se_printed": 4.0, "spread": 340.0}
    ours = {("xT", "std_mle"): judging.Ours(340.0, **errors), ("xT", "std_crlb"): judging.Ours(342.38)}
    stream = Stream("own", 3)
    random, exact = judging.judge(PAPER, TABLE, ours, made_from=[stream, stream])
    assert random.rounding == pytest.approx(0.5 * 0.01 / 5.0)
    assert random.limit == judging.sidak_limit(1)
    assert (random.sources, exact.sources) == ((stream.source,), ())
    assert (exact.limit, exact.rounding) == (None, None)


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
    bundle = table._repr_mimebundle_()
    rows = json.loads(json.dumps(bundle[module.CLAIMS], allow_nan=False))
    wanted = {"paper", "table", "row", "column", "printed", "unit", "ours", "se", "z", "verdict", "note"}
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
        (lambda: judged("std_mle", 340.0), "needs standard errors"),
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
