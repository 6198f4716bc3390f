"""Departures against other motion models, other formulas, exact copies and simulation."""

from dataclasses import replace

import numpy as np
import pytest
from random_scenarios import random_scenario
from scipy.optimize import minimize
from scipy.stats import binomtest, ncx2, norm

import tmalib as tma
from tmalib.departed import Departed

TESTS = ("size", "drift", "kinds")


class Moving:
    """The motion of a model's state."""

    def __init__(self, model, state, time):
        self.model, self.state, self.time = model, state, time

    def position_at(self, t):
        return np.moveaxis(self.model.motion(self.state, np.asarray(t) - self.time)[0], 0, -1)


def with_model(scenario, model):
    """The scenario with another model of the target's motion, in place of bearings."""
    sensors = [replace(sensor, model=model) for sensor in scenario.sensors]
    return replace(scenario, sensors=sensors, target=None)


def size_of(bound):
    return np.sqrt(np.trace(bound[:2, :2]))


@pytest.fixture(scope="module")
def watch():
    ship = tma.Course((0, 0), 6, 0.0, [tma.Straight(600), tma.Straight(600, heading=np.pi / 2)])
    ear = tma.Sensor(tma.Bearing(), np.arange(0, 1200, 10.0), np.radians(0.5))
    return tma.Scenario(ship, [ear], 1190, tma.Target((-2e3, 6e3), 5, np.radians(270), time=1190))


def turning(watch, rate):
    return Moving(tma.TurningBearing(), [*watch.state, rate], watch.reference_time)


@pytest.fixture(scope="module")
def turn(watch):
    """By 1e-8 rad/s, so little that the circle is a parabola."""
    return tma.departure_effect(watch, turning(watch, 1e-8))


@pytest.fixture(scope="module")
def speeding(watch):
    """Both components of an acceleration."""
    others = [
        Moving(tma.AcceleratedBearing(), [*watch.state, *part], watch.reference_time) for part in np.eye(2)
    ]
    return tma.departure_effect(watch, others)


# -- the price is the bound of a richer model ----------------------------------------------------------


def test_the_price_of_a_turn_is_that_of_the_model_that_turns(watch, turn):
    richer = tma.crlb(with_model(watch, tma.TurningBearing()), [*watch.state, 0.0])
    np.testing.assert_allclose(turn.bound_with_kinds, richer[:2, :2], rtol=1e-5)
    np.testing.assert_allclose(turn.price, size_of(richer) / size_of(tma.crlb(watch)), rtol=1e-5)
    np.testing.assert_allclose(turn.bound, tma.crlb(watch)[:2, :2], rtol=1e-9)


def test_the_price_of_two_kinds_is_that_of_the_model_that_speeds_up(watch, speeding):
    richer = tma.crlb(with_model(watch, tma.AcceleratedBearing()), [*watch.state, 0.0, 0.0])
    np.testing.assert_allclose(speeding.bound_with_kinds, richer[:2, :2], rtol=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_harm_and_price_of_one_kind_are_one_number(seed):
    """``error^2 = noncentrality (price^2 - 1) trace P``, in random scenarios, delays and all."""
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng, ["one to three legs", "air", "two platforms"][seed % 3])
    t = np.linspace(scenario.times.min() - 1000, max(scenario.times.max(), scenario.reference_time), 200)
    wander = np.cumsum(np.cumsum(rng.standard_normal((200, 2)), axis=0), axis=0)
    other = tma.SampledCourse(t, scenario.target.position_at(t) + wander)
    effect = tma.departure_effect(scenario, other)
    harm = effect.noncentrality(2.0) * (effect.price**2 - 1) * np.trace(effect.bound)
    np.testing.assert_allclose(effect.error(2.0) ** 2, harm, rtol=1e-6)


# -- what fits without noise do -------------------------------------------------------------------------


