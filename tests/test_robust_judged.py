"""What a robust fit is worth: sandwich, tests of residuals, alternatives; and what it refuses, and why."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from linear_sensors import LinearWithBias
from scipy.optimize import minimize
from scipy.stats import binomtest, chi2
from test_robust import close_pass, ship_that_turns, straight_observer, with_wild

import tmalib as tma
from tmalib.losses import CUT

RUNS = 400


def rho(e):
    """The loss, written out anew."""
    return np.where(np.abs(e) < CUT, CUT**2 / 3 * (1 - (1 - (e / CUT) ** 2) ** 3), CUT**2 / 3)


def psi(e):
    return np.where(np.abs(e) < CUT, e * (1 - (e / CUT) ** 2) ** 2, 0.0)


def slope(e, step=1e-5):
    return (psi(e + step) - psi(e - step)) / (2 * step)


def linear():
    """Two sensors of a linear model."""
    ship = tma.Course((0, 0), 5, 0.3, [tma.Straight(1000)])
    parts = [((0.8, 0.6, 0.0), 3.0, "a"), ((-0.6, 0.8, 1.0), 5.0, "b"), ((0.1, 1.0, 1.0), 2.0, "c")]
    sensors = [
        tma.Sensor(LinearWithBias(*mix), np.arange(0, 600, 10.0), sigma, name) for mix, sigma, name in parts
    ]
    return tma.Scenario(ship, sensors, 300.0)


def run_of(found, k):
    """One run of many as a fit of its own."""
    parts = {name: getattr(found, name)[k] for name in ("state", "status", "iterations", "cost", "measured")}
    return replace(found, **parts)


# -- sandwich ---------------------------------------------------------------------------------------


def test_the_sandwich_of_a_linear_model_by_hand():
    """J = sum psi'(e) g g' is exact there; the middle has the mean of psi^2 of each sensor."""
    scenario, rng = linear(), np.random.default_rng(1)
    truth = np.array([1e3, 2e3, 3.0, -2.0, 40.0])
    exact, gradient = scenario.linearise(truth)
    measured = exact + scenario.sigma * rng.standard_normal(exact.shape)
    measured[rng.random(exact.shape) < 0.1] += 100.0
    measured[17] = np.nan
    found = tma.fit(scenario, measured, start=truth, loss="bisquare")
    assert found.converged
    there = ~np.isnan(measured)
    g = (gradient / scenario.sigma[:, None])[there]
    e = ((measured - scenario.linearise(found.state)[0]) / scenario.sigma)[there]
    assert np.sum(np.abs(e) > CUT) > 5
    square, sensor = np.empty_like(e), np.repeat([0, 1, 2], 60)[there]
    for k in range(3):
        square[sensor == k] = np.mean(psi(e[sensor == k]) ** 2) * len(e) / (len(e) - 5)
    bread = np.linalg.inv(g.T @ (slope(e)[:, None] * g))
    np.testing.assert_allclose(found.sandwich, bread @ (g.T @ (square[:, None] * g)) @ bread, rtol=1e-5)


@pytest.mark.parametrize("share", [0.0, 0.1])
def test_the_sandwich_holds_the_truth_as_often_as_it_says(share):
    scenario = ship_that_turns()
    angles, _ = with_wild(scenario.simulate(RUNS, seed=21), share)
    found = tma.fit(scenario, angles, loss="bisquare")
    squares = [
        tma.nees(one.state, scenario.state, one.sandwich) for one in map(partial(run_of, found), range(RUNS))
        if one.converged
    ]  # fmt: skip
    assert len(squares) >= RUNS - 2
    low, high = binomtest(int(np.sum(squares <= chi2.ppf(0.9, 4))), len(squares)).proportion_ci(0.99)
    assert low < 0.9 < high


# -- tests of residuals -----------------------------------------------------------------------------


def thrown(angles, share, seed=5):
    """Wild ones that are surely wild: off by half a radian and more."""
    rng, angles = np.random.default_rng(seed), angles.copy()
    wild = rng.random(angles.shape) < share
    angles[wild] += rng.choice([-1, 1], wild.sum()) * rng.uniform(0.5, 3.0, wild.sum())
    return angles, wild


@pytest.mark.parametrize("make", [ship_that_turns, straight_observer, close_pass])
@pytest.mark.parametrize("share", [0.0, 0.1])
def test_p_values_are_those_of_noise(make, share):
    """Size and drift have an exact distribution, of the measurements that are no wild ones."""
    scenario = make()
    angles, wild = thrown(scenario.simulate(RUNS, seed=31), share)
    found = tma.fit(scenario, angles, loss="bisquare")
    tests, good = tma.residual_tests(found), found.converged
    assert good.sum() >= RUNS - 2
    np.testing.assert_array_equal(found.weights[good] == 0, wild[good])
    for test in (tests.size, tests.drift):
        for p in test.p_value[good].T:
            low, high = binomtest(int(np.sum(p < 0.1)), len(p)).proportion_ci(0.999)
            assert low < 0.1 < high
    largest = tests.largest.p_value[good][:, -1]
    assert binomtest(int(np.sum(largest < 0.1)), len(largest), 0.1, "greater").pvalue > 1e-3


def test_they_are_the_tests_of_a_fit_by_squares_without_the_wild_ones():
    """To first order in the errors; here the model is linear, and the order is exact."""
    scenario, rng = linear(), np.random.default_rng(2)
    truth = np.array([1e3, 2e3, 3.0, -2.0, 40.0])
    exact = scenario.linearise(truth)[0]
    measured = exact + scenario.sigma * rng.standard_normal((20, len(exact)))
    measured[rng.random(measured.shape) < 0.1] += 200.0
    robust = tma.fit(scenario, measured, start=truth, loss="bisquare")
    kept = np.where(robust.weights > 0, measured, np.nan)
    here, there = map(tma.residual_tests, (robust, tma.fit(scenario, kept, start=truth)))
    for name in ("size", "drift", "correlation", "largest"):
        for one, other in zip(getattr(here, name), getattr(there, name), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-9)


def test_a_turn_is_seen_among_wild_bearings():
    scenario = ship_that_turns()
    turning = tma.Course((2e3, 4e3), 6, 1.5, [tma.Straight(200), tma.Straight(400, heading=0.6)])
    angles, _ = thrown(scenario.with_target(turning).simulate(50, seed=3), 0.05)
    found = tma.fit(scenario, angles, loss="bisquare")
    p = tma.residual_tests(found).drift.p_value[found.converged, -1]
    assert len(p) > 40
    assert np.mean(p < 1e-3) > 0.9


def test_a_robust_fit_is_shown_with_its_warnings():
    scenario = ship_that_turns()
    angles, _ = thrown(scenario.simulate(1, seed=1)[0], 0.1)
    rows = {row.name: row.text for row in tma.summarise(tma.fit(scenario, angles, loss="bisquare"))}
    assert rows["status"] == "converged"
    assert rows["criterion"].endswith("degrees of freedom: no test, for the loss is bisquare")
    assert "warning" not in rows
    angles[:60] += 0.03  # a sensor that is off for half of the time
    rows = [row.name for row in tma.summarise(tma.fit(scenario, angles, loss="bisquare"))]
    assert "warning" in rows


# -- alternatives -----------------------------------------------------------------------------------


def no_left_or_right():
    array = tma.Course((0, 0), speed=5, heading=0.0, legs=[tma.Straight(600)])
    rays = [tma.ConicalAngle(path, 200.0, 4000.0, 100.0) for path in (tma.DIRECT, tma.BOTTOM_BOUNCE)]
    sensors = [tma.Sensor(ray, np.arange(0, 601, 20), 0.001) for ray in rays]
    return tma.Scenario(array, sensors, 0, tma.Target((5000, 7000), 4, np.radians(45), depth=100))


def test_the_mirror_image_is_as_likely():
    """For the robust criterion, too; and by squares the wild ones would spoil both."""
    scenario = no_left_or_right()
    cosines = scenario.simulate(1, seed=1)[0]
    cosines[[3, 17, 40, 55]] = -0.5, 0.1, 0.9, -0.9
    found = tma.fit(scenario, cosines, loss="bisquare")
    (other,) = tma.alternatives(found)
    np.testing.assert_allclose(other.state, found.state * [-1, 1, -1, 1], rtol=1e-5)
    assert round(other.likelihood, 6) == 1
    e = (cosines - scenario.linearise(other.state)[0]) / scenario.sigma
    np.testing.assert_allclose(other.cost, rho(e).sum(), rtol=1e-6)


def criterion(scenario, measured, about, step):
    state = about + np.array([1e2, 1e2, 1.0, 1.0]) * step
    return rho((measured - scenario.linearise(state)[0]) / scenario.sigma).sum()


def test_alternatives_are_minima_of_the_robust_criterion():
    """Around each scipy, which knows nothing of weights, finds no lower criterion."""
    scenario, rng, found = no_left_or_right(), np.random.default_rng(4), []
    legs = [tma.Straight(300), tma.Straight(300, heading=np.radians(1))]  # hardly tells left from right
    sensors = [replace(sensor, sigma=0.017) for sensor in scenario.sensors]
    scenario = replace(scenario, platform=tma.Course((0, 0), 5, 0.0, legs), sensors=sensors)
    for measured in scenario.simulate(10, seed=1):
        wild = rng.random(measured.shape) < 0.1
        measured[wild] = rng.uniform(-1, 1, wild.sum())
        fit = tma.fit(scenario, measured, loss="bisquare")
        for other in tma.alternatives(fit):
            around = partial(criterion, scenario, measured, other.state)
            np.testing.assert_allclose(around(np.zeros(4)), other.cost, rtol=1e-9)
            assert minimize(around, np.zeros(4), method="Nelder-Mead").fun > other.cost - 1e-3
            np.testing.assert_allclose(other.likelihood, np.exp((fit.cost - other.cost) / 2))
            found.append(np.sign(other.state[0]) != np.sign(fit.state[0]))
    assert len(found) > 3
    assert all(found), "each on the other side"


# -- what has no answer -----------------------------------------------------------------------------


def test_a_region_says_why_it_has_none_and_what_to_do_instead():
    scenario = ship_that_turns()
    angles, _ = thrown(scenario.simulate(1, seed=1)[0], 0.1)
    fit = tma.fit(scenario, angles, loss="bisquare")
    with pytest.raises(ValueError, match="no known distribution; fit by squares what it trusts") as said:
        tma.confidence_region(fit)
    kept = eval(str(said.value).rpartition("trusts: ")[2], {"np": np, "fit": fit})
    region = tma.confidence_region(tma.fit(scenario, kept))
    assert region.bounded
    assert region.contains(scenario.target.position_at(595))


def test_the_way_that_is_told_holds_the_truth_as_often_as_it_says():
    """By the profile at the true position, which says whether the region holds it."""
    scenario = replace(ship_that_turns(), reference_time=400.0)
    angles, _ = thrown(scenario.simulate(RUNS, seed=41), 0.1)
    found = tma.fit(scenario, angles, loss="bisquare")
    kept = np.where(found.weights > 0, angles, np.nan)
    profile = tma.profile_criterion(scenario, kept, scenario.target.position_at(400.0))
    low, high = binomtest(int(np.sum(profile <= -2 * np.log(0.1))), RUNS).proportion_ci(0.99)
    assert low < 0.9 < high
