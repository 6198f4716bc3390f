"""The ledger and its test: its false-alarm rate, its power, and what it refuses."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tmalib import claims, statistics

PAPER, TABLE = "emw-acoustic", "Table I"
RUNS, OURS = 500, 20_000
ROWS = ("xT", "yT", "vxT", "vyT")


def test_ledger_is_complete_and_readable():
    rows = claims.ledger()
    assert {row.kind for row in rows.values()} == {"input", "deterministic", "count", "monte-carlo", "text"}
    words = [row for row in rows.values() if row.kind == "text"]
    numbers = [row for row in rows.values() if row.kind != "text"]
    assert len(numbers) == 309
    assert all(row.printed and row.paper == "robustness" for row in words)
    assert all(row.runs for row in rows.values() if row.kind == "monte-carlo")
    assert sum(key[:2] == (PAPER, TABLE) for key in rows) == 28
    assert all(np.isfinite(row.value) for row in numbers)


@pytest.mark.parametrize(
    ("text", "unit"),
    [("342.38", 0.01), ("17998", 1.0), ("1.16e6", 1e4), ("5e-3", 1e-3), ("-4.33", 0.01), ("0", 1.0)],
)
def test_unit_of_the_last_digit(text, unit):
    row = claims.Printed("p", "t", "r", "c", text, "m", "deterministic", None)
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
    assert claims.same_digits(value, like) == text


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
            found.append((round(float(printed), 2), claims.Ours(value[0], se()[0], se(RUNS)[0])))
    return found


def rejected(table, limit, shift=0.0):
    """Whether any row of a table is beyond the limit; the first row's printed value may be shifted."""
    (first, ours), *others = table
    rows = [(first + shift, ours), *others]
    return any(claims.z_score(printed, 0.01, value) > limit for printed, value in rows)


@pytest.mark.parametrize("heavy", [False, True])
def test_false_alarm_rate_is_the_nominal_one(heavy):
    """Papers that are right are questioned in about one case of twenty, and not much more seldom."""
    rng = np.random.default_rng(12)
    limit = claims.sidak_limit(24)
    papers = 400
    rate = np.mean([rejected(simulated_paper(rng, heavy), limit) for _ in range(papers)])
    spread = np.sqrt(claims.ALPHA * (1 - claims.ALPHA) / papers)
    assert 0.01 < rate < claims.ALPHA + 3 * spread


def test_planted_errors_are_found():
    """An error of the stated detectable size is found with the stated power; a small one is not."""
    rng = np.random.default_rng(13)
    limit = claims.sidak_limit(24)
    tables = [simulated_paper(rng) for _ in range(300)]
    spread = np.hypot(1 / np.sqrt(OURS), 1 / np.sqrt(RUNS))
    detectable = 0.005 + (limit + 0.8416) * spread
    found = np.mean([claims.z_score(t[0][0] + detectable, 0.01, t[0][1]) > limit for t in tables])
    assert found == pytest.approx(claims.POWER, abs=0.08)
    assert np.mean([claims.z_score(t[0][0] + spread, 0.01, t[0][1]) > limit for t in tables]) < 0.2


def test_sidak_limit_grows_with_the_family():
    assert claims.sidak_limit(1) == pytest.approx(1.959964, abs=1e-6)
    assert claims.sidak_limit(16) > claims.sidak_limit(4) > claims.sidak_limit(1)


def verdict(column, value, **changes):
    ours = claims.Ours(value, **changes)
    return claims.judge(PAPER, TABLE, {("xT", column): ours}).of("xT", column)


def test_deterministic_verdicts():
    printed = claims.printed(PAPER, TABLE, "xT", "std_crlb").value
    assert verdict("std_crlb", printed + 0.004).verdict == claims.REPRODUCED
    assert verdict("std_crlb", printed + 0.0099).verdict == claims.REPRODUCED
    assert verdict("std_crlb", printed + 0.011).verdict == claims.NOT_REPRODUCED
    assert verdict("std_crlb", printed - 0.011, erratum="emw-1").verdict == claims.NOT_REPRODUCED
    assert verdict("std_crlb", printed, erratum="emw-1").verdict == claims.CORRECTED
    assert verdict("std_crlb", printed, assumption="guessed").verdict == claims.UNSPECIFIED
    claim = verdict("std_crlb", printed)
    assert (claim.z, claim.detectable, claim.se) == (None, None, 0.0)


