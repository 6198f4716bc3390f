"""Plausible mistakes: each gets a right answer, or a `ValueError` that says what is accepted.

The table has one line a mistake: what is called, and a regular expression of the message, or a check of the
answer. Warnings are errors here, as in all tests.
"""

import copy
import dataclasses
import pickle
from datetime import datetime
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import tmalib as tma
from tmalib import sensitivity

NAN, INF, PI = np.nan, np.inf, np.pi
SHIP = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=PI / 2)])
EAR = tma.Sensor(tma.Bearing(), np.arange(0, 600, 20.0), 0.01, name="ear")
TRUTH = tma.Target((2e3, 4e3), speed=6, heading=1.5)
WATCH = tma.Scenario(SHIP, [EAR], 595.0)
SEEN = WATCH.with_target(TRUTH)
RUNS = SEEN.simulate(4, seed=1)
ONE, STATE, N = RUNS[0], SEEN.state, RUNS.shape[1]
FIT = tma.fit(WATCH, ONE)
PRIOR = tma.prior_along_first_bearing(WATCH, ONE, 5e3, 2e3, 10.0)
CLOUD = tma.cloud_along_first_bearing(WATCH, ONE, (1e3, 1e4), 10.0, 200, seed=1)
TRACK = tma.ekf(WATCH, ONE, PRIOR)
SOUND = tma.Scenario(SHIP, [tma.Sensor(tma.DelayedBearing(340), EAR.times, 0.01)], 595.0)
RAYS = [
    tma.Sensor(tma.ConicalAngle(p, 200.0, 4000.0), EAR.times, 0.01) for p in (tma.DIRECT, tma.BOTTOM_BOUNCE)
]
ARRAY = tma.Scenario(SHIP, RAYS, 595.0)
NORTH = tma.Course((0, 0), 5, 0.0, [tma.Straight(600)])
STRAIGHT = tma.Scenario(NORTH, RAYS, 595.0)
DEEP = tma.Target((5e3, 7e3), 4, 0.8, depth=100)
LOST = RUNS.copy()
LOST[1] = NAN
WILD = RUNS.copy()
WILD[1] = INF
NOT_NUMBERS = {
    "text": "12", "none": None, "bool": True, "complex": 1 + 2j, "date": np.datetime64("2020-01-01"),
    "object": object(), "list": [1.0, 2.0], "nan": NAN, "infinite": -INF, "huge": 10**400,
}  # fmt: skip
NOT_ARRAYS = {
    "texts": ["1", "2"], "nones": [None, None], "bools": [True, False], "complex": [1j, 2.0],
    "ragged": [[1.0], [1.0, 2.0]],
    "dates": np.array(["2020-01-01", "2020-01-02"], dtype="datetime64[s]"), "objects": [object(), object()],
    "nan": [0.0, NAN], "masked": np.ma.array([0.0, 1.0], mask=[False, True]),
}  # fmt: skip


class Anything:
    """Not what is wanted."""


def with_sensor(**changes):
    return lambda: dataclasses.replace(EAR, **changes)


SCALARS = {
    "Target speed": ("speed", lambda v: tma.Target((0, 0), v, 0.0)),
    "Target heading": ("heading", lambda v: tma.Target((0, 0), 1.0, v)),
    "Target time": ("time", lambda v: tma.Target((0, 0), 1.0, 0.0, time=v)),
    "Course start_time": ("start_time", lambda v: tma.Course((0, 0), 1.0, 0.0, [tma.Straight(9)], v)),
    "Turn rate": ("rate", lambda v: tma.Turn(10, v)),
    "DelayedBearing c": ("c", tma.DelayedBearing),
    "DopplerFrequency c": ("c", tma.DopplerFrequency),
    "bottom_depth": ("bottom_depth", lambda v: tma.ConicalAngle(tma.DIRECT, 1.0, v)),
    "reference_time": ("reference_time", lambda v: tma.Scenario(SHIP, [EAR], v)),
    "tolerance": ("tolerance", lambda v: tma.fit(WATCH, ONE, tolerance=v)),
    "max_iterations": ("max_iterations", lambda v: tma.fit(WATCH, ONE, max_iterations=v)),
    "runs": ("runs", lambda v: SEEN.simulate(v, seed=1)),
    "range": ("range", lambda v: tma.along_first_bearing(WATCH, ONE, v)),
    "probability": ("probability", lambda v: tma.confidence_ellipse([0, 0], np.eye(2), v)),
    "acceleration": ("acceleration", tma.ProcessNoise),
    "predict time": ("time", lambda v: tma.predict(PRIOR, v)),
    "beta": ("beta", lambda v: tma.sir(WATCH, ONE, CLOUD, v, seed=1)),
    "bound": ("bound", lambda v: sensitivity.worst_sup(SEEN, v)),
    "within": ("within", lambda v: tma.near_ghosts(ARRAY.with_target(DEEP), v)),
    "together": ("together", lambda v: tma.average_measurements(WATCH, ONE, v)),
    "at": ("time", FIT.at),
}
ARRAYS = {
    "Target position": ("position", lambda v: tma.Target(v, 1.0, 0.0)),
    "Course start": ("start", lambda v: tma.Course(v, 1.0, 0.0, [tma.Straight(9)])),
    "Sensor times": ("times", lambda v: tma.Sensor(tma.Bearing(), v, 0.01)),
    "SampledCourse times": ("times", lambda v: tma.SampledCourse(v, np.zeros((2, 2)))),
    "from_velocity": ("velocity", lambda v: tma.Target.from_velocity((0, 0), v)),
    "nearest_motion": ("times", lambda v: sensitivity.nearest_motion(v, np.zeros((2, 2)))),
    "fit_over_time": ("times", lambda v: tma.fit_over_time(SEEN, ONE, v, STATE)),
}

MISTAKES = []


def mistake(name, call, expected):
    MISTAKES.append(pytest.param(call, expected, id=name))


for what, (argument, call) in SCALARS.items():
    for kind, value in NOT_NUMBERS.items():
        mistake(f"{what}: {kind}", lambda call=call, value=value: call(value), rf"{argument} must be ")
for what, (argument, call) in ARRAYS.items():
    for kind, value in NOT_ARRAYS.items():
        mistake(f"{what}: {kind}", lambda call=call, value=value: call(value), rf"{argument} must be ")

