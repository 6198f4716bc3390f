"""Saving and loading: everything comes back bit for bit."""

import dataclasses
import inspect
import json
import math
import struct
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tmalib as tma
from tmalib.files.encoding import CLASSES, decode, encode


def same(a, b):
    """Whether two things have the same types, fields, shapes, and floats bit for bit (a NaN is a NaN)."""
    if type(a) is not type(b):
        return False
    if isinstance(a, float):
        return struct.pack("d", a) == struct.pack("d", b) or (math.isnan(a) and math.isnan(b))
    if isinstance(a, np.ndarray | np.generic):
        if a.dtype != b.dtype or a.shape != b.shape:
            return False
        if a.dtype.kind == "f":
            lost = np.isnan(a)
            return np.array_equal(lost, np.isnan(b)) and a[~lost].tobytes() == b[~lost].tobytes()
        return a.tobytes() == b.tobytes()
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    if dataclasses.is_dataclass(a):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    return a == b


def there_and_back(thing):
    """Through the text that a file has."""
    return decode(json.loads(json.dumps(encode(thing), allow_nan=False)))


def test_same_can_tell():
    assert not same(0.0, -0.0)
    assert not same(1, 1.0)
    assert not same(np.array([1.0]), np.array([np.nextafter(1.0, 2)]))
    assert not same(np.float64(1), 1.0)
    assert not same(tma.Target((0, 0), 1, 1.0), tma.Target((0, 0), 1, np.nextafter(1.0, 2)))
    assert same(math.nan, math.nan)


# -- exact --------------------------------------------------------------------------------------

FLOATS = st.floats(allow_nan=True, allow_infinity=True)
SCALARS = st.none() | st.booleans() | st.integers() | st.text() | FLOATS
ARRAYS = st.one_of(
    st.lists(FLOATS).map(np.array).map(lambda a: a.astype(float)),
    st.lists(st.floats(width=32)).map(lambda v: np.array(v, dtype=np.float32)),
    st.lists(st.integers(-(2**63), 2**63 - 1)).map(lambda v: np.array(v, dtype=np.int64)),
    st.lists(st.booleans()).map(lambda v: np.array(v, dtype=bool)),
    st.lists(st.text(st.characters(min_codepoint=1)), min_size=1).map(np.array),
)
NUMPY = FLOATS.map(np.float64) | st.booleans().map(np.bool_) | st.integers(0, 255).map(np.uint8)
THINGS = st.recursive(
    SCALARS | ARRAYS | NUMPY,
    lambda parts: st.lists(parts) | st.lists(parts).map(tuple) | st.dictionaries(st.text(), parts),
    max_leaves=12,
)


@given(THINGS)
def test_any_content_comes_back(thing):
    assert same(there_and_back(thing), thing)


PLACES = st.tuples(*[st.floats(-1e9, 1e9)] * 2)
NUMBERS = st.floats(-1e6, 1e6)
POSITIVE = st.floats(1e-6, 1e6)


def increasing(values):
    return sorted(set(values))


TIMES = st.lists(st.floats(0, 1e3), min_size=1, max_size=20).map(increasing)
LEGS = st.lists(
    st.builds(tma.Straight, POSITIVE, st.none() | POSITIVE, st.none() | NUMBERS)
    | st.builds(tma.Turn, POSITIVE, NUMBERS, st.none() | POSITIVE),
    max_size=4,
).map(lambda legs: [*legs, tma.Straight(math.inf)])
COURSES = st.builds(tma.Course, PLACES, POSITIVE, NUMBERS, LEGS)
FRAMES = st.builds(
    lambda epoch, place: tma.Frame(epoch, *place),
    st.none() | st.datetimes(datetime(1970, 1, 1), datetime(2100, 1, 1), timezones=st.just(UTC)),
    st.just((None, None)) | st.tuples(st.floats(-90, 90), st.floats(-180, 360)),
)
RECORDED = st.builds(
    lambda times, frame: tma.RecordedCourse(times, np.outer(times, [1.1, -2.7]), np.sin(times), frame),
    TIMES,
    FRAMES,
)
TARGETS = st.builds(tma.Target, PLACES, POSITIVE, NUMBERS, st.none() | POSITIVE, NUMBERS) | st.builds(
    tma.Target.from_velocity, PLACES, st.tuples(NUMBERS, NUMBERS)
)
SPEEDS = st.floats(100, 1e4)
MODELS = st.one_of(
    st.builds(tma.Bearing), st.builds(tma.DelayedBearing, SPEEDS), st.builds(tma.AcceleratedBearing),
    st.builds(tma.TurningBearing), st.builds(tma.Range),
    st.builds(tma.DelayedBearingUnknownSpeed, SPEEDS, st.none() | SPEEDS),
    st.builds(tma.DopplerFrequency, SPEEDS, st.none() | POSITIVE, st.none() | POSITIVE),
    st.builds(tma.ConicalAngle, st.sampled_from([tma.DIRECT, tma.BOTTOM_BOUNCE, tma.SURFACE_BOUNCE]),
              st.floats(0, 100), st.floats(100, 5e3), st.none() | st.floats(0, 100), st.floats(0, 50)),
)  # fmt: skip
BIASED = st.builds(tma.Biased, MODELS, st.sampled_from(["bias", "compass"]), NUMBERS)
SLOW = st.builds(
    tma.Course, PLACES, st.floats(0, 50), NUMBERS, st.just([tma.Turn(99, 0.1), tma.Straight(math.inf)])
)
SENSORS = st.builds(
    tma.Sensor, MODELS | BIASED, TIMES, st.floats(1e-6, 3), st.text(max_size=5), st.none() | SLOW
)
SCENARIOS = st.builds(tma.Scenario, SLOW, st.lists(SENSORS, min_size=1, max_size=3), NUMBERS)


