"""Stored runs are those that would be computed; after a change of the code they are computed again."""

import fcntl
import platform
import subprocess
import sys
import threading
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import tmalib as tma
from tmalib import chunks, montecarlo
from tmalib.judging import code, stored_runs
from tmalib.papers.conical_angles import experiments

ROOT = Path(__file__).parents[2]
STREAM = tma.Stream("test", 9)
TASK = partial(experiments.two_rays, bottom_depth=2000.0)


@pytest.fixture
def store(tmp_path, monkeypatch):
    """The folder of the store."""
    monkeypatch.setenv("TMALIB_RUNS", str(tmp_path / "runs"))
    return tmp_path / "runs"


def test_stored_runs_are_the_computed_ones(store):
    fresh = tma.monte_carlo(TASK, 12, STREAM)
    for _ in range(2):
        found = stored_runs(TASK, 12, STREAM)
        assert found.source == fresh.source
        assert set(found) == set(fresh)
        for name, values in fresh.items():
            np.testing.assert_array_equal(found[name], values)
    assert len(list(store.glob("*.npz"))) == 1


def test_the_second_time_nothing_is_computed(store, monkeypatch):
    first = stored_runs(TASK, 5, STREAM)["state"]
    monkeypatch.setattr("tmalib.judging.chapter.monte_carlo", None)
    np.testing.assert_array_equal(stored_runs(TASK, 5, STREAM)["state"], first)


@pytest.mark.parametrize(
    ("task", "runs", "stream", "seed"),
    [
        (partial(experiments.two_rays, bottom_depth=4000.0), 5, STREAM, 2016),
        (TASK, 6, STREAM, 2016),
        (TASK, 5, tma.Stream("test", 10), 2016),
        (TASK, 5, tma.Stream("other", 9), 2016),
        (TASK, 5, STREAM, 2017),
    ],
)
def test_other_runs_have_another_name(store, task, runs, stream, seed):
    stored_runs(TASK, 5, STREAM)
    stored_runs(task, runs, stream, seed=seed)
    assert len(list(store.glob("*.npz"))) == 2


PROGRAM = """
from functools import partial
import tmalib
from tmalib.judging import stored_runs
from tmalib.papers.conical_angles import experiments
task = partial(experiments.two_rays, bottom_depth=2000.0)
print(tmalib.__file__, stored_runs(task, 4, "test")["cost"].sum())
"""