for name, scenario_taker in {
    "fit": lambda s: tma.fit(s, ONE),
    "along_first_bearing": lambda s: tma.along_first_bearing(s, ONE, 1e3),
    "prior_along_first_bearing": lambda s: tma.prior_along_first_bearing(s, ONE, 1e3, 1e3, 1.0),
    "cloud_along_first_bearing": lambda s: tma.cloud_along_first_bearing(s, ONE, (1, 2), 1.0, 9, 1),
    "ekf": lambda s: tma.ekf(s, ONE, PRIOR),
    "update": lambda s: tma.update(PRIOR, s, ONE),
    "gaussian_filter": lambda s: tma.gaussian_filter(s, ONE, PRIOR),
    "range_bank": lambda s: tma.range_bank(s, ONE, [1e3, 9e3], 5.0),
    "running_fit": lambda s: tma.running_fit(s, ONE),
    "refit": lambda s: tma.refit(None, s, ONE),
    "sir": lambda s: tma.sir(s, ONE, CLOUD, 0.1, 1),
    "crlb": tma.crlb,
    "crlb_sigma": tma.crlb_sigma,
    "fisher_information": tma.fisher_information,
    "information_rank": tma.information_rank,
    "average_measurements": lambda s: tma.average_measurements(s, ONE, 2),
    "profile_criterion": lambda s: tma.profile_criterion(s, ONE, (1, 2)),
    "distinct_minima": lambda s: tma.distinct_minima(s, ONE, [STATE]),
    "fit_over_time": lambda s: tma.fit_over_time(s, ONE, [595.0], STATE),
    "compare_with_truth": lambda s: tma.compare_with_truth(s, TRACK),
    "find_ghosts": tma.find_ghosts,
    "near_ghosts": lambda s: tma.near_ghosts(s, 1.0),
    "response": sensitivity.response,
    "modes": sensitivity.modes,
    "differential": lambda s: sensitivity.differential(s, np.zeros((N, 2))),
    "displaced_measurements": lambda s: sensitivity.displaced_measurements(s, np.zeros((N, 2))),
    "position_criterion": lambda s: sensitivity.position_criterion(s, 0.0),
    "sandwich_covariance": lambda s: sensitivity.sandwich_covariance(s, ONE, STATE),
    "stealth": lambda s: sensitivity.stealth(s, STATE),
    "worst_energy": lambda s: sensitivity.worst_energy(s, 1.0),
    "worst_sup": lambda s: sensitivity.worst_sup(s, 1.0),
    "worst_flyable": lambda s: sensitivity.worst_flyable(s, 1.0, 1.0),
    "worst_stealth": lambda s: sensitivity.worst_stealth(s, 1.0),
}.items():
    mistake(
        f"{name}: no scenario", lambda f=scenario_taker: f(Anything()), "scenario must be a Scenario, got"
    )
for name, fit_taker in {
    "confidence_region": tma.confidence_region,
    "residual_tests": tma.residual_tests,
    "alternatives": tma.alternatives,
}.items():
    mistake(f"{name}: a state for a fit", lambda f=fit_taker: f(STATE), "(fit|found) must be a Fit, got")

for name, measured_taker in {
    "fit": lambda m: tma.fit(WATCH, m),
    "ekf": lambda m: tma.ekf(WATCH, m, PRIOR),
    "sir": lambda m: tma.sir(WATCH, m, CLOUD, 0.1, 1),
    "update": lambda m: tma.update(PRIOR, WATCH, m),
    "gaussian_filter": lambda m: tma.gaussian_filter(WATCH, m, PRIOR),
    "range_bank": lambda m: tma.range_bank(WATCH, m, [1e3, 9e3], 5.0),
    "running_fit": lambda m: tma.running_fit(WATCH, m),
    "refit": lambda m: tma.refit(None, WATCH, m),
    "along_first_bearing": lambda m: tma.along_first_bearing(WATCH, m, 1e3),
    "prior_along_first_bearing": lambda m: tma.prior_along_first_bearing(WATCH, m, 1e3, 1e3, 1.0),
    "profile_criterion": lambda m: tma.profile_criterion(WATCH, m, (1, 2)),
    "fit_over_time": lambda m: tma.fit_over_time(SEEN, m, [595.0], STATE),
    "sandwich_covariance": lambda m: sensitivity.sandwich_covariance(SEEN, m, STATE),
}.items():
    degrees = np.degrees(np.abs(ONE)) + 10
    mistake(f"{name}: degrees", lambda f=measured_taker, m=degrees: f(m), "radians.*looks like degrees")
    mistake(f"{name}: one short", lambda f=measured_taker: f(ONE[1:]), "measurements must have shape")
    mistake(f"{name}: one number", lambda f=measured_taker: f(0.5), "measurements must have shape")
    mistake(f"{name}: nothing", lambda f=measured_taker: f([]), "measurements must have shape")
    mistake(
        f"{name}: measured texts", lambda f=measured_taker: f(ONE.astype(str)), "measurements must be numbers"
    )
    mistake(
        f"{name}: complex measurements", lambda f=measured_taker: f(ONE + 0j), "measurements must be numbers"
    )
    mistake(f"{name}: None", lambda f=measured_taker: f(None), "measurements must be numbers")

