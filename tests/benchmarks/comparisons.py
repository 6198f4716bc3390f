"""What is compared, and the goals: every function prints nothing and returns rows.

A row is a dict: ``what``, ``peer``, ``ratio`` with the middle half of the rounds ``low`` and ``high``, in
words ``of`` what, and a ``goal``, ``[">=", 25]``, where there is one. Answers are compared before anything
is timed.
"""

import os
import tracemalloc
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import filter_peers
import fit_peers
import numpy as np
from measure import in_a_process, interleaved, ratio
from other_peers import ghosts_by_search, particles_in_numpy, particles_in_stone_soup, worst_by_scipy
from problem import problem

import tmalib as tma
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.papers.robustness import scenarios as robust
from tmalib.sensitivity import differential, position_criterion, worst_sup

RUNS = 500
AS_WELL = 5e-3  # standard deviations: fits that stop by themselves differ by less
GHOST_STARTS, WORST_STARTS, PARTICLES, BETA = 40, 20, 20_000, 10.0


def row(what, peer, of, times, goal=None):
    middle, low, high = ratio(*times)
    return {"what": what, "peer": peer, "of": of, "ratio": middle, "low": low, "high": high, "goal": goal}


def in_sigmas(scenario, one, other):
    """The largest difference of states, in standard deviations of the bound."""
    return float(np.abs((one - other) / tma.crlb_sigma(scenario)).max())


def agree(name, difference, most):
    if not difference < most:
        raise AssertionError(f"{name} has another answer: {difference:.2g}, at most {most:g}")


def fits(runs=RUNS, few=25):
    """The batch fit, with and without a start. Peers that go run by run do a few runs only."""
    case, part, one = problem(runs), problem(few), problem(1)
    scenario = case.scenario
    for name, peer in fit_peers.PEERS.items():
        agree(name, in_sigmas(scenario, peer(part), tma.fit(scenario, part.angles).state), AS_WELL)
    slow = [name for name in fit_peers.PEERS if name.startswith(("scipy", "NumPy"))]
    tasks = {name: partial(peer, part if name in slow else case) for name, peer in fit_peers.PEERS.items()}
    ours = {
        "fit without a start": lambda: tma.fit(scenario, case.angles),
        "fit from the paper's start": lambda: tma.fit(scenario, case.angles, case.start),
        "fit from the truth": lambda: tma.fit(scenario, case.angles, scenario.state),
    }
    alone = {
        "one run without a start": (lambda: tma.fit(scenario, one.angles[0]), 20),
        "one run, scipy lm": (partial(fit_peers.in_scipy, one, "lm"), 20),
    }
    took = interleaved(tasks | ours | alone)
    each = {n: t / (few if n in slow else 1 if n in alone else runs) for n, t in took.items()}
    goals = {("fit without a start", "scipy lm"): [">=", 25], ("fit from the paper's start", "C"): ["<=", 4]}
    rows = []
    for mine in list(ours)[:2]:
        for name in fit_peers.PEERS:
            times = (each[mine], each[name]) if name == "C" else (each[name], each[mine])
            of = "time of ours over its" if name == "C" else "its time over ours"
            rows.append(row(mine, name, of, times, goals.get((mine, name))))
    times = each["fit without a start"], each["fit from the truth"]
    rows.append(row("fit without a start", "ours from the truth", "time of ours over its", times))
    times = each["one run, scipy lm"], each["one run without a start"]
    rows.append(row("fit of one run without a start", "scipy lm", "its time over ours", times, [">=", 1]))
    return rows


def filters(counts=(RUNS, 5000)):
    """The extended Kalman filter."""
    few, rows = problem(2), []
    reference = tma.ekf(few.scenario, few.angles, few.prior).state[:, -1]
    for name, peer in filter_peers.PEERS.items():
        most = 1e-3 if name == "Stone Soup" else 1e-8  # its gradients are differences
        agree(name, in_sigmas(few.scenario, peer(few), reference), most)
    single = problem(1)
    for runs, goal in zip(counts, (10, 6), strict=True):
        case = problem(runs)
        tasks = {
            "ours": partial(tma.ekf, case.scenario, case.angles, case.prior),
            "C": partial(filter_peers.in_c, case),
        }
        if runs == counts[0]:
            tasks |= {n: partial(filter_peers.PEERS[n], single) for n in ("filterpy", "Stone Soup")}
        took = interleaved(tasks, 5)
        ours, what = took["ours"] / runs, f"EKF, {runs} runs"
        rows.append(row(what, "C", "time of ours over its", (ours, took["C"] / runs), ["<=", goal]))
        rows += [row(what, n, "its time over ours", (took[n], ours)) for n in tasks if n not in ("ours", "C")]
    return rows


