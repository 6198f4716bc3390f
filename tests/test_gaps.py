"""Measurements as they come: some missing, some worse than others, a noise that nobody knows."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import binomtest

import tmalib as tma
from tmalib import status


def with_gaps(scenario, runs, share, seed):
    angles = scenario.simulate(runs, seed)
    return np.where(np.random.default_rng(seed).random(angles.shape) < share, np.nan, angles)


@pytest.mark.parametrize("given", [True, False])
def test_a_gap_is_a_scenario_without_the_measurement(scenario, given):
    angles = with_gaps(scenario, 5, 0.3, seed=1)
    angles[4] = scenario.simulate(1, seed=2)[0]  # a run without a gap
    whole = tma.fit(scenario, angles, scenario.state if given else None)
    assert whole.converged.all()
    for k, run in enumerate(angles):
        there = ~np.isnan(run)
        rest = scenario.keep(there)
        found = tma.fit(rest, run[there], scenario.state if given else None)
        np.testing.assert_array_equal(whole.state[k], found.state)
        assert (whole.cost[k], whole.freedom[k]) == (found.cost, there.sum() - 4)
        np.testing.assert_allclose(whole.covariance[k], tma.crlb(rest, found.state), rtol=1e-9)
        np.testing.assert_array_equal(np.isnan(whole.residuals[k]), ~there)
        np.testing.assert_allclose(whole.p_value[k], found.p_value, rtol=1e-12)


def test_a_masked_array_is_the_same_as_nan(scenario):
    angles = with_gaps(scenario, 3, 0.2, seed=3)
    masked = np.ma.masked_array(np.nan_to_num(angles, nan=99.0), mask=np.isnan(angles))
    np.testing.assert_array_equal(tma.fit(scenario, masked).state, tma.fit(scenario, angles).state)


def test_runs_with_too_few_measurements_say_so_and_stay_alone(scenario):
    angles = scenario.simulate(6, seed=4)
    alone = tma.fit(scenario, angles)
    few = angles.copy()
    few[1], few[2, 3:], few[3, 1:] = np.nan, np.nan, np.nan
    found = tma.fit(scenario, few)
    others = [0, 4, 5]
    np.testing.assert_array_equal(found.state[others], alone.state[others])
    assert list(found.status[[1, 2, 3]]) == [status.NOT_OBSERVABLE] * 3
    assert not np.isfinite(found.covariance[[1, 2, 3]]).any()
    assert "3 of 6 runs not observable" in found.explain()


def test_an_unknown_that_nothing_tells_any_more():
    """The only sensor with a bias has no measurement left: its bias has gone with it."""
    ship = tma.Course((0, 0), 6.0, 0.0, [tma.Straight(300), tma.Straight(300, heading=1.5)])
    times = np.arange(0, 600, 10.0)
    sensors = [
        tma.Sensor(tma.Bearing(), times, 0.005),
        tma.Sensor(tma.Biased(tma.Bearing(), true_bias=0.03), times, 0.005),
    ]
    scenario = tma.Scenario(ship, sensors, 600.0, tma.Target((5e3, 9e3), 7.0, 2.0))
    angles = scenario.simulate(2, seed=1)
    angles[0, 60:] = np.nan
    found = tma.fit(scenario, angles)
    assert list(found.status) == [status.NOT_OBSERVABLE, status.CONVERGED]
    assert "some unknown" in found.explain()


def test_a_sigma_for_each_measurement_against_scipy(scenario):
    rng = np.random.default_rng(5)
    sensors = [replace(s, sigma=s.sigma * rng.uniform(0.3, 3, len(s))) for s in scenario.sensors]
    uneven = replace(scenario, sensors=sensors)
    assert uneven.sigma.shape == scenario.times.shape
    angles = uneven.simulate(4, seed=6)
    found = tma.fit(uneven, angles, tolerance=1e-6)
    for k, run in enumerate(angles):

        def residuals(x, run=run):
            return uneven.residual(run, uneven.linearise(x)[0]) / uneven.sigma

        peer = least_squares(residuals, uneven.state, x_scale=tma.crlb_sigma(uneven), xtol=1e-12)
        np.testing.assert_allclose(found.state[k], peer.x, atol=1e-3)
        assert found.cost[k] == pytest.approx(2 * peer.cost, rel=1e-9)
    constant = [replace(s, sigma=np.full(len(s), s.sigma)) for s in scenario.sensors]
    same = tma.fit(replace(scenario, sensors=constant), angles, scenario.state)
    np.testing.assert_allclose(same.state, tma.fit(scenario, angles, scenario.state).state, rtol=1e-9)


@pytest.mark.parametrize("sigma", [[0.1] * 3, np.zeros(61), np.full(61, np.nan), "a", -1.0, np.ones((61, 1))])
def test_sigmas_that_cannot_be(scenario, sigma):
    with pytest.raises(ValueError, match="sigma must"):
        replace(scenario.sensors[0], sigma=sigma)


def test_repeated_times_and_any_reference_time(scenario):
    """Two bearings of one instant are two bearings; the state may be wanted far from the measurements."""
    radar = scenario.sensors[0]
    twice = replace(scenario, sensors=[tma.Sensor(tma.Bearing(), np.repeat(radar.times, 2), radar.sigma)])
    apart = replace(scenario, sensors=[radar, replace(radar, name="other")])
    angles = apart.simulate(20, seed=9)
    found = tma.fit(twice, angles.reshape(20, 2, -1).transpose(0, 2, 1).reshape(20, -1), tolerance=1e-6)
    np.testing.assert_allclose(found.state, tma.fit(apart, angles, tolerance=1e-6).state, rtol=1e-5)
    for reference in (-1e5, 0.0, 5e4, 1.7e9):
        other = tma.fit(replace(apart, reference_time=reference, target=None), angles, tolerance=1e-6)
        moved = other.at(600.0)
        np.testing.assert_allclose(moved.state, tma.fit(apart, angles, tolerance=1e-6).state, rtol=1e-5)
        np.testing.assert_allclose(moved.covariance, tma.crlb(apart, moved.state), rtol=1e-3)


def without_sigmas(scenario, which=(0, 1)):
    sensors = [replace(s, sigma=None) if k in which else s for k, s in enumerate(scenario.sensors)]
    return replace(scenario, sensors=sensors)


def test_an_unknown_sigma_is_that_of_the_residuals(scenario):
    """With one sensor: sum of squares over N - n, and the state of any sigma."""
    radar = replace(scenario, sensors=scenario.sensors[:1])
    run = radar.simulate(1, seed=7)[0]
    known, found = tma.fit(radar, run, tolerance=1e-6), tma.fit(without_sigmas(radar), run, tolerance=1e-6)
    np.testing.assert_allclose(found.state, known.state, rtol=1e-6)
    expected = radar.sensors[0].sigma * np.sqrt(known.cost / (len(run) - 4))
    assert found.scenario.sensors[0].sigma == pytest.approx(expected, rel=1e-3)
    np.testing.assert_allclose(found.covariance, known.covariance * known.cost / (len(run) - 4), rtol=1e-3)
    assert np.isnan(found.p_value)
    assert found.estimated == ("radar",)


def test_unknown_sigmas_of_two_sensors_are_right_on_average(scenario):
    """Both sigmas without bias, and intervals of the covariance that hold what they should."""
    runs, unknown = scenario.simulate(150, seed=8), without_sigmas(scenario)
    fits = [tma.fit(unknown, run) for run in runs]
    ratio = np.array(
        [[s.sigma / t.sigma for s, t in zip(f.scenario.sensors, scenario.sensors, strict=True)] for f in fits]
    )
    square = (ratio**2).mean(axis=0)
    np.testing.assert_array_less(np.abs(square - 1), 4 * (ratio**2).std(axis=0) / np.sqrt(150))
    off = np.array([(f.state - scenario.state) / f.sigma for f in fits])
    for inside in (np.abs(off) < 1.645).sum(axis=0):
        low, high = binomtest(int(inside), 150).proportion_ci(0.999)
        assert low < 0.9 < high, "about nine in ten"


def test_what_an_unknown_sigma_refuses(scenario):
    unknown = without_sigmas(scenario, which=[1])
    assert unknown.unknown_sigmas == ["sonar"]
    for call in (lambda: unknown.simulate(1, seed=1), lambda: tma.crlb(unknown)):
        with pytest.raises(ValueError, match=r"sigma of \['sonar'\] is not known"):
            call()
    with pytest.raises(ValueError, match="fit one run"):
        tma.fit(unknown, scenario.simulate(2, seed=1))
    run = scenario.simulate(1, seed=1)[0]
    run[63:] = np.nan
    with pytest.raises(ValueError, match="three measurements of sonar"):
        tma.fit(unknown, run)


def test_regions_and_profiles_leave_out_what_is_missing(scenario):
    angles = with_gaps(scenario, 3, 0.3, seed=10)
    place = scenario.state[:2] * [1.01, 0.99]
    profile = tma.profile_criterion(scenario, angles, place)
    for k, run in enumerate(angles):
        there = ~np.isnan(run)
        rest = scenario.keep(there)
        assert profile[k] == pytest.approx(tma.profile_criterion(rest, run[there], place), rel=1e-9)
    whole = tma.confidence_region(tma.fit(scenario, angles[0]))
    there = ~np.isnan(angles[0])
    part = tma.confidence_region(tma.fit(scenario.keep(there), angles[0][there]))
    assert whole.area == pytest.approx(part.area, rel=1e-9)
