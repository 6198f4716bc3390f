"""The bias of second order: an exact case, linear models, how it scales, and many runs."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from linear_sensors import LinearWithBias

import tmalib as tma

SHIP = tma.Course((0, 0), 5.0, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
TARGET = tma.Target((2e3, 4e3), speed=6.0, heading=1.5)


def watch(sigma, model=None):
    sensor = tma.Sensor(model or tma.Bearing(), np.arange(0, 600, 5.0), sigma)
    return tma.Scenario(SHIP, [sensor], reference_time=595, target=TARGET)


@dataclass(frozen=True)
class Growth:
    """``exp(x / length)`` of one unknown: the estimate from one value y is ``length log(y)``."""

    length: float
    coordinates = ("x",)

    def observer_state(self, platform, times):
        return np.zeros((1, len(times)))

    def value_and_gradient(self, state, observer, elapsed):
        value = np.exp(state[0] / self.length) + 0 * elapsed
        return value, (value / self.length)[None]

    def residual(self, measured, predicted):
        return measured - predicted

    def observe(self, target, platform, times):
        return np.exp(target.position_at(times)[..., 0] / self.length)


@pytest.mark.parametrize(("x", "length", "sigma"), [(3.0, 2.0, 0.1), (-1.0, 4.0, 0.02)])
def test_one_value_of_an_exponential(x, length, sigma):
    """``E(L log(y + e)) - x = -L sigma^2 / (2 y^2)`` to second order, by the series of the logarithm."""
    scenario = tma.Scenario(SHIP, [tma.Sensor(Growth(length), [0.0], sigma)], reference_time=0)
    y = np.exp(x / length)
    assert tma.second_order_bias(scenario, [x]) == pytest.approx(-length * sigma**2 / (2 * y**2), rel=1e-3)


def test_a_linear_model_has_none():
    mixes = [(1.0, 0.2, 0.5), (0.3, 1.0, -1.0), (1.0, -1.0, 0.2)]
    sensors = [tma.Sensor(LinearWithBias(*mix), np.arange(0, 600, 5.0), 10.0) for mix in mixes]
    scenario = tma.Scenario(SHIP, sensors, reference_time=595)
    state = np.array([2e3, 4e3, 5.0, 1.0, 30.0])
    bias = tma.second_order_bias(scenario, state) / tma.crlb_sigma(scenario, state)
    np.testing.assert_allclose(bias, 0, atol=1e-9)


def test_it_grows_with_the_square_of_the_noise():
    small, large = (tma.second_order_bias(watch(sigma)) for sigma in (1e-3, 3e-3))
    np.testing.assert_allclose(large, 9 * small, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("model", [tma.Bearing(), tma.DelayedBearing(300.0)])
def test_many_runs_have_this_bias(model):
    """To a tenth of it, which 100 000 runs can tell from none and from its negative."""
    scenario, runs = watch(0.015, model), 100_000
    sigma, bias = tma.crlb_sigma(scenario), tma.second_order_bias(scenario)
    found = tma.fit(scenario, scenario.simulate(runs, seed=1), tolerance=1e-4)
    assert found.converged.all()
    mean = (found.state - scenario.state).mean(axis=0)
    error = sigma / np.sqrt(runs)
    assert np.all(np.abs(bias) > 5 * error), "there is something to see"
    np.testing.assert_allclose(mean / error, bias / error, rtol=0.15, atol=4)


def test_one_observable_state():
    with pytest.raises(ValueError, match="one state"):
        tma.second_order_bias(watch(0.01), np.zeros((2, 4)))
    still = tma.Course((0, 0), 5.0, 0.0, [tma.Straight(600)])
    with pytest.raises(ValueError, match="observable"):
        tma.second_order_bias(replace(watch(0.01), platform=still))
