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
    ok = tma.Scenario(platform, [sensor], 0.0, target)
    crossing = tma.Target((0.0, 500.0), 5.0, np.pi)
    return [
        (lambda: tma.Sensor(tma.Bearing(), np.array([0, 1], "m8[s]"), 0.01), "numbers of seconds"),
        (lambda: tma.Sensor(tma.Bearing(), [1.0, 0.0], 0.01), "must not go back"),
        (lambda: tma.Sensor(tma.Bearing(), [[0.0]], 0.01), "times must have shape"),
        (lambda: tma.Sensor(tma.Bearing(), [np.nan], 0.01), "times must be finite"),
        (lambda: tma.Sensor(tma.Bearing(), [0.0], 0.0), "sigma must be greater than 0"),
        (lambda: tma.Sensor(tma.Bearing(), [0.0], -1.0), "sigma must be greater than 0"),
        (lambda: tma.Scenario(platform, [], 0.0, target), "sensors is empty"),
        (lambda: tma.Scenario(platform, [sensor], np.inf, target), "reference_time must be finite"),
        (lambda: tma.Scenario(platform, [sensor], 0.0, crossing), "cannot measure the target at t = 50"),
        (lambda: ok.simulate(-1, seed=1), "runs must be an integer that is not negative"),
        (lambda: ok.simulate(2.5, seed=1), "runs must be an integer that is not negative"),
        (lambda: ok.linearise([1.0, 2.0]), "state must have shape"),
        (lambda: ok.until(-1.0), "no measurement between -inf and -1"),
        (lambda: tma.fit(ok, np.zeros(3), ok.state), "measurements must have shape"),
    ]


@pytest.mark.parametrize(("make", "message"), bad_scenarios())
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()


class Shuffled(tma.Bearing):
    """The bearing, for a state in another order and with an unknown that it does not feel."""

    coordinates = ("vy", "idle", "x", "vx", "y")

    def value_and_gradient(self, state, observer, elapsed):
        vy, _, x, vx, y = state
        value, (gx, gy, gvx, gvy) = super().value_and_gradient((x, y, vx, vy), observer, elapsed)
        return value, np.stack([gvy, 0 * gx, gx, gvx, gy])


def test_the_state_is_the_union_of_what_sensors_want(scenario):
    radar, sonar = scenario.sensors
    union = replace(scenario, sensors=[sonar, replace(radar, model=Shuffled())], target=None)
    assert union.coordinates == ("x", "y", "vx", "vy", "idle")
    state = np.append(scenario.state, 7.0)
    value, gradient = union.linearise(state)
    swapped = replace(scenario, sensors=[sonar, radar])
    expected, slope = swapped.linearise(scenario.state)
    np.testing.assert_array_equal(value, expected)
    np.testing.assert_array_equal(gradient[:, :4], slope)
    np.testing.assert_array_equal(gradient[:, 4], 0.0)
    depth = replace(
        scenario,
        sensors=[tma.Sensor(tma.ConicalAngle(tma.DIRECT, 100.0, 4000.0), [1.0, 2.0], 0.1), radar],
        target=None,
    )
    assert depth.coordinates == ("x", "y", "z", "vx", "vy")


def test_estimators_find_the_components_by_name(scenario):
    """Two orders give the same bound, fit and filter; ``idle`` is held by a sensor of its own."""
    radar, sonar = scenario.sensors
    tells = tma.Sensor(Idle(), [0.0], 2.0)
    truth = np.append(scenario.state, 7.0)
    plain = replace(scenario, sensors=[radar, sonar])
    union = replace(scenario, sensors=[replace(radar, model=Shuffled()), sonar, tells], target=None)
    np.testing.assert_allclose(tma.crlb(union, truth)[:4, :4], tma.crlb(plain), rtol=1e-9)
    angles = plain.simulate(20, seed=3)
    more = np.append(angles, np.full((20, 1), 6.0), axis=1)
    for chart in (None, tma.Cartesian):
        alone = tma.fit(plain, angles, plain.state, chart=chart, tolerance=1e-6)
        both = tma.fit(union, more, truth, chart=chart, tolerance=1e-6)
        assert alone.converged.all()
        assert both.converged.all()
        np.testing.assert_allclose(both.state[:, :4], alone.state, rtol=1e-7)
        np.testing.assert_allclose(both.state[:, 4], 6.0)
    start = tma.along_first_bearing(union, more, 6e3, others={"idle": 1.0})
    np.testing.assert_allclose(start[:, :4], tma.along_first_bearing(plain, angles, 6e3))
    prior = tma.prior_along_first_bearing(plain, angles, 6e3, 2e3, 5.0)
    wide = tma.prior_along_first_bearing(union, more, 6e3, 2e3, 5.0, others={"idle": (1.0, 9.0)})
    for chart in (None, tma.ModifiedPolar):
        track, own = tma.ekf(union, more, wide, chart=chart), tma.ekf(plain, angles, prior, chart=chart)
        np.testing.assert_allclose(track.state[..., :4], own.state, rtol=1e-6)
        np.testing.assert_allclose(track.state[..., 4], 1.0, err_msg="told at the prior's own time: used up")
    final = tma.sensitivity.position_criterion(union, 600.0)
    np.testing.assert_array_equal(final[:, 4], 0.0)
    moved = np.random.default_rng(1).normal(0, 10, (len(plain.times), 2))
    shift = tma.sensitivity.displaced_measurements(plain, moved)
    again = tma.sensitivity.displaced_measurements(replace(union, sensors=union.sensors[:2]), moved, truth)
    np.testing.assert_allclose(again, shift, rtol=1e-12)


