"""The best manoeuvre: the two problems that the papers leave, rules of thumb, and what the rules cost.

The *array* is that of `conical-angles`, Section 4.2, with the depth in the state; its objective the area of
the 90 % ellipse of the first position. The *aircraft* is that of `robustness`, Section IV, in the assumed
geometry; its objective the largest first-order error of the last position by a target that departs by 15 m
from its uniform motion. Measurements are thinned where a search needs many courses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from .. import objectives, planning, sensitivity
from ..batch import fit
from ..montecarlo import Stream
from ..motion import Course, Straight, Turn
from ..papers.conical_angles import scenarios as conical
from ..papers.robustness import scenarios as robust
from ..uniform import propagate

STREAM = Stream("beyond/manoeuvre")
LEGS, STARTS = 8, 8
KEEP_OUT = 2e3  # m: the aircraft comes no nearer to a target


@dataclass(frozen=True, eq=False)
class Problem:
    """Who looks how, within which limits, and what is to be small.

    Attributes
    ----------
    scenario : Scenario
    speed, turn_rate : float
        In m/s and rad/s.
    objective : callable
        See `tmalib.objectives`.
    """

    scenario: object
    speed: float
    turn_rate: float
    objective: object

    @property
    def duration(self):
        """From the first to the last measurement, in seconds."""
        return float(np.ptp(self.scenario.times))

    def value(self, *courses, states=None):
        """The objective of courses, ``(B,)`` or ``(B, Q)``."""
        return objectives.objective_of_courses(self.scenario, courses, self.objective, states)

    def best(self, **options):
        """`planning.best_course` within the limits."""
        options = {"legs": LEGS, "starts": STARTS, "speed": self.speed, "turn_rate": self.turn_rate} | options
        return planning.best_course(self.scenario, self.objective, **options)


def thinned(scenario, every):
    """The scenario with every m-th measurement of its one sensor, and the last; each stands for its like.

    The variances are divided by the weights of the trapezoidal rule, which add up to the number of
    measurements.
    """
    (sensor,) = scenario.sensors
    kept = np.unique([*range(0, len(sensor), every), len(sensor) - 1])
    gaps = np.diff(kept)
    weights = (np.append(1, gaps) + np.append(gaps, 1)) / 2
    return replace(scenario, sensors=[replace(sensor.keep(kept), sigma=sensor.sigma / np.sqrt(weights))])


def array(every=1, time=None):
    """The `Problem` of the towed array; ``time``, of the position that counts, is 0 s by default."""
    scenario = thinned(conical.section_4_2(), every)
    leg = scenario.platform.legs[1]
    return Problem(scenario, scenario.platform.speed, leg.rate, objectives.position_area(scenario, time))


def aircraft(noise=False, every=5):
    """The `Problem` of the aircraft; with ``noise`` the objective is the area of the last position."""
    scenario = robust.reference().straight
    scenario = thinned(scenario.keep(scenario.times > 0), every)
    end = robust.DURATION
    area, worst = objectives.position_area(scenario, end), objectives.worst_shift(scenario, robust.WORST, end)
    rate = robust.PLATFORM_ACCELERATION / robust.PLATFORM_SPEED
    return Problem(scenario, robust.PLATFORM_SPEED, rate, area if noise else worst)


# -- rules of thumb -----------------------------------------------------------------------------


def _turned_once(angle, first, through):
    """A rule: straight, a turn by ``angle`` at half time, straight; it begins ``first`` beside the target."""

    def course(problem, toward, side):
        times, rate = problem.scenario.times, problem.turn_rate
        turn = angle / rate
        rest = (problem.duration - turn) / 2
        legs = [Straight(rest), Turn(turn, -side * through * rate), Straight(rest)]
        start = problem.scenario.platform.position_at(times[0])
        return Course(start, problem.speed, toward + side * first, legs, times[0])

    return course


def _weave(problem, toward, side):
    """Turns by 90 degrees to either side of a course across the line of sight: half one, whole ones."""
    times, rate = problem.scenario.times, problem.turn_rate
    quarter = np.pi / 4 / rate
    ends = np.append(np.arange(quarter, problem.duration - 1e-9, 2 * quarter), problem.duration)
    legs = [Turn(part, side * rate * (-1) ** k) for k, part in enumerate(np.diff(ends, prepend=0.0))]
    start = problem.scenario.platform.position_at(times[0])
    return Course(start, problem.speed, toward + side * np.pi / 2, legs, times[0])


def _circle(problem, toward, side):
    times = problem.scenario.times
    start = problem.scenario.platform.position_at(times[0])
    legs = [Turn(problem.duration, -side * problem.turn_rate)]
    return Course(start, problem.speed, toward + side * np.pi / 2, legs, times[0])


RULES = {
    "reversal towards": _turned_once(np.pi, np.pi / 2, 1),
    "reversal away": _turned_once(np.pi, np.pi / 2, -1),
    "across, then towards": _turned_once(np.pi / 2, np.pi / 2, 1),
    "V towards": _turned_once(np.pi / 2, np.pi / 4, 1),
    "circle": _circle,
    "weave across": _weave,
}


def rule(name, problem, side=1):
    """The course of a rule of thumb, by the target's first bearing; ``side`` 1 has the target to the left."""
    return RULES[name](problem, first_bearing(problem), side)


