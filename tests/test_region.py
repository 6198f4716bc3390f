"""Confidence regions: exact for linear models, the ellipse in the limit, brute force, odd shapes."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import binom

import tmalib as tma
from tmalib.charts import ModifiedPolar
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.profile import Held, lowest_of

LEVEL = -2 * np.log(0.1)
PLACE = [0, 1]


@dataclass(frozen=True)
class Component:
    """The component of the target's displacement along a direction that turns: linear in the state."""

    coordinates = ("x", "y", "vx", "vy")

    def observer_state(self, platform, times):
        return np.stack([np.cos(times / 150), np.sin(times / 150)])

    def value_and_gradient(self, state, observer, elapsed):
        x, y, vx, vy = state
        cos, sin = (part + 0 * (x + elapsed) for part in observer)
        value = cos * (x + elapsed * vx) + sin * (y + elapsed * vy)
        return value, np.stack([cos, sin, elapsed * cos, elapsed * sin])

    def residual(self, measured, predicted):
        return measured - predicted

    def observe(self, target, platform, times):
        return np.sum(self.observer_state(platform, times) * target.position_at(times).T, axis=0)


def still(place):
    return tma.Course(place, 0, 0.0, [tma.Straight(np.inf)])


def shoelace(line):
    x, y = (line - line[0]).T
    return abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) / 2


@pytest.fixture(scope="module")
def linear():
    sensor = tma.Sensor(Component(), np.arange(0, 600, 20.0), 150.0)
    return tma.Scenario(still((0, 0)), [sensor], 300.0, tma.Target((2e3, 3e3), 5.0, 1.0))


@pytest.fixture(scope="module")
def early():
    """Scenario 4 when the bound of the range is 60 per cent of the range."""
    return emw.scenario(4).until(280)


@pytest.fixture(scope="module")
def mirrored():
    """Ranges from two known places: the target or its mirror image in the line through them."""
    times = np.arange(0, 600, 20.0)
    ears = [
        tma.Sensor(tma.Range(), times, 20.0, platform=still(place)) for place in ((-1e3, 0.0), (2e3, 500.0))
    ]
    return tma.Scenario(still((0, 0)), ears, 600.0, tma.Target((3e3, 4e3), 5.0, 1.0))


# -- what is exact -----------------------------------------------------------------------------------


