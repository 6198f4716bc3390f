"""Regions: the tasks against the library they are made of, the priors, the count of evaluations."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.beyond import regions


def test_squares_are_those_of_single_fits():
    found = regions.squares(3, 5, 280)
    now = regions.early(280)
    for k, measured in enumerate(now.simulate(5, 3)):
        one = tma.fit(now, measured)
        ellipse = one.at(280).ellipse(0.9)
        away = (now.state[:2] - ellipse.centre) @ [
            [np.sin(ellipse.heading), np.cos(ellipse.heading)],
            [np.cos(ellipse.heading), -np.sin(ellipse.heading)],
        ]
        assert (np.sum((away / ellipse.semi_axes) ** 2) <= 1) == (found["ellipse"][k] <= regions.LEVEL)
        held = tma.confidence_region(one).contains(now.state[:2])
        assert held == (found["region"][k] <= regions.LEVEL)


def test_the_relative_range_is_that_of_polar_coordinates():
    now = regions.early(280)
    here = now.platform.position_at(280)
    bound = tma.crlb(now)
    rng = np.random.default_rng(1)
    scale = 1e-4
    states = rng.multivariate_normal(now.state, scale**2 * bound, 40_000)
    away = np.hypot(*(states[:, :2] - here).T)
    assert regions.bound_over_range(now) == pytest.approx(away.std() / scale / away.mean(), rel=0.02)
    area = tma.confidence_ellipse(now.state, bound, 0.9).area
    assert regions.ellipse_area(bound) == pytest.approx(area, rel=1e-6)


def test_priors_have_their_limits():
    now = regions.early(280)
    x, y = now.platform.position_at(280)
    states = np.array([[x + 1e3, y, 3, 4], [x - 1e3, y, 3, 4], [x + 61e3, y, 0, 0], [x + 1e3, y, 12, 10]])
    assert regions.flat(now)(states).tolist() == [0, 0, -np.inf, -np.inf]
    assert regions.flat(now, side=True)(states).tolist() == [0, -np.inf, -np.inf, -np.inf]
    assert regions.of_ships(states)[0] == -25 / 32


def test_evaluations_are_counted():
    """Of one linearisation it is one, and the fit itself is not among them."""
    now = regions.early(280)
    measured = now.simulate(1, 2)[0]
    alone, more = regions.evaluations(280, measured, lambda found: found.scenario.linearise(found.state))
    assert more == pytest.approx(1)
    assert alone > 3


@pytest.mark.slow
def test_tasks_give_a_row_a_run():
    one = regions.posteriors(1, 3, 360, 2000)
    assert {len(values) for values in one.values()} == {3}
    assert np.all(one["flat_size"] > regions.LEAST)
    drawn = regions.drawn_targets(1, 3, 280.0, 2000)
    assert {len(values) for values in drawn.values()} == {3}
    ray = regions.one_ray_posteriors(1, 2, 3000)
    assert {len(values) for values in ray.values()} == {2}
    assert len(regions.region_areas(1, 2, 360)["area"]) == 2