def first_bearing(problem):
    """Bearing of the problem's target at the first measurement, in radians."""
    scenario, first = problem.scenario, problem.scenario.times[0]
    return float(np.arctan2(*(scenario.target.position_at(first) - scenario.platform.position_at(first))))


# -- the target is not known --------------------------------------------------------------------


def array_states(rng, count, toward):
    """Targets that the array may meet, ``(count, 5)``: 4 to 16 km away, at 1 to 8 m/s on any course."""
    distance, speed = rng.uniform(4e3, 16e3, count), rng.uniform(1, 8, count)
    heading = rng.uniform(0, 2 * np.pi, count)
    return np.stack(
        [
            distance * np.sin(toward),
            distance * np.cos(toward),
            np.full(count, conical.TARGET_DEPTH),
            speed * np.sin(heading),
            speed * np.cos(heading),
        ],
        axis=1,
    )


def aircraft_states(rng, count, toward):
    """Targets that the aircraft may meet, ``(count, 4)``: 4 to 15 km away, at 270 m/s on any course."""
    place = np.array(robust.PLATFORM_START)
    distance, heading = rng.uniform(4e3, 15e3, count), rng.uniform(0, 2 * np.pi, count)
    line, course = (np.stack([np.sin(a), np.cos(a)]) for a in (np.full(count, toward), heading))
    return np.concatenate([place[:, None] + distance * line, robust.TARGET_SPEED * course]).T


def with_target(problem, state, toward):
    """The side of a rule that first goes the way the target draws; 1 if it draws to the right."""
    places = [problem.scenario.coordinates.index(name) for name in ("vx", "vy")]
    return 1 if state[places] @ [np.cos(toward), -np.sin(toward)] > 0 else -1


def nearest(problem, course, state):
    """Smallest distance of a course and a target at the measurements, in metres."""
    times = problem.scenario.times
    there = propagate(state, times - problem.scenario.reference_time, problem.scenario.coordinates)
    return float(np.hypot(*(there[:, :2] - course.position_at(times)).T).min())


