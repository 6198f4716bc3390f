"""Ranges, Doppler frequencies, biases, an unknown speed of sound: against definitions and crests."""

from functools import partial

import mpmath as mp
import numpy as np
import pytest
from scipy.optimize import brentq

import tmalib as tma
from tmalib.doppler import velocity_of


def turning(speed=8.0):
    """A platform that sees a target from three directions."""
    legs = [tma.Straight(200), tma.Turn(200, -0.01), tma.Straight(200)]
    return tma.Course((0, 0), speed, np.pi / 2, legs)


# -- values and gradients from the definitions, at 50 digits --------------------------------------


def delayed_gap(state, observer, s, c):
    """Emission point minus observer, and the delay, from its definition."""
    x, y, vx, vy = state[:4]

    def gap(tau):
        return x + (s - tau) * vx - observer[0], y + (s - tau) * vy - observer[1]

    tau = mp.mpf(0)
    for _ in range(120):
        tau = mp.hypot(*gap(tau)) / c
    return *gap(tau), tau


def exact_range(state, observer, s):
    x, y, vx, vy = state
    return mp.hypot(x + s * vx - observer[0], y + s * vy - observer[1])


def exact_biased(state, observer, s):
    x, y, vx, vy, bias = state
    return mp.atan2(x + s * vx - observer[0], y + s * vy - observer[1]) + bias


def exact_late(state, observer, s):
    return mp.atan2(*delayed_gap(state, observer, s, state[4])[:2])


def exact_frequency(c, state, observer, s):
    """Crests emitted between two receptions, by the time between them: no formula of Doppler's."""
    h, (ox, oy, ovx, ovy) = mp.mpf(10) ** -16, observer
    emitted = [
        s + sign * h - delayed_gap(state, (ox + sign * h * ovx, oy + sign * h * ovy), s + sign * h, c)[2]
        for sign in (1, -1)
    ]
    return state[4] * (emitted[0] - emitted[1]) / (2 * h)


MODELS = [
    (tma.Range(), exact_range, ()),
    (tma.Biased(tma.Bearing()), exact_biased, (0.3,)),
    (tma.DelayedBearingUnknownSpeed(), exact_late, (1500.0,)),
    (tma.DelayedBearingUnknownSpeed(), exact_late, (340.0,)),
    (tma.DopplerFrequency(1500.0), partial(exact_frequency, 1500), (300.0,)),
    (tma.DopplerFrequency(340.0), partial(exact_frequency, 340), (52.0,)),
]


@pytest.mark.parametrize(("model", "exact", "further"), MODELS)
def test_value_and_gradient_are_those_of_the_definition(model, exact, further):
    rng = np.random.default_rng(3)
    for _ in range(10):
        state = np.append(rng.uniform(-1, 1, 4) * [1e4, 1e4, 80, 80], np.multiply(further, 1.01))
        observer = rng.uniform(-1, 1, 4) * [2e3, 2e3, 30, 30]
        seen = observer if isinstance(model, tma.DopplerFrequency) else observer[:2]
        s = float(rng.uniform(-900, 100))
        value, gradient = model.value_and_gradient(state, seen, s)
        with mp.workdps(60):
            point, place = [mp.mpf(float(q)) for q in state], [mp.mpf(float(q)) for q in observer]
            place = place[: len(seen)]
            assert value == pytest.approx(float(exact(point, place, mp.mpf(s))), rel=1e-12, abs=1e-12)
            for i, slope in enumerate(gradient):
                h = mp.mpf(10) ** -14
                ends = [exact([q + sign * h * (i == j) for j, q in enumerate(point)], place, mp.mpf(s))
                        for sign in (1, -1)]  # fmt: skip
                expected = float((ends[0] - ends[1]) / (2 * h))
                scale = np.abs(gradient).max() if i < 2 else abs(expected)
                assert slope == pytest.approx(expected, rel=1e-9, abs=1e-11 * scale)


def test_check_model_agrees():
    for model, _, further in MODELS:
        state = [4e3, 5e3, 3.6, -4.8, *further]
        assert tma.check_model(model, turning(), np.arange(0, 601, 50.0), state, 600.0) < 1e-6


