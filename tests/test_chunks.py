"""Interrupted experiments: what is finished is kept, what is wrong never vanishes, numbers are the same."""

import os
import signal
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
import pytest

import tmalib as tma

RUNS, CHUNKS = 2300, [500, 500, 500, 500, 300]


def draw(seed, runs):
    rng = np.random.default_rng(seed)
    return {"x": rng.normal(size=(runs, 2)), "status": np.where(rng.random(runs) < 0.5, "a", "bcd")}


def noted(folder, seed, runs, stop_at=None, stop=None):
    """`draw`, with a note of every call in a folder; in one chunk it stops instead."""
    chunk = seed.spawn_key[-1]
    (folder / f"{chunk}-{os.getpid()}-{len(list(folder.iterdir()))}").touch()
    if chunk == stop_at:
        stop()
    return draw(seed, runs)


def chunks_in(folder):
    return sorted(int(path.name.split("-")[0]) for path in folder.iterdir())


def interrupt():
    signal.signal(signal.SIGINT, signal.default_int_handler)  # who was started in the background ignores it
    os.kill(os.getpid(), signal.SIGINT)  # as Ctrl-C does
    signal.pause()


def fail():
    raise ZeroDivisionError("a bad chunk")


def same(found, wanted):
    assert set(found) == set(wanted)
    for name in wanted:
        assert found[name].dtype == wanted[name].dtype
        np.testing.assert_array_equal(found[name], wanted[name])


WANTED = tma.monte_carlo(draw, RUNS, "chunks")


@pytest.fixture
def calls(tmp_path):
    (tmp_path / "calls").mkdir()
    return tmp_path / "calls"


def test_the_same_numbers_with_and_without(tmp_path):
    heard = []
    for keep in (None, tmp_path / "kept", tmp_path / "kept"):
        found = tma.monte_carlo(draw, RUNS, "chunks", progress=lambda *told: heard.append(told), keep=keep)
        same(found, WANTED)
        assert found.source == WANTED.source
    assert heard == 3 * [(500, RUNS), (1000, RUNS), (1500, RUNS), (2000, RUNS), (RUNS, RUNS)]


@pytest.mark.parametrize(("stop", "error"), [(interrupt, KeyboardInterrupt), (fail, ZeroDivisionError)])
def test_after_a_stop_in_the_middle_only_the_rest_is_computed(tmp_path, calls, stop, error):
    keep, heard = tmp_path / "kept", []
    options = dict(progress=lambda *told: heard.append(told), keep=keep)
    before, after = partial(noted, calls), partial(noted, calls)
    # The task that stops is named as the one that does not: what stops it comes from outside.
    tasks = {True: _Stopping(before, 2, stop), False: _Stopping(after, None, None)}
    with pytest.raises(error) as raised:
        tma.monte_carlo(tasks[True], RUNS, "chunks", **options)
    assert heard == [(500, RUNS), (1000, RUNS)]
    assert chunks_in(calls) == [0, 1, 2]
    assert len(list(keep.glob("*.npz"))) == 2
    assert not list(keep.glob("*.part"))
    if error is ZeroDivisionError:
        assert "in chunk 2" in raised.value.__notes__[0]
    same(tma.monte_carlo(tasks[False], RUNS, "chunks", **options), WANTED)
    assert chunks_in(calls) == [0, 1, 2, 2, 3, 4], "chunks 0 and 1 only once"
    assert heard[2:] == [(500, RUNS), (1000, RUNS), (1500, RUNS), (2000, RUNS), (RUNS, RUNS)]


class _Stopping:
    """A task that may stop in a chunk; by name it is the same in any case."""

    def __init__(self, task, stop_at, stop):
        self.__qualname__ = "_Stopping"
        self.task, self.stop_at, self.stop = task, stop_at, stop

    def __call__(self, seed, runs):
        return self.task(seed=seed, runs=runs, stop_at=self.stop_at, stop=self.stop)


@pytest.mark.parametrize("pool", ["threads", "processes"])
def test_with_workers_what_others_have_finished_is_kept_as_well(tmp_path, calls, pool):
    """The first chunk fails; those after it are finished by other workers, or not begun."""
    keep = tmp_path / "kept"
    make = {
        "threads": partial(ThreadPoolExecutor, 2),
        "processes": partial(ProcessPoolExecutor, 2, mp_context=get_context("spawn")),
    }[pool]
    bad, good = (_Stopping(partial(noted, calls), at, fail) for at in (0, None))
    with make() as workers, pytest.raises(ZeroDivisionError):
        tma.monte_carlo(bad, RUNS, "chunks", executor=workers, keep=keep)
    begun = set(chunks_in(calls)) - {0}
    kept = {int(path.name.split("-")[1]) for path in keep.glob("*.npz")}
    assert kept == begun
    with make() as workers:
        same(tma.monte_carlo(good, RUNS, "chunks", executor=workers, keep=keep), WANTED)
    assert sorted(chunks_in(calls)) == sorted([0, *range(5)]), "a bad chunk again, the others once"


