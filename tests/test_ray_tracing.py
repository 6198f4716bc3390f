"""Curved rays against the ray equations integrated, against circles, straight images and a fan of rays."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import tmalib as tma
from tmalib.ray_tracing import effective_speed, eigenrays, farthest, trace_ray
from tmalib.sound_profile import SoundSpeedProfile

OCEAN = SoundSpeedProfile(
    [0, 50, 120, 200, 400, 1000, 2000, 3000], [1538, 1539, 1525, 1512, 1492, 1484, 1491, 1506]
)
POLAR = SoundSpeedProfile([0, 40, 150, 300, 1000, 2500], [1433, 1437, 1440, 1455, 1462, 1485])


def shot(profile, depth, angle, distance, bottom):
    """Depth, angle and time at a distance, by integrating the ray equations; it bounces off the bottom."""
    z, c = profile.depths, profile.speeds

    def slopes(_, y):
        slope = (c[1:] - c[:-1]) / np.diff(z)
        speed, steep = np.interp(y[0], z, c), slope[np.clip(np.searchsorted(z, y[0]) - 1, 0, len(slope) - 1)]
        return [np.tan(y[1]), -steep / speed, 1 / (speed * np.cos(y[1]))]

    def floor(_, y):
        return y[0] - bottom

    floor.terminal, floor.direction = True, 1
    x, y = 0.0, np.array([depth, angle, 0.0])
    while x < distance:
        found = solve_ivp(slopes, (x, distance), y, rtol=1e-10, atol=1e-10, max_step=20, events=floor)
        x, y = found.t[-1], found.y[:, -1] * [1, -1 if found.status == 1 else 1, 1]
    return y


@pytest.mark.parametrize(
    ("profile", "path", "turns", "distance"),
    [
        (OCEAN, tma.DIRECT, 0, 700.0),
        (OCEAN, tma.DIRECT, 1, 2000.0),
        (OCEAN, tma.BOTTOM_BOUNCE, 0, 6000.0),
        (OCEAN, tma.BOTTOM_BOUNCE, 1, 21500.0),
        (POLAR, tma.DIRECT, 1, 9000.0),
        (POLAR, tma.BOTTOM_BOUNCE, 0, 9000.0),
    ],
)
def test_against_the_ray_equations_integrated(profile, path, turns, distance):
    rays = eigenrays(profile, path, 100, 200, 2400, distance, turns)
    assert len(rays.slowness)
    for departure, arrival, time, slowness in zip(
        rays.departure, rays.arrival, rays.time, rays.slowness, strict=True
    ):
        depth, angle, late = shot(profile, 100, departure, distance, 2400)
        assert depth == pytest.approx(200, abs=0.02 * max(1, distance / 1e4))
        assert angle == pytest.approx(arrival, abs=1e-5)
        assert late == pytest.approx(time, rel=1e-6)
        assert slowness == pytest.approx(np.cos(departure) / profile.speed_at(100), rel=1e-12)


def test_circles_where_the_gradient_is_constant():
    """The ray is an arc of the circle through both points with its centre where the speed would be zero."""
    rng = np.random.default_rng(3)
    profile = SoundSpeedProfile([0, 700, 5000], 1480 + 0.02 * np.array([0, 700, 5000]))
    for _ in range(20):
        target, array, distance = *rng.uniform(0, 1000, 2), rng.uniform(500, 20e3)
        centre = -1480 / 0.02
        across = (distance**2 + (array - centre) ** 2 - (target - centre) ** 2) / (2 * distance)
        departure = np.arctan2(across, target - centre)
        found = [eigenrays(profile, tma.DIRECT, target, array, 5000, distance, turns) for turns in (0, 1)]
        (angle,) = np.concatenate([each.departure for each in found])
        assert angle == pytest.approx(departure, abs=1e-9)
        chord, between = (
            np.hypot(distance, array - target),
            0.02**2 / (2 * profile.speed_at(target) * profile.speed_at(array)),
        )
        (time,) = np.concatenate([each.time for each in found])
        assert time == pytest.approx(np.arccosh(1 + between * chord**2) / 0.02, rel=1e-9)


@pytest.mark.parametrize(
    "triplet", [(1, 0, 0), (1, 1, 0), (-1, 0, 1), (1, 1, 1), (-1, 1, 1), (1, 2, 1), (-1, 2, 2)]
)
def test_straight_images_where_the_speed_is_constant(triplet):
    path = tma.RayPath(*triplet)
    profile = SoundSpeedProfile([0, 300, 4000], [1500, 1500, 1500])
    distance = np.array([0.0, 100.0, 8000.0, 50e3])
    rays = eigenrays(profile, path, 100, 200, 4000, distance)
    length = np.hypot(distance, tma.image_depth(path, 100, 200, 4000))
    np.testing.assert_allclose(rays.slowness[:, 0] * 1500, distance / length, rtol=1e-12)
    np.testing.assert_allclose(rays.time[:, 0], length / 1500, rtol=1e-10)  # rounding over the sine squared
    assert effective_speed(profile, path, 100, 200, 4000) == pytest.approx(1500, rel=1e-14)
    assert np.isinf(farthest(profile, path, 100, 200, 4000))


@pytest.mark.parametrize("turns", [0, 1, 2])
@pytest.mark.parametrize("profile", [OCEAN, POLAR])
def test_reciprocity(profile, turns):
    """Source and receiver exchanged: the same rays, the other way round."""
    for path, back in ((tma.DIRECT, tma.DIRECT), (tma.BOTTOM_BOUNCE, tma.BOTTOM_BOUNCE)):
        for distance in (900.0, 3000.0, 12e3):
            there = eigenrays(profile, path, 100, 250, 2400, distance, turns)
            returned = eigenrays(profile, back, 250, 100, 2400, distance, turns)
            np.testing.assert_allclose(there.slowness, returned.slowness, rtol=1e-11)
            np.testing.assert_allclose(there.time, returned.time, rtol=1e-11)
            np.testing.assert_allclose(there.departure, -returned.arrival, atol=1e-7)


def test_a_smooth_profile_by_quadrature():
    """Munk's canonical profile in fine layers, against the integrals of Snell's law."""

    def speed(z):
        eta = 2 * (z - 1300) / 1300
        return 1500 * (1 + 0.00737 * (eta + np.exp(-eta) - 1))

    z = np.linspace(0, 4000, 4001)
    profile = SoundSpeedProfile(z, speed(z))
    (ray,) = eigenrays(profile, tma.BOTTOM_BOUNCE, 100, 200, 4000, 9000.0).slowness

    def sine(z):
        return np.sqrt(1 - (ray * speed(z)) ** 2)

    far = sum(quad(lambda z: ray * speed(z) / sine(z), depth, 4000)[0] for depth in (100, 200))
    late = sum(quad(lambda z: 1 / (speed(z) * sine(z)), depth, 4000)[0] for depth in (100, 200))
    assert far == pytest.approx(9000, rel=1e-6)
    assert eigenrays(profile, tma.BOTTOM_BOUNCE, 100, 200, 4000, 9000.0).time[0] == pytest.approx(
        late, rel=1e-6
    )


@pytest.mark.parametrize("profile", [OCEAN, POLAR])
def test_no_direct_ray_is_missed_or_invented(profile):
    """A fan of traced rays crosses the array's depth at its distance as often as rays are found."""
    angles = np.radians(np.concatenate([np.linspace(-20, -1e-3, 1500), np.linspace(1e-3, 20, 1500)]))
    fine = np.union1d(profile.depths, np.arange(0, 2401.0, 25))
    fine = SoundSpeedProfile(fine, profile.speed_at(fine))
    for distance in (1000.0, 2500.0, 9000.0):
        rays = [eigenrays(profile, tma.DIRECT, 100, 200, 2400, distance, turns) for turns in range(4)]
        found = np.sort(np.concatenate([each.departure for each in rays]))
        below = []
        for angle in angles:
            x, z = trace_ray(fine, 100, angle, distance, 2400).T
            bounced = np.any((z[x < distance] <= 0) | (z[x < distance] >= 2400))
            below.append(np.nan if bounced else np.interp(distance, x, z) - 200)
        below = np.array(below)
        crossing = np.flatnonzero(below[:-1] * below[1:] < 0)
        crossing = [i for i in crossing if not np.any(np.abs(below[i : i + 2]) > 60)]  # not where rays part
        assert len(crossing) == len(found)
        np.testing.assert_allclose(found, angles[crossing], atol=5e-4)


