"""`emw-acoustic`: both estimators on other courses of the observer than the one that made the tables.

On the course as printed, and in scenarios 5 and 6 without their second turn: same duration, sensors and
target, so that what differs is the manoeuvre alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...batch import fit
from ...motion import SampledCourse, Straight, unit
from ...recursive import ekf
from . import scenarios as emw


def final_errors(seed, runs, number, path="computed", second_turn=True):
    """Errors of both estimators at the end, ``mle`` and ``ekf``, each ``(runs, 4)``.

    ``seed`` and ``runs`` as for `Scenario.simulate`, the others as for `scenario_on`.
    """
    now = scenario_on(number, path, second_turn)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    track = ekf(emw.filter_scenario(now), angles, emw.prior(start))
    return {"mle": fit(now, angles, start).state - now.state, "ekf": track.state[:, -1] - now.state}


def scenario_on(number, path="computed", second_turn=True):
    """A scenario with the observer's path as computed or as printed, with or without its second turn.

    Parameters
    ----------
    number : int
        Scenario 1 to 6; without the second turn 5 or 6.
    path : {"computed", "printed"}
    second_turn : bool
        If not, the observer keeps heading and speed of its second straight leg to the end.

    Raises
    ------
    ValueError
        For another path or number, or a second turn left out where there is none.
    """
    now = emw.scenario(number, path=path)
    if second_turn:
        return now
    if number not in (5, 6):
        raise ValueError(f"number must be 5 or 6, which have a second turn, got {number!r}")
    straight_on = _printed_straight_on if path == "printed" else _computed_straight_on
    return replace(now, platform=straight_on(number))


def _printed_straight_on(number):
    course = emw.course_as_printed(number)
    return replace(course, legs=[*course.legs[:2], Straight(np.inf, heading=emw.NORTH_WEST)])


def _computed_straight_on(number):
    course = emw.course_as_computed(number)
    turn = emw.scenario(number - 4).reference_time  # the last sample before the second turn
    late = course.times > turn
    after = (course.times[late] - turn)[:, None] * emw.OBSERVER_SPEED
    positions, headings = course.positions.copy(), course.headings.copy()
    positions[late] = course.position_at(turn) + after * unit(emw.NORTH_WEST)
    headings[late] = emw.NORTH_WEST
    return SampledCourse(course.times, positions, headings)


def one_turn(radius, speed, headings, rate):
    """The path as computed of scenarios 1 and 3 with every number free, the turn rate too.

    Parameters
    ----------
    radius : float
        Of the turn, to the left, in metres.
    speed : float
        On the straight legs, in m/s.
    headings : sequence of float
        Of the two straight legs, in radians.
    rate : float
        By which the heading falls in the turn, in rad/s.

    Returns
    -------
    SampledCourse
        200, 400 and 600 samples, one a second; each leg starts with the last sample of the leg before.
    """
    first, turn, last = (np.arange(count, dtype=float) for count in (200, 400, 600))
    start = speed * first[:, None] * unit(headings[0])
    along = headings[0] - rate * turn
    left = np.stack([-np.cos(along), np.sin(along)], axis=-1)  # of the course: towards the centre
    bend = start[-1] + radius * (left[0] - left)
    end = bend[-1] + speed * last[:, None] * unit(headings[1])
    heading = [np.full(200, headings[0]), along, np.full(600, headings[1])]
    return SampledCourse(np.arange(1200.0), np.concatenate([start, bend, end]), np.concatenate(heading))
