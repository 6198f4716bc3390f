"""The two commands mean the same whatever the user's environment, and in a copied or moved checkout."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

import tmalib

ROOT = Path(__file__).parent.parent
HOSTILE = {
    "PYTHONOPTIMIZE": "1", "PYTHONSAFEPATH": "1", "PYTHONPATH": "elsewhere", "PYTHONHOME": "elsewhere",
    "PYTHONWARNINGS": "error", "PYTHONSTARTUP": "elsewhere.py", "JUPYTER_PATH": "elsewhere",
    "JUPYTER_CONFIG_PATH": "elsewhere", "PIP_USER": "1", "PIP_TARGET": "elsewhere", "PIP_PREFIX": "elsewhere",
    "MPLBACKEND": "agg", "PYTEST_ADDOPTS": "--maxfail=1", "VIRTUAL_ENV": "elsewhere",
}  # fmt: skip
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}

pytestmark = pytest.mark.skipif(shutil.which("make") is None, reason="no make on this machine")


def make(*arguments, cwd=ROOT, **environment):
    done = subprocess.run(
        ["make", *arguments], cwd=cwd, env=ENVIRONMENT | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_settings_of_the_user_do_not_reach_the_recipes():
    seen = make("--eval", "probe: ; @env", "probe", **HOSTILE)
    names = {line.partition("=")[0] for line in seen.splitlines()}
    assert not names & HOSTILE.keys()
    assert {"OPENBLAS_NUM_THREADS", "JUPYTER_DATA_DIR", "TMALIB_RUNS"} <= names


@pytest.mark.parametrize("recipe", ["false | true", "true | false | cat", "false; true", "echo $$unknown"])
def test_a_step_that_fails_in_the_midst_of_a_recipe_stops_it(recipe):
    done = subprocess.run(
        ["make", "--eval", f"probe: ; @{recipe}", "probe"], cwd=ROOT, env=ENVIRONMENT, capture_output=True
    )
    assert done.returncode != 0


@pytest.fixture
def copied(tmp_path):
    """A copy of what decides on the environment, as if it were set up in the original's place."""
    copy = tmp_path / "copy"
    (copy / ".venv").mkdir(parents=True)
    for name in ("Makefile", "environment.txt", "pyproject.toml"):
        shutil.copy(ROOT / name, copy)
    stamp = f"{ROOT.resolve()}\n" + (ROOT / "environment.txt").read_text(encoding="utf-8")
    (copy / ".venv/.requirements").write_text(stamp, encoding="utf-8")
    (copy / ".venv/.tmalib").touch()
    return copy


def test_a_copied_checkout_makes_its_own_environment(copied):
    assert "-m venv --clear .venv" in make("-n", "env", cwd=copied)


def test_a_checkout_that_stays_does_not(copied):
    stamp = copied / ".venv/.requirements"
    stamp.write_text(stamp.read_text().replace(str(ROOT.resolve()), str(copied.resolve()), 1))
    (copied / ".venv/.tmalib").touch()
    assert "venv --clear" not in make("-n", "env", cwd=copied)


def test_a_changed_lock_makes_a_new_environment(copied):
    test_a_checkout_that_stays_does_not(copied)
    with (copied / "environment.txt").open("a") as lock:
        lock.write("# another pin\n")
    assert "venv --clear" in make("-n", "env", cwd=copied)


def test_the_library_that_is_tested_is_this_one():
    assert Path(tmalib.__file__).resolve() == ROOT.resolve() / "tmalib" / "__init__.py"


def test_make_is_new_enough_or_says_so():
    """macOS comes with make 3.81, which knows no .SHELLFLAGS and would hide a failing step of a pipe."""
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert "GNU make 4 or newer is needed" in text
    old = text.replace("$(.FEATURES)", "else-if archives")
    done = subprocess.run(
        ["make", "-n", "-f", "-", "help"], input=old, cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode != 0
    assert "GNU make 4 or newer is needed" in done.stderr


def pins(lock):
    """Packages of a lock, each with its versions."""
    found = {}
    for name, version in re.findall(r"(?m)^([\w.-]+)==([^\s;]+)", (ROOT / lock).read_text(encoding="utf-8")):
        found.setdefault(name, set()).add(version)
    return found


def test_the_lab_has_the_book_s_packages_in_the_book_s_versions():
    """Both locks go into one environment."""
    book, lab = pins("environment.txt"), pins("tools/lab/environment.txt")
    assert "jupyterlab" in lab
    assert "ipykernel" in lab.keys() & book.keys()
    assert {name: lab[name] for name in lab.keys() & book.keys() if not lab[name] <= book[name]} == {}


def test_the_lab_is_made_from_both_locks(copied):
    (copied / "tools/lab").mkdir(parents=True)
    shutil.copy(ROOT / "tools/lab/environment.txt", copied / "tools/lab")
    said = make("-n", "lab", cwd=copied)
    assert "-m venv --clear .venv-lab" in said
    assert "-r environment.txt -r tools/lab/environment.txt" in said
    assert ".venv-lab/bin/jupyter lab" in said


def test_binder_takes_the_book_s_lock():
    named = (ROOT / ".binder/requirements.txt").read_text(encoding="utf-8").split("-r ")[1].strip()
    assert (ROOT / ".binder" / named).resolve() == ROOT.resolve() / "environment.txt"
    assert os.access(ROOT / ".binder/postBuild", os.X_OK)


@pytest.mark.parametrize("fails", [False, True])
def test_a_chapter_that_fails_stops_the_build_and_the_others_are_kept(copied, fails):
    test_a_checkout_that_stays_does_not(copied)
    python, log = copied / ".venv/bin/python", copied / "calls.txt"
    python.parent.mkdir()
    python.write_text(f'#!/bin/sh\necho "$@" >> {log}\ncase "$*" in *pytest*) exit {int(fails)};; esac\n')
    python.chmod(0o755)
    (copied / "build/executing").mkdir(parents=True)
    (copied / "build/executing/one.ipynb").touch()
    done = subprocess.run(["make", "notebooks"], cwd=copied, env=ENVIRONMENT, capture_output=True, text=True)
    assert (done.returncode != 0) == fails, done.stderr
    steps = [line.split()[1] for line in log.read_text().splitlines() if line.startswith("tools/build.py")]
    assert steps == ["stale", "keep"]