def prices(seed, runs, which):
    """Objectives of rules and of the best course, for random targets in the direction of the first bearing.

    Parameters
    ----------
    seed : seed of the random numbers
    runs : int
        Targets.
    which : {"array", "aircraft"}
        The best course may begin with any heading. The aircraft's comes no nearer than `KEEP_OUT`; targets
        that come nearer on a rule's course are drawn again.

    Returns
    -------
    dict
        ``"states"`` ``(runs, n)``; ``"rules"`` ``(runs, 6, 2)`` in the order of `RULES`, first with the
        target and then against it (`with_target`); ``"best"`` ``(runs,)``.
    """
    rng = np.random.default_rng(seed)
    problem = array(every=4) if which == "array" else aircraft(every=12)
    kinds = {"array": (array_states, 0.0, 6), "aircraft": (aircraft_states, KEEP_OUT, STARTS)}
    draw, keep_out, starts = kinds[which]
    toward = first_bearing(problem)
    found = {"states": [], "rules": [], "best": []}
    while len(found["best"]) < runs:
        (state,) = draw(rng, 1, toward)
        side = with_target(problem, state, toward)
        courses = [make(problem, toward, s) for make in RULES.values() for s in (side, -side)]
        if min(nearest(problem, course, state) for course in courses) < keep_out:
            continue
        plan = problem.best(states=state, any_heading=True, keep_out=keep_out, seed=rng, starts=starts)
        found["states"].append(state)
        found["rules"].append(problem.value(*courses, states=state).reshape(-1, 2))
        found["best"].append(plan.value)
    return {name: np.array(values) for name, values in found.items()}


array_prices, aircraft_prices = (partial(prices, which=which) for which in ("array", "aircraft"))


def drawing_right(problem, states):
    """States ``(Q, n)`` mirrored about the first bearing, so that all targets draw to the right."""
    toward = first_bearing(problem)
    right = np.array([np.cos(toward), -np.sin(toward)])
    places = [problem.scenario.coordinates.index(name) for name in ("vx", "vy")]
    states = states.copy()
    states[:, places] -= 2 * np.minimum(states[:, places] @ right, 0.0)[:, None] * right
    return states


# -- how sure -----------------------------------------------------------------------------------


def searches(seed, runs):
    """Where searches of the array's best course end, each from one random course: ``{"area": (runs,)}``."""
    return {"area": array().best(starts=runs, seed=seed).reached}


def attained(seed, runs):
    """Errors of the estimated first position, ``(runs, 2)``, on the ``paper``'s and the ``best`` course."""
    problem = array()
    rng, found = np.random.default_rng(seed), {}
    for name, course in (("paper", problem.scenario.platform), ("best", problem.best().course)):
        scenario = replace(problem.scenario, platform=course)
        result = fit(scenario, scenario.simulate(runs, rng), scenario.state, max_iterations=2000)
        found[name] = (result.state - scenario.state)[:, :2]
        found[f"{name}_converged"] = result.converged
    return found


def worst_in_truth(problem, course, bound=robust.WORST):
    """The error of the last position by the worst displacement, in metres: to first order, and by fits.

    Returns
    -------
    float, ndarray of shape (2,)
        The latter for the displacement and its negative.
    """
    scenario = replace(problem.scenario, platform=course)
    final = sensitivity.position_criterion(scenario, robust.DURATION)
    worst = sensitivity.worst_sup(scenario, bound, criterion=final)
    measured = sensitivity.displaced_measurements(scenario, np.stack([worst, -worst]))
    found = fit(scenario, measured, scenario.state, tolerance=1e-6)
    linear = np.linalg.norm(final @ sensitivity.differential(scenario, worst))
    return float(linear), np.linalg.norm((found.state - scenario.state) @ final.T, axis=1)


def all_hard(problem, legs=8):
    """Objectives of all courses of legs that turn hard left, go straight, or turn hard right, sorted."""
    sides = np.array(list(product((-1, 0, 1), repeat=legs)))
    begin, platform = problem.scenario.times[0], problem.scenario.platform
    start, heading, stage = platform.position_at(begin), platform.heading_at(begin), problem.duration / legs

    def course(row):
        return Course(start, problem.speed, heading, [Turn(stage, problem.turn_rate * k) for k in row], begin)

    parts = np.array_split(sides, max(len(sides) // 200, 1))
    return np.sort(np.concatenate([problem.value(*map(course, part)) for part in parts]))


def floor_of_shift(distance, acceleration, duration=robust.DURATION, bound=robust.WORST):
    """No course with that acceleration, and that distance at the end, has a smaller worst error, in metres.

    A platform's way from its nearest uniform motion is at most ``A = acceleration duration^2 / 16``
    (Chebyshev's interpolation), and a target that copies the share ``bound / A`` of it is not seen.
    """
    away = acceleration * duration**2 / 16
    return bound * (distance - away) / away
