"""A fit without a start: against fits from the truth, scipy from many starts, and exact geometry."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

import tmalib as tma
from tmalib import starts


def random_scenario(rng, family):
    """A platform, a target and bearings whose bound is below a tenth of the range."""
    while True:
        air, legs = family == "air", 1 if family == "straight" else int(rng.integers(2, 4))
        duration, heading, parts = rng.uniform(400, 1800), rng.uniform(0, 2 * np.pi), []
        for _ in range(legs):
            parts.append(tma.Straight(duration / legs, heading=heading))
            heading += rng.choice([-1, 1]) * np.radians(rng.uniform(30, 120))
        platform = tma.Course((0, 0), rng.uniform(60, 150) if air else rng.uniform(3, 10), 0.0, parts)
        distance = np.exp(rng.uniform(np.log(1e3), np.log(10e3 if family == "close" else 60e3)))
        direction = rng.uniform(-0.1, 0.1) if family == "north" else rng.uniform(0, 2 * np.pi)
        speed = rng.uniform(50, 0.7 * 340) if air else rng.uniform(0.5, 15)
        when = duration / 2 if family == "close" else 0.0
        place = distance * np.array([np.sin(direction), np.cos(direction)])
        target = tma.Target(place, speed, rng.uniform(0, 2 * np.pi), time=when)
        times, sigma = np.arange(0, duration, rng.choice([5, 10, 20])), np.radians(rng.uniform(0.1, 2))
        sound = tma.Sensor(tma.DelayedBearing(340.0 if air else 1500.0), times, sigma)
        light = tma.Sensor(tma.Bearing(), times, sigma)
        sensors = (
            [light, sound] if family == "straight" else [[light], [sound], [light, sound]][rng.integers(3)]
        )
        scenario = tma.Scenario(platform, sensors, 0.999 * duration, target)
        bound = tma.crlb(scenario, scenario.state[None])[0]
        gap = target.position_at(times) - platform.position_at(times)
        apart = np.hypot(*gap.T)
        if apart.min() > 100 and np.sqrt(np.trace(bound[:2, :2])) < 0.1 * apart[-1]:
            return scenario


@pytest.mark.parametrize("family", ["manoeuvre", "close", "air", "straight", "north"])
def test_never_worse_than_from_the_truth(family):
    rng = np.random.default_rng(7)
    for k in range(8):
        scenario = random_scenario(rng, family)
        angles = scenario.simulate(5, seed=k)
        found, best = (
            tma.fit(scenario, angles, tolerance=1e-3),
            tma.fit(scenario, angles, scenario.state, tolerance=1e-3),
        )
        assert found.converged[best.converged].all()
        assert np.all(found.cost[best.converged] <= best.cost[best.converged] + 1e-3)


def test_never_worse_than_scipy_from_many_starts():
    rng = np.random.default_rng(11)
    for k in range(4):
        scenario = random_scenario(rng, "manoeuvre")
        (angles,) = scenario.simulate(1, seed=k)
        scale = np.array([1e3, 1e3, 1.0, 1.0])

        def residuals(x, scenario=scenario, angles=angles, scale=scale):
            with np.errstate(all="ignore"):  # scipy may ask for a target faster than sound
                off = scenario.residual(angles, scenario.linearise(x * scale)[0]) / scenario.sigma
            return np.nan_to_num(off, nan=1e3)

        guesses = np.concatenate([rng.uniform(-60, 60, (10, 2)), rng.uniform(-15, 15, (10, 2))], axis=1)
        costs = [2 * least_squares(residuals, guess, method="lm", max_nfev=400).cost for guess in guesses]
        assert tma.fit(scenario, angles, tolerance=1e-3).cost <= min(costs) + 1e-3


def test_the_linear_equations_are_exact_without_noise():
    """Instantaneous bearings of a uniform motion satisfy them: the state comes out at once, from no start."""
    scenario = random_scenario(np.random.default_rng(3), "manoeuvre")
    light = tma.Sensor(tma.Bearing(), np.arange(0, scenario.sensors[0].times[-1], 20.0), 0.01)
    exact = replace(scenario, sensors=[light])
    equations = starts.LinearEquations(exact, exact.measure()[None])
    state = tma.propagate(equations.solve()[0], exact.reference_time - equations.middle)
    np.testing.assert_allclose(state, exact.state, rtol=1e-5)


def test_two_platforms_and_a_further_unknown():
    """The equations use the platform of each sensor; a bias starts from its model's guess."""
    one = tma.Course((0, 0), 6.0, 0.0, [tma.Straight(600)])
    two = tma.Course((8e3, 0), 6.0, 1.0, [tma.Straight(600)])
    times = np.arange(0, 600, 10.0)
    sensors = [
        tma.Sensor(tma.Bearing(), times, 0.005),
        tma.Sensor(tma.Biased(tma.Bearing(), true_bias=0.03), times, 0.005, platform=two),
    ]
    watch = tma.Scenario(one, sensors, 600.0)
    scenario = watch.with_target(tma.Target((5e3, 9e3), 7.0, 2.0))
    found = tma.fit(watch, scenario.simulate(200, seed=1))
    assert found.converged.all()
    low, high = tma.nees_limits(5, 200, 0.999)
    assert low < tma.nees(found.state, scenario.state, tma.crlb(scenario)).mean() < high


