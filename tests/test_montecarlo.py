import hashlib
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
import pytest
from scipy.stats import kurtosis

import tmalib as tma
from tmalib.judging import read_papers
from tmalib.papers.emw_acoustic import experiments
from tmalib.papers.emw_acoustic.paper import PAPER


def draw(seed, runs):
    return {"x": np.random.default_rng(seed).normal(size=(runs, 2))}


def test_result_does_not_depend_on_who_computes_it():
    serial = tma.monte_carlo(draw, 1700, "example")["x"]
    with ThreadPoolExecutor(3) as pool:
        np.testing.assert_array_equal(tma.monte_carlo(draw, 1700, "example", executor=pool)["x"], serial)


def test_processes_give_the_same_estimates():
    task = partial(experiments.both_estimators, number=2)
    serial = tma.monte_carlo(task, 1000, PAPER.stream("emw/2"))
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        parallel = tma.monte_carlo(task, 1000, PAPER.stream("emw/2"), executor=pool)
    for key, values in serial.items():
        np.testing.assert_array_equal(parallel[key], values)


@pytest.mark.parametrize("runs", [0, 1, 499, 500, 501, 1700])
def test_every_chunk_has_numbers_of_its_own(runs):
    """Chunk k of a stream is seeded by the stream's number and k, as the module says; none is left out."""
    number, counts = tma.Stream("example").number, [min(500, runs - first) for first in range(0, runs, 500)]
    seeds = [np.random.SeedSequence(2016, spawn_key=(number, k)) for k in range(len(counts))]
    wanted = [np.empty((0, 2)), *(draw(*pair)["x"] for pair in zip(seeds, counts, strict=True))]
    found = tma.monte_carlo(draw, runs, "example", seed=2016)["x"]
    np.testing.assert_array_equal(found, np.concatenate(wanted))
    assert len(np.unique(found)) == 2 * runs


def test_a_long_experiment_begins_with_the_short_one():
    long, short = (tma.monte_carlo(draw, runs, "example")["x"] for runs in (1200, 500))
    np.testing.assert_array_equal(long[:500], short)


def test_streams_are_distinct_and_seeded():
    streams = {name: paper.stream(name) for paper in read_papers().values() for name in paper.streams}
    streams |= {name: tma.Stream(name) for name in ("my study", "another")}
    first = [np.random.default_rng(stream.chunk()).normal() for stream in streams.values()]
    assert len(set(first)) == len(first)
    assert len({stream.number for stream in streams.values()}) == len(streams)
    again, other = (
        np.random.default_rng(PAPER.stream("emw/1").chunk(seed=seed)).normal() for seed in (2016, 7)
    )
    assert again == first[0] != other


def test_numbers_of_the_streams_have_not_moved():
    """A fixed point: the first draw of a stream is the same for ever."""
    draws = np.random.default_rng(PAPER.stream("emw/1").chunk()).integers(1 << 32, size=3)
    expected = np.random.default_rng(np.random.SeedSequence(2016, spawn_key=(0, 0))).integers(1 << 32, size=3)
    np.testing.assert_array_equal(draws, expected)


def test_a_name_makes_a_stream_far_from_the_numbered_ones():
    """The number of a name is a fixed point, too: a digest, not Python's hash, which changes."""
    assert tma.Stream("my study").number == (1 << 32) + int(hashlib.sha256(b"my study").hexdigest()[:8], 16)
    assert tma.Stream("my study", 3).chunk(2).spawn_key == (3, 2)
    by_name, by_stream = (tma.monte_carlo(draw, 3, s)["x"] for s in ("own", tma.Stream("own")))
    np.testing.assert_array_equal(by_name, by_stream)


def test_runs_say_where_they_come_from():
    found = tma.monte_carlo(partial(partial(draw_scaled, 2.0), shift=1), 7, "own", seed=5)
    assert set(found) == {"x"}
    assert len(found) == 1
    assert found.source == tma.Source(f"{__name__}.draw_scaled(2.0, shift=1)", "own", 5, 7)
    assert "7 runs, stream own, seed 5" in repr(found)


def draw_scaled(scale, seed, runs, shift=0):
    return {"x": scale * np.random.default_rng(seed).normal(size=runs) + shift}


