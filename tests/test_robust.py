"""The robust loss: what wild bearings cost, what the covariance promises, and peers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import binomtest, chi2

import tmalib as tma
from tmalib.losses import CUT, influence_and_slope, value_and_weight, without_wild
from tmalib.papers.emw_acoustic.scenarios import scenario as of_paper

RUNS = 500


def ship_that_turns():
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    ear = tma.Sensor(tma.Bearing(), np.arange(0, 600, 5.0), 0.01)
    return tma.Scenario(ship, [ear], 595, tma.Target((2e3, 4e3), 6, 1.5))


def straight_observer():
    """Only the delay tells the range."""
    line, fine = tma.Course((0, 0), 7, 0.0, [tma.Straight(1200)]), np.radians(0.5)
    radar = tma.Sensor(tma.Bearing(), np.arange(0, 1200, 2.0), fine)
    sonar = tma.Sensor(tma.DelayedBearing(1500), np.arange(0, 1200, 4.0), fine)
    return tma.Scenario(line, [radar, sonar], 1199, tma.Target((5e3, 6e3), 40, np.radians(200)))


def close_pass():
    near = ship_that_turns()
    ear = tma.Sensor(tma.Bearing(), np.arange(0, 600, 2.0), 0.01)
    return replace(near, sensors=[ear], target=tma.Target((-900, 900), 6, 1.4))


SCENARIOS = {
    "turns": ship_that_turns,
    "paper": lambda: of_paper(1),
    "straight": straight_observer,
    "close": close_pass,
}


def with_wild(angles, share, seed=9):
    rng, angles = np.random.default_rng(seed), angles.copy()
    wild = rng.random(angles.shape) < share
    angles[wild] = rng.uniform(-np.pi, np.pi, wild.sum())
    return angles, wild


@pytest.mark.parametrize("name", SCENARIOS)
def test_wild_bearings_cost_little_and_lose_no_run(name):
    scenario = SCENARIOS[name]()
    clean = scenario.simulate(RUNS, seed=5)
    by_squares = tma.fit(scenario, clean)
    robust = tma.fit(scenario, with_wild(clean, 0.03)[0], loss="bisquare")
    assert by_squares.converged.all()
    assert robust.converged.all()
    errors = [found.state - scenario.state for found in (robust, by_squares)]
    bound = tma.crlb_sigma(scenario)
    assert np.all(np.abs(errors[0]) < 6 * bound)  # none is lost in another minimum
    rng = np.random.default_rng(1)
    picks = rng.integers(0, RUNS, (400, RUNS))  # bootstrap; the runs of both fits are those of one noise
    ratio = np.array([errors[0][pick].std(axis=0) / errors[1][pick].std(axis=0) for pick in picks])
    assert np.all(np.quantile(ratio, 0.995, axis=0) < 1.2)
    assert np.all(np.abs(errors[0].mean(axis=0)) < 4 * bound / np.sqrt(RUNS))


@pytest.mark.parametrize("share", [0.0, 0.03, 0.1])
def test_the_ellipsoid_holds_the_truth_as_often_as_it_says(share):
    scenario, runs = ship_that_turns(), 2000
    angles, _ = with_wild(scenario.simulate(runs, seed=11), share)
    found = tma.fit(scenario, angles, loss="bisquare")
    assert found.converged.sum() >= runs - 5
    squares = tma.nees(found.state, scenario.state, found.covariance)
    inside = int(np.sum(squares <= chi2.ppf(0.9, 4)))
    low, high = binomtest(inside, int(found.converged.sum())).proportion_ci(0.99)
    assert low < 0.9 < high


def test_coverage_with_one_bad_sensor_of_two():
    """The bad one has three wild in ten; a common mean over both would be wrong for either."""
    scenario, runs = straight_observer(), 600
    clean, sonar = scenario.simulate(runs, seed=3), scenario.blocks[1].columns
    angles = clean.copy()
    angles[:, sonar] = with_wild(clean[:, sonar], 0.3)[0]
    found = tma.fit(scenario, angles, start=scenario.state, loss="bisquare")
    ok = found.converged
    assert ok.sum() > 0.98 * runs
    inside = int(np.sum(tma.nees(found.state, scenario.state, found.covariance)[ok] <= chi2.ppf(0.9, 4)))
    low, high = binomtest(inside, int(ok.sum())).proportion_ci(0.99)
    assert low < 0.9 < high


@pytest.mark.parametrize("name", ["turns", "close"])
def test_the_minimum_is_that_of_scipy_from_the_same_start(name):
    scenario = SCENARIOS[name]()
    angles, _ = with_wild(scenario.simulate(20, seed=2), 0.05)
    found = tma.fit(scenario, angles, start=scenario.state, loss="bisquare")
    bound = tma.crlb_sigma(scenario)

    def bisquare(z):  # of scipy: value, first and second derivative by z = e^2, written out anew
        u = np.minimum(z / CUT**2, 1.0)
        return np.array([CUT**2 / 3 * (3 * u - 3 * u**2 + u**3), (1 - u) ** 2, -2 * (1 - u) / CUT**2])

    for measured, state, cost in zip(angles, found.state, found.cost, strict=True):

        def off(x, measured=measured):
            return (
                scenario.residual(measured, scenario.linearise(scenario.state + bound * x)[0])
                / scenario.sigma
            )

        peer = least_squares(off, np.zeros(4), loss=bisquare, xtol=1e-14, ftol=1e-14, gtol=1e-12)
        np.testing.assert_allclose((state - scenario.state) / bound, peer.x, atol=1e-4)
        assert cost == pytest.approx(2 * peer.cost, rel=1e-6)


def test_the_functions_of_the_loss_belong_together():
    e, step = np.linspace(-9, 9, 400), 1e-5
    weight = value_and_weight(e**2)[1]
    influence, slope = influence_and_slope(e)
    difference = (value_and_weight((e + step) ** 2)[0] - value_and_weight((e - step) ** 2)[0]) / (4 * step)
    np.testing.assert_allclose(influence, difference, atol=1e-8)
    np.testing.assert_allclose(influence, weight * e)
    change = (influence_and_slope(e + step)[0] - influence_and_slope(e - step)[0]) / (2 * step)
    np.testing.assert_allclose(slope, change, atol=1e-8)
    assert np.all(weight[np.abs(e) > CUT] == 0)


def test_the_weights_tell_what_was_wild():
    scenario = ship_that_turns()
    clean = scenario.simulate(50, seed=4)
    angles, wild = with_wild(clean, 0.05)
    found = tma.fit(scenario, angles, loss="bisquare")
    far = wild & (np.abs(tma.wrap(angles - clean)) > 0.15)
    assert np.all(found.weights[far] == 0)
    assert np.all(found.weights[~wild] > 0.1)
    assert found.weights[~wild].mean() > 0.9
    assert np.all(tma.fit(scenario, clean).weights == 1)


def test_missing_measurements_have_no_weight_and_change_nothing_else():
    scenario = ship_that_turns()
    angles, _ = with_wild(scenario.simulate(6, seed=4), 0.03)
    gaps = angles.copy()
    gaps[1::2, [3, 50, 51, 119]] = np.nan
    found = tma.fit(scenario, gaps, loss="bisquare")
    assert found.converged.all()
    assert np.array_equal(np.isnan(found.weights), np.isnan(gaps))
    there = ~np.isnan(gaps[1])
    alone = tma.fit(scenario.keep(there), gaps[1][there], loss="bisquare")
    np.testing.assert_array_equal(alone.state, found.state[1])
    np.testing.assert_allclose(alone.covariance, found.covariance[1], rtol=1e-9)


@pytest.mark.parametrize("name", ["turns", "straight"])
def test_a_run_is_the_same_alone(name):
    scenario = SCENARIOS[name]()
    angles, _ = with_wild(scenario.simulate(8, seed=4), 0.1)
    angles[2] = 1.0  # nonsense beside them, and a run that is not finite
    angles[5, 7] = np.inf
    together = tma.fit(scenario, angles, loss="bisquare")
    for k in range(len(angles)):
        alone = tma.fit(scenario, angles[k], loss="bisquare")
        np.testing.assert_array_equal(alone.state, together.state[k])
        assert (alone.status, alone.cost) == (
            together.status[k],
            pytest.approx(together.cost[k], nan_ok=True),
        )


def test_where_it_breaks_down_it_says_so():
    """With a third wild nearly all runs are right; with four fifths there is no estimate, not a wrong one."""
    scenario = ship_that_turns()
    clean, bound = scenario.simulate(40, seed=6), tma.crlb_sigma(scenario)
    third = tma.fit(scenario, with_wild(clean, 0.33)[0], loss="bisquare")
    assert third.converged.sum() >= 36
    assert np.sum(np.any(np.abs(third.state - scenario.state) > 8 * bound, axis=1) & third.converged) <= 1
    assert not tma.fit(scenario, with_wild(clean, 0.8)[0], loss="bisquare").converged.any()


def test_an_observer_that_does_not_turn_is_not_observable_with_any_loss():
    line = tma.Course((0, 0), 5, 0.0, [tma.Straight(600)])
    scenario = replace(ship_that_turns(), platform=line)
    found = tma.fit(scenario, with_wild(scenario.simulate(10, seed=1), 0.03)[0], loss="bisquare")
    assert not found.converged.any()
    assert np.isnan(found.covariance).all()


def test_the_covariance_moves_with_the_time():
    scenario = ship_that_turns()
    found = tma.fit(scenario, with_wild(scenario.simulate(5, seed=1), 0.03)[0], loss="bisquare")
    phi = tma.transition(200.0)
    np.testing.assert_allclose(found.at(795).covariance, phi @ found.covariance @ phi.T, rtol=1e-5)


def test_replaced_values_lie_between_their_neighbours():
    ear = tma.Sensor(tma.Bearing(), np.arange(40.0), 0.01)
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(100)])
    scenario = tma.Scenario(ship, [ear], 0.0)
    truth = tma.wrap(np.pi - 0.2 + 0.01 * np.arange(40.0))  # across south, where angles jump
    angles = truth[None].copy()
    angles[0, [0, 7, 8, 20, 39]] += [2.0, -1.0, 2.5, 0.3, -3.0]
    tame, wild = without_wild(scenario, angles)
    assert np.flatnonzero(wild[0]).tolist() == [0, 7, 8, 20, 39]
    np.testing.assert_allclose(tma.wrap(tame[0, 1:39] - truth[1:39]), 0, atol=1e-12)
    np.testing.assert_allclose(tma.wrap(tame[0, [0, 39]] - truth[[1, 38]]), 0, atol=1e-12)


def test_what_a_robust_fit_has_not():
    scenario = ship_that_turns()
    angles = scenario.simulate(1, seed=1)[0]
    found = tma.fit(scenario, angles, loss="bisquare")
    assert found.loss == "bisquare"
    assert "bisquare" in repr(found)
    assert np.isnan(found.p_value)
    with pytest.raises(ValueError, match="loss 'squares', and this one has 'bisquare'"):
        tma.confidence_region(found)
    unknown = replace(scenario, sensors=[replace(scenario.sensors[0], sigma=None)])
    with pytest.raises(ValueError, match=r"sigma of \['Bearing'\] is not known"):
        tma.fit(unknown, angles, loss="bisquare")
    for name in ("huber", None, 3, np.array(["squares"])):
        with pytest.raises(ValueError, match=r"loss must be one of \('squares', 'bisquare'\), got"):
            tma.fit(scenario, angles, loss=name)