def test_a_count_must_be_the_same_integer():
    key = ("number of measurement couples", "value")
    printed = claims.printed("conical-angles", "Section 5.2", *key).value
    for ours, expected in (
        (printed, claims.REPRODUCED),
        (printed + 1, claims.NOT_REPRODUCED),
        (printed - 1, claims.NOT_REPRODUCED),
    ):
        judged = claims.judge("conical-angles", "Section 5.2", {key: claims.Ours(ours)})
        assert judged.of(*key).verdict == expected


def test_simulated_values_are_judged_like_printed_ones():
    row = claims.printed(PAPER, TABLE, "xT", "std_crlb")
    simulated = replace(row, printed="350.00")
    (claim,) = claims.judge_rows([(simulated, claims.Ours(350.004))])
    assert (claim.printed, claim.verdict) == ("350.00", claims.REPRODUCED)
    assert claims.judge_rows([(row, claims.Ours(350.004))]).count(claims.NOT_REPRODUCED) == 1


def test_monte_carlo_verdicts():
    printed = claims.printed(PAPER, TABLE, "xT", "std_mle").value
    errors = {"se": 1.7, "se_printed": 10.8, "spread": 340.0}
    assert verdict("std_mle", printed + 10, **errors).verdict == claims.REPRODUCED
    far = verdict("std_mle", printed + 60, **errors)
    assert far.verdict == claims.NOT_REPRODUCED
    assert far.z == pytest.approx((60 - 0.005) / np.hypot(1.7, 10.8))
    assert verdict("std_mle", printed, se=20.0, se_printed=10.8, spread=340.0).verdict == claims.INCONCLUSIVE
    heavy = {"se": 20.0, "se_printed": 140.0, "spread": 340.0}
    assert verdict("std_mle", printed + 150, **heavy).verdict == claims.INCONCLUSIVE
    assert verdict("std_mle", printed + 600, **heavy).verdict == claims.NOT_REPRODUCED
    assert verdict("std_mle", printed + 0.004, **errors).z == 0.0


def phrase(value, **changes):
    key = ("BLS, circular target", "claim")
    return claims.judge("robustness", "Text", {key: claims.Ours(value, **changes)}).of(*key)


def test_verdicts_on_phrases():
    assert phrase(0.4, at_least=0.1).verdict == claims.REPRODUCED
    assert phrase(0.04, at_least=0.1).verdict == claims.NOT_REPRODUCED
    assert phrase(0.4, at_least=0.1, at_most=0.3).verdict == claims.NOT_REPRODUCED
    assumed = phrase(0.4, at_least=0.1, assumption="a geometry")
    assert assumed.verdict == claims.UNSPECIFIED
    assert assumed.note == "holds: at least 0.1 was asked; a geometry"
    assert phrase(0.04, at_least=0.1, assumption="a geometry").note.startswith("does not hold")
    assert claims.same_digits(0.12345, assumed.printed) == "0.123"


def test_verdicts_travel_as_json():
    judged = claims.judge(
        PAPER, TABLE, {("xT", "std_crlb"): claims.Ours(342.38), ("yT", "std_crlb"): claims.Ours(0.0)}
    )
    bundle = judged._repr_mimebundle_()
    rows = json.loads(json.dumps(bundle[claims.MIME], allow_nan=False))
    wanted = {"paper", "table", "row", "column", "printed", "unit", "ours", "se", "z", "verdict", "note"}
    assert all(wanted <= row.keys() for row in rows)
    assert judged.count(claims.REPRODUCED) == judged.count(claims.NOT_REPRODUCED) == 1
    assert "342.38" in bundle["text/plain"]
    assert len(judged) == len(list(judged)) == 2


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: claims.printed(PAPER, TABLE, "xT", "nonsense"), "no printed value"),
        (lambda: claims.judge(PAPER, TABLE, {}), "nothing to judge"),
        (lambda: claims.judge(PAPER, "Table XX", {("xT", "true"): claims.Ours(1.0)}), "no printed value"),
        (lambda: verdict("std_crlb", np.nan), "must be finite"),
        (lambda: verdict("std_mle", 340.0), "needs standard errors"),
        (lambda: verdict("std_crlb", 340.0, at_least=0.0), "are for text rows"),
        (lambda: phrase(0.4), "are for text rows"),
        (lambda: claims.sidak_limit(4, alpha=0.0), "alpha must be greater than 0"),
        (
            lambda: claims.judge(PAPER, TABLE, {("xT", "true"): claims.Ours(1.0)}).of("yT", "true"),
            "no claim on row",
        ),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
