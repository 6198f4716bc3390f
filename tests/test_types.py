"""Annotations: all public names have them, they are real names, and a type checker makes use of them."""

import dataclasses
import importlib
import inspect
import pkgutil
import subprocess
import sys
import typing
from functools import cached_property
from pathlib import Path

import pytest

import tmalib

ROOT = Path(__file__).parent.parent
UNTYPED = (
    "tmalib.papers",
    "tmalib.study",
    "tmalib.speed",
    "tmalib.conformance",
    "tmalib.beyond",
    "tmalib.judging.",
    "tmalib.__main__",
)
WRITTEN = ("__init__", "__getitem__", "__iter__", "__len__")  # methods with underscores that have annotations
CACHE = ROOT / "build" / "mypy-tests"
RIGHT = """
import numpy as np
import tmalib as tma
from numpy.typing import ArrayLike
from tmalib.types import FloatArray


class Sway:
    \"\"\"A motion of one's own.\"\"\"

    def position_at(self, t: ArrayLike) -> FloatArray:
        t = np.asarray(t, dtype=float)
        return np.stack([np.sin(t), np.cos(t)], axis=-1)


class Depression:
    \"\"\"A measurement model of one's own, without annotations.\"\"\"

    coordinates = ("x", "y", "vx", "vy")

    def observer_state(self, platform, times):
        return platform.position_at(times).T

    def value_and_gradient(self, state, observer, elapsed):
        return state[0] + elapsed, np.zeros((4, len(elapsed)))

    def residual(self, measured, predicted):
        return measured - predicted


ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 600, 5.0), sigma=0.01)
slow = tma.Sensor(tma.DelayedBearing(c=1500), times=[0.0, 10.0], sigma=[0.1, 0.2], platform=Sway())
watch = tma.Scenario(ship, [ear, slow, tma.Sensor(Depression(), [0.0], 1)], reference_time=595)
truth = tma.Target((2e3, 4e3), speed=6, heading=1.5)
angles = watch.with_target(truth).simulate(runs=1, seed=1)[0]
found = tma.fit(watch, angles, start=[1e3, 2e3, 0, 0], chart=tma.Cartesian)
print(found.state + 1, found.covariance[0, 0], float(found.p_value), found.at(900).ellipse(0.9).semi_axes)
prior = tma.prior_along_first_bearing(watch, angles, 5e3, 2e3, 10.0)
track = tma.ekf(watch, angles, prior, process_noise=tma.ProcessNoise(1e-4, {"bias": 1}), gate=0.99)
print(track.state.shape, tma.crlb_sigma(watch, found.state).max(), tma.find_ghosts(watch)[0].case)


def toss(seed: np.random.SeedSequence, runs: int) -> dict[str, np.ndarray]:
    return {"heads": np.random.default_rng(seed).random(runs) < 0.5}


print(tma.statistics(tma.monte_carlo(toss, 1000, "coins")["heads"][:, None]).bias_se())
"""
WRONG = """
import tmalib as tma

ship = tma.Course((0, 0), 5, "north", [tma.Straight(300)])  # wrong
tma.Course((0, 0), 5, 0.0, [300])  # wrong
ear = tma.Sensor(times=[0.0], sigma=0.1)  # wrong
tma.Sensor("bearing", [0.0], 0.1)  # wrong
tma.Sensor(tma.Bearing(), [0.0], 0.1, platform=(0, 0))  # wrong
watch = tma.Scenario(ship, ear, reference_time=0)  # wrong
found = tma.fit(watch, watch.simulate(runs=10))  # wrong
tma.fit(watch)  # wrong
tma.fit(watch, [0.1], tol=1)  # wrong
found.position  # wrong
found.ellipse(0.9)  # wrong
tma.confidence_region(watch)  # wrong
tma.load(5)  # wrong
"""
MODULES = [
    importlib.import_module(found.name)
    for found in pkgutil.walk_packages(tmalib.__path__, "tmalib.")
    if not found.name.startswith(UNTYPED)
]


def _functions_of(cls):
    """Functions that a class itself defines: methods, and those behind its properties."""
    made = {"__init__"} if dataclasses.is_dataclass(cls) or getattr(cls, "_is_protocol", False) else set()
    for name, member in vars(cls).items():
        if name in made or (name.startswith("_") and name not in WRITTEN):
            continue
        if isinstance(member, property):
            member = member.fget
        elif isinstance(member, cached_property):
            member = member.func
        elif isinstance(member, classmethod | staticmethod):
            member = member.__func__
        if inspect.isfunction(member):
            yield name, member


def _public():
    """Every public function and class, by module and name."""
    for module in [tmalib, *MODULES]:
        for name, thing in vars(module).items():
            here = (getattr(thing, "__module__", None) or "").startswith("tmalib")
            here = here and "<locals>" not in getattr(thing, "__qualname__", "")
            if not name.startswith("_") and here and (inspect.isfunction(thing) or inspect.isclass(thing)):
                yield f"{thing.__module__}.{thing.__qualname__}", thing


PUBLIC = dict(sorted(_public(), key=lambda found: found[0]))


def _unannotated(function):
    hints = typing.get_type_hints(function)  # fails for what is no name of the module
    names = [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]
    return [name for name in (*names, "return") if name not in hints and name != "return"] + (
        [] if "return" in hints else ["return"]
    )


def test_everything_public_is_seen():
    assert {"tmalib.batch.fit", "tmalib.estimate.Fit", "tmalib.files.frame.Frame"} <= PUBLIC.keys()
    assert {
        f"{getattr(tmalib, n).__module__}.{n}" for n in tmalib.__all__ if callable(getattr(tmalib, n))
    } <= (PUBLIC.keys())
    assert len(PUBLIC) > 250


@pytest.mark.parametrize("name", PUBLIC)
def test_parameters_and_results_are_annotated(name):
    thing = PUBLIC[name]
    if inspect.isclass(thing):
        missing = {method: _unannotated(function) for method, function in _functions_of(thing)}
        assert not any(missing.values()), missing
    else:
        assert not _unannotated(thing)


@pytest.mark.parametrize("name", [n for n, t in PUBLIC.items() if dataclasses.is_dataclass(t)])
def test_fields_say_what_is_in_them(name):
    vague = {object, tuple, list, dict, "np.ndarray"}
    hints = typing.get_type_hints(PUBLIC[name])
    assert {field.name for field in dataclasses.fields(PUBLIC[name])} <= hints.keys()
    found = {key: hint for key, hint in hints.items() if hint in vague}
    assert not found or found == {"origin": object}, "the origin of a Cartesian chart may be anything"


def _checked(folder, *programs):
    """What the type checker says of programs that use the library."""
    for k, program in enumerate(programs):
        (folder / f"user_{k}.py").write_text(program, encoding="utf-8")
    files = [f"user_{k}.py" for k in range(len(programs))]
    command = [sys.executable, "-m", "mypy", "--cache-dir", str(CACHE), "--config-file", "", *files]
    done = subprocess.run(
        command, cwd=folder, env={"MYPYPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert not done.stderr, done.stderr
    return done.stdout


def test_a_program_is_understood(tmp_path):
    """One run of the checker: of a program that is right, and of one with a mistake in every line."""
    said = _checked(tmp_path, RIGHT, WRONG)
    faults = [line for line in said.splitlines() if ": error:" in line]
    assert [line for line in faults if line.startswith("user_0")] == []
    lines = {int(line.split(":")[1]) for line in faults}
    wrong = {k for k, line in enumerate(WRONG.splitlines(), start=1) if line.endswith("# wrong")}
    assert lines == wrong, said
