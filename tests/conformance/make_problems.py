"""Make the problems of `tmalib.conformance`, and search for their answers: `make problems` (ten minutes).

Usage: make_problems.py FOLDER

The lowest criterion is looked for by least squares of scipy from random starts, by fits of this library
from 200 random starts in each of two charts, from the truth and without any. The bound there is computed in
sixty digits, from formulas that are written here once more, and stored with fifty.
"""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from exact_bound import deviations
from random_scenarios import FAMILIES, best_of_scipy, random_scenario
from scipy.stats import chi2

import tmalib as tma
from tmalib.bounds import information_rank
from tmalib.papers.conical_angles import scenarios as conical

MOST = 120  # measurements
STARTS = 200
SEED = 20261128
SAME = 1e-2


def thinned(scenario):
    """With at most `MOST` measurements, spread over all."""
    count = len(scenario.times)
    wanted = np.zeros(count, dtype=bool)
    wanted[np.unique(np.linspace(0, count - 1, min(count, MOST)).round().astype(int))] = True
    return scenario.keep(wanted)


def random_problems(rng):
    """Three of each family that bearings see well, and nine that they do not."""
    for family in FAMILIES:
        for k in range(3):
            yield f"{family.replace(' ', '-')}-{k + 1}", thinned(random_scenario(rng, family)), {}
    for k in range(9):
        scenario = thinned(random_scenario(rng, "one to three legs", well_seen=False))
        yield f"ill-seen-{k + 1}", scenario, {}


def ship(*legs):
    return tma.Course((0, 0), 6.0, 0.0, [tma.Straight(length, heading=np.radians(h)) for length, h in legs])


def other_problems(rng):
    """Biased sensors, wild bearings, cones with ghosts, and what nothing can tell."""
    times, target = np.arange(0, 1200, 12.0), tma.Target((3e3, 7e3), speed=7.0, heading=np.radians(130))
    turning, straight = ship((400, 0), (400, 110), (400, 20)), ship((1200, 30))
    compass = tma.Biased(tma.Bearing(), "compass")
    for k, sigma in enumerate(np.radians([0.1, 0.3, 1.0])):
        watch = tma.Scenario(turning, [tma.Sensor(compass, times, sigma)], 1188.0, target)
        yield f"biased-{k + 1}", watch, {"bias": np.radians([2.0, -1.0, 3.0][k])}
    plain = tma.Scenario(turning, [tma.Sensor(tma.Bearing(), times, np.radians(0.5))], 1188.0, target)
    for k, share in enumerate((0.03, 0.1)):
        yield f"wild-bearings-{k + 1}", plain, {"wild": share}
    cones = [
        conical.section_5_2(2000.0, assumed_depth=100.0),
        conical.section_5_2(4000.0, assumed_depth=100.0),
        conical.close_target(),
    ]
    for k, scenario in enumerate([*cones, conical.turning_array(assumed_depth=100.0)]):
        yield f"cones-{k + 1}", thinned(scenario), {}
    nothing = {
        "straight-ship": replace(plain, platform=straight),
        "two-bearings": plain.between(0, 12),
        "motionless-ship": replace(plain, platform=tma.Course((0, 0), 0.0, 0.0, [tma.Straight(1200)])),
        "biased-straight": replace(plain, platform=straight, sensors=[tma.Sensor(compass, times, 0.01)]),
    }
    for name, scenario in nothing.items():
        yield f"unobservable-{name}", scenario, {"none": True}


def measured(scenario, rng, bias=0.0, wild=0.0, none=False):
    """One run of measurements with what is wrong with them, and the true state."""
    truth = scenario.state if "compass" not in scenario.coordinates else None
    if truth is None:
        target, when = scenario.target, scenario.reference_time
        known = (*target.position_at(when), *target.velocity, bias)
        values = dict(zip(("x", "y", "vx", "vy", "compass"), known, strict=True))
        truth = np.array([values[name] for name in scenario.coordinates])
    angles = scenario.linearise(truth)[0] + scenario.sigma * rng.standard_normal(len(scenario.times))
    if wild:
        which = rng.random(len(angles)) < wild
        angles[which] = rng.uniform(-np.pi, np.pi, which.sum())
    return angles, truth


def random_starts(scenario, truth, rng):
    """States about the platform and the truth, far and near."""
    near, n = np.abs(truth) + np.where(np.isin(scenario.coordinates, ("vx", "vy")), 10.0, 1e3), len(truth)
    near[[name == "compass" for name in scenario.coordinates]] = 0.1
    size = np.exp(rng.uniform(np.log(0.1), np.log(3.0), (STARTS, 1)))
    states = size * near * rng.standard_normal((STARTS, n))
    for i in (i for i, name in enumerate(scenario.coordinates) if name == "z"):
        states[:, i] = np.abs(states[:, i])
    return states


def search(scenario, angles, truth, rng):
    """Lowest criterion, its state, and by how many starts of how many it was found."""
    starts = np.concatenate([truth[None], random_starts(scenario, truth, rng)])
    options = {"tolerance": 1e-5, "max_iterations": 300}
    fits = [tma.fit(scenario, angles, starts, **options),
            tma.fit(scenario, angles, starts, chart=tma.Cartesian, **options)]  # fmt: skip
    state = np.concatenate([found.state for found in fits])
    cost = np.concatenate([np.where(found.converged, found.cost, np.inf) for found in fits])
    alone = tma.fit(scenario, angles, **options)
    if alone.converged:
        state, cost = np.vstack([state, alone.state]), np.append(cost, alone.cost)
    lowest = cost.min()
    if scenario.coordinates == ("x", "y", "vx", "vy") and not any(
        isinstance(sensor.model, tma.ConicalAngle) for sensor in scenario.sensors
    ):
        lowest = min(lowest, best_of_scipy(rng, scenario, angles))
    if lowest < cost.min() - SAME:
        raise RuntimeError(f"scipy finds {lowest}, fits {cost.min()}")
    return float(cost.min()), state[cost.argmin()], int(np.sum(cost < lowest + SAME)), len(cost)


def answer(scenario, angles, truth, rng, none):
    """What is stored of a problem."""
    found = {"unknowns": list(scenario.coordinates), "measurements": len(angles)}
    if none:
        rank = int(information_rank(scenario, truth))
        return found | {"criterion": None, "rank": rank}
    lowest, state, hits, starts = search(scenario, angles, truth, rng)
    rank = int(information_rank(scenario, state))
    return found | {
        "criterion": lowest,
        "state": state.tolist(),
        "found_by": hits,
        "searches": starts,
        "p_value": float(chi2.sf(lowest, len(angles) - len(state))),
        "rank": rank,
        "bound": deviations(scenario, state),
    }


def main(folder):
    folder, rng, answers = Path(folder), np.random.default_rng(SEED), {}
    (folder / "problems").mkdir(parents=True, exist_ok=True)
    for name, scenario, wrong in [*random_problems(rng), *other_problems(rng)]:
        angles, truth = measured(scenario, rng, **wrong)
        watch = scenario.with_target(None)
        tma.save(folder / "problems" / f"{name}.json", {"scenario": watch, "angles": angles})
        answers[name] = answer(watch, angles, truth, rng, wrong.get("none", False))
        print(name, answers[name]["criterion"], answers[name].get("found_by"), flush=True)
    text = json.dumps(dict(sorted(answers.items())), indent=1)
    (folder / "answers.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