@pytest.mark.parametrize("time", [0.0, 600.0, 1190.0])
def test_error_and_noncentrality_are_those_of_small_departures_fitted(watch, turn, speeding, time):
    for effect, amounts in ((turn, [50.0]), (speeding, [3e-6, -2e-6])):
        effect = tma.departure_effect(watch, effect.others, time)
        target = effect.target(amounts)
        found = tma.fit(watch, watch.with_target(target).measure(), watch.state, tolerance=1e-10)
        off = tma.propagate(found.state, time - watch.reference_time)[:2] - target.position_at(time)
        np.testing.assert_allclose(off, effect.gain @ amounts, rtol=1e-2, atol=1e-3)
        np.testing.assert_allclose(found.cost, effect.noncentrality(amounts), rtol=1e-2)


def test_size_is_the_largest_distance_from_the_nearest_uniform_motion(watch, speeding):
    amounts = [1e-3, 2e-3]
    places = speeding.target(amounts).position_at(watch.times)
    nearest = tma.sensitivity.nearest_motion(watch.times, places, norm="squares")
    off = places - nearest[:2] - watch.times[:, None] * nearest[2:]
    np.testing.assert_allclose(speeding.size(amounts), np.hypot(*off.T).max(), rtol=1e-9)
    np.testing.assert_allclose(speeding.size([amounts, [0, 0]]), [speeding.size(amounts), 0], rtol=1e-12)


# -- the tests ------------------------------------------------------------------------------------------


def test_each_test_notices_as_often_as_it_is_foretold(watch, turn):
    """Of 2000 runs with a turn; ``kinds`` by fitting the turn as well. And none exceeds the ceiling."""
    amount, runs = turn.hidden(0.5, "drift"), 2000
    angles = watch.with_target(turning(watch, 1e-8 * amount[0])).simulate(runs, seed=3)
    found = tma.fit(watch, angles)
    start = np.column_stack([found.state, np.zeros(runs)])
    richer = tma.fit(with_model(watch, tma.TurningBearing()), angles, start, tolerance=1e-4)
    noticed = {
        "size": found.p_value < 0.05,
        "drift": tma.residual_tests(found).drift.p_value[:, -1] < 0.05,
        "kinds": found.cost - richer.cost > norm.isf(0.025) ** 2,
    }
    assert np.all(found.converged & richer.converged)
    for test in TESTS:
        share = binomtest(int(noticed[test].sum()), runs).proportion_ci(0.9999)
        assert share.low < turn.power(amount, test) < share.high, test
        assert share.low < turn.power(amount, "any")


def test_power_is_noncentral_chi_square_and_at_nothing_the_level(turn):
    for test in TESTS:
        limit = ncx2.isf(0.05, turn.freedom(test), 1e-12)
        chance = ncx2.sf(limit, turn.freedom(test), turn.noncentrality(700.0, test))
        np.testing.assert_allclose(turn.power(700.0, test), chance, rtol=1e-6)
        np.testing.assert_allclose(turn.power(0.0, test), 0.05, rtol=1e-9)
    assert (turn.freedom("size"), turn.freedom("kinds")) == (116, 1)
    amounts = np.linspace(10, 5000, 40)
    ceiling = turn.power(amounts, "any")
    assert all(np.all(turn.power(amounts, test) <= ceiling + 1e-12) for test in TESTS)


@pytest.mark.parametrize("test", ["size", "drift", "kinds", "any"])
def test_the_hidden_departure_has_the_power_and_no_other_does_more_harm(turn, speeding, test):
    np.testing.assert_allclose(turn.power(turn.hidden(0.8, test), test), 0.8, rtol=1e-6)
    worst = speeding.hidden(0.8, test)
    np.testing.assert_allclose(speeding.power(worst, test), 0.8, rtol=1e-6)
    wanted = speeding.noncentrality(worst, test)

    def harm(angle):
        way = np.array([np.cos(angle), np.sin(angle)])
        return float(speeding.error(way * np.sqrt(wanted / speeding.noncentrality(way, test))))

    angles = np.linspace(0, np.pi, 20001)
    best = angles[np.argmax([harm(angle) for angle in angles[::20]]) * 20]
    refined = minimize(lambda x: -harm(x[0]), [best], method="Nelder-Mead", options={"xatol": 1e-9})
    np.testing.assert_allclose(speeding.error(worst), -refined.fun, rtol=1e-6)
    assert worst[np.argmax(np.abs(worst))] > 0


