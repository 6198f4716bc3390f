"""`conical-angles`: the scenes in which the chapters on Theorems 1 and 2 draw ghosts; metres and seconds.

Neither is a scenario of the paper. Array and bottom have the depths of its Sections 3.2 and 4.2.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...cones import ConicalAngle
from ...motion import Course, Straight, Target, unit
from ...scenario import Scenario, Sensor
from .scenarios import ARRAY_DEPTH, BOTTOM_DEPTH

SPEED = 5.0  # m/s, of the array
SIGMA = 0.017  # plays no part

HEADING = np.radians(30)  # one leg
ACROSS = np.array([np.cos(HEADING), -np.sin(HEADING)])  # to the right of the array
AHEAD = np.array([np.sin(HEADING), np.cos(HEADING)])

LEGS = np.radians([-40, 60])  # two legs
TURN = 300.0  # s, time of the turn


def one_leg(start, velocity, depth, path):
    """A target seen from one leg on a heading of 30 degrees, for ten minutes.

    Parameters
    ----------
    start, velocity : (2,)
        Position at the start and velocity relative to the array, across (to the right) and ahead.
    depth : float
    path : RayPath

    Returns
    -------
    Scenario
    """
    array = Course((0, 0), SPEED, HEADING, [Straight(np.inf)])
    target = Target.from_velocity(
        start[0] * ACROSS + start[1] * AHEAD,
        SPEED * AHEAD + velocity[0] * ACROSS + velocity[1] * AHEAD,
        depth=depth,
    )
    sensor = Sensor(ConicalAngle(path, ARRAY_DEPTH, BOTTOM_DEPTH), np.arange(0, 601, 10.0), SIGMA)
    return Scenario(array, [sensor], reference_time=0, target=target)


def relative(scenario, motion, times):
    """Positions relative to the array of a scenario of `one_leg`, ``(..., 2)``: across and ahead."""
    d = motion.position_at(times) - scenario.platform.position_at(times)
    return np.stack([d @ ACROSS, d @ AHEAD], axis=-1)


def two_legs(p, velocity, path, depth, headings=LEGS):
    """A target seen from two legs of five minutes each, with the array at the origin at the turn.

    Parameters
    ----------
    p, velocity : (2,)
        Position at the turn and velocity, east and north.
    depth : float
    path : RayPath
    headings : (2,)
        Of the two legs, in radians.

    Returns
    -------
    Scenario
        Its reference time is that of the turn.
    """
    legs = [Straight(TURN), Straight(TURN, heading=headings[1])]
    array = Course(-SPEED * TURN * unit(headings[0]), SPEED, headings[0], legs)
    target = Target.from_velocity(p, velocity, depth=depth, time=TURN)
    model = ConicalAngle(path, ARRAY_DEPTH, BOTTOM_DEPTH)
    sensor = Sensor(model, np.arange(2.0, 2 * TURN, 4.0), SIGMA)
    return Scenario(array, [sensor], reference_time=TURN, target=target)


def disagreement(scenario, other):
    """Largest difference between the cosines of a scenario's target and those of another one."""
    return np.abs(replace(scenario, target=other).measure() - scenario.measure()).max()
