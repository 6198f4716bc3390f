"""Ranges, Doppler frequencies, biases, an unknown speed of sound: bounds, fits and filters of scenarios."""

from dataclasses import replace

import numpy as np
import pytest

import tmalib as tma

RUNS = 400
PLATFORM = tma.Course((0, 0), 8.0, np.pi / 2, [tma.Straight(200), tma.Turn(200, -0.01), tma.Straight(200)])
TARGET = tma.Target((4e3, 5e3), speed=6.0, heading=2.5)
SLOW = np.arange(0, 601, 10.0)


def ranging():
    return [tma.Sensor(tma.Range(), SLOW, 5.0)], TARGET, {}


def listening():
    tone = tma.DopplerFrequency(1500.0, f0=301.0, true_f0=300.0)
    return [tma.Sensor(tma.Bearing(), SLOW, 0.005), tma.Sensor(tone, SLOW, 0.02)], TARGET, {"f0": 300.0}


def misaligned():
    radar = tma.Biased(tma.Bearing(), true_bias=0.05)
    return [tma.Sensor(radar, SLOW, 0.005), tma.Sensor(tma.Range(), SLOW, 20.0)], TARGET, {"bias": 0.05}


def in_air():
    """A fast target, seen and heard: the speed of sound shows in the lag between the two."""
    plane = tma.Target((-8e3, 3e3), speed=60.0, heading=1.4)
    ear = tma.DelayedBearingUnknownSpeed(340.0, true_c=335.0)
    return [tma.Sensor(tma.Bearing(), SLOW, 0.005), tma.Sensor(ear, SLOW, 0.01)], plane, {"c": 335.0}


def mixed():
    tone = tma.DopplerFrequency(1500.0, f0=301.0, true_f0=300.0)
    compass = tma.Biased(tma.DelayedBearing(1500.0), "compass", true_bias=-0.04)
    sensors = [
        tma.Sensor(compass, SLOW[::2], 0.005),
        tma.Sensor(tone, SLOW, 0.02),
        tma.Sensor(tma.Bearing(), SLOW, 0.01),
    ]
    return sensors, TARGET, {"compass": -0.04, "f0": 300.0}


@pytest.fixture(params=[ranging, listening, misaligned, in_air, mixed], ids=lambda make: make.__name__)
def case(request):
    """A scenario with its target, and the true state with the further unknowns."""
    sensors, target, further = request.param()
    scenario = tma.Scenario(PLATFORM, sensors, reference_time=600.0, target=target)
    assert scenario.coordinates == ("x", "y", "vx", "vy", *further)
    return scenario, np.append(target.state(600.0), list(further.values()))


def simulated(model, further):
    """The model with other true values of its unknowns."""
    if isinstance(model, tma.Biased):
        return replace(model, true_bias=further[model.name])
    names = {f"true_{name}": value for name, value in further.items() if hasattr(model, f"true_{name}")}
    return replace(model, **names) if names else model


def measured_of(scenario, state):
    """What a target with this state would be measured as: by simulation, not by the prediction."""
    further = dict(zip(scenario.coordinates[4:], state[4:], strict=True))
    target = tma.Target.from_velocity(state[:2], state[2:4], time=scenario.reference_time)
    sensors = [replace(s, model=simulated(s.model, further)) for s in scenario.sensors]
    return replace(scenario, sensors=sensors, target=target).measure()


def test_observed_is_predicted_for_a_uniform_target(case):
    scenario, truth = case
    error = scenario.residual(scenario.measure(), scenario.linearise(truth)[0])
    assert np.abs(error / scenario.sigma).max() < 1e-6
    elsewhere = truth * 1.03
    error = scenario.residual(measured_of(scenario, elsewhere), scenario.linearise(elsewhere)[0])
    assert np.abs(error / scenario.sigma).max() < 1e-6