LINES = [
    # motions
    (
        "endless leg first",
        lambda: tma.Course((0, 0), 1, 0, [tma.Straight(INF), tma.Straight(1)]),
        r"legs\[0\]",
    ),
    ("no legs", lambda: tma.Course((0, 0), 1, 0, []), "legs is empty"),
    ("a leg for legs", lambda: tma.Course((0, 0), 1, 0, tma.Straight(1)), "legs must be a sequence of Leg"),
    ("numbers for legs", lambda: tma.Course((0, 0), 1, 0, [60]), "each of legs must be a Leg, got 60"),
    ("leg of no time", lambda: tma.Straight(0), "duration of a leg must be positive, got 0"),
    ("leg back in time", lambda: tma.Straight(-5), "duration of a leg must be positive, got -5"),
    ("leg of nan", lambda: tma.Straight(NAN), "duration of a leg must be positive, got nan"),
    ("leg of text", lambda: tma.Straight("60"), "duration must be numbers, got '60'"),
    ("leg of two times", lambda: tma.Straight([1, 2]), r"duration of a leg must be positive, got \[1, 2\]"),
    ("leg goes back", lambda: tma.Straight(5, speed=-1), "speed must be at least 0.0, got -1.0"),
    ("negative speed", lambda: tma.Target((0, 0), -1, 0), "speed must be at least 0.0, got -1.0"),
    ("three coordinates", lambda: tma.Target((0, 0, 9), 1, 0), r"position must have shape \(2\), got \(3,\)"),
    ("before the course", lambda: SHIP.position_at(-1.0), "time -1.0 is outside the course"),
    ("after the course", lambda: SHIP.heading_at([5, 601.0]), "time 601.0 is outside the course"),
    ("at no time", lambda: SHIP.position_at(NAN), "time nan is outside the course"),
    ("at a text", lambda: TRUTH.position_at("noon"), "t must be numbers, got 'noon'"),
    ("at a date", lambda: TRUTH.position_at(np.datetime64("2020-01-01")), "t must be numbers of seconds"),
    ("at a datetime", lambda: SHIP.position_at(datetime(2020, 1, 1)), "t must be numbers, got datetime"),
    ("empty times", lambda: SHIP.position_at([]), lambda found: found.shape == (0, 2)),
    ("no depth", lambda: TRUTH.state(0.0, ("x", "z")), "target has no depth"),
    ("unknown component", lambda: TRUTH.state(0.0, ("x", "bias")), r"and no \['bias'\]"),
    (
        "samples go back",
        lambda: tma.SampledCourse([1, 0], np.zeros((2, 2))),
        "times must be strictly increasing",
    ),
    (
        "no samples",
        lambda: tma.SampledCourse([], np.zeros((0, 2))),
        "times must be strictly increasing and not empty",
    ),
    ("samples do not fit", lambda: tma.SampledCourse([0, 1], np.zeros((3, 2))), "positions must have shape"),
    ("no headings", lambda: tma.SampledCourse([0, 1], np.zeros((2, 2))).heading_at(0), "has no headings"),
    ("a fraction is a number", lambda: tma.Target((0, 0), Fraction(1, 2), 0).speed, lambda v: v == 0.5),
    # models
    ("sound at zero speed", lambda: tma.DelayedBearing(0), "c must be greater than 0.0, got 0.0"),
    (
        "array below the bottom",
        lambda: tma.ConicalAngle(tma.DIRECT, 5e3, 4e3),
        "array_depth must be between 0",
    ),
    ("array in the air", lambda: tma.ConicalAngle(tma.DIRECT, -5, 4e3), "array_depth must be between 0"),
    (
        "assumed in the rock",
        lambda: tma.ConicalAngle(tma.DIRECT, 5, 4e3, 5e3),
        "assumed_depth must be between 0",
    ),
    ("no path", lambda: tma.ConicalAngle("direct", 5, 4e3), "path must be a RayPath, got 'direct'"),
    ("class for path", lambda: tma.ConicalAngle(tma.RayPath, 5, 4e3), "path must be a RayPath"),
    ("impossible path", lambda: tma.RayPath(1, 0, 1), "no ray has the path"),
    ("start beyond all bounds", lambda: tma.fit(WATCH, ONE, [1e200] * 4).converged, lambda found: not found),
    (
        "a number beyond all bounds",
        lambda: tma.predict(PRIOR, 1e300),
        "time must be at most 1e[+]100 in size",
    ),
    (
        "a count beyond all bounds",
        lambda: tma.nees_limits(1e90, 5),
        "n must be at most 1000000000000000, got",
    ),
    ("record beyond all bounds", lambda: tma.ekf(WATCH, ONE, PRIOR, record=1e300), "record must be finite"),
    ("delta an array", lambda: tma.RayPath(np.ones(2), 0, 0), "delta must be a number, got an array"),
    (
        "others an array",
        lambda: tma.along_first_bearing(WATCH, ONE, 1e3, np.ones(2)),
        "others must be a dict",
    ),
    ("walks an array", lambda: tma.sir(WATCH, ONE, CLOUD, 0.1, 1, np.ones(2)), "walks must be a Mapping"),
    ("half a bounce", lambda: tma.RayPath(1, 0.5, 0), "bottom must be a number of bounces, got 0.5"),
    ("bounces of text", lambda: tma.RayPath(1, "1", 0), "bottom must be a number, got '1'"),
    ("image of no path", lambda: tma.image_depth(None, 1, 1, 10), "path must be a RayPath, got None"),
    ("image of a text", lambda: tma.image_depth(tma.DIRECT, "1", 1, 10), "target_depth must be a number"),
    ("bias named x", lambda: tma.Biased(tma.Bearing(), "x"), "name must be a text and none of"),
    ("bias of nothing", lambda: tma.Biased(None), "model must be an object with coordinates"),
    ("bias of a class", lambda: tma.Biased(tma.Bearing), "model must be an object with coordinates"),
    (
        "check no model",
        lambda: tma.check_model(Anything(), SHIP, [0.0], STATE),
        "model must be an object with",
    ),
    (
        "check nowhere",
        lambda: tma.check_model(tma.Bearing(), None, [0.0], STATE),
        "platform must be an object with",
    ),
    (
        "delay faster than sound",
        lambda: tma.propagation_delay((1, 2), (400, 0), 340),
        "slower than c = 340.0 m/s",
    ),
    (
        "delay of three",
        lambda: tma.propagation_delay((1, 2, 3), (4, 0), 340),
        r"displacement must have shape \(..., 2\)",
    ),
    ("delay shapes", lambda: tma.propagation_delay(np.ones((3, 2)), np.ones((2, 2)), 340), "must broadcast"),
    ("bearing of one", lambda: tma.bearing(5.0), r"displacement must have shape \(..., 2\), got \(\)"),
    ("bearing of text", lambda: tma.bearing("north"), "displacement must be numbers, got 'north'"),
    ("wrap a text", lambda: tma.wrap("north"), "angle must be numbers, got 'north'"),
    ("wrap None", lambda: tma.wrap(None), "angle must be numbers, got None"),
    (
        "no unknown f0",
        lambda: tma.Scenario(SHIP, [tma.Sensor(tma.DopplerFrequency(), [0.0], 1)], 0, TRUTH),
        "true_f0",
    ),
    # sensors
    ("model class", with_sensor(model=tma.Bearing), "model must be an object with"),
    ("model name", with_sensor(model="bearing"), "model must be an object with .*, got 'bearing'"),
    ("times go back", with_sensor(times=EAR.times[::-1]), "times of a sensor must not go back"),
    ("no times", with_sensor(times=[]), "times is empty"),
    ("times in rows", with_sensor(times=np.zeros((2, 3))), r"times must have shape \(any\), got \(2, 3\)"),
    ("sigma zero", with_sensor(sigma=0), "sigma must be greater than 0.0, got 0.0"),
    ("sigma negative", with_sensor(sigma=-0.1), "sigma must be greater than 0.0, got -0.1"),
    ("sigma in degrees", with_sensor(sigma=5.0), "sigma of a bearing must be in radians, got 5.0"),
    ("a sigma zero", with_sensor(sigma=np.zeros(N)), "sigma must be positive, got 0.0"),
    ("two sigmas", with_sensor(sigma=[0.1, 0.2]), "sigma must have shape"),
    ("sigma of text", with_sensor(sigma="1 deg"), "sigma must be a number, got '1 deg'"),
    ("name a number", with_sensor(name=5), "name must be a text, got 5"),
    (
        "platform a point",
        with_sensor(platform=(0, 0)),
        r"platform must be an object with position_at, got \(0, 0\)",
    ),
    # scenarios
    (
        "no platform",
        lambda: tma.Scenario(None, [EAR], 0),
        "platform must be an object with position_at, got None",
    ),
    ("a class for a platform", lambda: tma.Scenario(tma.Course, [EAR], 0), "platform must be an object with"),
    ("one sensor", lambda: tma.Scenario(SHIP, EAR, 0), "sensors must be a sequence of Sensor"),
    (
        "a model for a sensor",
        lambda: tma.Scenario(SHIP, [tma.Bearing()], 0),
        "each of sensors must be a Sensor",
    ),
    ("no sensors", lambda: tma.Scenario(SHIP, [], 0), "sensors is empty"),
    (
        "sensor outlasts the course",
        lambda: tma.Scenario(SHIP, [with_sensor(times=[0, 700.0], sigma=1)()], 0),
        "outside",
    ),
    ("a state for a target", lambda: WATCH.with_target(STATE), "target must be an object with position_at"),
    ("target on the platform", lambda: WATCH.with_target(SHIP), "is it on the platform"),
    ("supersonic", lambda: SOUND.with_target(tma.Target((0, 4e3), 400, 1.0)), "slower than sound"),
    ("just supersonic", lambda: SOUND.with_target(tma.Target((0, 4e3), 341, 1.0)), "slower than sound"),
    ("supersonic, receding", lambda: SOUND.with_target(tma.Target((0, 4e3), 1e3, 0.0)), "slower than sound"),
    ("no depth for a cone", lambda: ARRAY.with_target(TRUTH), "needs the target's depth"),
    ("a course has no depth", lambda: ARRAY.with_target(SHIP), "needs the target's depth"),
    ("measure nothing", lambda: WATCH.measure(), "measure needs a target"),
    ("simulate nothing", lambda: WATCH.simulate(1, 1), "needs a target"),
    (
        "less than no runs",
        lambda: SEEN.simulate(-1, 1),
        "an integer that is not negative, got -1",
    ),
    ("half a run", lambda: SEEN.simulate(1.5, 1), "runs must be an integer that is not negative, got 1.5"),
    ("seed of text", lambda: SEEN.simulate(1, "one"), "seed must be an integer.*got 'one'"),
    ("negative seed", lambda: SEEN.simulate(1, -1), "seed must be an integer that is not negative"),
    ("between, the wrong way", lambda: WATCH.between(500, 100), "no measurement between 500.* and 100"),
    ("between texts", lambda: WATCH.between("0", 1), "first must be numbers, got '0'"),
    ("until before all", lambda: WATCH.until(-5), "no measurement between"),
    ("keep nothing", lambda: WATCH.keep(np.zeros(N, bool)), "wanted must be a mask"),
    ("keep indices", lambda: WATCH.keep([0, 1]), "wanted must be a mask"),
    ("state too short", lambda: WATCH.linearise([1, 2, 3]), r"state must have shape \(..., 4\)"),
    ("state of text", lambda: WATCH.linearise("state"), "state must be numbers, got 'state'"),
    # bounds
    ("bound of no state", lambda: tma.crlb(WATCH), "state needs a target"),
    ("bound faster than sound", lambda: tma.crlb(SOUND, [0, 4e3, 400, 0]), "slower than sound"),
    ("rank faster than sound", lambda: tma.information_rank(SOUND, [0, 4e3, 341, 0]), "slower than sound"),
    ("bound at nan", lambda: tma.crlb(WATCH, [NAN, 0, 0, 0]), "state must be finite"),
    (
        "bound on the platform",
        lambda: tma.crlb(WATCH, [1500, 1500, 0, 0.0]),
        lambda found: np.isfinite(found).all(),
    ),
    (
        "one supersonic of two",
        lambda: tma.crlb(SOUND, [STATE, [0, 4e3, 400, 0]]),
        lambda found: np.isfinite(found[0]).all() and np.isnan(found[1]).all(),
    ),
    ("no states", lambda: tma.crlb(WATCH, np.zeros((0, 4))), lambda found: found.shape == (0, 4, 4)),
    ("nees shapes", lambda: tma.nees(np.ones(3), np.ones(4), np.eye(4)), "state .3,., truth .4,."),
    (
        "nees covariance",
        lambda: tma.nees(np.ones(4), np.ones(4), np.eye(3)),
        r"covariance must have shape \(..., 4, 4\)",
    ),
    ("nees batches", lambda: tma.nees(np.ones((3, 4)), np.ones(4), np.ones((2, 4, 4))), "must broadcast"),
    ("nees of text", lambda: tma.nees("x", np.ones(4), np.eye(4)), "state must be numbers"),
    ("bias of no state", lambda: tma.second_order_bias(WATCH), "state needs a target"),
    ("bias of two states", lambda: tma.second_order_bias(WATCH, [STATE, STATE]), "state must be one state"),
    ("progress of half a run", lambda: tma.ProgressLine()(0.5, 10), "finished must be"),
    (
        "nees of nobody",
        lambda: tma.nees(np.ones((0, 4)), np.ones(4), np.eye(4)),
        lambda found: found.shape == (0,),
    ),
    ("limits in per cent", lambda: tma.nees_limits(4, 10, 90), "probability must be below 1, got 90.0"),
    ("limits of no runs", lambda: tma.nees_limits(4, 0), "runs must be a positive integer, got 0"),
    (
        "ellipse of one",
        lambda: tma.confidence_ellipse([1], np.eye(2)),
        r"centre must have shape \(2\), got \(1,\)",
    ),
    ("ellipse of nan", lambda: tma.confidence_ellipse([0, NAN], np.eye(2)), "centre must be finite"),
    ("ellipse of nothing", lambda: tma.confidence_ellipse([0, 0], -np.eye(2)), "positive semi-definite"),
    (
        "ellipse in per cent",
        lambda: tma.confidence_ellipse([0, 0], np.eye(2), 90),
        "probability must be below 1",
    ),
    ("transition of names", lambda: tma.transition(1.0, "xyvxvy"), "coordinates must be a sequence of names"),
    ("transition without y", lambda: tma.transition(1.0, ("x", "vx")), "uniform motion needs the components"),
    ("transition of text", lambda: tma.transition("1"), "duration must be numbers, got '1'"),
    ("propagate three", lambda: tma.propagate([1, 2, 3], 1.0), r"state must have shape \(..., 4\)"),
    ("propagate batches", lambda: tma.propagate(np.ones((3, 4)), np.ones(2)), "must broadcast"),
    # fit
    ("fit no runs", lambda: tma.fit(WATCH, np.zeros((0, N))), lambda found: found.state.shape == (0, 4)),
    (
        "fit no runs, a start",
        lambda: tma.fit(WATCH, np.zeros((0, N)), STATE),
        lambda found: found.status.shape == (0,),
    ),
    (
        "fit no runs robustly",
        lambda: tma.fit(WATCH, np.zeros((0, N)), loss="bisquare").covariance,
        lambda found: found.shape == (0, 4, 4),
    ),
    (
        "residuals of no runs",
        lambda: tma.residual_tests(tma.fit(WATCH, np.zeros((0, N)))).size.p_value,
        lambda found: found.shape == (0, 2),
    ),
    (
        "one lost run",
        lambda: tma.fit(WATCH, LOST).converged,
        lambda found: found.tolist() == [True, False, True, True],
    ),
    (
        "one infinite run",
        lambda: tma.fit(WATCH, WILD).converged,
        lambda found: found.tolist() == [True, False, True, True],
    ),
    (
        "one lost run, robustly",
        lambda: tma.fit(WATCH, LOST, loss="bisquare").converged,
        lambda found: found.tolist() == [True, False, True, True],
    ),
    (
        "one run in degrees among others",
        lambda: tma.fit(WATCH, np.stack([ONE, np.degrees(ONE)])).converged,
        lambda found: found[0],
    ),
    (
        "all masked",
        lambda: tma.fit(WATCH, np.ma.masked_all(N)).status,
        lambda found: found == "not observable",
    ),
    (
        "supersonic start",
        lambda: tma.fit(SOUND, ONE, [0, 4e3, 400, 0]).status,
        lambda found: found == "not finite",
    ),
    ("start of three", lambda: tma.fit(WATCH, ONE, [1, 2, 3]), r"state must have shape \(..., 4\)"),
    (
        "starts do not fit",
        lambda: tma.fit(WATCH, RUNS, np.ones((3, 4))),
        "must broadcast, got measurements .4,., start .3,.",
    ),
    ("start of text", lambda: tma.fit(WATCH, ONE, "north"), "state must be numbers"),
    (
        "safeguard of text",
        lambda: tma.fit(WATCH, ONE, safeguard="no"),
        "safeguard must be True or False, got 'no'",
    ),
    ("chart of text", lambda: tma.fit(WATCH, ONE, chart="polar"), "chart must be a class"),
    ("chart a model", lambda: tma.fit(WATCH, ONE, chart=tma.Bearing), "chart must be a class"),
    (
        "unknown loss",
        lambda: tma.fit(WATCH, ONE, loss="huber"),
        r"loss must be one of \('squares', 'bisquare'\), got 'huber'",
    ),
    (
        "nothing to start from",
        lambda: tma.fit(tma.Scenario(SHIP, [tma.Sensor(tma.Range(), EAR.times, 1)], 0), ONE),
        "needs a sensor that measures bearings",
    ),
    (
        "others not a dict",
        lambda: tma.along_first_bearing(WATCH, ONE, 1e3, others=5),
        "others must be a dict, got 5",
    ),
    (
        "others not wanted",
        lambda: tma.along_first_bearing(WATCH, ONE, 1e3, {"f0": 1}),
        r"others must have the unknowns \[\]",
    ),
    (
        "no starts",
        lambda: tma.distinct_minima(WATCH, ONE, np.zeros((0, 4)))[0],
        lambda found: found.shape == (0, 4),
    ),
    ("region of many", lambda: tma.confidence_region(tma.fit(WATCH, RUNS)), "a region is of one run"),
    ("region too near", lambda: tma.confidence_region(FIT, nearest=0), "nearest must be greater than 0.0"),
    ("region in per cent", lambda: tma.confidence_region(FIT, 90), "probability must be below 1"),
    (
        "profile of three",
        lambda: tma.profile_criterion(WATCH, ONE, (1, 2, 3)),
        r"position must have shape \(..., 2\)",
    ),
    ("profile batches", lambda: tma.profile_criterion(WATCH, RUNS, np.ones((3, 2))), "must broadcast"),
    ("no lags", lambda: tma.residual_tests(FIT, lags=0), "lags must be a positive integer, got 0"),
    # filters
    (
        "prior not symmetric",
        lambda: tma.Prior(STATE, np.triu(np.ones((4, 4))) + np.eye(4), 0),
        "must be symmetric",
    ),
    ("prior not positive", lambda: tma.Prior(STATE, -np.eye(4), 0), "must be positive definite"),
    ("prior of three", lambda: tma.Prior(STATE[:3], np.eye(4), 0), "must be symmetric, of shape"),
    ("prior of text", lambda: tma.Prior("here", np.eye(4), 0), "mean must be numbers, got 'here'"),
    (
        "prior of names",
        lambda: tma.Prior(STATE, np.eye(4), 0, "xyuv"),
        "coordinates must name the 4 components",
    ),
    (
        "prior of numbers",
        lambda: tma.Prior(STATE, np.eye(4), 0, [1, 2, 3, 4]),
        "each of coordinates must be a str",
    ),
    ("state for a prior", lambda: tma.ekf(WATCH, ONE, STATE), "prior must be a Prior, got"),
    (
        "prior after all data",
        lambda: tma.ekf(WATCH, ONE, tma.Prior(STATE, np.eye(4), 700.0)),
        "prior.*700.0.*no measurement",
    ),
    (
        "record before the data",
        lambda: tma.ekf(WATCH, ONE, PRIOR, record=[-50.0]).state,
        lambda found: np.allclose(found[0], tma.propagate(PRIOR.mean, -50.0 - PRIOR.time)),
    ),
    (
        "record after the data",
        lambda: tma.ekf(WATCH, ONE, PRIOR, record=[595.0, 900.0]).state,
        lambda found: np.allclose(found[1], tma.propagate(found[0], 305.0)),
    ),
    (
        "record goes back",
        lambda: tma.ekf(WATCH, ONE, PRIOR, record=[5.0, 1.0]),
        "record must be finite and strictly",
    ),
    ("record of text", lambda: tma.ekf(WATCH, ONE, PRIOR, record="end"), "record must be numbers, got 'end'"),
    (
        "record of rows",
        lambda: tma.ekf(WATCH, ONE, PRIOR, record=np.zeros((2, 2))),
        "record must be finite and strictly",
    ),
    (
        "noise a number",
        lambda: tma.ekf(WATCH, ONE, PRIOR, process_noise=0.1),
        "process_noise must be a ProcessNoise, got 0.1",
    ),
    (
        "filter chart of text",
        lambda: tma.ekf(WATCH, ONE, PRIOR, chart="polar"),
        "chart must be a class such as",
    ),
    (
        "update chart a model",
        lambda: tma.update(PRIOR, WATCH.between(20, INF), ONE[1:], chart=tma.Range),
        "chart must be a class",
    ),
    ("gate of five sigma", lambda: tma.ekf(WATCH, ONE, PRIOR, gate=5), "gate"),
    (
        "ekf no runs",
        lambda: tma.ekf(WATCH, np.zeros((0, N)), PRIOR).state,
        lambda found: found.shape == (0, 1, 4),
    ),
    (
        "ekf one lost run",
        lambda: tma.ekf(WATCH, WILD, PRIOR).finite,
        lambda found: found.tolist() == [True, False, True, True],
    ),
    (
        "another update",
        lambda: tma.gaussian_filter(WATCH, ONE, PRIOR, update="sigma"),
        "update must be one of",
    ),
    ("an update's prior", lambda: tma.gaussian_filter(WATCH, ONE, STATE), "prior must be a Prior"),
    ("no speed in a bank", lambda: tma.range_bank(WATCH, ONE, [1e3, 9e3], 0.0), "velocity_sigma"),
    ("edges of text", lambda: tma.range_bank(WATCH, ONE, "far", 5.0), "edges must be"),
    ("a state for what is known", lambda: tma.refit(STATE, WATCH, ONE), "known must be a RunningFit"),
    ("a memory of three", lambda: tma.running_fit(WATCH, ONE, most=3), "most must be"),
    ("running start of three", lambda: tma.running_fit(WATCH, ONE, start=[1, 2, 3]), "state must have shape"),
    (
        "running record back",
        lambda: tma.running_fit(WATCH, ONE, [9.0, 1.0]),
        "record must be finite and strictly",
    ),
    (
        "running fit, one wild run",
        lambda: tma.running_fit(WATCH, WILD, most=16).finite[:, 0],
        lambda found: found.tolist() == [True, False, True, True],
    ),
    (
        "running fit, one silent run",
        lambda: tma.running_fit(WATCH, LOST).finite[:, 0],
        lambda found: found.tolist() == [True, False, True, True],
    ),
    ("ekf batches", lambda: tma.ekf(WATCH, RUNS, tma.Prior(np.ones((3, 4)), np.eye(4), 0)), "must broadcast"),
    ("predict back", lambda: tma.predict(PRIOR, -5.0), "time must not be before the prior's"),
    ("predict a state", lambda: tma.predict(STATE, 5.0), "prior must be a Prior"),
    (
        "predict with a number",
        lambda: tma.predict(PRIOR, 5.0, 0.1),
        "process_noise must be a ProcessNoise, got 0.1",
    ),
    (
        "update late",
        lambda: tma.update(tma.Prior(STATE, np.eye(4), 700.0), WATCH, ONE),
        "must not measure before the prior's time",
    ),
    ("walks a list", lambda: tma.ProcessNoise(0.1, ["bias"]), "walks must be a Mapping, got"),
    ("walk of x", lambda: tma.ProcessNoise(0.1, {"x": 1.0}), "walks must name components other than"),
    (
        "walk of nothing",
        lambda: tma.ProcessNoise(0.1, {"bias": None}),
        r"walks\['bias'\] must be a number, got None",
    ),
    (
        "cloud from far to near",
        lambda: tma.cloud_along_first_bearing(WATCH, ONE, (9, 1), 1.0, 9, 1),
        "range must be a smaller",
    ),
    (
        "cloud of one range",
        lambda: tma.cloud_along_first_bearing(WATCH, ONE, 5e3, 1.0, 9, 1),
        "range must be two numbers, got",
    ),
    (
        "cloud of many runs",
        lambda: tma.cloud_along_first_bearing(WATCH, RUNS, (1, 9), 1.0, 9, 1),
        "takes one run",
    ),
    ("empty cloud", lambda: tma.Cloud(np.zeros((0, 4)), 0.0), "states is empty"),
    (
        "cloud after all data",
        lambda: tma.sir(WATCH, ONE, tma.Cloud(CLOUD.states, 700.0), 0.1, 1),
        "no measurement after",
    ),
    ("states for a cloud", lambda: tma.sir(WATCH, ONE, CLOUD.states, 0.1, 1), "cloud must be a Cloud, got"),
    ("sir seed", lambda: tma.sir(WATCH, ONE, CLOUD, 0.1, "a"), "seed must be an integer"),
    # Monte-Carlo, consistency
    ("statistics of one column", lambda: tma.statistics([1.0, 2.0]), "errors must have shape"),
    ("statistics of text", lambda: tma.statistics([["a"]]), "errors must be numbers"),
    ("statistics of nobody", lambda: tma.statistics(np.zeros((0, 4))), "at least 4 runs, got 0 of 0"),
    ("statistics mask", lambda: tma.statistics(np.ones((5, 1)), used=[1, 1, 1, 1, 0]), "used must be bool"),
    (
        "statistics without spread",
        lambda: tma.statistics(np.ones((5, 1))).kurtosis,
        lambda found: np.isnan(found).all(),
    ),
    ("no task", lambda: tma.monte_carlo("task", 5, "s"), "task must be a function"),
    (
        "no dict",
        lambda: tma.monte_carlo(lambda seed, runs: 5, 5, "s"),
        "what the task returns must be a Mapping, got 5",
    ),
    (
        "rows lost",
        lambda: tma.monte_carlo(lambda seed, runs: {"a": [1]}, 5, "s"),
        "must return 5 rows of 'a'",
    ),
    ("stream without a name", lambda: tma.Stream(""), "name of a stream must be a text"),
    (
        "stream of a number",
        lambda: tma.monte_carlo(lambda seed, runs: {}, 5, 7),
        "name of a stream must be a text",
    ),
    ("stream number a text", lambda: tma.Stream("a", "1"), "number must be a number, got '1'"),
    (
        "compare without a target",
        lambda: tma.compare_with_truth(WATCH, TRACK),
        "target must be a Target, got None",
    ),
    ("compare a fit", lambda: tma.compare_with_truth(SEEN, FIT), "track must be a Track, got"),
    ("a track of no times", lambda: tma.fit_over_time(SEEN, ONE, [], STATE), "times is empty"),
    (
        "masks do not divide",
        lambda: tma.average_measurements(WATCH, ONE, 7),
        "cannot be divided into means of 7",
    ),
    (
        "average an unknown sigma",
        lambda: (
            tma.average_measurements(dataclasses.replace(WATCH, sensors=[with_sensor(sigma=None)()]), ONE, 2)[
                0
            ]
            .sensors[0]
            .sigma
        ),
        lambda found: found is None,
    ),
    # ghosts
    (
        "target in the air is a ghost",
        lambda: STRAIGHT.with_target(dataclasses.replace(DEEP, depth=-300)).measure()[0],
        lambda m: np.isclose(m, 7e3 / np.sqrt(5e3**2 + 7e3**2 + 500**2)),
    ),
    (
        "average sigmas",
        lambda: (
            tma.average_measurements(
                dataclasses.replace(WATCH, sensors=[with_sensor(sigma=np.full(N, 0.02))()]), ONE, 2
            )[0].sigma
        ),
        lambda found: np.allclose(found, 0.02 / np.sqrt(2)),
    ),
    ("ghosts of no target", lambda: tma.find_ghosts(ARRAY), "target"),
    ("ghosts of bearings", lambda: tma.find_ghosts(SEEN), "depth|ConicalAngle"),
    (
        "ghost of a ghost",
        lambda: tma.find_ghosts(STRAIGHT.with_target(dataclasses.replace(DEEP, depth=-50))),
        "depth must be between 0",
    ),
    (
        "ghosts within nothing",
        lambda: tma.near_ghosts(ARRAY.with_target(DEEP), 0),
        "within must be greater than 0.0",
    ),
    (
        "ghosts known by state",
        lambda: tma.near_ghosts(ARRAY.with_target(DEEP), 1.0, known=[STATE]),
        "each of known must be a Target",
    ),
    (
        "tolerance of a metre",
        lambda: tma.find_ghosts(ARRAY.with_target(DEEP), tolerance=1.0),
        "tolerance must be at most",
    ),
    (
        "admissible in the air",
        lambda: tma.admissible(dataclasses.replace(DEEP, depth=-1), 4e3),
        lambda found: not found,
    ),
    ("admissible without depth", lambda: tma.admissible(TRUTH, 4e3), "target must have a depth, got None"),
    ("admissible state", lambda: tma.admissible(STATE, 4e3), "target must be a Target, got"),
    # sensitivity
    (
        "displacement of one",
        lambda: sensitivity.differential(SEEN, np.zeros(2)),
        "displacement must have shape",
    ),
    ("displacement of text", lambda: sensitivity.differential(SEEN, "east"), "displacement must be numbers"),
    (
        "criterion of three",
        lambda: sensitivity.modes(SEEN, criterion=np.eye(3)),
        "criterion must be a finite matrix of shape",
    ),
    ("criterion of text", lambda: sensitivity.modes(SEEN, criterion="end"), "criterion must be numbers"),
    ("two states", lambda: sensitivity.response(SEEN, [STATE, STATE]), "one state is needed"),
    ("three sides", lambda: sensitivity.worst_flyable(SEEN, 1.0, 1.0, sides=3), "sides must be even"),
    (
        "unknown norm",
        lambda: sensitivity.nearest_motion([0, 1], np.zeros((2, 2)), norm="l1"),
        "norm must be one of",
    ),
    (
        "one time",
        lambda: sensitivity.nearest_motion([1, 1], np.zeros((2, 2))),
        "times must not be empty or all the same",
    ),
    ("no motion", lambda: sensitivity.nearest_motion([], np.zeros((0, 2))), "times"),
]
for line in LINES:
    mistake(*line)

