"""A batch fit against Gauss-Newton in C, compiled here; `make bench` prints the ratios. No pass, no fail."""

import ctypes
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import tmalib as tma
from tmalib.papers.emw_acoustic import scenarios as emw

RUNS, PASSES = 500, 6
FLAGS = ("-O3", "-march=native", "-ffast-math", "-fopenmp-simd", "-shared", "-fPIC")
SOURCE = Path(__file__).with_name("gauss_newton.c")
DOUBLES = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")


def compiled(folder):
    """The function of `SOURCE`, or the reason why there is none."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None, "no C compiler on the path"
    library = folder / "gauss_newton.so"
    made = subprocess.run([compiler, *FLAGS, SOURCE, "-o", library, "-lm"], capture_output=True, text=True)
    if made.returncode:
        return None, f"{compiler} does not compile {SOURCE.name}: {made.stderr}"
    function = ctypes.CDLL(str(library)).gauss_newton
    function.restype = None
    function.argtypes = [ctypes.c_int] * 4 + [DOUBLES] * 3 + [ctypes.c_double] * 3 + [DOUBLES] * 2
    return function, ""


def test_against_c(tmp_path):
    function, reason = compiled(tmp_path)
    if function is None:
        print(f"\nno comparison with C: {reason}")
        pytest.skip(reason)
    scenario = emw.scenario(1)
    light, sound = scenario.blocks
    angles = scenario.simulate(RUNS, seed=1)
    start = tma.along_first_bearing(scenario, angles, 10e3)
    x, y = (np.concatenate([light.observer[i], sound.observer[i]]) for i in range(2))
    elapsed = np.concatenate([light.elapsed, sound.elapsed])
    weights = light.sensor.sigma**-2, sound.sensor.sigma**-2

    def in_c():
        state = start.copy()
        function(RUNS, PASSES, len(light.elapsed), len(sound.elapsed), x, y, elapsed, *weights,
                 sound.sensor.model.c, angles, state)  # fmt: skip
        return state

    tasks = {
        "C": in_c,
        "from the paper's start": lambda: tma.fit(scenario, angles, start).state,
        "without a start": lambda: tma.fit(scenario, angles).state,
    }
    best = dict.fromkeys(tasks, np.inf)
    for _ in range(7):  # in turns, so that a slow moment of the machine hits all
        for name, task in tasks.items():
            begin = time.perf_counter()
            task()
            best[name] = min(best[name], time.perf_counter() - begin)
    print(f"\nscenario 1, {RUNS} runs, {PASSES} passes in C: {1e3 * best['C'] / RUNS:.4f} ms a run")
    for name in list(tasks)[1:]:
        print(f"fit {name}: {1e3 * best[name] / RUNS:.4f} ms a run, {best[name] / best['C']:.1f} times C")
    sigma, answer = tma.crlb_sigma(scenario), in_c()
    for name in list(tasks)[1:]:
        np.testing.assert_allclose(tasks[name]() / sigma, answer / sigma, rtol=0, atol=5e-3, err_msg=name)
