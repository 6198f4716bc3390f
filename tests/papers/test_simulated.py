"""The test of the ledger on papers of our own runs: nominal false-alarm rate, planted errors found."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import binom

import tmalib as tma
from tmalib import judging
from tmalib.papers.emw_acoustic import experiments, simulated, tables
from tmalib.papers.emw_acoustic.paper import PAPER

NUMBERS = (2, 6)  # the quick ones; notebooks/verdicts/calibration.ipynb does all six
RUNS = 20_000
PAPERS = RUNS // tables.PRINTED_RUNS
SPREADS = [(row, "std_mle") for row in tables.ROWS]

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def simulated_tables():
    """Forty simulated papers of two tables each, printed at the paper's precision."""
    errors = {
        k: tma.monte_carlo(partial(experiments.both_estimators, number=k), RUNS, PAPER.stream(f"emw/{k}"))
        for k in NUMBERS
    }
    return [simulated.simulated_table(k, errors[k], part) for part in range(PAPERS) for k in NUMBERS]


def rejected(rows):
    return judging.judge_rows(rows).count(judging.NOT_REPRODUCED) > 0


def test_false_alarm_rate_is_nominal(simulated_tables):
    """Not more simulated_tables are questioned than one in twenty explains, with a probability of 99.9 %."""
    assert sum(map(rejected, simulated_tables)) <= binom.ppf(0.999, len(simulated_tables), judging.ALPHA)


def test_the_test_is_not_lenient_either(simulated_tables):
    """Five per cent of right numbers exceed the two-sided 5 % limit, however the numbers of a table hang
    together: four standard errors of the mean over papers."""
    z = [[judging.judge_rows(rows).of(*cell).z for cell in SPREADS] for rows in simulated_tables]
    shares = np.mean(np.array(z).reshape(PAPERS, -1) > judging.sidak_limit(1), axis=1)
    assert abs(shares.mean() - 0.05) < 4 * shares.std(ddof=1) / np.sqrt(PAPERS)


@pytest.mark.parametrize("size", [3.0, 3.8, 5.0])
def test_planted_errors_are_found_with_the_power_of_theory(simulated_tables, size):
    """An error of three standard errors in a cell is found every other time, of 3.8 in eight cases of ten."""
    cells = [SPREADS[i // 2 % 4] for i in range(len(simulated_tables))]
    wrong = [
        simulated.plant_error(rows, cell, size) for rows, cell in zip(simulated_tables, cells, strict=True)
    ]
    judged = [judging.judge_rows(rows).of(*cell).verdict for rows, cell in zip(wrong, cells, strict=True)]
    found = np.mean([verdict == judging.NOT_REPRODUCED for verdict in judged])
    power = simulated.detection_probability(size, judging.sidak_limit(16))
    assert abs(found - power) < 4 * np.sqrt(power * (1 - power) / len(simulated_tables))


def test_three_standard_deviations_of_a_run_are_always_found(simulated_tables):
    for rows in simulated_tables:
        for cell in SPREADS:
            (ours,) = (ours for row, ours in rows if (row.row, row.column) == cell)
            size = 3 * ours.spread / np.hypot(ours.se, ours.se_printed)
            judged = judging.judge_rows(simulated.plant_error(rows, cell, size))
            assert judged.of(*cell).verdict == judging.NOT_REPRODUCED


def test_a_simulated_table_has_the_papers_digits(simulated_tables):
    for row, ours in simulated_tables[0]:
        like = PAPER.printed(*row.key[1:])
        assert row.last_digit == like.last_digit
        assert row.printed == judging.same_digits(row.value, like.printed)
        assert ours.se < ours.se_printed


def test_bad_input(simulated_tables):
    with pytest.raises(ValueError, match="part must be from 0 to 0"):
        simulated.simulated_table(2, {name: np.zeros((500, 4)) for name in ("mle", "ekf")}, 1)
    with pytest.raises(ValueError, match="key must be a row"):
        simulated.plant_error(simulated_tables[0], ("xT", "true"), 1.0)