BEYOND = [
    ("no other motion", lambda: tma.departure_effect(SEEN, []), "others is empty"),
    ("a departure at no time", lambda: tma.departure_effect(SEEN, TRUTH, "noon"), "time must be"),
    ("a posterior of no fit", lambda: tma.sample_posterior(ONE, 1), "must be a Fit"),
    ("no draws", lambda: tma.sample_posterior(FIT, 1, draws=0), "draws must be"),
    ("two rays", lambda: tma.position_from_rays([tma.DIRECT] * 2, [0.1, 0.2], 9, 99), "paths|three"),
    (
        "three rays that are one",
        lambda: tma.position_from_rays([tma.DIRECT] * 3, [0.1] * 3, 9, 99),
        "different",
    ),
    ("a component without a name", lambda: tma.KnownComponent(3), "name must be"),
]
for line in BEYOND:
    mistake(*line)


@pytest.mark.parametrize(("call", "expected"), MISTAKES)
def test_a_mistake_gets_an_answer_or_is_named(call, expected):
    if callable(expected):
        assert expected(call())
        return
    with pytest.raises(ValueError, match=expected) as caught:
        call()
    assert type(caught.value) is ValueError  # no LinAlgError, no UnicodeError


def test_the_table_is_long_and_names_are_used_once():
    names = [line.id for line in MISTAKES]
    assert len(names) >= 200
    assert len(set(names)) == len(names)