def test_statistics():
    errors = np.random.default_rng(0).normal([1.0, -2.0], [2.0, 0.5], size=(30_000, 2))
    found = tma.statistics(errors)
    np.testing.assert_allclose(found.bias, errors.mean(axis=0))
    np.testing.assert_allclose(found.std, errors.std(axis=0, ddof=1))
    np.testing.assert_allclose(found.kurtosis, kurtosis(errors, fisher=False), rtol=1e-10)
    np.testing.assert_allclose(found.bias_se(), found.std / np.sqrt(30_000))
    np.testing.assert_allclose(found.std_se(500), found.std / np.sqrt(2 * 499), rtol=0.03)


@pytest.mark.parametrize(
    "draw_errors", [np.random.Generator.standard_normal, np.random.Generator.standard_exponential]
)
def test_standard_errors_are_those_of_repeated_experiments(draw_errors):
    errors = draw_errors(np.random.default_rng(1), (4000, 100))
    found = tma.statistics(errors.reshape(-1, 1))
    assert errors.mean(axis=1).std() == pytest.approx(found.bias_se(100)[0], rel=0.05)
    assert errors.std(axis=1, ddof=1).std() == pytest.approx(found.std_se(100)[0], rel=0.08)


def test_a_lost_run_is_counted():
    errors = np.ones((10, 2)) * np.arange(10.0)[:, None]
    errors[4, 1] = np.nan
    found = tma.statistics(errors)
    assert (found.runs, found.used) == (10, 9)
    assert np.all(np.isfinite(found.std))


@pytest.mark.parametrize("seed", range(5))
def test_runs_that_are_left_out_change_nothing_and_are_counted(seed):
    rng = np.random.default_rng(seed)
    good = rng.normal(size=(50, 3)) * [1e3, 1.0, 1e-3]
    lost = np.array([[np.nan, 0, 0], [0, -np.inf, 0], [0, 0, 1e80], [1e10, 0, 0], [-1e12, 5, 5]])
    order = rng.permutation(55)
    errors = np.concatenate([good, lost])[order]
    used = order < 53  # the estimator owns up to the runaways; a mask may leave out the others, too
    expected = tma.statistics(good[order[order < 50]])
    for mask in (used, used & np.isfinite(errors).all(axis=1)):
        found = tma.statistics(errors, used=mask)
        assert (found.runs, found.used) == (55, 50)
        assert found.left_out == {"not finite": 3, "failed": 2}
        for field in ("bias", "std", "kurtosis"):
            np.testing.assert_array_equal(getattr(found, field), getattr(expected, field))
    believed = tma.statistics(errors)
    assert (believed.used, believed.left_out) == (52, {"not finite": 3, "failed": 0})
    assert abs(believed.bias[0]) > 1e9, "a mean is the mean of all that it is told to use"


def test_statistics_of_a_fit_leave_out_what_did_not_converge(scenario):
    angles = scenario.simulate(8, seed=1)
    start = np.tile(scenario.state, (8, 1))
    angles[3, 0], start[5] = np.inf, [-1e7, -1e7, 400.0, 400.0]
    found = tma.fit(scenario, angles, start, max_iterations=4)
    converged = [k for k in range(8) if k not in (3, 5)]
    np.testing.assert_array_equal(found.converged, np.isin(range(8), converged))
    told = tma.statistics(found.state - scenario.state, found.converged)
    assert told.left_out == {"not finite": 1, "failed": 1}
    np.testing.assert_array_equal(told.bias, tma.statistics((found.state - scenario.state)[converged]).bias)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PAPER.stream("nonsense").chunk(), "stream must be one of"),
        (lambda: tma.Stream(""), "must be a text that is not empty"),
        (lambda: tma.monte_carlo(draw, -1, "example"), "runs must be an integer that is not negative"),
        (lambda: tma.statistics(np.zeros(5)), "errors must have shape"),
        (
            lambda: tma.statistics(np.full((9, 2), np.nan)),
            "at least 4 runs, got 0 of 9: 9 not finite, 0 failed",
        ),
        (lambda: tma.statistics(np.ones((5, 2)), np.arange(5) < 3), "got 3 of 5: 0 not finite, 2 failed"),
        (lambda: tma.statistics(np.empty((0, 2))), "got 0 of 0"),
        (
            lambda: tma.statistics(np.ones((5, 2)), [0, 1, 2, 3]),
            r"used must be bool of shape \(5,\), got int",
        ),
        (lambda: tma.statistics(np.ones((5, 2)), [True] * 4), r"got bool of shape \(4,\)"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