def particles():
    """The particle filter, 500 bearings, one run, with the same first cloud and as much noise."""
    scenario = robust.reference().straight
    angles = scenario.simulate(1, seed=3)[0]
    cloud = tma.cloud_along_first_bearing(scenario, angles, (1e3, 15e3), 400.0, PARTICLES, 1)
    inputs = scenario, angles, cloud, BETA, 1
    track = tma.sir(*inputs)
    spread = np.sqrt(np.diag(track.covariance[-1]))
    peers = {"NumPy": particles_in_numpy, "Stone Soup": particles_in_stone_soup}
    for name, peer in peers.items():
        agree(name, float(np.abs((peer(*inputs) - track.state[-1]) / spread).max()), 2)
    took = interleaved(
        {"ours": lambda: tma.sir(*inputs)} | {n: partial(p, *inputs) for n, p in peers.items()}, 3
    )
    return [row("particle filter", n, "its time over ours", (took[n], took["ours"])) for n in peers]


def ghosts():
    """Ghosts of two rays at an array, by theorems and by a search that knows none."""
    scenario = conical.section_5_2(2000.0)
    known = [scenario.state] + [
        tma.Scenario(scenario.platform, scenario.sensors, 0.0, family.target()).state
        for family in tma.find_ghosts(scenario)
    ]
    searched = ghosts_by_search(scenario, GHOST_STARTS)
    agree("search for ghosts", max(min(np.abs(s - k).max() for k in known) for s in searched), 1.0)
    agree("ghosts of the theorem", max(min(np.abs(s - k).max() for s in searched) for k in known), 1.0)
    tasks = {
        "ours": (lambda: tma.find_ghosts(scenario), 20),
        "scipy": lambda: ghosts_by_search(scenario, GHOST_STARTS),
    }
    took = interleaved(tasks, 3)
    what = f"scipy from {GHOST_STARTS} starts"
    return [row("ghosts", what, "its time over ours", (took["scipy"], took["ours"]))]


def worst():
    """The worst displacement with a bound on every point, all vertices against a bounded search."""
    scenario, bound = robust.reference().straight, robust.WORST
    criterion = position_criterion(scenario, scenario.reference_time)
    found = np.linalg.norm(
        criterion @ differential(scenario, worst_sup(scenario, bound, criterion=criterion))
    )
    agree("search for the worst", abs(found / worst_by_scipy(scenario, bound, WORST_STARTS) - 1), 1e-6)
    tasks = {
        "ours": (lambda: worst_sup(scenario, bound, criterion=criterion), 5),
        "scipy": lambda: worst_by_scipy(scenario, bound, WORST_STARTS),
    }
    took = interleaved(tasks, 5)
    what = f"scipy from {WORST_STARTS} starts"
    return [row("worst displacement", what, "its time over ours", (took["scipy"], took["ours"]))]


def peak_and_result(runs):
    """Bytes that a fit without a start needs at the most beyond its measurements, and keeps at the end."""
    scenario, angles = emw.scenario(1), emw.scenario(1).simulate(runs, seed=2)
    tma.fit(scenario, angles[:50])
    tracemalloc.start()
    found = tma.fit(scenario, angles)
    kept, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak, kept, len(found.state)


def memory(small=5000, large=50_000):
    """What a fit needs beyond measurements and results, for ten times as many runs."""
    needs = [peak - kept for peak, kept, _ in map(peak_and_result, (small, large))]
    value = needs[1] / needs[0]
    of = f"bytes beyond measurements and results, {large} runs over {small}"
    return [{"what": "memory of a fit", "peer": "itself", "of": of, "ratio": value, "low": value,
             "high": value, "goal": ["<=", 1.25], "megabytes": [n / 1e6 for n in needs]}]  # fmt: skip


IMPORT = (
    "import time; a = time.perf_counter(); import numpy; b = time.perf_counter(); import tmalib; print({})"
)


def importing(rounds=9):
    """Time of `import tmalib` above that of `import numpy`, in milliseconds."""
    program = IMPORT.format("1e3 * (time.perf_counter() - b)")
    low, middle, high = np.quantile([in_a_process(program) for _ in range(rounds)], [0.25, 0.5, 0.75])
    return [{"what": "import tmalib", "peer": "import numpy", "of": "milliseconds above", "ratio": middle,
             "low": low, "high": high, "goal": ["<=", 50]}]  # fmt: skip


def table_task(seed, runs):
    """Fits of scenario 1, as a Monte-Carlo task."""
    scenario = emw.scenario(1)
    return {"state": tma.fit(scenario, scenario.simulate(runs, seed=seed)).state}


def processes(runs=20_000):
    """Two processes against one; skipped on a machine with one processor."""
    if (os.cpu_count() or 1) < 2:
        return []
    context, rows = get_context("spawn"), []
    with ProcessPoolExecutor(1, context) as one, ProcessPoolExecutor(2, context) as two:
        results = [tma.monte_carlo(table_task, 1000, "bench", executor=pool)["state"] for pool in (one, two)]
        agree("two processes", float(np.abs(results[0] - results[1]).max()), 5e-324)
        tasks = {
            name: partial(tma.monte_carlo, table_task, runs, "bench", executor=pool)
            for name, pool in (("one", one), ("two", two))
        }
        took = interleaved(tasks, 3)
    rows.append(
        row("two processes", "one process", "its time over theirs", (took["one"], took["two"]), [">=", 1.7])
    )
    return rows


GROUPS = (fits, filters, particles, ghosts, worst, memory, importing, processes)
