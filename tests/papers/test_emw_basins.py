"""Fits without a start: who is lost, what it costs, and the drawings of it."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from scipy.stats import chi2, kstest

import tmalib as tma
from tmalib.papers.emw_acoustic import basin_drawing, basins, likelihood_regions
from tmalib.papers.emw_acoustic import scenarios as emw


def test_squares_are_where_the_starts_are():
    side = 1e3 * np.arange(-4.5, 5)
    one, none = np.zeros((2, 10, 10), dtype=bool)
    one[7, 1] = True  # 2.5 km north, 3.5 km west
    scenarios = {"a": emw.scenario(2), "b": emw.scenario(4)}
    reached = {(name, chart): one if name == "a" else none for name in "ab" for chart in ("p", "c")}
    figure = basin_drawing.basins(side, reached, scenarios)
    figure.canvas.draw()
    assert [ax.get_title() for ax in figure.axes] == ["a, p: 1 %", "a, c: 1 %", "b, p: 0 %", "b, c: 0 %"]
    for ax, (name, _), grid in zip(figure.axes, reached, reached.values(), strict=True):
        (mesh,) = (item for item in ax.collections if isinstance(item, QuadMesh))
        colours = mesh.get_facecolors().reshape(10, 10, 4)
        corners = mesh.get_coordinates()
        centres = (corners[1:, 1:] + corners[:-1, :-1]) / 2
        differs = np.any(colours != colours[0, 0], axis=-1)
        np.testing.assert_array_equal(differs, grid)
        np.testing.assert_allclose(centres[differs], np.tile([-3.5, 2.5], (grid.sum(), 1)))
        now = scenarios[name]
        drawn = [line.get_xydata()[0] for line in ax.lines if len(line.get_xydata()) > 1]
        np.testing.assert_allclose(
            drawn, [now.platform.position_at(0) / 1e3, now.target.position_at(0) / 1e3]
        )
    plt.close(figure)


def fit_of(statuses, costs):
    """A fit of which only these are looked at."""
    return tma.Fit(None, np.array(statuses), None, np.array(costs), None, None)


def test_lost_by_hand():
    """Not converged, or converged more than 0.01 above; where nothing has converged nobody is lost."""
    ok, away = "converged", "ran away"
    first = fit_of([ok, ok, away, away, ok], [5.0, 5.02, 1.0, 1.0, 7.0])
    second = fit_of([ok, ok, ok, away, away], [5.005, 5.0, 9.0, 2.0, 3.0])
    expected = [[False, True, True, False, False], [False, False, False, False, True]]
    np.testing.assert_array_equal(basins.lost(first, second), expected)


def test_starts_are_lost_when_they_end_elsewhere():
    """Distance from the minimum, in standard deviations of the bound, instead of the criterion."""
    now = emw.scenario(2)
    angles = now.simulate(20, 5)
    ranges = [3e3, 8e3, 40e3, 60e3]
    fits, lost = basins.lost_from_ranges(now, angles, ranges, now.state)
    best = tma.fit(now, angles, now.state)
    apart = tma.nees(fits.state - best.state, np.zeros(4), tma.crlb(now))
    assert best.converged.all()
    assert lost.shape == (4, 20)
    np.testing.assert_array_equal(lost, ~(apart < 0.2**2))
    assert 0 < lost.mean() < 1
    guess = np.hypot(*emw.start(now, angles, 2, 40e3)[:, :2].T)
    np.testing.assert_allclose(guess, 40e3)


def test_random_targets_are_where_they_should_be():
    now, rng = emw.scenario(1), np.random.default_rng(3)
    moved = [basins.random_target(now, 5e3, 4.0, rng) for _ in range(400)]
    place = np.array([scenario.target.position_at(0.0) for scenario in moved])
    speed = np.array([scenario.target.velocity for scenario in moved])
    np.testing.assert_allclose(np.hypot(*place.T), 5e3)
    np.testing.assert_allclose(np.hypot(*speed.T), 4.0)
    for directions in (place / 5e3, speed / 4):  # 400 uniform ones: each mean has a sigma of 0.035
        assert np.all(np.abs(directions.mean(axis=0)) < 0.15)
    states = basins.targets_on_a_grid(np.array([-1e3, 0.0, 2e3]), 4.0, rng)
    np.testing.assert_array_equal(states[2, 0, :2], [-1e3, 2e3])
    np.testing.assert_allclose(np.hypot(*np.moveaxis(states[..., 2:], -1, 0)), 4.0)


def test_sightings_are_what_each_target_alone_gives():
    now = emw.scenario(4)
    rng = np.random.default_rng(1)
    states = basins.targets_on_a_grid(np.array([5e3, 9e3]), 4.0, rng)
    angles = basins.sightings(now, states, 3000, rng)
    assert angles.shape == (2, 2, 3000, len(now.times))
    for state, seen in zip(states.reshape(4, 4), angles.reshape(4, 3000, -1), strict=True):
        speed, heading = np.hypot(*state[2:]), np.arctan2(*state[2:])
        place = state[:2] - now.reference_time * state[2:]
        exact = now.with_target(tma.Target(place, speed=speed, heading=heading)).measure()
        error = tma.wrap(seen - exact) / now.sigma
        assert np.all(np.abs(error.mean(axis=0)) < 5 / np.sqrt(3000))
        assert np.all(np.abs(error.var(axis=0) - 1) < 5 * np.sqrt(2 / 3000))


def ship():
    legs = [tma.Straight(300), tma.Straight(300, heading=-0.5)]
    course = tma.Course((0, 0), 6.0, 1.0, legs)
    sensor = tma.Sensor(tma.Bearing(), np.arange(0, 600, 10.0), 0.01)
    return tma.Scenario(course, [sensor], 0.0, tma.Target((1e3, 6e3), speed=4, heading=2.5))


def test_evaluations_from_a_start_are_those_that_the_fit_counts():
    now = ship()
    angles = now.simulate(30, 2)
    start = tma.along_first_bearing(now, angles, 8e3)
    expected = tma.fit(now, angles, start).iterations.mean()
    assert basins.evaluations(now, angles, start) == pytest.approx(expected, rel=1e-12)
    assert basins.evaluations(now, angles) >= tma.fit(now, angles).iterations.mean()


def test_exact_bearings_are_on_the_line_and_others_are_not():
    now = emw.scenario(2)
    optical, sonar = now.sensors
    for sensor, c in ((optical, np.inf), (sonar, emw.SOUND_SPEED)):
        assert np.max(np.abs(basins.off_the_line(now, sensor, c))) < 1e-8
    assert np.min(np.abs(basins.off_the_line(now, sonar))) > 1.0, "the delay moves the target by metres"
    assert np.max(np.abs(basins.off_the_line(ship(), ship().sensors[0]))) < 1e-8


def test_squares_at_the_truth_are_chi_square_where_the_range_is_well_known():
    found = likelihood_regions.squares_at_the_truth(7, 600, 2, emw.scenario(2).reference_time)
    for name in ("ellipse", "region"):
        assert kstest(found[name], chi2(2).cdf).pvalue > 1e-3, name


def test_the_bound_over_the_range_is_that_of_the_logarithm_of_the_range():
    """Its gradient by differences, in place of a projection."""
    now = emw.scenario(4).until(300)
    here = now.platform.position_at(300)

    def log_range(place):
        return np.log(np.hypot(*(place - here)))

    gradient = [(log_range(now.state[:2] + d) - log_range(now.state[:2] - d)) / 2 for d in np.eye(2)]
    expected = np.sqrt(gradient @ tma.crlb(now)[:2, :2] @ gradient)
    assert likelihood_regions.bound_over_range(4, 300) == pytest.approx(expected, rel=1e-6)


def test_guesses_are_drawn_where_they_belong():
    side = 1e3 * np.arange(-1.5, 2)
    share, work = np.full((4, 4), 100.0), np.full((4, 4), 3.0)
    share[3, 0], work[0, 3] = 60.0, 90.0
    ranges = np.array([1e3, 10e3])
    figure = basin_drawing.guesses(
        side,
        (share, work),
        np.array([[0, 0], [500, 500]]),
        {"p": (ranges, np.array([0.3, 0.0])), "c": (ranges, np.array([0.1, 0.02]))},
        (0.01, (0.005, 0.02)),
        {"without": work, "near": work + 1, "far": work + 2},
    )
    figure.canvas.draw()
    maps = [ax for ax in figure.axes if any(isinstance(item, QuadMesh) for item in ax.collections)]
    for ax, values in zip(maps[:2], (share, work), strict=True):
        (mesh,) = (item for item in ax.collections if isinstance(item, QuadMesh))
        np.testing.assert_array_equal(np.reshape(mesh.get_array(), (4, 4)), values)
    below = figure.axes[2]
    np.testing.assert_allclose(below.lines[0].get_ydata(), [30, 0])
    np.testing.assert_allclose(below.lines[-1].get_ydata(), [1, 1])
    plt.close(figure)


def test_an_ellipse_is_drawn_as_the_observer_sees_it():
    """A target due east: along is east, and across, to the right, is south."""
    shape = tma.confidence_ellipse((3e3, 1e3), np.diag([1e4, 1e2]))
    line = np.array([[2e3, 0.0], [4e3, 50.0], [2e3, 0.0]])
    region = SimpleNamespace(boundary=(line,))
    here, target = np.array([1e3, 0.0]), np.array([5e3, 0.0])
    figure = basin_drawing.ellipse_and_region([(shape, region), (shape, region)], here, target)
    for ax in figure.axes:
        drawn = [line.get_xydata() for line in ax.lines]
        np.testing.assert_allclose(drawn[1], [[2.0, -1e3]], atol=1e-9)
        np.testing.assert_allclose(drawn[2], [[4.0, 0.0]], atol=1e-9)
        corners = ax.patches[0].get_xy()
        np.testing.assert_allclose(corners[1], [3.0, -50.0], atol=1e-9)
    plt.close(figure)