def run_copy(copy, store):
    """What the library in a copy finds, through its store."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={"PYTHONPATH": str(copy), "TMALIB_RUNS": str(store)},
        cwd=copy,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    file, value = done.stdout.split()
    assert file == str(copy / "tmalib" / "__init__.py"), "the copy's library, not the original's"
    return float(value)


@pytest.mark.parametrize(
    ("of", "name", "value"), [(np, "__version__", "1"), (platform, "python_version", str)]
)
def test_runs_of_another_numpy_or_python_are_not_found(store, monkeypatch, of, name, value):
    stored_runs(TASK, 5, STREAM)
    monkeypatch.setattr(of, name, value)
    stored_runs(TASK, 5, STREAM)
    assert len(list(store.glob("*.npz"))) == 2


def test_arguments_that_print_alike_have_other_names(store, monkeypatch):
    """Long arrays are abbreviated where they are shown, and numbers rounded."""

    def made(task, runs, stream, seed, keep):
        keep.mkdir()
        return {"x": np.zeros(runs)}

    monkeypatch.setattr("tmalib.judging.chapter.monte_carlo", made)
    depths = np.linspace(0, 1, 3000)
    for at, by in ((0, 0.0), (-1, 1e-12), (1000, 1.0)):
        other = depths.copy()
        other[at] += by
        assert repr(other) == repr(depths)
        stored_runs(partial(experiments.two_rays, bottom_depth=other), 5, STREAM)
    assert len(list(store.glob("*.npz"))) == 3


def test_who_comes_second_waits(store):
    """The lock of an entry is held here, as by another chapter that makes its runs."""
    stored_runs(TASK, 5, STREAM)
    (path,) = store.glob("*.npz")
    path.unlink()
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        second = threading.Thread(target=stored_runs, args=(TASK, 5, STREAM))
        second.start()
        second.join(0.5)
        assert second.is_alive()
        assert not path.exists()
    second.join(60)
    assert path.exists()


def test_a_changed_line_of_the_library_is_seen(tmp_path, copy_of_library):
    """A sign two imports below the task: the stored runs of before are not used."""
    store = tmp_path / "runs"
    before = run_copy(copy_of_library, store)
    assert run_copy(copy_of_library, store) == before
    assert len(list(store.glob("*.npz"))) == 1
    model = copy_of_library / "tmalib" / "cones.py"  # two imports below the task
    source = model.read_text()
    changed = source.replace("value = (dx * sin + dy * cos) * scale", "value = (dx * sin - dy * cos) * scale")
    assert changed != source
    model.write_text(changed)
    after = run_copy(copy_of_library, store)
    assert after != before
    assert len(list(store.glob("*.npz"))) == 2


def test_a_line_that_the_task_does_not_use_changes_nothing(tmp_path, copy_of_library):
    store = tmp_path / "runs"
    run_copy(copy_of_library, store)
    with (copy_of_library / "tmalib" / "particles.py").open("a") as file:
        file.write("CHANGED = True\n")
    run_copy(copy_of_library, store)
    assert len(list(store.glob("*.npz"))) == 1


def test_only_tasks_of_modules_are_stored(store):
    def task(seed, runs):
        return {"x": np.zeros(runs)}

    with pytest.raises(ValueError, match="only a task of a module"):
        stored_runs(task, 3, "test")


def test_without_a_folder_nothing_is_stored(tmp_path, monkeypatch):
    monkeypatch.delenv("TMALIB_RUNS", raising=False)
    first = stored_runs(TASK, 3, STREAM)
    monkeypatch.setenv("TMALIB_RUNS", str(tmp_path))
    np.testing.assert_array_equal(stored_runs(TASK, 3, STREAM)["state"], first["state"])
    assert len(list(tmp_path.glob("*.npz"))) == 1


def test_the_code_of_a_module_is_what_it_imports():
    """Against what Python itself loads, parent packages apart: they are not used, only passed through."""
    name = "tmalib.papers.conical_angles.experiments"
    names = {path.relative_to(ROOT).as_posix() for path in code.code_of_modules(name)}
    assert {"tmalib/cones.py", "tmalib/checks.py", "tmalib/papers/conical_angles/quadratic.py"} <= names
    assert "tmalib/papers/conical_angles/published.csv" in names
    assert not {"tmalib/particles.py", "tmalib/papers/robustness/scenarios.py"} & names
    everything = code.code_of_source("import tmalib as tma\nfrom numpy import pi\nprint(tma)")
    assert {ROOT / "tmalib/particles.py", ROOT / "tmalib/ghosts/turn.py"} <= everything
    drawn = code.code_of_source("from tmalib import figures")
    assert drawn == {ROOT / "tmalib" / f"{name}.py" for name in ("figures", "ellipse", "checks", "types")}
    assert code.code_of_source("import numpy") == set()


@pytest.mark.parametrize(
    ("source", "used", "unused"),
    [
        ("import tmalib as tma\ntma.fit(1)", "batch.py", "particles.py"),
        ("import tmalib as tma\ndef f():\n    return tma.sir", "particles.py", "ghosts/turn.py"),
        ("from tmalib import find_ghosts", "ghosts/turn.py", "particles.py"),
        ("from tmalib import sensitivity as sens\nsens.worst_sup(1)", "sensitivity/worst.py", "batch.py"),
        ("from tmalib.judging import judge", "judging/verdict.py", "judging/prose.py"),
        ("from tmalib import judging\njudging.numbers", "judging/chapter.py", "judging/prose.py"),
        ("from tmalib.papers.robustness.filters import filtered", "particles.py", "ghosts/turn.py"),
    ],
)
def test_a_name_leads_to_the_module_that_has_it(source, used, unused):
    names = {path.relative_to(ROOT / "tmalib").as_posix() for path in code.code_of_source(source)}
    assert used in names
    assert unused not in names


def test_comments_and_layout_do_not_count(tmp_path):
    one, two, three = (tmp_path / f"{name}.py" for name in ("one", "two", "three"))
    one.write_text("x = [1, 2]  # a remark\n")
    two.write_text("# another\nx = [\n    1,\n    2,\n]\n")
    three.write_text("x = [1, 3]\n")
    assert code.hash_of([one]) == code.hash_of([two]) != code.hash_of([three])
    data = tmp_path / "data.csv"
    data.write_text("1\n")
    before = code.hash_of([data])
    data.write_text("1\n\n")
    assert code.hash_of([data]) != before, "of data every byte counts"


def test_interrupted_runs_go_on_where_they_were(store, monkeypatch):
    """The second chunk is interrupted; the rerun computes it and not the first one."""
    seen, run_chunk = [], chunks.run_chunk

    def interrupted(task, k, seed, runs):
        seen.append(k)
        if seen == [0, 1]:
            raise KeyboardInterrupt
        return run_chunk(task, k, seed, runs)

    task = partial(experiments.two_rays, bottom_depth=2000.0)
    monkeypatch.setattr(montecarlo, "CHUNK", 5)
    monkeypatch.setattr(chunks, "run_chunk", interrupted)
    with pytest.raises(KeyboardInterrupt):
        stored_runs(task, 12, STREAM)
    assert len(list(store.rglob("chunk-*.npz"))) == 1
    found = stored_runs(task, 12, STREAM)
    assert seen == [0, 1, 1, 2]
    wanted = tma.monte_carlo(task, 12, STREAM)
    assert set(found) == set(wanted)
    for name, values in wanted.items():
        np.testing.assert_array_equal(found[name], values)
    assert not list(store.rglob("chunk-*.npz")), "the whole has taken their place"