def test_bound_is_that_of_a_numerical_fisher_information(case):
    scenario, truth = case
    columns = []
    for i, sigma in enumerate(tma.crlb_sigma(scenario, truth)):
        step = 1e-2 * sigma * np.eye(len(truth))[i]
        rise = scenario.residual(measured_of(scenario, truth + step), measured_of(scenario, truth - step))
        columns.append(rise / (2 * step[i]) / scenario.sigma)
    information = np.array(columns) @ np.array(columns).T
    scale = tma.crlb_sigma(scenario, truth)
    bound = np.linalg.inv(information * np.outer(scale, scale))
    np.testing.assert_allclose(bound, tma.crlb(scenario, truth) / np.outer(scale, scale), atol=1e-4)


def test_fit_is_unbiased_and_efficient(case):
    scenario, truth = case
    bound = tma.crlb(scenario, truth)
    draw = np.random.default_rng(11).multivariate_normal(np.zeros(len(truth)), bound, RUNS)
    found = tma.fit(scenario, scenario.simulate(RUNS, seed=5), truth + draw, tolerance=1e-4)
    assert found.converged.all()
    low, high = tma.nees_limits(len(truth), RUNS, 0.999)
    assert low < tma.nees(found.state, truth, bound).mean() < high
    mean_error = (found.state - truth).mean(axis=0)
    assert tma.nees(mean_error, 0.0, bound / RUNS) < tma.nees_limits(len(truth), 1, 0.999)[1]


def test_ekf_says_how_well_it_knows(case):
    """A prior of three times the bound, true on average, and the filter's own covariance."""
    scenario, truth = case
    phi = tma.transition(-601.0, scenario.coordinates)
    start = tma.propagate(truth, -601.0, scenario.coordinates)
    covariance = phi @ (9 * tma.crlb(scenario, truth)) @ phi.T
    mean = np.random.default_rng(12).multivariate_normal(start, covariance, RUNS)
    angles = scenario.simulate(RUNS, seed=6)
    track = tma.ekf(scenario, angles, tma.Prior(mean, covariance, -1.0))
    assert track.finite.all()
    low, high = tma.nees_limits(len(truth), RUNS, 0.999)
    assert low < tma.nees(track.state[:, 0], truth, track.covariance[:, 0]).mean() < high
    gained = np.diagonal(track.covariance[:, 0], axis1=-2, axis2=-1).mean(axis=0)
    np.testing.assert_allclose(gained / np.diagonal(tma.crlb(scenario, truth)), 0.9, rtol=0.05)


def test_no_run_changes_another(case):
    """Bits of a prediction do not depend on the batch, a state outside the model's domain included."""
    scenario, truth = case
    states = truth * np.random.default_rng(2).uniform(0.9, 1.1, (7, len(truth)))
    states[3, 2:4] = 2000.0  # faster than sound
    with np.errstate(invalid="ignore"):  # of `DelayedBearing`
        value, gradient = scenario.linearise(states)
        for k, state in enumerate(states):
            own = scenario.linearise(state)
            np.testing.assert_array_equal(value[k], own[0])
            np.testing.assert_array_equal(gradient[k], own[1])
    for block in scenario.blocks:
        if isinstance(block.sensor.model, tma.DopplerFrequency | tma.DelayedBearingUnknownSpeed):
            assert np.isnan(value[3, block.columns]).all()
            assert np.isnan(gradient[3, block.columns, :4]).all()
    found = tma.fit(scenario, scenario.measure(), np.stack([truth, states[3]]))
    np.testing.assert_array_equal(found.state[0], tma.fit(scenario, scenario.measure(), truth).state)
    assert found.converged[0]


def test_the_union_of_bearing_frequency_and_bias():
    sensors, target, further = mixed()
    scenario = tma.Scenario(PLATFORM, sensors, reference_time=600.0)
    assert scenario.coordinates == ("x", "y", "vx", "vy", "compass", "f0")
    truth = np.append(target.state(600.0), list(further.values()))
    assert tma.information_rank(scenario, truth) == 6
    guess = {name: value for s in sensors for name, value in getattr(s.model, "guess", {}).items()}
    assert guess == {"compass": 0.0, "f0": 301.0}
    angles = scenario.with_target(target).simulate(50, seed=8)
    found = tma.fit(scenario, angles, tma.along_first_bearing(scenario, angles, 6e3, others=guess))
    assert found.converged.all()
