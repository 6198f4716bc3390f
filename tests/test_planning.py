"""Objectives against the bound and `sensitivity`; the search against brute force and known results."""

from dataclasses import replace

import numpy as np
import pytest

import tmalib as tma
from tmalib import sensitivity
from tmalib.objectives import objective_of_courses, position_area, worst_shift
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.planning import best_course

TURN = np.radians(20) / 60


def ship(heading=90.0, duration=600.0):
    return tma.Course((0, 0), 5, np.radians(heading), [tma.Straight(duration)])


def bearings_of(target, platform=None, every=20.0):
    sensor = tma.Sensor(tma.Bearing(), np.arange(0, 600.1, every), np.radians(1))
    return tma.Scenario(platform or ship(), [sensor], 0.0, target)


def random_courses(rng, count, duration=600.0):
    legs = [[tma.Turn(duration / 4, rate) for rate in rng.uniform(-TURN, TURN, 4)] for _ in range(count)]
    return [tma.Course((0, 0), 5.0, rng.uniform(0, 6), parts) for parts in legs]


@pytest.mark.parametrize("time", [None, 450.0])
def test_area_is_that_of_the_ellipse_of_the_bound(time):
    rng = np.random.default_rng(1)
    scenario = bearings_of(tma.Target((2000, 9000), 4, 1.0))
    courses = random_courses(rng, 5)
    found = objective_of_courses(scenario, courses, position_area(scenario, time, probability=0.7))
    for course, area in zip(courses, found, strict=True):
        moved = replace(scenario, platform=course, reference_time=time or 0.0)
        assert area == pytest.approx(tma.confidence_ellipse(moved.state, tma.crlb(moved), 0.7).area, rel=1e-6)


def test_area_with_a_depth_and_a_lag_in_the_heading():
    scenario = conical.section_4_2()
    found = objective_of_courses(scenario, [scenario.platform], position_area(scenario))
    assert found == pytest.approx(tma.confidence_ellipse(scenario.state, tma.crlb(scenario)).area, rel=1e-6)


@pytest.mark.parametrize("time", [0.0, 600.0])
def test_worst_shift_is_that_of_the_worst_displacement(time):
    rng = np.random.default_rng(2)
    scenario = bearings_of(tma.Target((2000, 9000), 4, 1.0))
    courses = random_courses(rng, 5)
    found = objective_of_courses(scenario, courses, worst_shift(scenario, 10.0, time))
    for course, shift in zip(courses, found, strict=True):
        moved = replace(scenario, platform=course)
        final = sensitivity.position_criterion(moved, time)
        worst = sensitivity.worst_sup(moved, 10.0, criterion=final)
        exact = np.linalg.norm(final @ sensitivity.differential(moved, worst))
        assert 0.9994 * exact < shift < exact * (1 + 1e-9)


def test_several_states_and_a_sensor_elsewhere():
    near, far = tma.Target((2000, 9000), 4, 1.0), tma.Target((-3000, 12000), 6, 2.0)
    scenario = bearings_of(near)
    other = tma.Sensor(tma.DelayedBearing(), [100.0, 300.0], 0.02, platform=ship(heading=10.0))
    scenario = replace(scenario, sensors=[*scenario.sensors, other])
    courses = random_courses(np.random.default_rng(3), 3)
    states = [near.state(0.0), far.state(0.0)]
    found = objective_of_courses(scenario, courses, position_area(scenario), states)
    assert found.shape == (3, 2)
    for course, row in zip(courses, found, strict=True):
        for target, area in zip((near, far), row, strict=True):
            moved = replace(scenario, platform=course, target=target)
            wanted = tma.confidence_ellipse(moved.state, tma.crlb(moved)).area
            assert area == pytest.approx(wanted, rel=1e-6)


def test_what_is_not_observable_is_infinite():
    scenario = bearings_of(tma.Target((2000, 9000), 4, 1.0))
    for objective in (position_area(scenario), worst_shift(scenario, 10.0)):
        assert np.isinf(objective_of_courses(scenario, [ship()], objective)).all()


def test_brute_force_over_two_legs():
    """No pair of turn rates on a fine grid is better; the best pair is nearly as good."""
    scenario = bearings_of(tma.Target((2000, 9000), 4, 1.0), ship(heading=60.0))
    area = position_area(scenario)
    rates = np.linspace(-TURN, TURN, 41)
    start = np.radians(60.0)
    pairs = [tma.Course((0, 0), 5, start, [tma.Turn(300, a), tma.Turn(300, b)]) for a in rates for b in rates]
    least = objective_of_courses(scenario, pairs, area).min()
    plan = best_course(scenario, area, 5.0, TURN, legs=2, starts=8, seed=1)
    assert 0.98 * least < plan.value <= least * (1 + 1e-6)
    assert plan.value == pytest.approx(objective_of_courses(scenario, [plan.course], area)[0])
    assert plan.reached.min() == plan.value
    assert 1 <= plan.agreeing <= 8


