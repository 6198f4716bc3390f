"""Results are the same, bit for bit, for every executor, number of workers and size of a block."""

import os
import signal
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import active_children, get_context

import numpy as np
import pytest

import tmalib as tma
from tmalib import batch, levenberg_marquardt
from tmalib.papers.emw_acoustic import experiments
from tmalib.papers.emw_acoustic import scenarios as emw

RUNS = 1300  # two chunks of 500 and one of 300
SPAWN = get_context("spawn")
TASK = partial(experiments.both_estimators, number=1)
EXECUTORS = {
    "two threads": partial(ThreadPoolExecutor, 2),
    "one process": partial(ProcessPoolExecutor, 1, SPAWN),
    "two processes": partial(ProcessPoolExecutor, 2, SPAWN),
    "three processes": partial(ProcessPoolExecutor, 3, SPAWN),
}


@pytest.fixture(scope="module")
def alone():
    return tma.monte_carlo(TASK, RUNS, "executors")


@pytest.mark.slow
@pytest.mark.parametrize("name", EXECUTORS)
def test_executors_and_numbers_of_workers(alone, name):
    with EXECUTORS[name]() as pool:
        found = tma.monte_carlo(TASK, RUNS, "executors", executor=pool)
    for key, values in alone.items():
        np.testing.assert_array_equal(found[key], values)


@pytest.mark.parametrize("start", [True, False], ids=["start", "no start"])
@pytest.mark.parametrize(("runs_at_once", "elements"), [(1, 1), (7, 5000), (64, 1 << 14), (10**6, 10**7)])
def test_sizes_of_blocks(monkeypatch, start, runs_at_once, elements):
    scenario = emw.scenario(2)
    angles = scenario.simulate(150, seed=4)
    angles[3, 10] += 1.0  # one wild bearing, one missing, one run lost
    angles[5, :40] = np.nan
    angles[8] = np.nan
    first = tma.along_first_bearing(scenario, scenario.simulate(150, seed=4), 10e3) if start else None
    wanted = tma.fit(scenario, angles, first)
    monkeypatch.setattr(batch, "BLOCK", runs_at_once)
    monkeypatch.setattr(levenberg_marquardt, "BLOCK_ELEMENTS", elements)
    found = tma.fit(scenario, angles, first)
    for name in ("state", "status", "iterations", "cost"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))


def slow_draw(folder, seed, runs):
    """Random numbers; the third chunk kills its worker, once."""
    mark = folder / "killed"
    if seed.spawn_key[-1] == 2 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return {"x": np.random.default_rng(seed).normal(size=(runs, 2))}


def draw(seed, runs):
    return {"x": np.random.default_rng(seed).normal(size=(runs, 2))}


def test_a_killed_worker_stops_the_pool_and_a_rerun_goes_on(tmp_path):
    task, keep = partial(slow_draw, tmp_path), tmp_path / "kept"
    with ProcessPoolExecutor(2, SPAWN) as pool, pytest.raises(BrokenProcessPool):
        tma.monte_carlo(task, 3000, "killed", executor=pool, keep=keep)
    kept = {path.name for path in keep.glob("*.npz")}
    assert not list(keep.glob("*.part"))
    with ProcessPoolExecutor(2, SPAWN) as pool:
        found = tma.monte_carlo(task, 3000, "killed", executor=pool, keep=keep)
    assert kept < {path.name for path in keep.glob("*.npz")}
    np.testing.assert_array_equal(found["x"], tma.monte_carlo(draw, 3000, "killed")["x"])
    assert not active_children(), "no worker is left behind"
