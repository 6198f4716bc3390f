"""Everything public can be pickled, so that it goes to another process and comes back as it was."""

import dataclasses
import inspect
import pickle
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from functools import partial

import numpy as np
import pytest
from test_files_saved import same
from test_ghosts_one_leg import SHAPES, geometry, paths_of, sample
from test_ghosts_two_legs import KINDS, draw, members

import tmalib as tma
from tmalib import files, ghosts, sensitivity
from tmalib.summary import Row

SHIP = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Turn(60, 0.02), tma.Straight(300)])
TIMES = np.arange(0, 600, 10.0)
MODELS = [
    tma.Bearing(), tma.DelayedBearing(), tma.DelayedBearingUnknownSpeed(1480.0, 1500.0), tma.Range(),
    tma.DopplerFrequency(f0=300.0), tma.Biased(tma.Bearing(), "compass", 0.01), tma.AcceleratedBearing(),
    tma.TurningBearing(), tma.ConicalAngle(tma.BOTTOM_BOUNCE, 100.0, 4000.0), tma.KnownComponent("z"),
]  # fmt: skip
WATCH = tma.Scenario(SHIP, [tma.Sensor(tma.Bearing(), TIMES, 0.01, "ear")], 595)
SCENARIO = WATCH.with_target(tma.Target((2e3, 4e3), speed=6, heading=1.5))
HEARD = SCENARIO.simulate(3, seed=1)
FOUND = tma.fit(WATCH, HEARD[0])
PRIOR = tma.prior_along_first_bearing(WATCH, HEARD, 5e3, 2e3, 10.0)
DRAWN = tma.sample_posterior(FOUND, 1)
TRACK = tma.ekf(WATCH, HEARD, PRIOR, [100.0, 595.0])
CLOUD = tma.cloud_along_first_bearing(WATCH, HEARD[0], (1e3, 9e3), 10, 50, 1)
FRAME = tma.Frame(datetime(2024, 5, 1, tzinfo=UTC), 50.0, -5.0)


def toss(seed, runs):
    return {"heads": np.random.default_rng(seed).random(runs) < 0.5}


def unknown_sigma():
    return dataclasses.replace(WATCH, sensors=[dataclasses.replace(WATCH.sensors[0], sigma=None)])


THINGS = {
    "motions": [
        SHIP, SCENARIO.target, tma.SampledCourse([0, 1], [(0, 0), (1, 1)], [0.0, 1.0]),
        files.RecordedCourse([0, 1], [(0, 0), (1, 1)], frame=FRAME),
    ],
    "frame": FRAME,
    "models": MODELS,
    "scenarios": [tma.Scenario(SHIP, [tma.Sensor(model, TIMES, 0.01)], 595) for model in MODELS],
    "a sigma each, and none": [tma.Sensor(tma.Bearing(), TIMES, s) for s in (0.01 + 0 * TIMES, None)],
    "a scenario with a target": SCENARIO,
    "a scenario that was used": [WATCH, WATCH.blocks, WATCH.until(300.0)],
    "charts": [tma.ModifiedPolar((0, 0)), tma.Cartesian()],
    "process noise": tma.ProcessNoise(1e-4, {"compass": 1e-6}),
    "fits": [
        FOUND, tma.fit(WATCH, HEARD), tma.fit(WATCH, HEARD, loss="bisquare"),
        tma.fit(WATCH, np.full(len(TIMES), np.nan)), tma.fit(unknown_sigma(), HEARD[0]),
    ],
    "estimates": [FOUND.at(700.0), FOUND.at(700.0).ellipse(), tma.fit(WATCH, HEARD).at(700.0)],
    "filters": [TRACK, PRIOR, tma.predict(PRIOR, 30.0), tma.update(PRIOR, WATCH, HEARD)],
    "running fits": [tma.running_fit(WATCH, HEARD, most=16), tma.refit(None, WATCH, HEARD, most=16)],
    "bank": tma.range_bank(WATCH, HEARD, [1e3, 9e3], 5.0),
    "fit over time": tma.fit_over_time(SCENARIO, HEARD, [400.0, 595.0], SCENARIO.state),
    "consistency": tma.compare_with_truth(SCENARIO, TRACK),
    "particles": [CLOUD, tma.sir(WATCH, HEARD[0], CLOUD, 0.001, 1)],
    "region": tma.confidence_region(FOUND, 0.9),
    "posterior": [DRAWN, DRAWN.region(0.9)],
    "departure": tma.departure_effect(SCENARIO, tma.Course((0, 0), 6.0, 0.0, [tma.Turn(600, 0.001)])),
    "rays": tma.position_from_rays([tma.DIRECT, tma.BOTTOM_BOUNCE, tma.RayPath(-1, 1, 1)], [0.6] * 3, 9, 99),
    "tests of residuals": tma.residual_tests(FOUND),
    "rows": tma.summarise(FOUND),
    "alternative": tma.Alternative(FOUND.state, 1.0, 0.5),
    "Monte-Carlo": [tma.monte_carlo(toss, 700, "coins"), tma.Stream("coins"), tma.Stream("coins").source],
    "statistics": tma.statistics(np.arange(20.0).reshape(10, 2)),
    "sensitivity": [sensitivity.response(SCENARIO), sensitivity.modes(SCENARIO)],
}  # fmt: skip