def test_the_mirrored_problem_has_the_mirrored_course():
    area, plans = None, []
    for side in (1, -1):
        scenario = bearings_of(tma.Target((2000 * side, 9000), 4, side * 1.0), ship(heading=60.0 * side))
        area = position_area(scenario)
        plans.append(best_course(scenario, area, 5.0, TURN, legs=3, starts=12, seed=1))
    assert plans[0].value == pytest.approx(plans[1].value, rel=1e-4)
    times = np.linspace(0, 600, 7)
    places = [plan.course.position_at(times) for plan in plans]
    assert np.allclose(places[0], places[1] * [-1, 1], atol=20.0)


def test_a_distant_target_is_looked_at_from_across_with_reversals():
    """Known since the eighties: far from the target, legs across the line of sight and reversals."""
    scenario = bearings_of(tma.Target((0, 60e3), 0, 0))
    plan = best_course(
        scenario, position_area(scenario), 5.0, np.radians(4), legs=15, any_heading=True, starts=8, seed=1
    )
    heading = plan.course.heading_at(np.linspace(0, 600, 121))
    assert np.mean(np.abs(np.cos(heading)) < 0.35) > 0.75, "across"
    assert 0.1 < np.mean(np.sin(heading) > 0) < 0.9, "to both sides"


def test_it_keeps_out():
    scenario = bearings_of(tma.Target((0, 3000), 2, np.pi))
    area = position_area(scenario)
    free = best_course(scenario, area, 5.0, np.radians(1), legs=4, starts=6)
    kept = best_course(scenario, area, 5.0, np.radians(1), legs=4, starts=6, keep_out=1500.0)
    assert free.nearest < 1400
    assert kept.nearest >= 1500 * (1 - 1e-3)
    assert kept.value > free.value
    times = scenario.times
    gap = scenario.target.position_at(times) - kept.course.position_at(times)
    assert kept.nearest == pytest.approx(np.hypot(*gap.T).min())
    with pytest.raises(ValueError, match="keeps 5000"):
        best_course(scenario, area, 5.0, np.radians(1), legs=2, starts=2, keep_out=5000.0)


def test_limits_of_speed_and_turn_rate_hold():
    scenario = bearings_of(tma.Target((2000, 9000), 4, 1.0))
    plan = best_course(scenario, position_area(scenario), (2.0, 5.0), TURN, legs=4, starts=4)
    for leg in plan.course.legs:
        assert 2.0 <= leg.speed <= 5.0 + 1e-9
        assert abs(leg.rate) <= TURN * (1 + 1e-9)


def test_over_several_states_the_mean_logarithm_counts():
    scenario = bearings_of(tma.Target((2000, 9000), 4, 1.0))
    area = position_area(scenario)
    states = [[2000, 9000, 3, 2], [-2000, 7000, -3, 2.0]]
    plan = best_course(scenario, area, 5.0, TURN, legs=3, starts=4, states=states)
    values = objective_of_courses(scenario, [plan.course], area, states)
    assert plan.value == pytest.approx(np.exp(np.log(values).mean()))


def test_a_course_within_a_scenario_that_begins_late():
    platform = tma.Course((100, 50), 5, 1.0, [tma.Straight(1000)])
    sensor = tma.Sensor(tma.Bearing(), np.arange(200, 801.0, 20), 0.02)
    scenario = tma.Scenario(platform, [sensor], 800.0, tma.Target((2000, 9000), 4, 1.0))
    plan = best_course(scenario, position_area(scenario), 5.0, TURN, legs=3, starts=2)
    assert np.allclose(plan.course.position_at(200.0), platform.position_at(200.0))
    assert plan.course.heading_at(200.0) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": (5, 2)}, "speed"),
        ({"speed": -1}, "speed"),
        ({"turn_rate": 0.0}, "turn_rate"),
        ({"legs": 0}, "legs"),
        ({"starts": 1.5}, "starts"),
        ({"keep_out": -1.0}, "keep_out"),
        ({"any_heading": 1}, "any_heading"),
        ({"states": [1.0, 2.0]}, "state"),
        ({"objective": lambda jacobian: -np.ones(jacobian.shape[:-2])}, "positive"),
        ({"objective": lambda jacobian: 1.0}, "one number"),
    ],
)
def test_bad_arguments(change, message):
    scenario = bearings_of(tma.Target((2000, 9000), 4, 1.0))
    arguments = {"objective": position_area(scenario), "speed": 5.0, "turn_rate": TURN, "starts": 1} | change
    with pytest.raises(ValueError, match=message):
        best_course(scenario, **arguments)
