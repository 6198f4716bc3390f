"""`robustness`: the scenario of Section IV, with the geometry that the paper leaves open.

The paper gives speeds, accelerations, the observation time, the noise and the size of the worst
perturbation. It gives neither positions nor the platform's path. What is assumed here meets all that it does
give: a platform that weaves with a period of 7 s, and a target that comes from the north. `random_geometry`
draws others.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...bearings import Bearing
from ...motion import Course, SampledCourse, Target, Turn
from ...scenario import Scenario, Sensor
from ...sensitivity import nearest_motion, response, worst_energy

DURATION = 20.0  # s
RATE = 25.0  # Hz, "video frequency"
SIGMA = 5e-3  # rad
PLATFORM_SPEED, PLATFORM_ACCELERATION = 250.0, 50.0  # m/s, m/s^2
TARGET_SPEED, TARGET_ACCELERATION = 270.0, 7.0
WORST = 15.0  # m, sup norm of the worst perturbation

# Assumed, not printed.
PLATFORM_START, PLATFORM_HEADING = (-5000.0, 3000.0), np.radians(190)
TARGET_START, TARGET_HEADING = (200.0, 6000.0), np.radians(170)
WEAVE_PERIOD = 7.0  # s
PERIODIC_AMPLITUDE, PERIODIC_PERIOD = 100.0, 1.0  # m, s


def weave(start, heading, period, duration=DURATION):
    """A platform that turns left and right with the printed speed and acceleration.

    Parameters
    ----------
    start : array_like, shape (2,)
        In metres.
    heading : float
        At the start, in the middle of a left turn, in radians.
    period : float
        In seconds: a quarter to the left, then halves to the right and to the left in turn.
    """
    rate = PLATFORM_ACCELERATION / PLATFORM_SPEED
    ends = np.append(np.arange(period / 4, duration, period / 2), duration)
    legs = [Turn(length, -rate * (-1) ** k) for k, length in enumerate(np.diff(ends, prepend=0.0))]
    return Course(start, PLATFORM_SPEED, heading, legs)


def circular(start, heading, side=1):
    """The circular target: printed speed and acceleration; ``side`` 1 turns to the right, -1 to the left."""
    rate = side * TARGET_ACCELERATION / TARGET_SPEED
    return Course(start, TARGET_SPEED, heading, [Turn(DURATION, rate)])


@dataclass(frozen=True, eq=False)
class Geometry:
    """A platform's course and a circular target: what the paper leaves open, and what follows from it.

    Attributes
    ----------
    platform, target : Course
    """

    platform: Course
    target: Course

    def __post_init__(self):
        self.circle  # noqa: B018  a target on the platform is refused here

    def _measured(self, target):
        times = np.arange(1, int(DURATION * RATE) + 1) / RATE
        return Scenario(
            self.platform, [Sensor(Bearing(), times, SIGMA, "camera")], reference_time=0.0, target=target
        )

    @cached_property
    def circle(self):
        """The scenario with the circular target (Figures 1, 2, 5 and 6)."""
        return self._measured(self.target)

    @cached_property
    def theta_star(self):
        """The uniform motion nearest to the circle, in the sum of distances, shape ``(4,)``."""
        return nearest_motion(self.circle.times, self.target.position_at(self.circle.times), norm="sum")

    @cached_property
    def straight(self):
        """The scenario with the target on that uniform motion: what the estimator assumes."""
        return self._measured(Target.from_velocity(self.theta_star[:2], self.theta_star[2:]))

    @cached_property
    def circle_displacement(self):
        """Circle minus nearest uniform motion at the times of measurement, shape ``(N, 2)``."""
        times = self.circle.times
        return self.target.position_at(times) - self.straight.target.position_at(times)

    @cached_property
    def worst_displacement(self):
        """The paper's worst perturbation: strongest mode of the parameter norm, largest value 15 m."""
        return worst_energy(self.straight, WORST)

    def displaced(self, displacement):
        """The scenario with the uniform motion displaced by ``(N, 2)``, straight lines between samples."""
        times = self.straight.times
        return self._measured(SampledCourse(times, self.straight.target.position_at(times) + displacement))

    @property
    def final_range(self):
        """Distance of target and platform at the end, in metres."""
        gap = self.straight.target.position_at(DURATION) - self.platform.position_at(DURATION)
        return float(np.hypot(*gap))


def reference():
    """The geometry of the book's figures; assumed, not printed."""
    platform = weave(PLATFORM_START, PLATFORM_HEADING, WEAVE_PERIOD)
    return Geometry(platform, circular(TARGET_START, TARGET_HEADING))


def periodic_displacement(geometry, period=PERIODIC_PERIOD, amplitude=PERIODIC_AMPLITUDE, phase=0.0):
    """A cosine of the given period (s), amplitude (m) and phase across the line of sight, ``(N, 2)``.

    Source: `robustness`, Figure 9, whose period and amplitude are not printed.
    """
    wave = amplitude * np.cos(2 * np.pi * geometry.straight.times / period + phase)
    return response(geometry.straight).displacement(wave)


def random_geometry(rng):
    """A geometry with all that the paper prints, the rest at random.

    Platform: any heading, a weave of 4 to 12 s. Target: 3 to 15 km away in any direction, any heading, a
    turn to either side. Drawn again while the two come nearer than 1 km to each other.
    """
    rng = np.random.default_rng(rng)
    while True:
        platform = weave((0.0, 0.0), rng.uniform(0, 2 * np.pi), rng.uniform(4, 12))
        distance, direction = rng.uniform(3e3, 15e3), rng.uniform(0, 2 * np.pi)
        start = distance * np.array([np.sin(direction), np.cos(direction)])
        target = circular(start, rng.uniform(0, 2 * np.pi), rng.choice([-1, 1]))
        times = np.linspace(0, DURATION, 101)
        if np.hypot(*(target.position_at(times) - platform.position_at(times)).T).min() > 1e3:
            return Geometry(platform, target)
