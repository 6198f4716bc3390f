"""A prior as a measurement: information adds, the estimate is that of another minimiser."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

import tmalib as tma


@pytest.fixture(scope="module")
def rays():
    array = tma.Course((0, 0), speed=3, heading=0.2, legs=[tma.Straight(300)])
    sensors = [
        tma.Sensor(tma.ConicalAngle(path, 300.0, 2000.0), np.arange(0, 301, 10.0), 0.01)
        for path in (tma.DIRECT, tma.BOTTOM_BOUNCE)
    ]
    target = tma.Target.from_velocity((900, 700), (-2, -3), depth=500.0)
    return tma.Scenario(array, sensors, 0.0, target)


def known(scenario, name, sigma):
    sensor = tma.Sensor(tma.KnownComponent(name), scenario.times[:1], sigma, "known")
    return replace(scenario, sensors=[*scenario.sensors, sensor], target=None)


@pytest.mark.parametrize("name", ["x", "z", "vy"])
def test_information_adds_on_its_diagonal(rays, name):
    more = tma.fisher_information(known(rays, name, 7.0), rays.state) - tma.fisher_information(rays)
    place = rays.coordinates.index(name)
    wanted = np.zeros((5, 5))
    wanted[place, place] = 1 / 49
    size = np.sqrt(np.diagonal(tma.fisher_information(rays)))
    np.testing.assert_allclose(more / np.outer(size, size), wanted / np.outer(size, size), atol=1e-12)


def test_the_estimate_is_that_of_another_minimiser(rays):
    now, mean, sigma = known(rays, "z", 3.0), 520.0, 3.0
    angles = np.append(rays.simulate(1, seed=4)[0], mean)
    found = tma.fit(now, angles, rays.state)

    def residuals(state):
        part = (angles[:-1] - rays.linearise(state)[0]) / rays.sigma
        return np.append(part, (mean - state[2]) / sigma)

    other = least_squares(residuals, rays.state, x_scale=[1e3, 1e3, 1e2, 1, 1], xtol=1e-14, ftol=1e-14)
    assert found.converged
    np.testing.assert_allclose((found.state - other.x) / found.sigma, 0, atol=1e-3)
    assert found.cost == pytest.approx(2 * other.cost, rel=1e-6)


def test_it_is_a_model_and_simulates_what_is_true(rays):
    model = tma.KnownComponent("z")
    assert tma.check_model(model, rays.platform, [0.0, 5.0], [123.0]) < 1e-9
    deep = replace(rays, sensors=[*rays.sensors, tma.Sensor(model, [0.0], 1.0)])
    assert deep.measure()[-1] == 500.0
    bias = tma.KnownComponent("bias", truth_value=0.25)
    assert bias.observe(rays.target, rays.platform, np.zeros(2)).tolist() == [0.25, 0.25]


def test_what_is_not_known_is_refused(rays):
    with pytest.raises(ValueError, match="the true vx is not known"):
        tma.KnownComponent("vx").observe(rays.target, rays.platform, np.zeros(1))
    for name in ("", 3):
        with pytest.raises(ValueError, match="name must be that of a component"):
            tma.KnownComponent(name)
