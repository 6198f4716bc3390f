"""What a further unknown costs and does, against the bound, against fits and against the chi-square."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import tmalib as tma
from tmalib.nuisance import nuisance

SHIP = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
TIMES = np.arange(0, 600, 5.0)
TRUTH = tma.Target((2e3, 4e3), speed=6, heading=1.5)


def watch(true_bias=0.0, ship=SHIP):
    eye = tma.Sensor(tma.Bearing(), TIMES, np.radians(0.5), "eye")
    ear = tma.Sensor(tma.Biased(tma.DelayedBearing(), "bias", true_bias), TIMES, np.radians(1), "ear")
    return tma.Scenario(ship, [eye, ear], 595, TRUTH)


def without(scenario):
    """The scenario that ignores the bias."""
    eye, ear = scenario.sensors
    return replace(scenario, sensors=[eye, replace(ear, model=ear.model.model)])


def test_the_bounds_are_those_of_both_scenarios():
    found = nuisance(watch(), "bias")
    both = tma.crlb(watch())
    assert found.coordinates == ("x", "y", "vx", "vy")
    assert found.estimated == pytest.approx(both[:4, :4], rel=1e-8)
    assert found.sigma**2 == pytest.approx(both[4, 4], rel=1e-10)
    assert found.known == pytest.approx(tma.crlb(without(watch())), rel=1e-8)
    assert found.freedom == 2 * len(TIMES) - 4


def test_shift_and_noncentrality_are_those_of_a_fit_without_noise():
    found, size = nuisance(watch(), "bias"), 1e-6
    exact = tma.fit(without(watch()), watch(size).measure(), watch().state[:4], tolerance=1e-10)
    assert exact.state - TRUTH.state(595) == pytest.approx(size * found.shift, rel=1e-3)
    assert exact.cost == pytest.approx((size / found.sigma) ** 2, rel=1e-3)
    assert found.displaced == pytest.approx(np.sqrt(tma.nees(found.shift, np.zeros(4), found.known)))


def test_no_direction_pays_more_than_the_price():
    found, directions = nuisance(watch(), "bias"), np.random.default_rng(1).normal(size=(2000, 4))
    directions /= np.sqrt(np.diag(found.known))
    ratio = np.sqrt(np.vecdot(directions @ found.estimated, directions))
    ratio /= np.sqrt(np.vecdot(directions @ found.known, directions))
    hardest = np.linalg.solve(found.known, found.shift)
    most = hardest @ found.estimated @ hardest / (hardest @ found.known @ hardest)
    assert np.all((ratio >= 1 - 1e-9) & (ratio <= found.price * (1 + 1e-9)))
    assert np.sqrt(most) == pytest.approx(found.price)


@pytest.mark.parametrize("multiple", [0, 5, 10])
def test_the_criterion_notices_as_often_as_said(multiple):
    found, runs = nuisance(watch(), "bias"), 2000
    off = watch(multiple * found.sigma)
    fits = tma.fit(without(off), off.simulate(runs, seed=7), watch().state[:4])
    chance = found.noticed(multiple * found.sigma, false_alarms=0.05)
    spread = np.sqrt(chance * (1 - chance) / runs)
    assert abs(np.mean(fits.p_value < 0.05) - chance) < norm.isf(5e-5) * spread


def test_any_component_can_be_the_unknown():
    found = nuisance(watch(), "vx")
    assert found.coordinates == ("x", "y", "vy", "bias")
    assert found.sigma == pytest.approx(tma.crlb_sigma(watch())[2], rel=1e-9)


def test_what_cannot_be_answered_is_refused():
    with pytest.raises(ValueError, match="name must be one of several"):
        nuisance(watch(), "compass")
    with pytest.raises(ValueError, match="one state"):
        nuisance(watch(), "bias", np.tile(watch().state, (2, 1)))
    still = replace(watch(), platform=tma.Course((0, 0), 0.0, 0.0, [tma.Straight(600)]))
    with pytest.raises(ValueError, match="not observable"):
        nuisance(replace(still, sensors=still.sensors[1:]), "bias")
