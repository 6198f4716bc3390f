"""`emw-acoustic`: random geometries of a target and an observer that does not turn.

Two general kinds, and the five in which the bearing is constant: the exceptions to the claim that light and
sound together make the state observable. The paper mentions none of them.
"""

from __future__ import annotations

import numpy as np

from ...bearings import Bearing, DelayedBearing, bearing
from ...motion import Course, Straight, Target
from ...scenario import Scenario, Sensor
from .scenarios import SOUND_SPEED

DURATION = 600.0  # s
KINDS = (
    "motionless observer",
    "straight observer",
    "motionless observer, radial target",
    "motionless observer, fixed target",
    "straight observer, collision course",
    "straight observer, receding target",
    "straight observer, same velocity",
)


def random_scene(kind, rng):
    """Position of the target at the start, its velocity and the observer's, each ``(2,)``.

    The observer starts at the origin, the target is 10 to 30 km away, and speeds are 1 to 15 m/s. What the
    kind does not set is random.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    rng : numpy.random.Generator
    """
    if kind not in KINDS:
        raise ValueError(f"kind must be one of {KINDS}, got {kind!r}")
    position, observer, velocity = (_vector(rng, *ends) for ends in ((10e3, 30e3), (1, 15), (1, 15)))
    sight = position / np.hypot(*position)
    if "motionless" in kind:
        observer = np.zeros(2)
    if "radial" in kind:
        velocity = rng.choice([-1, 1]) * rng.uniform(1, 15) * sight
    if "fixed" in kind:
        velocity = np.zeros(2)
    if "collision" in kind:
        velocity = observer - rng.uniform(1, 15) * sight
    if "receding" in kind:
        velocity = observer + rng.uniform(1, 15) * sight
    if "same" in kind:
        velocity = observer
    return position, velocity, observer


def _vector(rng, low, high):
    length, heading = rng.uniform(low, high), rng.uniform(0, 2 * np.pi)
    return length * np.array([np.sin(heading), np.cos(heading)])


def scene(position, velocity, observer):
    """`Scenario` of a geometry: ten minutes, light every 20 s and sound every 30 s, the state at the start.

    Parameters
    ----------
    position, velocity, observer : ndarray
        As `draw` gives them: metres and m/s.
    """
    sigma = np.radians(1)
    light_times, sound_times = np.arange(0.0, DURATION + 1, 20.0), np.arange(0.0, DURATION + 1, 30.0)
    return Scenario(
        Course((0, 0), np.hypot(*observer), bearing(observer), [Straight(np.inf)]),
        [Sensor(Bearing(), light_times, sigma), Sensor(DelayedBearing(SOUND_SPEED), sound_times, sigma)],
        reference_time=0.0,
        target=Target.from_velocity(position, velocity),
    )
