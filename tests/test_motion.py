import numpy as np
import pytest
from scipy.integrate import solve_ivp

import tmalib as tma

LEGS = [
    tma.Straight(30.0),
    tma.Turn(60.0, 0.03, speed=9.0),
    tma.Straight(20.0, heading=1.0),
    tma.Turn(50.0, -0.02),
]


def test_course_matches_integration_of_its_velocity():
    course = tma.Course((100.0, -50.0), speed=5.0, heading=0.4, legs=LEGS)

    def velocity(t, _):
        speed = 5.0 if t < 30 else 9.0
        return speed * np.array([np.sin(course.heading_at(t)), np.cos(course.heading_at(t))])

    position = np.array([100.0, -50.0])
    for start, end in ((0, 30), (30, 90), (90, 110), (110, 160)):
        inside = (start + 1e-9, end - 1e-9)
        position = solve_ivp(velocity, inside, position, rtol=1e-10, atol=1e-9).y[:, -1]
        np.testing.assert_allclose(course.position_at(end), position, atol=1e-5)


def test_course_heading_and_speed_carry_over():
    course = tma.Course((0, 0), speed=5.0, heading=0.4, legs=LEGS)
    np.testing.assert_allclose(
        course.heading_at([0, 29, 60, 89.999, 100, 160]), [0.4, 0.4, 1.3, 2.19997, 1.0, 0.0]
    )
    assert course.end_time == 160.0


def test_at_a_corner_the_next_leg_has_begun():
    legs = [tma.Straight(30.0), tma.Straight(30.0, heading=1.0), tma.Straight(30.0, heading=2.0)]
    course = tma.Course((0, 0), speed=5.0, heading=0.0, legs=legs)
    np.testing.assert_array_equal(course.heading_at([0.0, 30.0, 60.0, 90.0]), [0.0, 1.0, 2.0, 2.0])


@pytest.mark.parametrize("velocity", [(3.0, 4.0), (-3.0, 4.0), (0.5, -2.0)])
def test_a_target_is_where_it_is_said_to_be(velocity):
    """At its time at its position; along speed and heading as along the velocity."""
    target = tma.Target.from_velocity((100.0, 50.0), velocity, time=20.0)
    np.testing.assert_array_equal(target.position_at(20.0), [100.0, 50.0])
    np.testing.assert_allclose(target.position_at(21.0), np.add([100.0, 50.0], velocity))
    again = tma.Target((100.0, 50.0), target.speed, target.heading, time=20.0)
    np.testing.assert_allclose(again.position_at(30.0), target.position_at(30.0))


def test_full_turn_is_a_circle():
    rate = 2 * np.pi / 100
    course = tma.Course((7.0, 3.0), speed=2.0, heading=0.9, legs=[tma.Turn(100.0, rate)])
    np.testing.assert_allclose(course.position_at(100.0), [7.0, 3.0], atol=1e-12)
    half = course.position_at(50.0) - course.position_at(0.0)
    assert np.hypot(*half) == pytest.approx(2 * 2.0 / rate)


def test_tiny_turn_rate_tends_to_a_straight_leg():
    straight = tma.Course((0, 0), 5.0, 0.3, [tma.Straight(100.0)]).position_at(100.0)
    turning = tma.Course((0, 0), 5.0, 0.3, [tma.Turn(100.0, 1e-12)]).position_at(100.0)
    np.testing.assert_allclose(turning, straight, rtol=1e-9)


def test_last_leg_without_end():
    course = tma.Course((0, 0), 1.0, 0.0, [tma.Turn(10.0, 0.1), tma.Straight(np.inf)])
    assert np.all(np.isfinite(course.position_at([0.0, 10.0, 1e6])))


def test_target_state_and_propagation_agree():
    target = tma.Target((10.0, 20.0), speed=3.0, heading=0.7, depth=50.0, time=5.0)
    moved = tma.propagate(target.state(5.0), np.array([0.0, 12.5]))
    np.testing.assert_allclose(moved[1], target.state(17.5))
    five = target.state(5.0, ("x", "y", "z", "vx", "vy"))
    np.testing.assert_allclose(
        tma.transition(12.5, ("x", "y", "z", "vx", "vy")) @ five,
        target.state(17.5, ("x", "y", "z", "vx", "vy")),
    )
    np.testing.assert_allclose(tma.transition(12.5) @ target.state(5.0), moved[1])


def test_transitions_compose():
    np.testing.assert_allclose(tma.transition(3.0) @ tma.transition(4.5), tma.transition(7.5))


def test_sampled_course_interpolates():
    course = tma.SampledCourse([0, 1, 3], [[0, 0], [2, 0], [2, 4]], headings=[0.0, 0.1, 0.5])
    np.testing.assert_allclose(course.position_at([0.5, 2.0, 3.0]), [[1, 0], [2, 2], [2, 4]])
    np.testing.assert_allclose(course.heading_at(2.0), 0.3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: tma.Target((0, 0, 0), 1, 0), "position must have shape"),
        (lambda: tma.Target((0, np.nan), 1, 0), "position must be finite"),
        (lambda: tma.Target((0, 0), -1, 0), "speed must be at least"),
        (lambda: tma.Target((0, 0), "fast", 0), "speed must be a number"),
        (lambda: tma.Target((0, 0), 1, 0).state(0, ("x", "z")), "no depth"),
        (lambda: tma.Straight(0), "duration of a leg must be positive"),
        (lambda: tma.Turn(10, np.nan), "rate must be finite"),
        (lambda: tma.Straight(10, speed=-2), "speed must be at least"),
        (lambda: tma.Course((0, 0), 1, 0, []), "legs is empty"),
        (lambda: tma.Course((0, 0), 1, 0, [tma.Straight(10)]).position_at(11.0), "outside the course"),
        (
            lambda: tma.Course((0, 0), 1, 0, [tma.Straight(10)]).position_at([5.0, -1.0]),
            "time -1.0 is outside",
        ),
        (lambda: tma.Course((0, 0), 1, 0, [tma.Straight(10)]).heading_at(np.nan), "outside the course"),
        (lambda: tma.SampledCourse([0, 0], [[0, 0], [1, 1]]), "strictly increasing"),
        (lambda: tma.SampledCourse([0, 1], [[0, 0]]), "positions must have shape"),
        (lambda: tma.SampledCourse([0, 1], [[0, 0], [1, 1]]).position_at(2.0), "outside the samples"),
        (lambda: tma.SampledCourse([0, 1], [[0, 0], [1, 1]]).heading_at(0.5), "no headings"),
        (lambda: tma.transition(1.0, ("x", "y", "vx")), "a uniform motion needs"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