def test_of_a_linear_model_the_profile_is_the_quadratic_form(linear):
    angles = linear.simulate(40, seed=1)
    found = tma.profile_criterion(linear, angles, linear.state[PLACE], start=linear.state)
    jacobian = linear.linearise(linear.state)[1] / linear.sigma[:, None]
    error = np.linalg.lstsq(jacobian, ((angles - linear.measure()) / linear.sigma).T, rcond=None)[0][PLACE]
    covariance = np.linalg.inv(jacobian.T @ jacobian)[:2, :2]
    exact = np.sum(error * np.linalg.solve(covariance, error), axis=0)
    np.testing.assert_allclose(found, exact, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("probability", [0.5, 0.99])
def test_of_a_linear_model_the_region_is_the_ellipse(linear, probability):
    fit = tma.fit(linear, linear.simulate(1, seed=2)[0], linear.state)
    region, ellipse = tma.confidence_region(fit, probability), fit.at(300.0).ellipse(probability)
    (line,) = region.boundary
    inverse = np.linalg.inv(fit.covariance[:2, :2])
    away = line - fit.state[PLACE]
    np.testing.assert_allclose(np.sum(away @ inverse * away, axis=1), region.level, rtol=1e-3)
    assert region.bounded
    assert 0.99 < region.area / ellipse.area < 1  # the line is inscribed
    assert shoelace(line) == pytest.approx(region.area, rel=2e-3)
    np.testing.assert_array_equal(line[0], line[-1])
    away = np.linalg.norm(ellipse.boundary(20001), axis=1)  # the platform is at the origin
    np.testing.assert_allclose(region.ranges, [[away.min(), away.max()]], rtol=1e-6)


def test_for_small_noise_the_region_is_the_ellipse(scenario):
    sharp = tma.Scenario(
        scenario.platform,
        [tma.Sensor(s.model, s.times, s.sigma / 300) for s in scenario.sensors],
        600.0,
        scenario.target,
    )
    fit = tma.fit(sharp, sharp.simulate(1, seed=3)[0])
    region, ellipse = tma.confidence_region(fit), fit.at(600.0).ellipse()
    np.testing.assert_allclose(region.profile(ellipse.boundary(40)), region.level, rtol=0.02)
    assert region.area == pytest.approx(ellipse.area, rel=0.01)


def test_a_held_component_does_not_move(early):
    chart = ModifiedPolar((0.0, 0.0))
    start = early.state * [1.3, 0.9, 0.0, 2.0]
    state, cost = lowest_of(early, early.simulate(1, seed=4), start[None, None], Held(chart, (0, 1)))
    np.testing.assert_allclose(chart.from_state(state[0])[:2], chart.from_state(start)[:2], rtol=1e-12)
    assert np.abs(state[0] - start)[2:].min() > 0.01
    before = tma.wrap(early.linearise(start)[0] - early.simulate(1, seed=4)[0]) / early.sigma
    assert cost[0] < np.sum(before**2)


# -- brute force -------------------------------------------------------------------------------------


def brute(scenario, angles, point, starts):
    """Lowest criterion over the velocity by scipy."""

    def residuals(velocity):
        return scenario.residual(angles, scenario.linearise([*point, *velocity])[0]) / scenario.sigma

    return min(2 * least_squares(residuals, v, x_scale=10.0, xtol=1e-12, ftol=1e-12).cost for v in starts)


@pytest.mark.parametrize("seed", range(3))
def test_the_profile_is_that_of_another_minimiser(early, seed):
    """At random points about the region, in and out, and on its boundary."""
    rng, angles = np.random.default_rng(seed), early.simulate(1, seed=seed)[0]
    fit = tma.fit(early, angles)
    region = tma.confidence_region(fit)
    scale = [1e3, 1e3, 5, 5]
    whole = [
        least_squares(
            lambda x: early.residual(angles, early.linearise(x)[0]) / early.sigma, start, x_scale=scale
        ).cost
        for start in (early.state, fit.state, early.state * [2, 2, 1, 1])
    ]
    assert region.cost == pytest.approx(2 * min(whole), abs=1e-3)
    (line,) = region.boundary
    middle = line.mean(axis=0)
    points = middle + (line[rng.integers(len(line), size=25)] - middle) * rng.uniform(0.2, 1.6, (25, 1))
    starts = [fit.state[2:], early.state[2:], [0.0, 0.0]]
    exact = np.array([brute(early, angles, p, starts) for p in points]) - 2 * min(whole)
    found, near = region.profile(points), exact < 100 * region.level
    np.testing.assert_allclose(found[near], exact[near], rtol=1e-3, atol=2e-3)
    assert near.sum() > 15
    assert (found <= exact * 1.001 + 2e-3).all()  # far out scipy may miss the lowest
    clear = np.abs(exact / region.level - 1) > 0.01
    np.testing.assert_array_equal(region.contains(points)[clear], (exact <= region.level)[clear])
    edge = [brute(early, angles, p, starts) - 2 * min(whole) for p in line[:-1:6]]
    np.testing.assert_allclose(edge, region.level, rtol=2e-3)


def test_the_area_is_that_of_a_grid(early):
    """Points at random in a box about the region; the share inside, with its error."""
    fit = tma.fit(early, early.simulate(1, seed=5)[0])
    region, rng = tma.confidence_region(fit), np.random.default_rng(1)
    low, high = region.boundary[0].min(axis=0), region.boundary[0].max(axis=0)
    points = rng.uniform(low, high, (5000, 2))
    inside, box = region.contains(points).sum(), np.prod(high - low)
    few, many = binom.ppf([5e-5, 1 - 5e-5], len(points), region.area / box)
    assert few <= inside <= many


# -- shapes that no ellipse has ----------------------------------------------------------------------


def test_a_mirror_image_is_a_piece(mirrored):
    fit = tma.fit(mirrored, mirrored.simulate(1, seed=1)[0], mirrored.state)
    region = tma.confidence_region(fit)
    assert len(region.boundary) == 2
    here, along = np.array([-1e3, 0.0]), np.array([3e3, 500.0]) / np.hypot(3e3, 500.0)

    def image(points):
        away = points - here
        return here + 2 * np.outer(away @ along, along) - away

    first, second = region.boundary
    np.testing.assert_allclose(region.profile(image(first[:-1:5])), region.level, rtol=1e-3)
    assert shoelace(first) == pytest.approx(shoelace(second), rel=0.01)
    assert region.area == pytest.approx(shoelace(first) + shoelace(second), rel=0.01)
    assert region.contains(mirrored.state[PLACE])
    assert region.contains(image(mirrored.state[None, PLACE])).all()


def test_a_region_around_the_platform(mirrored):
    """Ranges do not mind where the platform is."""
    place = mirrored.state[PLACE]
    near = tma.Scenario(still(place + [3.0, -4.0]), mirrored.sensors, 600.0)
    angles = mirrored.simulate(1, seed=1)[0]
    region = tma.confidence_region(tma.fit(near, angles, mirrored.state))
    apart = tma.confidence_region(tma.fit(mirrored, angles, mirrored.state))
    assert region.ranges[:, 0].min() < 1
    assert region.area == pytest.approx(apart.area, rel=0.02)


@pytest.fixture(scope="module")
def open_range():
    """A last leg of one minute says that the target is not near, and no more."""
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(540), tma.Straight(60, heading=1.0)])
    ear = tma.Sensor(tma.Bearing(), np.arange(0, 600, 20.0), 0.02)
    return tma.Scenario(ship, [ear], 580.0, tma.Target((8e3, 9e3), 3, 1.0))


