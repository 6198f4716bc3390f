"""Position from three rays: against the cone model, of which no formula is used, and at its limits."""

from itertools import combinations

import numpy as np
import pytest

import tmalib as tma
from tmalib.multipath import array_image

PATHS = [tma.DIRECT, tma.BOTTOM_BOUNCE, tma.SURFACE_BOUNCE, tma.RayPath(1, 1, 1), tma.RayPath(-1, 1, 1),
         tma.RayPath(1, 2, 1), tma.RayPath(-1, 1, 2)]  # fmt: skip


def cosines_of(paths, target, array, array_depth, bottom):
    models = [tma.ConicalAngle(path, array_depth, bottom) for path in paths]
    return np.array([model.observe(target, array, [0.0])[0] for model in models])


@pytest.mark.parametrize("paths", list(combinations(PATHS, 3)), ids=str)
def test_any_three_rays_give_any_target_back(paths):
    rng = np.random.default_rng(3)
    for _ in range(5):
        bottom, heading = rng.uniform(500, 4000), rng.uniform(0, 2 * np.pi)
        array_depth, depth = rng.uniform(0.1, 0.9, 2) * bottom
        place, here = rng.uniform(-5e3, 5e3, (2, 2))
        array = tma.Course(here, 5.0, heading, [tma.Straight(60)])
        cosines = cosines_of(paths, tma.Target(place, 3.0, 1.0, depth=depth), array, array_depth, bottom)
        found = tma.position_from_rays(paths, cosines, array_depth, bottom)
        east, north = place - here
        along = east * np.sin(heading) + north * np.cos(heading)
        across = abs(east * np.cos(heading) - north * np.sin(heading))
        np.testing.assert_allclose(found, [along, across, depth], rtol=1e-5, atol=1e-2)


def test_images_are_where_a_mirror_puts_the_array():
    """The array mirrored at the bottom is at 2 D - zO, at the surface at -zO; then on."""
    images = [-array_image(path, 200, 4000) for path in PATHS[:6]]
    assert images == [200, 7800, -200, 8200, -7800, 15800]


def test_small_noise_gives_the_spread_of_the_bound():
    """Three measurements of three unknowns: the covariance is that of the inverse Jacobian."""
    paths, sigma = [tma.DIRECT, tma.BOTTOM_BOUNCE, tma.RayPath(-1, 1, 1)], 1e-5
    array, target = tma.Course((0, 0), 5, 0.3, [tma.Straight(60)]), tma.Target((3e3, 4e3), 4, 1.0, depth=100)
    exact = cosines_of(paths, target, array, 200, 2000)
    models = [tma.ConicalAngle(path, 200, 2000) for path in paths]
    state, observer = (3e3, 4e3, 100.0, 0.0, 0.0), models[0].observer_state(array, np.zeros(1))
    slopes = [
        model.value_and_gradient(np.array(state)[:, None], observer, np.zeros(1))[1][:3, 0]
        for model in models
    ]
    wanted = sigma * np.linalg.norm(np.linalg.inv(slopes)[2])
    noise = sigma * np.random.default_rng(1).standard_normal((20_000, 3))
    found = tma.position_from_rays(paths, exact + noise, 200, 2000)
    assert found.depth.std() == pytest.approx(wanted, rel=0.03)  # six standard errors


def test_more_rays_are_fitted_together():
    array, target = tma.Course((0, 0), 5, 0.0, [tma.Straight(60)]), tma.Target((3e3, 4e3), 4, 1.0, depth=100)
    noise = 1e-3 * np.random.default_rng(2).standard_normal((4000, 6))
    spreads = []
    for count in (3, 6):
        exact = cosines_of(PATHS[:count], target, array, 200, 2000)
        found = tma.position_from_rays(PATHS[:count], exact + noise[:, :count], 200, 2000)
        spreads.append(np.nanstd(found.depth))
        assert np.isfinite(found.depth).mean() > 0.9
    assert spreads[1] < 0.2 * spreads[0]


def test_what_noise_leaves_no_position_is_nan_and_harms_no_other():
    paths = [tma.DIRECT, tma.BOTTOM_BOUNCE, tma.RayPath(-1, 1, 1)]
    rows = np.array([[0.5, 0.6, 0.6], [0.0, 0.0, 0.0], [np.nan, 0.3, 0.2], [0.64, 0.53, 0.54]])
    found = tma.position_from_rays(paths, rows, 200, 2000)
    assert np.isnan(found.depth).tolist() == [True, True, True, False]
    alone = tma.position_from_rays(paths, rows[3], 200, 2000)
    np.testing.assert_array_equal([part[3] for part in found], alone)


@pytest.mark.parametrize(
    ("paths", "depth", "message"),
    [
        (PATHS[:2], 200, "these have 2"),
        ([PATHS[0], PATHS[0], PATHS[1]], 200, "these have 2"),
        (PATHS[:3], 0, "these have 2"),  # an array at the surface: direct and surface bounce are one
        ([*PATHS[:2], "up"], 200, "paths"),
    ],
)
def test_too_few_different_rays_are_refused(paths, depth, message):
    with pytest.raises(ValueError, match=message):
        tma.position_from_rays(paths, [0.5] * len(paths), depth, 2000)


def test_another_number_of_cosines_is_refused():
    with pytest.raises(ValueError, match=r"shape \(..., 3\), one a path, got \(2,\)"):
        tma.position_from_rays(PATHS[:3], [0.5, 0.4], 200, 2000)