class Idle:
    """A direct look at the unknown ``idle``."""

    coordinates = ("idle",)

    def observer_state(self, platform, times):
        return np.zeros((1, len(times)))

    def value_and_gradient(self, state, observer, elapsed):
        value = state[0] + 0.0 * elapsed
        return value, np.ones((1, *value.shape))

    def residual(self, measured, predicted):
        return measured - predicted


@pytest.fixture
def watch(scenario):
    """What the observer knows."""
    return replace(scenario, target=None)


def test_knowledge_is_enough_to_estimate(scenario, watch):
    angles = scenario.simulate(5, seed=1)
    start = tma.along_first_bearing(watch, angles, 7e3)
    with_truth, without = (tma.fit(s, angles, start) for s in (scenario, watch))
    np.testing.assert_array_equal(with_truth.state, without.state)
    prior = tma.prior_along_first_bearing(watch, angles, 7e3, 2e3, 5.0)
    np.testing.assert_array_equal(tma.ekf(watch, angles, prior).state, tma.ekf(scenario, angles, prior).state)
    np.testing.assert_array_equal(tma.crlb(watch, scenario.state), tma.crlb(scenario))
    assert watch.with_target(scenario.target).state.tolist() == scenario.state.tolist()


@pytest.mark.parametrize(
    ("needs", "what"),
    [
        (lambda s: s.state, "state needs a target"),
        (lambda s: s.measure(), "measure needs a target"),
        (lambda s: s.simulate(2, seed=1), "measure needs a target"),
        (lambda s: tma.crlb(s), "state needs a target"),
        (lambda s: tma.information_rank(s), "state needs a target"),
        (lambda s: tma.sensitivity.response(s), "state needs a target"),
    ],
)
def test_what_needs_truth_says_so(watch, needs, what):
    with pytest.raises(ValueError, match=what):
        needs(watch)


def test_each_sensor_may_have_its_own_platform(scenario):
    """Two ships with a bearing each: against a scenario of each alone."""
    radar, sonar = scenario.sensors
    other = tma.Course((3e3, -2e3), 5.0, 0.3, [tma.Straight(600)])
    pair = replace(scenario, sensors=[radar, replace(sonar, platform=other)])
    first = replace(scenario, sensors=[radar])
    second = replace(scenario, sensors=[sonar], platform=other)
    np.testing.assert_array_equal(pair.measure(), np.concatenate([first.measure(), second.measure()]))
    information = tma.fisher_information(first) + tma.fisher_information(second)
    np.testing.assert_allclose(tma.fisher_information(pair), information, rtol=1e-12)
    away = replace(pair, sensors=[replace(radar, platform=other, times=radar.times[1:]), sonar])
    angles = away.simulate(4, seed=2)
    start = tma.along_first_bearing(away, angles, 5e3)
    gap = start[:, :2] - scenario.platform.position_at(0.0)
    np.testing.assert_allclose(np.hypot(*gap.T), 5e3, err_msg="from the ship that took the first bearing")
    np.testing.assert_allclose(np.arctan2(*gap.T), angles[:, len(radar) - 1])


def test_a_window_of_time(scenario):
    some = scenario.between(100.0, 300.0)
    kept = scenario.columns_between(100.0, 300.0)
    np.testing.assert_array_equal(some.times, scenario.times[kept])
    np.testing.assert_allclose(some.measure(), scenario.measure()[kept], rtol=1e-14)
    assert some.reference_time == scenario.reference_time
    with pytest.raises(
        ValueError, match=r"no measurement between 1000\.0 and 2000\.0; there are some from 0\.0"
    ):
        scenario.between(1e3, 2e3)


class Wrong(tma.Bearing):
    """A bearing with one fault, chosen by name."""

    def __init__(self, fault):
        self.fault = fault

    def observer_state(self, platform, times):
        found = super().observer_state(platform, times)
        return found.T if self.fault == "observer" else found

    def value_and_gradient(self, state, observer, elapsed):
        observer = observer.T if self.fault == "observer" else observer
        value, gradient = super().value_and_gradient(state, observer, elapsed)
        if self.fault == "axis":
            gradient = np.moveaxis(gradient, 0, -1)
        if self.fault == "short":
            gradient = gradient[:3]
        if self.fault == "value":
            value = value[..., None]
        if self.fault == "sign":
            gradient = gradient * np.array([1, -1, 1, 1]).reshape(-1, *[1] * value.ndim)
        return value, gradient


@pytest.mark.parametrize("fault", ["observer", "axis", "short", "value"])
def test_a_model_of_wrong_shapes_is_refused_on_entry(scenario, fault):
    with pytest.raises(
        ValueError, match=r"Wrong\.(observer_state must have shape|value_and_gradient must give)"
    ):
        replace(scenario, sensors=[tma.Sensor(Wrong(fault), np.arange(7.0), 0.1)])


def test_a_wrong_gradient_is_found_by_differences(scenario):
    state = scenario.state
    for model in (tma.Bearing(), tma.DelayedBearing(1500.0), Shuffled()):
        own = np.array(
            [{"idle": 3.0}.get(n) or state[scenario.coordinates.index(n)] for n in model.coordinates]
        )
        assert tma.check_model(model, scenario.platform, np.arange(0, 600, 50.0), own, 600.0) < 1e-6
    assert tma.check_model(Wrong("sign"), scenario.platform, np.arange(0, 600, 50.0), state, 600.0) > 0.5
    with pytest.raises(ValueError, match="must have shapes"):
        tma.check_model(Wrong("short"), scenario.platform, np.arange(5.0), state)
    with pytest.raises(ValueError, match="must be finite"):
        tma.check_model(tma.Bearing(), scenario.platform, np.arange(5.0), [0.0, 0.0, 5.0, 0.0])
