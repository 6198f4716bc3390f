"""Tests of residuals: how often they speak where all is well, and what they find."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

import tmalib as tma
from tmalib.papers.emw_acoustic import scenarios as emw

KINDS = ("size", "drift", "correlation", "largest")
RUNS = 2000


# -- where all is well -------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["two sensors", "few of one sensor"])
def well(request, scenario):
    true = scenario if request.param == "two sensors" else emw.scenario(4)
    return tma.residual_tests(tma.fit(true, true.simulate(RUNS, seed=5)))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("level", [0.05, 0.01])
def test_p_values_are_uniform(well, kind, level):
    """The share below a level is the level, in an interval that it leaves once in ten thousand cases.

    That of the correlation may be half as large again at 0.01; see the module.
    """
    p = getattr(well, kind).p_value
    most = 1.5 * level if (kind, level) == ("correlation", 0.01) else level
    for column in p.T[~np.isnan(p).all(axis=0)]:
        assert np.isfinite(column).all()
        few, many = binom.ppf([5e-5, 1 - 5e-5], RUNS, [level, most])
        assert few <= np.sum(column < level) <= many


def test_a_good_fit_is_seldom_called_suspicious(scenario):
    fits = [tma.fit(scenario, angles) for angles in scenario.simulate(150, seed=6)]
    said = sum(bool(tma.residual_tests(fit).warnings()) for fit in fits)
    assert said <= binom.ppf(1 - 5e-5, 150, 0.012)


# -- what they find ----------------------------------------------------------------------------------


def share(scenario, angles, kind, column=-1):
    """Share of the runs that a test rejects at 0.001."""
    p = getattr(tma.residual_tests(tma.fit(scenario, angles)), kind).p_value[:, column]
    return np.mean(p[np.isfinite(p)] < 0.001)


def scaled(scenario, factor):
    return replace(scenario, sensors=[replace(s, sigma=factor * s.sigma) for s in scenario.sensors])


def test_wild_bearings_are_found(scenario):
    """Three in a hundred anywhere: of 77 there is none in one run of ten."""
    angles, rng = scenario.simulate(300, seed=7), np.random.default_rng(8)
    wild = rng.random(angles.shape) < 0.03
    angles = np.where(wild, rng.uniform(-np.pi, np.pi, angles.shape), angles)
    some = wild.any(axis=1)
    assert share(scenario, angles[some], "largest") > 0.95
    assert share(scenario, angles[~some], "largest") < 0.1


def test_a_turning_target_is_found(scenario):
    """By drift, where noise is small."""
    before = scenario.target.position_at(-100.0)
    legs = [tma.Straight(400, heading=2.5), tma.Straight(400, heading=1.0)]
    turning = tma.Course(before, 6.0, 2.5, legs, start_time=-100.0)
    sharp = scaled(scenario, 0.2)
    angles = sharp.with_target(turning).simulate(300, seed=9)
    assert share(sharp, angles, "drift") > 0.9
    assert share(sharp, sharp.simulate(300, seed=9), "drift") < 0.02


@pytest.mark.parametrize("columns", [slice(0, 61), slice(61, 77)])
def test_a_bias_of_one_of_two_sensors_is_found(scenario, columns):
    """By drift: the constant among the slow functions. Neither sensor alone can tell."""
    angles = scenario.simulate(300, seed=10)
    angles[:, columns] += np.radians(1.5)
    assert share(scenario, angles, "drift") > 0.95
    assert share(scenario, angles, "size", 0) < 0.02


def test_a_wrong_sigma_is_found_on_both_sides(scenario):
    angles = scenario.simulate(300, seed=11)
    small = tma.residual_tests(tma.fit(scaled(scenario, 0.5), angles))
    large = tma.residual_tests(tma.fit(scaled(scenario, 2.0), angles))
    for tests, above in ((small, True), (large, False)):
        assert np.mean(tests.size.p_value[:, -1] < 0.001) > 0.99
        assert ((tests.size.statistic > tests.size.freedom)[:, -1] == above).all()
    one = tma.residual_tests(tma.fit(scaled(scenario, 2.0), angles[0]))
    assert any("sigma is too large" in text for text in one.warnings())


def test_a_clock_that_is_off_is_found(scenario):
    """Bearings of the second sensor that are stamped twenty seconds late."""
    radar, sonar = scenario.sensors
    early = replace(sonar, times=sonar.times[1:] - 20.0)
    late = replace(scenario, sensors=[radar, replace(sonar, times=sonar.times[1:])], target=None)
    angles = replace(scenario, sensors=[radar, early]).simulate(300, seed=12)
    assert share(late, angles, "drift") > 0.95


def test_smoothed_bearings_are_found():
    """Means of three successive bearings, with the sigma of a mean: the size is right."""
    scenario = emw.scenario(1)
    angles = scenario.simulate(100, seed=13)
    for block in scenario.blocks:
        x = angles[:, block.columns] - scenario.measure()[block.columns]
        x = (x + np.roll(x, 1, axis=1) + np.roll(x, 2, axis=1)) / np.sqrt(3)
        angles[:, block.columns] = scenario.measure()[block.columns] + x
    assert share(scenario, angles, "correlation") > 0.99
