"""Depth from rays: the tasks against the bound, and the minima against a search from everywhere."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.beyond import depth
from tmalib.papers.conical_angles import scenarios as paper


def test_two_rays_are_the_papers_scenario():
    ours, theirs = depth.far(), paper.section_5_2(2000)
    np.testing.assert_array_equal(ours.measure(), theirs.measure())
    np.testing.assert_array_equal(tma.crlb_sigma(ours), tma.crlb_sigma(theirs))


def test_along_the_null_direction_two_rays_are_blind_to_first_order_only():
    level, below = depth.close(depth=300.0), depth.close(depth=310.0)
    seen = [np.linalg.norm(now.linearise(now.state)[1] @ depth.null_direction(now)) for now in (level, below)]
    assert seen[0] < 1e-12 < 1e-6 < seen[1]
    assert tma.information_rank(level) == 4


def test_the_squared_depth_has_the_spread_of_a_fit_of_it():
    """At equal depths half of the estimates are there; the others scatter as the root of half a Gaussian."""
    now = depth.close(depth=300.0)
    error = depth.depth_errors(5, 1000, 300.0, paper.SIGMA)["error"]
    wanted = np.sqrt(depth.squared_depth_sigma(now) / np.sqrt(2 * np.pi))
    assert np.sqrt(np.mean(error**2)) == pytest.approx(wanted, rel=0.1)


def test_a_prior_makes_the_ellipse_honest_and_an_assumption_does_not():
    held = [
        depth.unknown_depth(7, 1000, **way)["held"].mean()
        for way in (dict(prior=True), dict(assumed=200.0), dict(third=("surface-bottom",)))
    ]
    assert abs(held[0] - 0.9) < 0.04
    assert held[1] < 0.86
    assert abs(held[2] - 0.9) < 0.04


@pytest.mark.slow
@pytest.mark.parametrize("third", [(), ("surface-bottom",)], ids=str)
def test_the_ghosts_minima_are_those_of_a_search_from_everywhere(third):
    now = depth.close(*third, depth=500.0)
    found = tma.fit(now, now.simulate(1, seed=3)[0])
    states, likelihood = depth.minima_at_ghosts(found)
    wanted = tma.alternatives(found, within=20, max_iterations=60)
    near = likelihood > np.exp(-10)
    assert near.sum() == 1 + len(wanted)
    for other in wanted:
        away = np.linalg.norm((states[near] - other.state) / found.sigma, axis=1)
        assert away.min() < 0.1
        assert likelihood[near][np.argmin(away)] == pytest.approx(other.likelihood, abs=1e-3)