def test_the_effective_speed_leaves_what_is_of_second_order():
    distance = np.array([2e3, 6e3, 12e3])
    below = tma.image_depth(tma.BOTTOM_BOUNCE, 100, 200, 2400)
    straight = distance / np.hypot(distance, below)
    left = []
    for share in (1.0, 0.5):
        profile = SoundSpeedProfile(OCEAN.depths, 1500 + share * (OCEAN.speeds - 1500))
        speed = effective_speed(profile, tma.BOTTOM_BOUNCE, 100, 200, 2400)
        ray = eigenrays(profile, tma.BOTTOM_BOUNCE, 100, 200, 2400, distance).slowness[:, 0]
        left.append(np.abs(ray * speed - straight))
        assert np.all(left[-1] < 0.1 * np.abs(ray * profile.speed_at(200) - straight))
    assert np.all((left[0] / left[1] > 3.5) & (left[0] / left[1] < 5.5)), (
        "a quarter of it for half of the variation"
    )


def test_the_mean_along_a_path_by_quadrature():
    depths = [(100, 3000), (200, 3000)]
    sums = [quad(OCEAN.speed_at, *ends, points=[120, 200, 400, 1000, 2000])[0] for ends in depths]
    expected = sum(sums) / sum(lower - upper for upper, lower in depths)
    assert effective_speed(OCEAN, tma.BOTTOM_BOUNCE, 100, 200, 3000) == pytest.approx(expected, rel=1e-9)
    assert effective_speed(OCEAN, tma.DIRECT, 150, 150, 3000) == OCEAN.speed_at(150)