def test_every_public_name_is_in_the_table():
    text = Path(__file__).read_text(encoding="utf-8")
    of_files = {"load", "save", "read_bearings", "read_track", "Frame", "RecordedCourse", "sensitivity"}
    of_files |= {"write_bearings", "summarise"}  # their own tests have them
    outputs = {
        "Alternative",
        "Consistency",
        "CredibleRegion",
        "DepartureEffect",
        "Posterior",
        "RayPosition",
        "Ellipse",
        "Estimate",
        "FilterState",
        "Fit",
        "RunningFit",
        "NearGhost",
        "Track",
        "ParticleTrack",
        "Region",
        "ResidualTest",
        "ResidualTests",
        "Runs",
        "Source",
        "Statistics",
        "AcceleratedBearing",
        "TurningBearing",
        "DelayedBearingUnknownSpeed",
        "SURFACE_BOUNCE",
        "ModifiedPolar",
        "Cartesian",
    }
    missing = {n for n in tma.__all__ if f"tma.{n}" not in text} - of_files - outputs
    assert not missing
    made = {"Modes", "Response"}
    assert not {n for n in sensitivity.__all__ if f"sensitivity.{n}" not in text} - made


OBJECTS = [
    TRUTH,
    SHIP,
    tma.Straight(5),
    tma.SampledCourse([0, 1], np.zeros((2, 2))),
    EAR,
    WATCH,
    SEEN,
    FIT,
    FIT.at(0.0),
    FIT.at(0.0).ellipse(),
    PRIOR,
    CLOUD,
    TRACK,
    tma.predict(PRIOR, 5.0),
    tma.ProcessNoise(0.1),
    tma.Bearing(),
    tma.DelayedBearing(),
    tma.DelayedBearingUnknownSpeed(),
    tma.DopplerFrequency(),
    tma.Range(),
    tma.Biased(tma.Bearing()),
    tma.AcceleratedBearing(),
    tma.TurningBearing(),
    tma.DIRECT,
    RAYS[0].model,
    tma.Stream("a"),
    tma.Stream("a").source,
    tma.statistics(RUNS),
    tma.residual_tests(FIT),
    tma.ModifiedPolar((0, 0)),
    tma.Cartesian(),
    sensitivity.modes(SEEN),
    sensitivity.response(SEEN),
    tma.compare_with_truth(SEEN, TRACK),
    tma.sir(WATCH, ONE, CLOUD, 0.1, 1),
    tma.confidence_region(FIT),
    tma.monte_carlo(lambda seed, runs: {"a": np.ones(runs)}, 5, "s"),
]