def parts_of(thing):
    """What pickling has to give back, fields by name; of a method or a `partial` what it is made of."""
    if isinstance(thing, partial):
        return ["partial", *map(parts_of, (thing.func, thing.args, thing.keywords))]
    if inspect.ismethod(thing):
        return [thing.__qualname__, parts_of(thing.__self__)]
    if isinstance(thing, tma.Runs):
        return [dict(thing), thing.source]
    if dataclasses.is_dataclass(thing):
        fields = {field.name: parts_of(getattr(thing, field.name)) for field in dataclasses.fields(thing)}
        return [type(thing).__qualname__, fields]
    if isinstance(thing, list | tuple):
        return [type(thing).__qualname__, *map(parts_of, thing)]
    return {key: parts_of(value) for key, value in thing.items()} if isinstance(thing, Mapping) else thing


def comes_back(thing):
    back = pickle.loads(pickle.dumps(thing))
    assert same(parts_of(thing), parts_of(back))
    return back


@pytest.mark.parametrize("name", THINGS)
def test_it_comes_back(name):
    comes_back(THINGS[name])


def test_all_kinds_are_among_them():
    """Every class of the library whose objects a user gets; charts and models are there by their objects."""
    seen = set()

    def walk(thing):
        seen.add(type(thing))
        for part in (vars(thing) if dataclasses.is_dataclass(thing) else {}).values():
            walk(part)
        for part in thing if isinstance(thing, list | tuple) else ():
            walk(part)

    walk(list(THINGS.values()))
    walk([tma.DIRECT, tma.find_ghosts(GHOSTLY), near()])
    classes = {getattr(tma, name) for name in tma.__all__ if isinstance(getattr(tma, name), type)}
    classes -= {tma.ProgressLine}  # writes to a file of this process
    assert classes | {ghosts.Family, Row, sensitivity.Response, sensitivity.Modes} <= seen


# -- ghosts: what makes their members comes back too ----------------------------------------------

GHOSTLY = geometry(np.random.default_rng(1), "general", paths_of("two"))


def near():
    legs = [tma.Straight(300), tma.Straight(300, heading=np.radians(1))]
    array = tma.Course((0, 0), speed=5, heading=0.0, legs=legs)
    target = tma.Target((5000, 7000), speed=4, heading=np.radians(45), depth=100)
    rays = [tma.ConicalAngle(path, 200.0, 4000.0) for path in (tma.DIRECT, tma.BOTTOM_BOUNCE)]
    sensors = [tma.Sensor(ray, np.arange(0, 601, 20), 0.017) for ray in rays]
    return tma.near_ghosts(tma.Scenario(array, sensors, 0, target), within=11.07)


def test_near_ghosts_come_back():
    found = near()
    assert len(found) > 1
    for ghost in found:
        assert same(comes_back(ghost).target(), ghost.target())


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("rays", ["direct", "bottom", "two"])
def test_families_of_one_leg_come_back(rays, shape):
    for family in tma.find_ghosts(geometry(np.random.default_rng(3), shape, paths_of(rays))):
        here, there = (sample(np.random.default_rng(4), one) for one in (family, comes_back(family)))
        assert same(here, there)


@pytest.mark.parametrize("kind", KINDS)
def test_families_of_two_legs_come_back(kind):
    scenario = draw(kind, np.random.default_rng(3))
    for family in tma.find_ghosts(scenario):
        both = family, comes_back(family)
        here, there = (members(one, scenario, np.random.default_rng(4)) for one in both)
        assert here
        assert same(here, there)


def ghosts_of(scenario):
    return tma.find_ghosts(scenario)


def test_ghosts_are_found_in_another_process():
    with ProcessPoolExecutor(1) as pool:
        (there,) = pool.map(ghosts_of, [GHOSTLY])
    here = tma.find_ghosts(GHOSTLY)
    assert [family.case for family in there] == [family.case for family in here]
    assert all(same(a.target(), b.target()) for a, b in zip(there, here, strict=True) if a.is_isolated)