@given(COURSES | RECORDED | TARGETS | FRAMES | MODELS | BIASED | SENSORS)
def test_parts_come_back(thing):
    assert same(there_and_back(thing), thing)


@given(SCENARIOS)
def test_scenarios_come_back_and_predict_the_same(scenario):
    again = there_and_back(scenario)
    assert same(again, scenario)
    assert again.coordinates == scenario.coordinates
    with np.errstate(all="ignore"):
        state = np.linspace(1.0, 2.0, len(scenario.coordinates))
        assert same(again.linearise(state), scenario.linearise(state))


@pytest.fixture(scope="module")
def results():
    """A scenario with everything in it, and what comes out of estimators, several runs and one."""
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    frame = tma.Frame(datetime(2024, 5, 1, tzinfo=UTC), 60, 5)
    buoy = tma.RecordedCourse([0, 700], [(3e3, 0), (3e3, 1)], frame=frame)
    times = np.arange(0, 600, 10.0)
    watch = tma.Scenario(ship, [
        tma.Sensor(tma.Biased(tma.Bearing(), "compass", 0.01), times, 0.01),
        tma.Sensor(tma.DelayedBearing(1500), times + 0.1, 0.02, "buoy", buoy)], 595)  # fmt: skip
    scenario = watch.with_target(tma.Target.from_velocity((2e3, 4e3), (5.9, 0.1)))
    angles = scenario.simulate(runs=3, seed=1)
    angles[1, 3] = np.nan
    plain = tma.Scenario(ship, [tma.Sensor(tma.Bearing(), times, 0.01)], 595)
    seen = plain.with_target(scenario.target).simulate(runs=1, seed=2)[0]
    prior = tma.prior_along_first_bearing(plain, seen, 4e3, 2e3, 5)
    cloud = tma.cloud_along_first_bearing(plain, seen, (1e3, 9e3), 10, particles=50, seed=3)
    one, track = tma.fit(plain, seen), tma.ekf(plain, seen, prior)
    return {
        "scenario": scenario,
        "angles": angles,
        "fits": tma.fit(watch, angles),
        "fit": one,
        "later": one.at(900),
        "ellipse": one.at(900).ellipse(),
        "prior": prior,
        "track": track,
        "cloud": cloud,
        "particles": tma.sir(plain, seen, cloud, beta=0.01, seed=4),
        "consistency": tma.compare_with_truth(plain.with_target(scenario.target), track),
    }


def test_a_file_with_all_results(results, tmp_path):
    path = tmp_path / "all.json"
    tma.save(path, results)
    again = tma.load(path)
    assert same(again, results)
    assert repr(again["fits"]) == repr(results["fits"])
    assert same(again["fits"].covariance, results["fits"].covariance)
    assert same(again["scenario"].simulate(2, 3), results["scenario"].simulate(2, 3))
    assert np.isnan(again["angles"][1, 3])
    tma.save(path, again)
    assert same(tma.load(path), results)


def test_every_field_is_saved_whatever_fields_there_are(results):
    """As for a field that is added later: no class is written by hand."""
    content = encode(results["fit"])["Fit"]
    assert list(content) == [field.name for field in dataclasses.fields(tma.Fit)]


def test_the_file_is_valid_json_without_nan(results, tmp_path):
    path = tmp_path / "all.json"
    tma.save(path, results)
    constants = []
    json.loads(path.read_text(encoding="ascii"), parse_constant=constants.append)
    assert constants == []


def test_the_dataclasses_of_the_library_are_known():
    """Left out: charts, random numbers, statistics, ghosts (members are functions), what is made of a fit."""
    public = {getattr(tma, name) for name in tma.__all__}
    dataclasses_ = {c.__name__ for c in public if inspect.isclass(c) and dataclasses.is_dataclass(c)}
    left_out = {"Cartesian", "ModifiedPolar", "NearGhost", "Region", "ResidualTests", "Source", "Statistics"}
    left_out |= {"Stream", "Posterior", "CredibleRegion", "DepartureEffect", "RunningFit"}
    assert dataclasses_ - set(CLASSES) == left_out
    assert set(CLASSES) - dataclasses_ == {"Leg"}