# -- crests ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("c", [1500.0, 340.0])
def test_frequency_is_that_of_the_crests_that_arrive(c):
    """Source and observer turn; crests leave every 20 ms and are waited for one by one."""
    f0, spacing = 50.0, 0.02
    source = tma.Course((2e3, 1e3), 25.0, 0.5, [tma.Turn(300.0, 0.03)], start_time=-50.0)
    ship = tma.Course((0, 0), 15.0, 1.0, [tma.Turn(300.0, -0.02)])

    def arrival(emitted):
        def early(t):
            return c * (t - emitted) - np.hypot(*(source.position_at(emitted) - ship.position_at(t)))

        return brentq(early, emitted, emitted + 60.0, xtol=1e-13, rtol=1e-14)

    model = tma.DopplerFrequency(c, true_f0=f0)
    for leaves in (5.0, 60.0, 180.0):
        first, middle, last = (arrival(leaves + k * spacing) for k in (-1, 0, 1))
        heard = model.observe(source, ship, np.array([middle]))[0]
        assert heard == pytest.approx(2 * spacing * f0 / (last - first), rel=2e-8)
        # with the direction at reception the same formula is wrong, and by what the module says
        gap = source.position_at(middle) - ship.position_at(middle)
        u = gap / np.hypot(*gap)
        there, here = velocity_of(source, [middle])[0], velocity_of(ship, [middle])[0]
        wrong = abs(f0 * (c + here @ u) / (c + there @ u) / heard - 1)
        assert 1e-6 < wrong < 10 * (40 / c) ** 2


def test_limits_of_the_doppler_formula():
    still = tma.Course((0, 0), 0.0, 0.0, [tma.Straight(100.0)])
    north = tma.Course((0, 0), 20.0, 0.0, [tma.Straight(100.0)])
    model, t = tma.DopplerFrequency(1500.0, true_f0=300.0), np.array([0.0, 50.0, 100.0])
    ahead = tma.Target((0.0, 5e3), 0.0, 0.0)
    np.testing.assert_allclose(model.observe(ahead, still, t), 300.0, rtol=1e-11)
    np.testing.assert_allclose(model.observe(ahead, north, t), 300 * (1 + 20 / 1500), rtol=1e-10)
    together = tma.Target((3e3, 4e3), 20.0, 0.0)
    np.testing.assert_allclose(model.observe(together, north, t), 300.0, rtol=1e-10)
    other = tma.DopplerFrequency(1e9, true_f0=300.0)
    state = np.array([3e3, 4e3, -5.0, 7.0, 300.0])
    value, _ = other.value_and_gradient(state, other.observer_state(north, t)[:, 0], 0.0)
    rate = (3 * -5 + 4 * (7 - 20)) / 5
    assert (value / 300 - 1) * 1e9 == pytest.approx(-rate, rel=1e-6)


# -- velocities from positions ---------------------------------------------------------------------


def test_velocity_stays_inside_the_course():
    course = turning()
    t = np.array([0.0, 1e-4, 77.7, 300.0, 450.0, 599.9999, 600.0])
    expected = 8.0 * np.stack([np.sin(course.heading_at(t)), np.cos(course.heading_at(t))], axis=-1)
    np.testing.assert_allclose(velocity_of(course, t), expected, atol=1e-8)
    circle = tma.Course((0, 0), 10.0, 0.0, [tma.Turn(60.0, 0.02)])
    ends = velocity_of(circle, [0.0, 60.0]) - 10 * np.array([[0, 1], [np.sin(1.2), np.cos(1.2)]])
    assert np.hypot(*ends.T).max() < 1.01 * 1e-3 / 2 * 0.2
    np.testing.assert_allclose(velocity_of(circle, [30.0])[0], 10 * np.array([np.sin(0.6), np.cos(0.6)]))
    far = tma.Target((1e5, -1e5), 300.0, 1.0, time=1e6)
    np.testing.assert_allclose(velocity_of(far, [1e6 + 100.0])[0], far.velocity, atol=1e-7)


def test_velocity_at_corners_and_without_neighbours():
    knots = tma.SampledCourse([0.0, 10.0, 20.0], [[0, 0], [10, 0], [10, 30]])
    np.testing.assert_allclose(
        velocity_of(knots, [0.0, 5.0, 10.0, 20.0]), [[1, 0], [1, 0], [0.5, 1.5], [0, 3]]
    )
    with pytest.raises(ValueError, match=r"no velocity at t = 3\.0 s"):
        velocity_of(tma.SampledCourse([3.0], [[0, 0]]), [3.0])


