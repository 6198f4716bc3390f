from dataclasses import replace

import numpy as np
import pytest

import tmalib as tma


def rotated(scenario, angle, shift):
    """The whole scenario turned clockwise by ``angle`` and moved by ``shift``."""
    rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    times = scenario.sensors[0].times
    platform = tma.SampledCourse(times, scenario.platform.position_at(times) @ rotation.T + shift)
    target = tma.Target.from_velocity(
        rotation @ scenario.target.position_at(0.0) + shift, rotation @ scenario.target.velocity
    )
    return replace(scenario, target=target, platform=platform), rotation


def test_rotation_and_translation_invariance(scenario):
    for angle, shift in ((0.0, [1e5, -2e5]), (1.1, [0, 0]), (-2.7, [300.0, 5e3])):
        other, rotation = rotated(scenario, angle, np.array(shift, dtype=float))
        turn = np.kron(np.eye(2), rotation)
        np.testing.assert_allclose(tma.wrap(other.measure() - scenario.measure() - angle), 0, atol=1e-9)
        np.testing.assert_allclose(tma.crlb(other), turn @ tma.crlb(scenario) @ turn.T, rtol=1e-6)


def test_linearise_at_truth_is_what_is_measured(scenario):
    value, gradient = scenario.linearise(scenario.state)
    np.testing.assert_allclose(value, scenario.measure(), atol=1e-13)
    assert gradient.shape == (77, 4)


def test_batch_axes_lead(scenario):
    states = scenario.state + np.arange(24.0).reshape(2, 3, 4)
    value, gradient = scenario.linearise(states)
    assert (value.shape, gradient.shape) == ((2, 3, 77), (2, 3, 77, 4))
    one_value, one_gradient = scenario.linearise(states[1, 2])
    np.testing.assert_array_equal(value[1, 2], one_value)
    np.testing.assert_array_equal(gradient[1, 2], one_gradient)


def test_simulation_has_the_sensors_noise(scenario):
    angles = scenario.simulate(4000, seed=3)
    error = angles - scenario.measure()
    np.testing.assert_allclose(error.std(axis=0) / scenario.sigma, 1.0, atol=5 / np.sqrt(2 * 4000))
    np.testing.assert_allclose(error.mean(axis=0) / scenario.sigma, 0.0, atol=5 / np.sqrt(4000))
    np.testing.assert_array_equal(angles, scenario.simulate(4000, seed=3))


def test_until_keeps_columns_and_moves_the_state(scenario):
    then = scenario.until(300.0)
    angles = scenario.simulate(2, seed=1)
    assert then.reference_time == 300.0
    np.testing.assert_allclose(then.measure(), scenario.measure()[scenario.columns_until(300.0)])
    assert angles[:, scenario.columns_until(300.0)].shape[1] == len(then.times)
    np.testing.assert_allclose(tma.propagate(then.state, 300.0), scenario.state)


def test_truth_may_leave_the_model(scenario):
    turning = tma.Course((4e3, 5e3), 6.0, 2.5, [tma.Turn(700.0, 0.001)], start_time=-100.0)
    bent = replace(scenario, target=turning)
    assert np.abs(tma.wrap(bent.measure() - scenario.measure())).max() > 0.01
    assert bent.simulate(2, seed=1).shape == (2, 77)


def bad_scenarios():
    platform = tma.Course((0, 0), 5.0, 0.0, [tma.Straight(100.0)])
    target = tma.Target((1e3, 0.0), 1.0, 0.0)
    sensor = tma.Sensor(tma.Bearing(), [0.0, 50.0], 0.01)
    ok = tma.Scenario(target, platform, [sensor], 0.0)
    crossing = tma.Target((0.0, 500.0), 5.0, np.pi)
    return [
        (lambda: tma.Sensor(tma.Bearing(), [0.0, 0.0], 0.01), "strictly increasing"),
        (lambda: tma.Sensor(tma.Bearing(), [1.0, 0.0], 0.01), "strictly increasing"),
        (lambda: tma.Sensor(tma.Bearing(), [[0.0]], 0.01), "times must have shape"),
        (lambda: tma.Sensor(tma.Bearing(), [np.nan], 0.01), "times must be finite"),
        (lambda: tma.Sensor(tma.Bearing(), [0.0], 0.0), "sigma must be greater than 0"),
        (lambda: tma.Sensor(tma.Bearing(), [0.0], -1.0), "sigma must be greater than 0"),
        (lambda: tma.Scenario(target, platform, [], 0.0), "sensors is empty"),
        (lambda: tma.Scenario(target, platform, [sensor], np.inf), "reference_time must be finite"),
        (lambda: tma.Scenario(crossing, platform, [sensor], 0.0), "on the platform at t = 50"),
        (lambda: ok.simulate(0, seed=1), "runs must be a positive integer"),
        (lambda: ok.simulate(2.5, seed=1), "runs must be a positive integer"),
        (lambda: ok.linearise([1.0, 2.0]), "state must have shape"),
        (lambda: ok.until(-1.0), "no measurement up to"),
        (lambda: tma.fit(ok, np.zeros(3), ok.state), "measurements must have shape"),
    ]


@pytest.mark.parametrize(("make", "message"), bad_scenarios())
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_sensors_must_agree_on_the_state(scenario):
    class Deep(tma.Bearing):
        coordinates = ("x", "y", "z", "vx", "vy")

    with pytest.raises(ValueError, match="same state"):
        replace(scenario, sensors=[scenario.sensors[0], tma.Sensor(Deep(), [0.0], 0.1)])
