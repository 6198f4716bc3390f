"""Courses that make the estimate good: a search under limits of speed and turn rate.

A platform that is to measure until the scenario's last time can still choose how to go. A course is made of
``legs`` parts of equal duration, each with a turn rate (and a speed) within the limits. `best_course` looks
for the one whose objective (`tmalib.objectives`) is smallest. It follows the slope from many random courses,
and returns how good each of them became: where most end at the same value there is little reason to hope for
a better one. It is no proof.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_count, check_flag, check_has, check_is, check_scalar, check_seed
from .motion import Course, Leg
from .objectives import Objective, objective_of_courses
from .scenario import Scenario
from .types import FloatArray, Seed
from .uniform import POSITION, propagate

STEP = 1e-5  # of the differences, where limits are one
TOLERANCE = 1e-7  # of the logarithm of the objective
SLACK = 1e-3  # of the distance to keep, relative
UNSEEN = 1e100  # in place of an objective that is infinite, or no number
SAME = 0.01  # relative difference of values that count as one


@dataclass(frozen=True, eq=False)
class Plan:
    """The best course that was found.

    Attributes
    ----------
    course : Course
    value : float
        Its objective; over several states, the exponential of the mean logarithm.
    reached : ndarray, shape (starts,)
        Values at which the searches from all starts ended, the best first.
    nearest : float
        Smallest distance of platform and target at a measurement, over the states, in metres.
    """

    course: Course
    value: float
    reached: FloatArray
    nearest: float

    @property
    def agreeing(self) -> int:
        """How many of the searches came within 1 % of the best value."""
        return int(np.sum(self.reached <= (1 + SAME) * self.value))


def best_course(
    scenario: Scenario,
    objective: Objective,
    speed: ArrayLike,
    turn_rate: float,
    *,
    legs: int = 8,
    any_heading: bool = False,
    keep_out: float = 0.0,
    states: ArrayLike | None = None,
    starts: int = 20,
    seed: Seed = 0,
) -> Plan:
    """The course with the smallest objective that a search from random courses finds.

    Parameters
    ----------
    scenario : Scenario
        Its platform says where the course begins, at the first measurement, and with which heading.
    objective : callable
        `position_area`, `worst_shift`, or another positive function of whitened Jacobians ``(..., N, n)``.
    speed : float or (lowest, highest)
        In m/s: one for all legs, or limits between which each leg has its own.
    turn_rate : float
        Largest turn rate to either side, in rad/s.
    legs : int
        Parts of equal duration, each with its turn rate.
    any_heading : bool
        Whether the first heading may be chosen, too.
    keep_out : float
        Smallest distance from the target, in metres, at the measurements; 0 for none.
    states : array_like, shape (Q, n) or (n,), optional
        What the target may do; its true state by default. The mean logarithm over them is minimised.
    starts : int
        Random courses from which the search starts; every second has two turn rates only.
    seed : int, SeedSequence or Generator

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        For bad arguments, a platform without a heading, a state that does not move uniformly, and when
        no search ends in a course that keeps out.

    Notes
    -----
    Each search is scipy's SLSQP, a local method; its gradient is by differences, all courses of a step in
    one batch.

    Examples
    --------
    A target to the north, a ship that heads east. The best that it can do in ten minutes is to come back:

    >>> import numpy as np, tmalib as tma
    >>> from tmalib.objectives import position_area
    >>> ship = tma.Course((0, 0), 5, np.radians(90), [tma.Straight(600)])
    >>> bearings = tma.Sensor(tma.Bearing(), np.arange(0, 601.0, 20), np.radians(1))
    >>> target = tma.Target((0, 12000), speed=4, heading=np.radians(90))
    >>> watch = tma.Scenario(ship, [bearings], reference_time=0, target=target)
    >>> plan = best_course(watch, position_area(watch), 5.0, np.radians(1), legs=4, starts=6)
    >>> np.degrees(plan.course.heading_at([0.0, 300.0, 600.0])).round(-1)
    array([  90., -120., -260.])
    """
    from scipy.optimize import minimize  # imported here: it costs half a second

    check_has("the platform of the scenario", check_is("scenario", scenario, Scenario).platform, "heading_at")
    limits = np.broadcast_to(as_numbers("speed", speed), 2)
    if not 0 <= check_scalar("speed", limits[0]) <= check_scalar("speed", limits[1]):
        raise ValueError(f"speed must be one number or (lowest, highest), not negative, got {speed!r}")
    legs, starts = check_count("legs", legs), check_count("starts", starts)
    courses = _Courses(
        scenario,
        limits,
        check_scalar("turn_rate", turn_rate, above=0.0),
        legs,
        check_flag("any_heading", any_heading),
    )
    keep_out = check_scalar("keep_out", keep_out, minimum=0.0)
    states = scenario.check_state(scenario.state if states is None else as_numbers("states", states))
    rng, found = check_seed(seed), []
    measure = _measured(scenario, courses, objective, np.atleast_2d(states), keep_out)
    room = [{"type": "ineq", "fun": lambda x: measure(x)[2], "jac": lambda x: measure(x)[3]}]
    for k in range(starts):
        one = minimize(
            lambda x: measure(x)[0],
            courses.draw(rng, whole=k % 2 == 1),
            jac=lambda x: measure(x)[1],
            bounds=np.column_stack([courses.low, courses.high]),
            constraints=room if keep_out else [],
            method="SLSQP",
            options={"maxiter": 100, "ftol": TOLERANCE},
        )
        x = np.clip(one.x, courses.low, courses.high)
        if not keep_out or measure(x)[2].min() > -SLACK:
            found.append((float(np.exp(measure(x)[0])), x))
    if not found:
        raise ValueError(f"no search ended in a course that keeps {keep_out} m away from the target")
    found.sort(key=lambda end: end[0])
    best = courses.course(found[0][1])
    reached = np.array([value for value, _ in found])
    return Plan(best, found[0][0], reached, float(_distances(scenario, [best], states).min()))


class _Courses:
    """Courses by variables: of each leg the turn rate in [-1, 1] and the speed in [0, 1]; first heading."""

    def __init__(self, scenario, speeds, turn_rate, legs, any_heading):
        self.begin, end = float(scenario.times.min()), float(scenario.times.max())
        self.place = scenario.platform.position_at(self.begin)
        self.heading = float(scenario.platform.heading_at(self.begin))
        self.speeds, self.turn_rate, self.legs = speeds, turn_rate, legs
        self.duration = (end - self.begin) / legs
        own, free = legs * (speeds[1] > speeds[0]), int(any_heading)
        self.low = np.concatenate([-np.ones(legs), np.zeros(own), -np.ones(free)])
        self.high = np.ones(len(self.low))

    def draw(self, rng, whole):
        """Random variables; a ``whole`` course has two turn rates only, one after the other."""
        x = rng.uniform(self.low, self.high)
        if whole:
            first = np.arange(self.legs) < rng.integers(1, self.legs + 1)
            x[: self.legs] = np.where(first, x[0], x[self.legs - 1])
        return x

    def course(self, x):
        """The course of variables ``(n,)``."""
        slowest, fastest = self.speeds
        speeds = np.full(self.legs, fastest)
        if fastest > slowest:
            speeds = slowest + (fastest - slowest) * x[self.legs : 2 * self.legs]
            speeds = np.maximum(speeds, 0.0)  # the search may step out by a rounding error
        free = len(x) - self.legs * (1 + (fastest > slowest))
        heading = self.heading + (np.pi * x[-1] if free else 0.0)
        parts = [
            Leg(self.duration, self.turn_rate * rate, speed)
            for rate, speed in zip(x[: self.legs], speeds, strict=True)
        ]
        return Course(self.place, speeds[0], heading, parts, self.begin)


def _measured(scenario, courses, objective, states, keep_out):
    """A function of x: mean logarithm of the objective, its gradient, room to the target, its gradient."""
    kept: dict[bytes, tuple[Any, ...]] = {}

    def measure(x):
        if (key := x.tobytes()) not in kept:
            around = [courses.course(x + step) for step in np.vstack([0 * x, STEP * np.eye(len(x))])]
            values = objective_of_courses(scenario, around, objective, states)
            values = np.nan_to_num(values, nan=UNSEEN, posinf=UNSEEN)
            if not (values > 0).all():
                raise ValueError(f"objective must be positive, got {values.min()}")
            log = np.log(values).mean(axis=1)
            room = np.zeros((len(around), 0))
            if keep_out:
                apart = _distances(scenario, around, states).min(axis=1)
                parts = np.array_split(apart, courses.legs, axis=1)
                room = np.stack([part.min(axis=1) for part in parts if part.size], axis=1) / keep_out - 1
            kept.clear()
            kept[key] = log[0], (log[1:] - log[0]) / STEP, room[0], ((room[1:] - room[0]) / STEP).T
        return kept[key]

    return measure


def _distances(scenario, courses, states):
    """Distances of platform and target ``(B, Q, N)``, at the times of all measurements in order."""
    names = scenario.coordinates
    elapsed = np.unique(scenario.times)
    target = propagate(np.atleast_2d(states)[:, None], elapsed - scenario.reference_time, names)
    here = np.stack([course.position_at(elapsed) for course in courses])
    gap = target[..., [names.index(name) for name in POSITION]] - here[:, None]
    return np.hypot(gap[..., 0], gap[..., 1])