def same(one, other):
    """Whether two values are the same, arrays and parts included."""
    if dataclasses.is_dataclass(one):
        names = [field.name for field in dataclasses.fields(one)]
        return type(one) is type(other) and all(same(getattr(one, n), getattr(other, n)) for n in names)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray | np.generic) and np.asarray(one).dtype.kind == "f":
        return np.array_equal(one, other, equal_nan=True)
    return (
        np.array_equal(one, other) if isinstance(one, np.ndarray) else True if callable(one) else one == other
    )


@pytest.mark.parametrize("thing", OBJECTS, ids=lambda thing: type(thing).__name__)
def test_it_can_be_pickled_copied_and_replaced(thing):
    for other in (pickle.loads(pickle.dumps(thing)), copy.deepcopy(thing)):
        if isinstance(thing, tma.Runs):
            assert np.array_equal(other["a"], thing["a"]) and other.source == thing.source  # noqa: PT018
        else:
            assert same(thing, other)
    if dataclasses.is_dataclass(thing):
        assert same(thing, dataclasses.replace(thing))


def test_a_near_ghost_can_be_pickled():
    legs = [tma.Straight(300), tma.Straight(300, heading=np.radians(1))]
    array = tma.Course((0, 0), speed=5, heading=0.0, legs=legs)
    sensors = [dataclasses.replace(ray, sigma=0.017) for ray in RAYS]
    target = tma.Target((5000, 7000), speed=4, heading=np.radians(45), depth=100)
    (ghost, *_) = tma.near_ghosts(tma.Scenario(array, sensors, 0, target), within=11.07)
    other = pickle.loads(pickle.dumps(ghost))
    assert other.chi_square == ghost.chi_square
    np.testing.assert_array_equal(other.target().position, ghost.target().position)


@pytest.mark.parametrize("speed", [339.9, 340.0, 341.0, 1e3])
def test_a_state_as_fast_as_sound_predicts_nothing(speed):
    states = np.array([STATE, [0.0, 4e3, speed, 0.0], [0.0, 4e3, 0.0, -speed], [NAN, 0.0, 0.0, 0.0], STATE])
    with np.errstate(invalid="ignore"):
        value, gradient = SOUND.linearise(states)
    slower = speed < 340
    assert np.isfinite(value[[1, 2]]).all() == slower
    assert np.isnan(value[[1, 2]]).all() == (not slower)
    assert np.isnan(gradient[[1, 2]]).all() == (not slower)
    np.testing.assert_array_equal(value[0], SOUND.linearise(STATE)[0])
    np.testing.assert_array_equal(value[4], value[0])