# -- what nobody notices ----------------------------------------------------------------------------------


def test_a_copy_of_the_own_manoeuvre_is_never_noticed(watch, turn):
    """The lines of sight are those of a uniform motion; the error is its distance, exactly."""
    own = watch.platform.position_at(watch.times)
    line = tma.sensitivity.nearest_motion(watch.times, own, norm="squares")
    copied = own - line[:2] - watch.times[:, None] * line[2:]
    other = tma.SampledCourse(watch.times, watch.target.position_at(watch.times) + copied)
    effect = tma.departure_effect(watch, other)
    np.testing.assert_allclose(effect.power([1e-3, 0.3], "any"), 0.05, rtol=1e-6)
    share = 1e-3  # X + a w has the bearings of the uniform motion (X - a line) / (1 - a)
    exact = (watch.state[:2] - share * (line[:2] + 1190 * line[2:])) / (1 - share)
    off = np.hypot(*(exact - effect.target(share).position_at(1190.0)))
    np.testing.assert_allclose(effect.error(share), off, rtol=2e-3)
    for test in TESTS:
        with pytest.raises(ValueError, match=f"the test '{test}' does not see"):
            effect.hidden(0.5, test)
    with pytest.raises(ValueError, match="does not see"):
        tma.departure_effect(watch, [*turn.others, other]).price  # noqa: B018


def test_another_uniform_motion_is_no_departure(watch):
    other = tma.Target((3e3, 4e3), 7, 1.0)
    effect = tma.departure_effect(watch, other)
    np.testing.assert_allclose(effect.gain, 0, atol=1e-3)
    np.testing.assert_allclose(effect.size(1.0), 0, atol=1e-6)
    with pytest.raises(ValueError, match="does not see"):
        effect.hidden()


# -- words ------------------------------------------------------------------------------------------------


def test_what_cannot_be_is_refused(watch, turn, speeding):
    for call, words in (
        (lambda: tma.departure_effect(watch, []), "others is empty"),
        (lambda: tma.departure_effect(watch, [7]), "each of others must be an object with position_at"),
        (lambda: tma.departure_effect(watch, turn.others[0], np.nan), "time must be finite"),
        (lambda: tma.departure_effect(watch.with_target(None), turn.others), "needs a target"),
        (lambda: tma.departure_effect(7, turn.others), "scenario must be a Scenario"),
        (lambda: turn.power(1.0, "portmanteau"), "test must be one of .* 'portmanteau'"),
        (lambda: turn.freedom("any"), "test must be one of"),
        (lambda: turn.hidden(0.05), "power must be above the level 0.05, got 0.05"),
        (lambda: turn.power(1.0, level=1.0), "probability must be below 1"),
        (lambda: speeding.error(1.0), r"amounts must have shape \(..., 2\)"),
        (lambda: speeding.target([[1.0, 2.0]]), "amounts must be those of one target"),
    ):
        with pytest.raises(ValueError, match=words):
            call()


def test_shapes_of_amounts(turn, speeding):
    assert turn.error(1.0).shape == turn.power([1.0], "drift").shape == ()
    assert turn.error([1.0, 2.0]).shape == turn.size([[1.0], [2.0]]).shape == (2,)
    assert speeding.noncentrality(np.ones((3, 4, 2))).shape == (3, 4)


def test_a_sum_of_ways(watch):
    others = (tma.Target((0, 0), 5, 0.0), tma.Target((10, 0), 7, 0.0))
    start = tma.Target((4, 2), 1, 0.0)
    expected = [4 - 4 * 0.5 + 6 * 2, 2 - 0.5 * 2 - 2 * 2 + 3 * (1 + 0.5 * 4 + 2 * 6)]
    np.testing.assert_allclose(Departed(start, others, (0.5, 2.0)).position_at(3.0), expected, rtol=1e-12)