def test_a_run_that_is_not_finite_is_alone(scenario):
    angles = scenario.simulate(6, seed=2)
    spoilt = angles.copy()
    spoilt[3, 5] = np.inf
    whole, rest = tma.fit(scenario, spoilt), tma.fit(scenario, angles)
    others = np.arange(6) != 3
    np.testing.assert_array_equal(whole.state[others], rest.state[others])
    assert (whole.status[3], whole.converged[3]) == ("not finite", False)
    single = tma.fit(scenario, angles[0])
    np.testing.assert_array_equal(single.state, rest.state[0])


def test_ranges_are_tried_where_bearings_leave_the_range_open():
    """A straight observer: only the delay gives the range. With a turn nothing has to be tried."""
    rng = np.random.default_rng(5)
    for family, share in (("straight", 0.5), ("manoeuvre", 0.0)):
        tried = []
        for k in range(6):
            scenario = random_scenario(rng, family)
            tried.append(starts.find_start(scenario, scenario.simulate(5, seed=k))[1].mean())
        assert np.median(tried) >= share if share else np.median(tried) == 0.0


def test_what_cannot_start_says_so(scenario):
    deep = tma.Sensor(tma.Range(), [1.0, 2.0], 0.1)
    with pytest.raises(ValueError, match="needs a sensor that measures bearings"):
        tma.fit(tma.Scenario(scenario.platform, [deep], 0.0), [[0.1, 0.2]])


def test_a_fit_knows_its_worth(scenario):
    angles = scenario.simulate(400, seed=4)
    found = tma.fit(scenario, angles)
    assert np.all(found.freedom == len(scenario.times) - 4)
    assert np.abs(np.mean(found.p_value < 0.1) - 0.1) < 4 * np.sqrt(0.1 * 0.9 / 400)
    np.testing.assert_allclose(np.sum(found.residuals**2, axis=1), found.cost, rtol=1e-3)
    np.testing.assert_allclose(found.covariance[7], tma.crlb(scenario, found.state[7]))
    wild = angles.copy()
    wild[:, ::20] += 0.3
    assert np.all(tma.fit(scenario, wild).p_value < 1e-3), "wild bearings show"
    assert repr(found).startswith("Fit(400 runs, 400 converged; x, y, vx, vy at 600")


