"""Proposition 1: folds and other minima. And the orders that the chapters measure."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.papers.robustness import minima, orders, theory
from tmalib.papers.robustness import scenarios as paper
from tmalib.papers.robustness.paper import PAPER
from tmalib.sensitivity import displaced_measurements

ONES = np.ones(500)
LOST_AT_A_FOLD, TWO_MINIMA = 5, 67  # places in the chapters' sequence of random geometries


@pytest.fixture(scope="module")
def geometries():
    rng = np.random.default_rng(PAPER.stream("robustness/geometries").chunk())
    return [paper.random_geometry(rng) for _ in range(TWO_MINIMA + 1)]


def test_the_curvature_vanishes_at_the_fold_with_the_square_root(geometries):
    """A minimum and a saddle that meet: the least curvature is as the root of the distance to the fold."""
    lost = geometries[LOST_AT_A_FOLD]
    scenario, displacement = lost.straight, lost.circle_displacement
    path = theory.follow(scenario, displacement, steps=40)
    fraction, state = minima.fold(scenario, displacement, path)
    last = int(np.isfinite(path[:, 0]).sum()) - 1
    assert last / 40 <= fraction < (last + 1) / 40
    there, curvature = path[last], []
    for before in (1.6e-3, 4e-4, 1e-4, 4e-5, 1e-5):  # of the displacement, before the fold
        measured = displaced_measurements(scenario, (fraction - before) * displacement)
        there = theory.newton_estimate(scenario, ONES, measured, there)
        curvature.append(1 / theory.deviation_ratios(scenario, ONES, measured, there)[1])
    np.testing.assert_allclose(there, state, rtol=1e-2)
    assert curvature[-2] / curvature[-1] == pytest.approx(2, rel=0.03)
    assert 0 < curvature[-1] < 0.03


def test_no_fold_is_an_error_that_says_so():
    geometry = paper.reference()
    path = theory.follow(geometry.straight, geometry.circle_displacement, steps=2)
    with pytest.raises(ValueError, match="there is no fold"):
        minima.fold(geometry.straight, geometry.circle_displacement, path)


def test_backwards_is_the_way_that_was_followed():
    geometry = paper.reference()
    scenario, displacement = geometry.straight, geometry.circle_displacement
    path = theory.follow(scenario, displacement, steps=5)
    nothing = np.full_like(path, np.nan)
    back = minima.follow_back(scenario, displacement, path[-1], nothing)
    np.testing.assert_allclose(back, path, rtol=1e-9)
    assert np.isnan(minima.follow_back(scenario, displacement, path[-1], path)).all(), "no other minimum"


def test_the_other_minimum_is_one_for_another_optimiser(geometries):
    two = geometries[TWO_MINIMA]
    scenario, displacement = two.straight, two.circle_displacement
    local = theory.follow(scenario, displacement, steps=10)
    measured = displaced_measurements(scenario, displacement)
    starts = theory.scattered_starts(scenario, measured, np.random.default_rng(1), 40)
    states, *_ = tma.distinct_minima(scenario, measured, starts, max_iterations=200)
    assert not np.allclose(states[0], local[-1], rtol=0.1), "the best of them is not the local one"
    back = minima.follow_back(scenario, displacement, states[0], local)
    exists = np.isfinite(back[:, 0])
    assert 0 < exists.sum() < len(back)
    assert exists[np.argmax(exists) :].all(), "it begins at some displacement and goes on to the full one"
    for k in np.flatnonzero(exists):
        seen = displaced_measurements(scenario, k / 10 * displacement)
        found = tma.fit(scenario, seen, start=back[k], tolerance=1e-6)
        assert found.converged
        assert np.all(np.abs(found.state - back[k]) < 0.01 * tma.crlb_sigma(scenario, back[k]))


def test_bearing_change_is_the_change_of_the_bearings():
    scenario = paper.reference().straight
    information = theory.information(scenario, ONES)
    shifts = 1e-3 * np.random.default_rng(1).standard_normal((3, 4))
    ahead, _ = scenario.linearise(scenario.state + shifts)
    behind, _ = scenario.linearise(scenario.state - shifts)
    changes = tma.wrap(ahead - behind) / 2
    expected = np.sqrt(np.sum(changes**2, axis=-1))
    np.testing.assert_allclose(orders.bearing_change(shifts, information), expected, rtol=1e-6)


def test_the_order_is_that_of_the_leading_term():
    sizes = 10.0 ** np.arange(-6, 0.0)
    assert orders.measured_order(sizes, 3 * sizes**1.5) == pytest.approx(1.5, abs=1e-12)
    disturbed = sizes**2 + sizes**3
    assert orders.measured_order(sizes, disturbed) == pytest.approx(2, abs=1e-3)
    assert orders.measured_order(sizes, disturbed, first=6) > 2.005, "the last sizes are not small"
