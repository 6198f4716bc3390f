from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

import tmalib as tma
from tmalib.papers.conical_angles.paper import PAPER

ZO, D = 200.0, 4000.0


def valid_paths(most):
    """All ray paths with at most ``most`` bounces, by letting the bounces alternate."""
    yield (1, 0, 0)
    yield (-1, 0, 0)
    for delta in (1, -1):
        for bounces in range(1, most + 1):
            first, second = (bounces + 1) // 2, bounces // 2
            yield (delta, first, second) if delta == 1 else (delta, second, first)


@pytest.mark.parametrize("triplet", list(valid_paths(10)))
def test_image_depth_is_that_of_the_mirror_images(triplet):
    """Mirror the target at each surface in the order of the bounces: exact arithmetic."""
    delta, bottom, surface = triplet
    for z in (0, 100, 1234, 4000):
        image, downwards = z, delta == 1
        for _ in range(bottom + surface):
            image = 2 * int(D) - image if downwards else -image
            downwards = not downwards
        assert tma.image_depth(tma.RayPath(*triplet), z, ZO, D) == image - ZO


def test_every_other_path_is_refused():
    allowed = set(valid_paths(12))
    for delta in (1, -1):
        for bottom in range(6):
            for surface in range(6):
                if (delta, bottom, surface) in allowed:
                    tma.RayPath(delta, bottom, surface)
                else:
                    with pytest.raises(ValueError, match="no ray has the path"):
                        tma.RayPath(delta, bottom, surface)


def test_unfolded_ray_is_as_long_as_the_zigzag():
    """The bottom-bounced ray by Fermat's principle: the shortest way over the bottom."""
    from scipy.optimize import minimize_scalar

    horizontal, z = 8000.0, 100.0

    def zigzag(s):
        return np.hypot(s, D - z) + np.hypot(horizontal - s, D - ZO)

    length = minimize_scalar(zigzag, bounds=(0, horizontal), method="bounded", options={"xatol": 1e-9}).fun
    assert length == pytest.approx(
        np.hypot(horizontal, tma.image_depth(tma.BOTTOM_BOUNCE, z, ZO, D)), rel=1e-9
    )


def exact_cosine(state, site, lag, path):
    x, y, z, vx, vy = state
    dx, dy = x + lag * vx - site[0], y + lag * vy - site[1]
    image, downwards = z, path.delta == 1
    for _ in range(path.bottom + path.surface):
        image = 2 * mp.mpf(D) - image if downwards else -image
        downwards = not downwards
    zeta = image - mp.mpf(ZO)
    return (dx * site[2] + dy * site[3]) / mp.sqrt(dx**2 + dy**2 + zeta**2)


@pytest.mark.parametrize("triplet", [(1, 0, 0), (1, 1, 0), (-1, 0, 1), (1, 2, 1), (-1, 2, 2)])
def test_gradient_against_exact_differences(triplet):
    path = tma.RayPath(*triplet)
    full = tma.ConicalAngle(path, ZO, D)
    rng = np.random.default_rng(5)
    for _ in range(10):
        state = rng.uniform(-1, 1, 5) * [8e3, 8e3, 0, 6, 6] + [0, 0, rng.uniform(0, 500), 0, 0]
        heading, lag = rng.uniform(-3, 3), rng.uniform(0, 1000)
        site = np.array([*rng.uniform(-2e3, 2e3, 2), np.sin(heading), np.cos(heading)])
        value, gradient = full.value_and_gradient(state, site, lag)
        with mp.workdps(50):
            exact = []
            point = [mp.mpf(float(q)) for q in state]
            for i in range(5):
                ends = [
                    exact_cosine(
                        [q + sign * mp.mpf(10) ** -12 * (j == i) for j, q in enumerate(point)],
                        site,
                        lag,
                        path,
                    )
                    for sign in (1, -1)
                ]
                exact.append(float((ends[0] - ends[1]) / (2 * mp.mpf(10) ** -12)))
            assert value == pytest.approx(float(exact_cosine(point, site, lag, path)), abs=1e-14)
        np.testing.assert_allclose(gradient, exact, rtol=1e-9, atol=1e-18)
        reduced = tma.ConicalAngle(path, ZO, D, assumed_depth=float(state[2]))
        four_value, four = reduced.value_and_gradient(state[[0, 1, 3, 4]], site, lag)
        assert four_value == value
        np.testing.assert_array_equal(four, gradient[[0, 1, 3, 4]])


def array_scenario(**model):
    platform = tma.Course(
        (0, 0),
        5.0,
        np.radians(135),
        [tma.Straight(100), tma.Turn(405, np.radians(20) / 60), tma.Straight(295)],
    )
    target = tma.Target((5000, 7000), 4.0, np.radians(45), depth=100)
    sensor = tma.Sensor(tma.ConicalAngle(tma.BOTTOM_BOUNCE, ZO, D, **model), 4.0 * np.arange(201), 1.7e-2)
    return tma.Scenario(platform, [sensor], reference_time=0.0, target=target)


def test_what_is_measured_does_not_know_what_is_assumed():
    truth = array_scenario()
    wrong = array_scenario(assumed_depth=300.0)
    np.testing.assert_array_equal(truth.measure(), wrong.measure())
    assert np.abs(wrong.linearise(wrong.state)[0] - wrong.measure()).max() > 1e-4
    np.testing.assert_allclose(truth.linearise(truth.state)[0], truth.measure(), atol=1e-15)


def test_bounds_of_a_turning_array_agree_with_the_paper():
    """Table 4 of conical-angles, with the array's heading half a sample late."""
    bound = tma.crlb_sigma(array_scenario(assumed_depth=100.0, heading_lag=2.0))
    for row, ours in zip(("xT", "yT", "vxT", "vyT"), bound, strict=True):
        like = PAPER.printed("Table 4", row, "std_crlb")
        assert abs(ours - like.value) <= like.last_digit


def test_fit_of_conical_angles_finds_the_target():
    scenario = array_scenario(assumed_depth=100.0)
    fit = tma.fit(scenario, scenario.measure(), scenario.state + [300, -200, 1, 1], tolerance=1e-6)
    assert fit.converged
    np.testing.assert_allclose(fit.state, scenario.state, rtol=1e-5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: tma.RayPath(0, 0, 0), "delta must be"),
        (lambda: tma.RayPath(1, -1, 0), "bottom must be a number of bounces"),
        (lambda: tma.ConicalAngle(tma.DIRECT, -1.0, D), "array_depth must be between"),
        (lambda: tma.ConicalAngle(tma.DIRECT, ZO, 0.0), "bottom_depth must be greater"),
        (lambda: tma.ConicalAngle(tma.DIRECT, ZO, D, assumed_depth=5000.0), "assumed_depth must be between"),
        (lambda: tma.ConicalAngle(tma.DIRECT, ZO, D, heading_lag=-1.0), "heading_lag must be at least"),
        (lambda: replace(array_scenario(), target=tma.Target((1e3, 0), 1, 0)), "needs the target's depth"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
