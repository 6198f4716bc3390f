"""The best manoeuvre: rules against geometry, the floor against random courses and exhaustive search."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import tmalib as tma
from tmalib import sensitivity
from tmalib.beyond import manoeuvre, manoeuvre_drawing, manoeuvre_floor
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.robustness import scenarios as robust
from tmalib.papers.robustness.worst import worst_final


@pytest.fixture(scope="module")
def array():
    return manoeuvre.array(every=4)


def test_the_papers_own_courses_have_the_papers_values():
    scenario = conical.section_4_2()
    area = tma.confidence_ellipse(scenario.state, tma.crlb(scenario)).area
    assert manoeuvre.array().value(scenario.platform)[0] == pytest.approx(area, rel=1e-6)
    geometry = robust.reference()
    worst = manoeuvre.aircraft(every=1).value(geometry.platform)[0]
    assert 0.9994 < worst / worst_final(geometry) <= 1 + 1e-9


def test_thinned_measurements_tell_nearly_the_same():
    for every in (2, 4):
        thin, full = manoeuvre.array(every), manoeuvre.array()
        assert thin.duration == full.duration
        assert np.sum(thin.scenario.sigma**-2) == pytest.approx(np.sum(full.scenario.sigma**-2))
        own = full.scenario.platform
        assert thin.value(own)[0] == pytest.approx(full.value(own)[0], rel=0.01)


def test_limits_are_those_of_the_papers_platforms():
    array, aircraft = manoeuvre.array(), manoeuvre.aircraft()
    assert 60 * np.degrees(array.turn_rate) == pytest.approx(20)
    assert aircraft.speed * aircraft.turn_rate == pytest.approx(50)
    assert np.abs([leg.rate for leg in robust.reference().platform.legs]).max() == pytest.approx(
        aircraft.turn_rate
    )


@pytest.mark.parametrize("name", manoeuvre.RULES)
@pytest.mark.parametrize("side", [1, -1])
def test_rules_keep_the_limits_and_last(array, name, side):
    course = manoeuvre.rule(name, array, side)
    assert course.end_time == pytest.approx(array.duration)
    for leg in course.legs:
        assert abs(leg.rate) <= array.turn_rate * (1 + 1e-12)
    toward = manoeuvre.first_bearing(array)
    heading = np.degrees(course.heading_at([0.0, array.duration]) - toward) * side
    ends = {
        "reversal towards": (90, -90),
        "reversal away": (90, 270),
        "across, then towards": (90, 0),
        "V towards": (45, -45),
    }
    if name in ends:
        assert heading == pytest.approx(ends[name])


def test_a_rule_is_mirrored_by_its_side(array):
    toward = manoeuvre.first_bearing(array)
    times = array.scenario.times
    across = np.array([np.cos(toward), -np.sin(toward)])
    for name in manoeuvre.RULES:
        right, left = (manoeuvre.rule(name, array, side).position_at(times) for side in (1, -1))
        assert np.allclose(right - left, np.outer(2 * right @ across, across), atol=1e-6)


def test_a_mirrored_target_costs_the_same(array):
    toward = manoeuvre.first_bearing(array)
    states = manoeuvre.array_states(np.random.default_rng(1), 6, toward)
    mirrored = manoeuvre.drawing_right(array, states)
    for state, other in zip(states, mirrored, strict=True):
        side = manoeuvre.with_target(array, state, toward)
        assert manoeuvre.with_target(array, other, toward) == 1
        own, same = (
            array.value(manoeuvre.rule("reversal towards", array, s), states=x)[0]
            for s, x in ((side, state), (1, other))
        )
        assert own == pytest.approx(same, rel=1e-6)


def test_prices_are_those_of_the_courses(array):
    found = manoeuvre.array_prices(3, 2)
    assert found["rules"].shape == (2, 6, 2)
    toward = manoeuvre.first_bearing(array)
    for state, rules, best in zip(found["states"], found["rules"], found["best"], strict=True):
        side = manoeuvre.with_target(array, state, toward)
        for k, name in enumerate(manoeuvre.RULES):
            course = manoeuvre.rule(name, array, -side)
            moved = replace(
                array.scenario,
                platform=course,
                target=tma.Target.from_velocity(state[:2], state[3:], depth=state[2]),
            )
            area = tma.confidence_ellipse(moved.state, tma.crlb(moved)).area
            assert rules[k, 1] == pytest.approx(area, rel=1e-6)
        assert best < 1.02 * rules.min()


def test_the_aircraft_keeps_out():
    problem = manoeuvre.aircraft(every=12)
    found = manoeuvre.aircraft_prices(2, 1)
    toward = manoeuvre.first_bearing(problem)
    for name in manoeuvre.RULES:
        for side in (1, -1):
            course = manoeuvre.RULES[name](problem, toward, side)
            assert manoeuvre.nearest(problem, course, found["states"][0]) >= manoeuvre.KEEP_OUT


def test_floor_of_the_shift_is_below_random_courses():
    problem = manoeuvre.aircraft()
    rng, above = np.random.default_rng(4), 0
    for _ in range(20):
        rates = rng.uniform(-problem.turn_rate, problem.turn_rate, 5)
        platform = problem.scenario.platform
        legs = [tma.Turn(robust.DURATION / 5, rate) for rate in rates]
        course = tma.Course(platform.start, problem.speed, rng.uniform(0, 6), legs)
        gap = problem.scenario.target.position_at(20.0) - course.position_at(20.0)
        floor = manoeuvre.floor_of_shift(np.hypot(*gap), problem.speed * problem.turn_rate)
        assert floor < problem.value(course)[0]
        above += floor > 0
    assert above > 10


def test_first_order_and_fits_agree_for_a_small_displacement():
    problem = manoeuvre.aircraft(every=10)
    course = manoeuvre.rule("reversal away", problem)
    linear, actual = manoeuvre.worst_in_truth(problem, course, bound=0.1)
    assert actual == pytest.approx([linear, linear], rel=1e-2)
    moved = replace(problem.scenario, platform=course)
    final = sensitivity.position_criterion(moved, robust.DURATION)
    worst = sensitivity.worst_sup(moved, 0.1, criterion=final)
    assert linear == pytest.approx(np.linalg.norm(final @ sensitivity.differential(moved, worst)))


@pytest.fixture(scope="module")
def grid():
    problem = manoeuvre.array()
    return manoeuvre_floor.Grid(problem.scenario, problem.speed, problem.turn_rate, headings=27, cell=250.0)


def test_dynamic_programming_finds_what_all_courses_of_its_stages_give(grid):
    """Twenty stages: all courses with one change of side, and random ones, are not better."""
    start = grid.scenario.platform
    rng = np.random.default_rng(5)
    sides = [
        np.r_[np.full(k, a), np.full(grid.stages - k, b)]
        for k in range(grid.stages + 1)
        for a, b in product((-1, 0, 1), repeat=2)
    ]
    sides = [row for row in sides if len(row) == grid.stages] + list(rng.integers(-1, 2, (200, grid.stages)))
    courses = [
        tma.Course((0, 0), 5.0, start.heading, [tma.Turn(grid.stage, grid.turn_rate * k) for k in row])
        for row in sides
    ]
    parts = manoeuvre_floor.informations(grid.scenario, courses)
    g, _ = manoeuvre_floor.slope(parts[-20:].mean(axis=0), [0, 1])
    gains = np.einsum("ij,kij->k", g, parts)
    most, course = grid.best(g)
    own = np.sum(g * manoeuvre_floor.informations(grid.scenario, [course])[0])
    assert most > 0.97 * gains.max()
    assert own > 0.97 * gains.max()
    assert most == pytest.approx(own, rel=0.05)


def test_the_floor_is_below_every_course(grid):
    floor = manoeuvre_floor.floor_of_area(grid, rounds=5)
    assert floor.weights.sum() == pytest.approx(1)
    assert floor.excess >= 1
    assert floor.area == pytest.approx(floor.mixture / floor.excess)
    assert floor.area < manoeuvre.array().best(starts=4).value


def test_slope_is_the_gradient_of_the_logarithm():
    rng = np.random.default_rng(6)
    information = np.cov(rng.standard_normal((5, 12)))
    g, log = manoeuvre_floor.slope(information, [0, 1])
    change = rng.standard_normal((5, 5))
    change += change.T
    step = 1e-6
    up, down = (manoeuvre_floor.slope(information + s * step * change, [0, 1])[1] for s in (1, -1))
    assert (up - down) / (2 * step) == pytest.approx(-np.sum(g * change) / 2, rel=1e-5)
    inverse = np.linalg.inv(information)[:2, :2]
    assert np.exp(log) == pytest.approx(np.pi * 2 * np.log(10) * np.sqrt(np.linalg.det(inverse)))


def test_drawings_have_what_they_are_given(array):
    course = manoeuvre.rule("reversal towards", array)
    one = (array, {"rule": ("rule", course)})
    _, axes = manoeuvre_drawing.maps(one, one)
    assert len(axes[0].lines) == len(axes[1].lines) + 1, "the ellipse"
    _, ax = manoeuvre_drawing.headings({"rule": ("rule", array, course, manoeuvre.first_bearing(array))})
    drawn = ax.lines[0].get_ydata()
    assert drawn[[0, -1]] == pytest.approx([90, -90])
    ratios = np.linspace(1, 3, 11)
    _, axes = manoeuvre_drawing.costs({"a": {"x": (ratios, None)}, "b": {"x": None}})
    assert axes[0].lines[1].get_xdata() == pytest.approx([2])
    assert len(axes[1].lines) == 1