def test_condensed_bearings_are_exact_for_parabolas_and_not_correlated():
    """Two values a group: their mean is that of a parabola; noise gives both the stated sigma."""
    rng, times = np.random.default_rng(2), np.cumsum(np.random.default_rng(1).uniform(1, 3, 300))
    sensor = tma.Sensor(tma.Bearing(), times, 0.01)
    a, b, c = 3.1, 2e-3, -1e-5  # through south, where bearings wrap
    exact = a + b * (times - 300) + c * (times - 300) ** 2
    fewer, values = starts.condense(sensor, tma.wrap(exact)[None])
    wanted = a + b * (fewer.times - 300) + c * (fewer.times - 300) ** 2
    off = tma.wrap(values[0] - wanted).reshape(-1, 2)
    assert len(fewer) == 60
    assert np.all(np.diff(fewer.times) > 0)
    np.testing.assert_allclose(off.mean(axis=1), 0, atol=1e-12)
    _, noisy = starts.condense(sensor, 0.01 * rng.standard_normal((4000, 300)))
    np.testing.assert_allclose(noisy.std(axis=0) / fewer.sigma, 1, atol=0.06)
    assert np.abs(np.mean(noisy[:, ::2] * noisy[:, 1::2], axis=0)).max() < 0.1 * fewer.sigma**2


def test_few_bearings_stay_as_they_are_and_none_is_left_out():
    few = tma.Sensor(tma.Bearing(), np.arange(119.0), 0.01)
    assert starts.condense(few, np.zeros((1, 119)))[0] is few
    many = tma.Sensor(tma.Bearing(), np.arange(127.0), 0.01)
    angles = np.zeros((127, 127)) + 0.1 * np.eye(127)
    assert np.all(np.abs(starts.condense(many, angles)[1]).max(axis=1) > 0)


def test_a_start_faster_than_sound_is_no_converged_fit(scenario):
    """Such a state predicts nothing: neither a criterion nor an estimate."""
    model = tma.DelayedBearingUnknownSpeed()
    heard = replace(scenario, sensors=[tma.Sensor(model, np.arange(0, 600, 5.0), 0.01)])
    start = np.array([heard.state, heard.state])
    start[0, 2] = 2e3
    found = tma.fit(heard, heard.simulate(2, seed=1), start)
    assert found.status[0] == "not finite"
    assert np.isnan(found.state[0]).all()


def test_sound_alone_on_a_straight_course():
    """In air the delay tells the range of a fast target, and the equations' own delays run away."""
    rng = np.random.default_rng(77)
    one = tma.Course((0, 0), 90.0, 0.0, [tma.Straight(1200)])
    for _ in range(6):
        place, heading = rng.uniform(-30e3, 30e3, 2), rng.uniform(0, 2 * np.pi)
        sound = tma.Sensor(tma.DelayedBearing(340.0), np.arange(0, 1200, 10.0), 0.002)
        scenario = tma.Scenario(one, [sound], 1200.0, tma.Target(place, 200.0, heading))
        angles = scenario.simulate(5, seed=3)
        found, best = tma.fit(scenario, angles), tma.fit(scenario, angles, scenario.state)
        assert np.all(found.cost[best.converged] <= best.cost[best.converged] + 1e-2)


def test_a_target_that_passes_close_and_fast():
    """The bearings of a group then are no line; where nothing explains the condensed ones, all are used."""
    one = tma.Course(
        (0, 0), 112.2, 0.0, [tma.Straight(738.8, heading=3.591), tma.Straight(738.8, heading=4.229)]
    )
    sound = tma.Sensor(tma.DelayedBearing(340.0), np.arange(0, 1476, 5.0), 0.006)
    scenario = tma.Scenario(one, [sound], 1476.0, tma.Target((-148.3, -1554.0), 65.5, 5.352))
    angles = scenario.simulate(200, seed=3)
    found, best = tma.fit(scenario, angles), tma.fit(scenario, angles, scenario.state)
    lost = found.cost > best.cost + 1e-2
    assert lost.sum() <= 1, "three without these steps"
    assert np.all(found.p_value[lost] < 1e-6), "and it shows"