def test_more_runs_go_on_with_the_kept_chunks(tmp_path, calls):
    task, keep = _Stopping(partial(noted, calls), None, None), tmp_path / "kept"
    for runs in (700, 1200):
        found = tma.monte_carlo(task, runs, "chunks", keep=keep)
        same(found, tma.monte_carlo(draw, runs, "chunks"))
    assert chunks_in(calls) == [0, 1, 1, 2], "the second chunk had 200 runs, then 500"


def other(seed, runs):
    return draw(seed, runs)


@pytest.mark.parametrize(
    "changed", [dict(task=other), dict(stream="others"), dict(stream=tma.Stream("chunks", 3)), dict(seed=7)]
)
def test_runs_of_another_experiment_are_refused(tmp_path, changed):
    tma.monte_carlo(draw, 10, "chunks", keep=tmp_path / "kept")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(ValueError, match="keep must be a folder for the runs of"):
        tma.monte_carlo(**{"task": draw, "runs": 10, "stream": "chunks", "keep": tmp_path / "kept"} | changed)
    assert sorted(tmp_path.rglob("*")) == before


def scaled(scale, seed, runs):
    return {"x": scale[-1] * draw(seed, runs)["x"]}


class Sum:
    """A task that is an object: its text says where it is, and no more."""

    def __call__(self, seed, runs):
        return draw(seed, runs)


@pytest.mark.parametrize(("at", "by"), [(-1, 1e-12), (1000, 1.0)])
def test_arguments_that_print_alike_are_different_experiments(tmp_path, at, by):
    """Long arrays are abbreviated where they are shown, and numbers rounded."""
    scale = np.linspace(0, 1, 3000)
    tma.monte_carlo(partial(scaled, scale), 10, "chunks", keep=tmp_path / "kept")
    other = scale.copy()
    other[at] += by
    assert repr(other) == repr(scale)
    with pytest.raises(ValueError, match="keep must be a folder"):
        tma.monte_carlo(partial(scaled, other), 10, "chunks", keep=tmp_path / "kept")


def test_objects_are_never_taken_for_each_other(tmp_path):
    here, there = Sum(), Sum()
    same(tma.monte_carlo(here, 10, "chunks", keep=tmp_path / "kept"), tma.monte_carlo(draw, 10, "chunks"))
    with pytest.raises(ValueError, match="keep must be a folder"):
        tma.monte_carlo(there, 10, "chunks", keep=tmp_path / "kept")


def test_a_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "thesis.txt").write_text("precious")
    with pytest.raises(ValueError, match="something else"):
        tma.monte_carlo(draw, 10, "chunks", keep=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def short_by_one(seed, runs):
    return {"x": np.zeros(runs - 1)}


def objects(seed, runs):
    return {"x": np.array([{}] * runs)}


@pytest.mark.parametrize(
    ("task", "message"),
    [
        (short_by_one, "must return 500 rows of 'x', got shape"),
        (objects, "only arrays of numbers and texts can be kept"),
        (lambda seed, runs: np.zeros(runs), "what the task returns must be a Mapping"),
    ],
)
def test_a_chunk_that_is_none_is_not_kept(tmp_path, task, message):
    with pytest.raises(ValueError, match=message):
        tma.monte_carlo(task, 700, "chunks", keep=tmp_path / "kept")
    assert not list((tmp_path / "kept").glob("*.npz"))


def test_progress_must_be_a_function():
    with pytest.raises(ValueError, match="progress must be a function of two numbers of runs, got True"):
        tma.monte_carlo(draw, 10, "chunks", progress=True)


def stop(finished, total):
    raise KeyboardInterrupt


def test_progress_may_stop_the_experiment(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        tma.monte_carlo(draw, RUNS, "chunks", progress=stop, keep=tmp_path / "kept")
    assert len(list((tmp_path / "kept").glob("*.npz"))) == 1


def test_half_a_chunk_has_no_name(tmp_path, monkeypatch):
    """As when the disk is full, or with Ctrl-C, while it is written."""

    def half(file, **rows):
        file.write(b"PK")
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez", half)
    with pytest.raises(KeyboardInterrupt):
        tma.monte_carlo(draw, 10, "chunks", keep=tmp_path / "kept")
    assert [path.name for path in (tmp_path / "kept").iterdir()] == ["experiment.txt"]
