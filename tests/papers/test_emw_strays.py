"""Runs that stray, and what one of them does to a table."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.papers.emw_acoustic import strays, tables


def test_one_run_among_others_by_simulation():
    """Means over 40 000 experiments of ten runs, one of them held."""
    rng = np.random.default_rng(1)
    usual = tma.Statistics(100, 100, np.array([2.0, -1.0]), np.array([1.0, 3.0]), np.full(2, 3.0), {})
    deviation = np.array([5.0, -4.0])
    runs = usual.bias + usual.std * rng.normal(size=(40_000, 10, 2))
    runs[:, 0] = usual.bias + deviation
    bias, std = strays.with_one_run(usual, deviation, runs=10)
    means, variances = runs.mean(axis=1), runs.var(axis=1, ddof=1)
    for values, expected in ((means, bias), (variances, std**2)):
        error = values.std(axis=0) / np.sqrt(len(values))
        assert np.all(np.abs(values.mean(axis=0) - expected) < 4 * error)


def test_the_deviation_needed_gives_the_printed_spread():
    usual = tma.Statistics(100, 100, np.zeros(2), np.array([1.0, 3.0]), np.full(2, 3.0), {})
    printed = np.array([1.2, 3.3])
    _, std = strays.with_one_run(usual, strays.deviation_needed(printed, usual.std))
    np.testing.assert_allclose(std, printed, rtol=1e-12)
    np.testing.assert_allclose(strays.deviation_needed(usual.std, usual.std), usual.std)


def test_largest_z_is_that_of_experiments_with_such_a_run():
    """Of 500 runs with the given mean and spread and one at a deviation, by the statistics of the runs."""
    rng = np.random.default_rng(2)
    usual = tma.statistics(rng.normal(size=(2000, 4)) * [150, 13, 0.1, 0.1] + [-480, 14.4, -0.39, 0.24])
    rest = rng.normal(size=(499, 4))
    rest = usual.bias + usual.std * (rest - rest.mean(axis=0)) / rest.std(axis=0, ddof=0)
    for deviation in ([-3300, 330, -0.9, 3.4], [-1000, 100, 0.3, 1.0]):
        found = tma.statistics(np.concatenate([rest, [usual.bias + deviation]]))
        z = np.abs(
            [
                (np.abs(found.bias) - tables.printed_values(6, "bias_ekf")) / usual.bias_se(500),
                (found.std - tables.printed_values(6, "std_ekf")) / usual.std_se(500),
            ]
        )
        assert strays.largest_z(usual, deviation) == pytest.approx(z.max(), rel=0.02)


def test_the_search_finds_again_what_it_has_found():
    chunks = [88, 89, 90, 2594, 3325]
    assert strays.search(chunks) == tuple(where for where in strays.FOUND if where[0] in chunks)
    assert max(strays.FOUND)[0] < strays.SEARCHED
    errors = strays.errors_again(strays.FOUND[:2])
    assert errors.shape == (2, 4)
    assert np.all(np.abs(errors[:, 0]) > strays.FAR)


def test_rare_runs_are_those_found():
    rare = strays.rare_runs()
    np.testing.assert_array_equal(rare.ekf, strays.errors_again(strays.FOUND))
    assert np.all(np.abs(rare.mle[:, 0]) < 500), "the other estimator does not stray"
    assert rare.searched == 2_000_000


def test_where_they_are_early_on():
    """The errors at the last time are those of the task; the range is that of the scenario."""
    now = emw.scenario(6)
    early = strays.after(100.0, strays.FOUND[:2])
    assert early.true_distance == np.hypot(*(now.target.position_at(100) - now.platform.position_at(100)))
    last = strays.after(now.reference_time, strays.FOUND[:2])
    errors = strays.errors_again(strays.FOUND[:2])
    place = errors[:, :2] + now.state[:2] - now.platform.position_at(now.reference_time)
    np.testing.assert_allclose(last.distance, np.hypot(*place.T), rtol=1e-9)
    claimed = np.hypot(*errors[:, :2].T) / last.error_over_sigma
    assert np.all((claimed > 5) & (claimed < 150)), "metres, less than the bound of the usual runs"