def test_a_region_without_end(open_range):
    """The fit runs away; the least distance is that of another minimiser."""
    angles = open_range.simulate(1, seed=1)[0]
    fit = tma.fit(open_range, angles)
    region = tma.confidence_region(fit)
    assert not fit.converged
    assert not region.bounded
    assert region.area == np.inf
    assert region.contains(open_range.state[PLACE])
    assert "to infinity" in repr(region)
    here = open_range.platform.position_at(580.0)

    def lowest_at(distance):
        def residuals(x):
            theta, *velocity = x
            state = [*(here + distance * np.array([np.sin(theta), np.cos(theta)])), *velocity]
            return open_range.residual(angles, open_range.linearise(state)[0]) / open_range.sigma

        theta = tma.bearing(open_range.state[PLACE] - here)
        return 2 * least_squares(residuals, [theta, 0.0, 5.0], x_scale=[0.01, 1, 1]).cost

    assert lowest_at(region.ranges[0, 0]) - lowest_at(1e7) == pytest.approx(region.level, abs=0.02)


# -- batches and bad input ---------------------------------------------------------------------------


def test_a_lost_run_stays_alone(early):
    angles = early.simulate(5, seed=6)
    angles[2, 3] = np.inf
    some = tma.profile_criterion(early, angles, early.state[PLACE])
    np.testing.assert_array_equal(np.isnan(some), [False, False, True, False, False])
    one = tma.profile_criterion(early, angles[3], early.state[PLACE])
    assert one == some[3]
    several = tma.profile_criterion(early, angles[3], early.state[PLACE] * [[1.0], [1.1], [1.2]])
    assert several.shape == (3,)
    assert several[0] == one
    region = tma.confidence_region(tma.fit(early, angles[3]))
    points = early.state[PLACE] * np.array([1.0, 1.1, 1.2])[:, None]
    np.testing.assert_allclose(region.profile(points), several, atol=1e-3)


def test_bad_input_is_refused(early):
    fit = tma.fit(early, early.simulate(2, seed=7))
    with pytest.raises(ValueError, match="a region is of one run"):
        tma.confidence_region(fit)
    angles = early.simulate(1, seed=7)[0]
    one = tma.fit(early, angles)
    with pytest.raises(ValueError, match="nearest must be"):
        tma.confidence_region(one, nearest=2e6)
    with pytest.raises(ValueError, match="probability must be below 1"):
        tma.confidence_region(one, probability=90)
    with pytest.raises(ValueError, match="must have a finite state"):
        tma.confidence_region(tma.fit(early, angles * np.nan))
    with pytest.raises(ValueError, match=r"points must have shape"):
        tma.confidence_region(one).contains([1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match=r"position must have shape"):
        tma.profile_criterion(early, angles, [1.0, 2.0, 3.0])
    few = emw.scenario(4).until(4)
    with pytest.raises(ValueError, match="a region needs 4 measurements"):
        tma.confidence_region(tma.fit(few, few.simulate(1, seed=1)[0], few.state))