# -- the protocol ----------------------------------------------------------------------------------


def test_a_bias_passes_on_what_the_model_is():
    tone = tma.DopplerFrequency(1500.0, f0=300.0)
    assert tma.Biased(tma.Bearing()).is_bearing
    assert not tma.Biased(tone).is_bearing
    twice = tma.Biased(tma.Biased(tone, "first"), "second", true_bias=1.0)
    assert twice.coordinates == ("x", "y", "vx", "vy", "f0", "first", "second")
    assert twice.guess == {"f0": 300.0, "first": 0.0, "second": 0.0}
    assert tma.Biased(tma.Bearing()).residual(np.pi + 0.02, -np.pi) == pytest.approx(0.02)
    assert tma.Biased(tma.Range()).residual(7.0, 0.0) == 7.0
    assert tma.DopplerFrequency(1500.0).guess == {}
    assert tma.DelayedBearingUnknownSpeed(340.0).guess == {"c": 340.0}


def test_a_biased_sensor_measures_what_it_should_and_its_bias(scenario):
    times = np.array([0.0, 300.0, 600.0])
    for model in (tma.Bearing(), tma.Range(), tma.DopplerFrequency(true_f0=300.0)):
        plain = model.observe(scenario.target, scenario.platform, times)
        biased = tma.Biased(model, "error", true_bias=0.25)
        np.testing.assert_allclose(biased.observe(scenario.target, scenario.platform, times), plain + 0.25)


def test_unknown_speed_is_the_delayed_bearing_of_its_value():
    observer, s, state = np.array([100.0, -50.0]), -30.0, np.array([3e3, -2e3, 14.0, 7.0, 1480.0])
    value, gradient = tma.DelayedBearingUnknownSpeed().value_and_gradient(state, observer, s)
    plain, slope = tma.DelayedBearing(1480.0).value_and_gradient(state[:4], observer, s)
    assert value == plain
    np.testing.assert_array_equal(gradient[:4], slope)
    for c in (0.0, -1480.0, np.hypot(14.0, 7.0)):  # no delay, and no plausible value either
        state[4] = c
        assert np.isnan(tma.DelayedBearingUnknownSpeed().value_and_gradient(state, observer, s)[0])


def bad_input():
    still = tma.Course((0, 0), 0.0, 0.0, [tma.Straight(100.0)])
    jet = tma.Course((0, 0), 400.0, 0.0, [tma.Straight(100.0)])
    over = tma.Target((0.0, 0.0), 0.0, 0.0)

    def scenario(model, platform=still):
        return tma.Scenario(platform, [tma.Sensor(model, [0.0, 5.0], 1.0)], 0.0, over)

    return [
        (lambda: tma.DopplerFrequency(0.0), "c must be greater than 0"),
        (lambda: tma.DopplerFrequency(1500.0, f0=-1.0), "f0 must be greater than 0"),
        (lambda: tma.DopplerFrequency(1500.0, true_f0=np.nan), "true_f0 must be finite"),
        (lambda: scenario(tma.DopplerFrequency(340.0), jet), r"platform must be slower than c = 340\.0 m/s"),
        (lambda: scenario(tma.DopplerFrequency(340.0)), "needs true_f0"),
        (lambda: scenario(tma.DopplerFrequency(340.0, true_f0=1.0)), "cannot measure the target at t = 0"),
        (lambda: scenario(tma.Range()), "cannot measure the target at t = 0"),
        (lambda: scenario(tma.DelayedBearingUnknownSpeed()), "cannot measure the target at t = 0"),
        (lambda: tma.DelayedBearingUnknownSpeed(-5.0), "c must be greater than 0"),
        (lambda: tma.DelayedBearingUnknownSpeed(true_c=0.0), "true_c must be greater than 0"),
        (lambda: tma.Biased(tma.Bearing(), "x"), "name must be a text and none of"),
        (lambda: tma.Biased(tma.Range(), "z"), "name must be a text and none of"),
        (lambda: tma.Biased(tma.Biased(tma.Bearing())), "name must be a text and none of"),
        (lambda: tma.Biased(tma.Bearing(), ""), "name must be a text and none of"),
        (lambda: tma.Biased(tma.Bearing(), true_bias=np.inf), "true_bias must be finite"),
    ]


@pytest.mark.parametrize(("make", "message"), bad_input())
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
