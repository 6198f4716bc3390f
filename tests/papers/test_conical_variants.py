"""Variants of Section 5.2 of conical-angles, rows of its tables, the long axis of an ellipse."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.judging import Ours, judge, of_runs
from tmalib.papers.conical_angles import drawing, experiments, tables, variants
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.conical_angles.paper import PAPER

TRUTH = conical.section_5_2(2000.0, assumed_depth=300.0).state


def by_hand(array_depth, target_depth, assumed_depth, pairs=76):
    """Section 5.2 with the bottom at 2000 m, put together by hand."""
    array = tma.Course((0, 0), 0.0, 0.0, [tma.Straight(300.0)])
    sensors = [
        tma.Sensor(
            tma.ConicalAngle(ray, array_depth, 2000.0, assumed_depth), 4.0 * np.arange(pairs), conical.SIGMA
        )
        for ray in (tma.DIRECT, tma.BOTTOM_BOUNCE)
    ]
    target = tma.Target((5e3, 7e3), 4.0, np.radians(45), depth=target_depth)
    return tma.Scenario(array, sensors, 0.0, target)


def test_without_a_change_it_is_the_experiment_of_the_section():
    found = experiments.two_rays(3, 20, bottom_depth=2000.0)["state"]
    np.testing.assert_array_equal(variants.attempt(3, 20, 2000.0)["errors"], found - TRUTH)


def test_fewer_pairs_are_the_first_of_both_rays():
    measured = by_hand(200.0, 100.0, 300.0).simulate(20, 3)
    kept = np.concatenate([measured[:, :40], measured[:, 76:116]], axis=1)
    found = tma.fit(by_hand(200.0, 100.0, 300.0, pairs=40), kept, variants.START)
    np.testing.assert_allclose(variants.attempt(3, 20, 2000.0, pairs=40)["errors"], found.state - TRUTH)


def test_exchanged_depths_in_the_data_only():
    measured = by_hand(100.0, 200.0, 300.0).simulate(20, 3)
    found = tma.fit(by_hand(200.0, 100.0, 300.0), measured, variants.START)
    changed = variants.attempt(3, 20, 2000.0, exchanged=(False, True))["errors"]
    np.testing.assert_allclose(changed, found.state - TRUTH, rtol=1e-6)


@pytest.mark.parametrize("steps", [1, 2, 3])
def test_steps_are_those_of_gauss_newton(steps):
    scenario = by_hand(200.0, 100.0, 300.0)
    measured, state = scenario.simulate(1, 3)[0], np.array(variants.START)
    for _ in range(steps):
        value, gradient = scenario.linearise(state)
        state = state + np.linalg.lstsq(gradient, measured - value)[0]
    found = variants.attempt(3, 1, 2000.0, steps=steps)["errors"][0]
    np.testing.assert_allclose(found, state - TRUTH, rtol=1e-6)


def test_which_bounds_agree_with_the_printed_ones():
    """Table 3 has x, y and z to two decimals but 1173.60 m, and the velocities to two."""
    printed = np.array([868.12, 1173.60, 545.99, 1.65, 2.68])
    assert tables.bounds_agree("Table 3", printed + 0.009).all()
    off = printed + [0.02, 0, 0, -0.02, 0]
    assert tables.bounds_agree("Table 3", off).tolist() == [False, True, True, False, True]
    assert tables.bounds_agree("Table 4", [606.4, 762.57, 1.58, 2.6]).tolist() == [True, True, True, False]


def test_values_by_row():
    assert tables.by_row([1, 2, 3, 4]) == {"xT": 1, "yT": 2, "vxT": 3, "vyT": 4}
    with pytest.raises(ValueError, match="zip"):
        tables.by_row([1, 2, 3, 4, 5])


def test_the_largest_deviation_is_in_standard_errors():
    """Printed are 401.12 m and 557.24 m; a unit of the last digit is let pass."""
    runs = np.random.default_rng(1).standard_normal((20_000, 2))
    runs -= runs.mean(axis=0)
    ours = {
        ("xT", "true"): Ours(5000.0),
        ("xT", "bias"): of_runs(401.13 + 2.0 + 80 * runs[:, 0]),
        ("yT", "bias"): of_runs(557.23 - 30.0 + 200 * runs[:, 1]),
    }
    expected = 30 / (200 * np.sqrt(1 / 500 + 1 / 20_000))
    found = tables.largest_deviation(judge(PAPER, "Table 5", ours))
    assert found == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("centre", [(5e3, 7e3), (-5e3, 7e3), (5e3, -7e3)])
def test_outward_is_along_the_ellipse_and_away_from_the_array(centre):
    along = np.array(centre) / np.hypot(*centre)
    shape = tma.confidence_ellipse(centre, 1e4 * np.outer(along, along) + np.eye(2))
    np.testing.assert_allclose(drawing.outward(shape), along, atol=1e-12)


def test_factors_have_the_spread_asked_for_and_are_not_the_noise():
    factors = variants.random_factors(PAPER.stream("example"), 4000, 0.97, 0.02)
    assert factors.shape == (4000, 1)
    assert abs(factors.mean() - 0.97) < 4 * 0.02 / np.sqrt(4000)
    assert abs(factors.std() / 0.02 - 1) < 4 / np.sqrt(8000)
    noise = np.random.default_rng(PAPER.stream("example").chunk()).normal(size=4000)
    assert abs(np.corrcoef(factors[:, 0], noise)[0, 1]) < 4 / np.sqrt(4000)