def test_a_traced_ray_meets_the_array():
    (ray,) = eigenrays(OCEAN, tma.BOTTOM_BOUNCE, 100, 200, 2400, 6000.0).departure
    fine = np.union1d(OCEAN.depths, np.arange(0, 2401.0, 1))
    x, z = trace_ray(SoundSpeedProfile(fine, OCEAN.speed_at(fine)), 100, ray, 6000, 2400).T
    assert np.interp(6000, x, z) == pytest.approx(200, abs=1e-3)
    assert z.max() == 2400


def test_no_ray_is_nan_or_an_empty_axis():
    beyond = farthest(OCEAN, tma.BOTTOM_BOUNCE, 100, 200, 2400) + 1
    rays = eigenrays(OCEAN, tma.BOTTOM_BOUNCE, 100, 200, 2400, [5000, beyond])
    np.testing.assert_array_equal(np.isfinite(rays.slowness), [[True], [False]])
    assert eigenrays(OCEAN, tma.BOTTOM_BOUNCE, 100, 200, 2400, beyond).slowness.shape == (0,)
    assert eigenrays(OCEAN, tma.DIRECT, 100, 200, 2400, np.ones((2, 3)) * 1e4, 1).time.shape == (2, 3, 0)
    assert farthest(SoundSpeedProfile([0, 100], [1500, 1500]), tma.DIRECT, 10, 20, 100, turns=1) == 0


def test_one_distance_does_not_change_another():
    distance = np.array([500.0, 2000.0, 2400.0, 9000.0])
    together = eigenrays(OCEAN, tma.DIRECT, 100, 200, 2400, distance, 1)
    for i, each in enumerate(distance):
        alone = eigenrays(OCEAN, tma.DIRECT, 100, 200, 2400, each, 1).slowness
        found = together.slowness[i]
        np.testing.assert_array_equal(found[np.isfinite(found)], alone)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: SoundSpeedProfile([0, 0], [1500, 1500]), "depths must be at least two that increase from 0"),
        (
            lambda: SoundSpeedProfile([10, 20], [1500, 1500]),
            "depths must be at least two that increase from 0",
        ),
        (lambda: SoundSpeedProfile([0, 20], [1500, -1]), "speeds must be positive"),
        (lambda: SoundSpeedProfile([0, 20], [1500]), "speeds must have shape"),
        (lambda: OCEAN.speed_at(4000), "depth must be between 0 and 3000"),
        (lambda: eigenrays(OCEAN, tma.DIRECT, 100, 200, 4000, 1e3), "bottom_depth must be at most 3000"),
        (
            lambda: eigenrays(OCEAN, tma.DIRECT, 100, 2500, 2400, 1e3),
            "array_depth must be at most bottom_depth",
        ),
        (lambda: eigenrays(OCEAN, tma.DIRECT, -1, 200, 2400, 1e3), "target_depth must be at least 0"),
        (
            lambda: eigenrays(OCEAN, tma.DIRECT, 100, 200, 2400, [1, -1]),
            "distance must be finite and not negative",
        ),
        (
            lambda: eigenrays(OCEAN, tma.DIRECT, 100, 200, 2400, np.nan),
            "distance must be finite and not negative",
        ),
        (lambda: eigenrays(OCEAN, "direct", 100, 200, 2400, 1e3), "path must be a RayPath"),
        (lambda: eigenrays(OCEAN, tma.DIRECT, 100, 200, 2400, 1e3, 0.5), "turns must be an integer"),
        (lambda: eigenrays("fresh", tma.DIRECT, 100, 200, 2400, 1e3), "profile must be a SoundSpeedProfile"),
        (lambda: trace_ray(OCEAN, 100, 0.0, 1e3, 2400), "angle must be between 0 and pi / 2"),
        (lambda: trace_ray(OCEAN, 100, 0.1, np.nan, 2400), "distance must be finite"),
    ],
)
def test_what_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
