"""What nothing tells is never called converged: bearings from a ship that does not turn, or lies still."""

import numpy as np
import pytest

import tmalib as tma
from tmalib import status as words


def watch(rng, speed, sensors=1):
    """A ship on one course, random times, and a random target."""
    duration, count = rng.uniform(200, 3000), int(rng.integers(8, 300))
    course = tma.Course(rng.uniform(-5e3, 5e3, 2), speed, rng.uniform(0, 6.28), [tma.Straight(duration)])
    listeners = [
        tma.Sensor(
            tma.Bearing(), np.sort(rng.uniform(0, duration, count)), np.radians(rng.uniform(0.05, 3)), str(k)
        )
        for k in range(sensors)
    ]
    place = course.position_at(0) + rng.uniform(1e3, 4e4) * np.array(
        [np.sin(a := rng.uniform(0, 6.28)), np.cos(a)]
    )
    target = tma.Target(place, rng.uniform(0, 12), rng.uniform(0, 6.28))
    return tma.Scenario(course, listeners, duration * rng.uniform(0, 1), target)


@pytest.mark.parametrize("sensors", [1, 2])
@pytest.mark.parametrize("speed", [0.0, 1e-9, 3.0, 9.0])
@pytest.mark.parametrize("seed", range(6))
def test_a_ship_that_keeps_its_velocity(seed, speed, sensors):
    scenario = watch(np.random.default_rng([seed, sensors]), speed, sensors)
    angles = scenario.simulate(20, seed=seed)
    for chart in (tma.ModifiedPolar, tma.Cartesian):
        for start in (None, scenario.state, scenario.state * [2, 2, 2, 2]):
            found = tma.fit(scenario, angles, start, chart=chart)
            assert not found.converged.any(), np.unique(found.status)
    found = tma.fit(scenario.with_target(None), angles)
    clear = np.flatnonzero(found.status == words.NOT_OBSERVABLE)
    assert len(clear) > 10, "and the others have no step, or no minimum"
    assert "not observable" in str(tma.fit(found.scenario, angles[clear[0]]))


@pytest.mark.parametrize("seed", range(6))
def test_a_little_turn_is_enough_for_the_rank(seed):
    """The other side: what is observable, however badly, is not called unobservable because of the chart."""
    rng = np.random.default_rng(seed)
    ship = tma.Course((0, 0), 5.0, 0.0, [tma.Straight(600), tma.Straight(600, heading=rng.uniform(0.3, 2))])
    sensor = tma.Sensor(tma.Bearing(), np.arange(0, 1200, 10.0), np.radians(0.5))
    scenario = tma.Scenario(ship, [sensor], 1190, tma.Target((2e3, 5e3), 5.0, rng.uniform(0, 6.28)))
    found = tma.fit(scenario, scenario.simulate(50, seed=seed), scenario.state)
    assert not (found.status == words.NOT_OBSERVABLE).any()
