"""The moment at which the array turns from one straight leg to another, and the target relative to it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ..cones import ConicalAngle
from ..motion import Course, Target
from .family import Family

# What is zero up to rounding: lengths, relative to the largest length in the scenario; velocities, relative
# to the sum of both speeds; sines of angles.
TOLERANCE = 1e-13
INSTANTS = 5


@dataclass(frozen=True)
class TurnMoment:
    """The moment of the turn. Row i of ``e``, ``n``, ``V``, ``w`` belongs to leg i."""

    time: float
    durations: tuple  # seconds observed before and after
    place: np.ndarray
    e: np.ndarray
    speed: float
    p: np.ndarray
    V_T: np.ndarray
    depth: float
    model: ConicalAngle
    length: float

    @cached_property
    def n(self):
        """Normals of the two headings."""
        return self.e[:, ::-1] * [1, -1]

    @cached_property
    def V(self):
        """Velocities of the array."""
        return self.speed * self.e

    @cached_property
    def chord(self):
        """Change of the array's velocity, ``V_2 - V_1``."""
        return self.V[1] - self.V[0]

    @cached_property
    def w(self):
        """Velocities of the target relative to the array."""
        return self.V_T - self.V

    @cached_property
    def slope(self):
        """Change of the image's depth with the target's: 1 or -1."""
        return self.model.path.image(self.model.bottom_depth)[0]

    @cached_property
    def zeta(self):
        """Depth of the image below the array."""
        slope, offset = self.model.path.image(self.model.bottom_depth)
        return slope * self.depth + (offset - self.model.array_depth)  # in the order of `ConicalAngle`

    @cached_property
    def level(self):
        """Whether the image is at the array's depth."""
        return self.zero(self.zeta)

    @cached_property
    def overhead(self):
        """Whether the image is right above or below the array."""
        return self.zero(self.p)

    def zero(self, length):
        return bool(np.all(np.abs(length) <= TOLERANCE * self.length))

    def still(self, velocity):
        return bool(np.all(np.abs(velocity) <= TOLERANCE * (self.speed + np.hypot(*self.V_T))))

    def broadside(self, i):
        return self.zero(self.e[i] @ self.p) and self.still(self.e[i] @ self.w[i])

    def mirrored(self, i, vector):
        return 2 * (self.e[i] @ vector) * self.e[i] - vector

    def ends(self, p, velocity):
        """Relative positions at the first and the last instant."""
        return [
            p + s * (velocity - V)
            for s, V in zip((-self.durations[0], self.durations[1]), self.V, strict=True)
        ]

    def member(self, p, velocity, depth):
        """The target at ``p`` from the array at the turn."""
        on_array = self.zero(p) and self.zero(self.zeta + self.slope * (depth - self.depth))
        if on_array and not (self.overhead and self.level):
            raise ValueError(f"depth = {depth} puts the ghost on the array at the turn")
        return Target.from_velocity(self.place + p, velocity, depth=depth, time=self.time)

    def depth_at(self, zeta):
        return self.depth + (zeta - self.zeta) / self.slope

    def family(self, case, make, **parameters):
        return Family(case, "conical-angles, Theorem 2", make, parameters)

    def isolated(self, case, beta, velocity, sign=1):
        depth = self.depth_at(sign * beta * self.zeta)
        return self.family(case, partial(self.member, beta * self.p, velocity, depth))


def cross(a, b):
    """Third component of the vector product."""
    return a[0] * b[1] - a[1] * b[0]


def turn_of(scenario):
    """The moment of the turn, or `ValueError` for a scenario that is not covered."""
    target, course = scenario.target, scenario.platform
    if not isinstance(target, Target) or target.depth is None:
        raise ValueError(f"target must be a Target with a depth, got {target!r}")
    if len(scenario.sensors) != 1 or not isinstance(scenario.sensors[0].model, ConicalAngle):
        names = [type(sensor.model).__name__ for sensor in scenario.sensors]
        raise ValueError(f"sensors must be one ConicalAngle sensor, got {names}")
    (sensor,) = scenario.sensors
    if sensor.model.heading_lag:
        raise ValueError(f"heading_lag must be 0, got {sensor.model.heading_lag}")
    if not isinstance(course, Course) or len(course.legs) != 2 or any(leg.rate for leg in course.legs):
        raise ValueError(f"platform must be a Course of two Straight legs, got {course!r}")
    (*_, heading, speed, _), (time, *place, heading_2, speed_2, _) = course.leg_starts
    if not speed > 0 or abs(speed_2 - speed) > TOLERANCE * speed:
        raise ValueError(f"both legs must have the same positive speed, got {speed} and {speed_2}")
    if abs(np.sin(heading_2 - heading)) <= TOLERANCE and np.cos(heading_2 - heading) > 0:
        raise ValueError("both legs have the same heading: there is no turn, use one leg")
    counts = [int(np.sum(sensor.times < time)), int(np.sum(sensor.times > time))]
    if min(counts) < INSTANTS:
        raise ValueError(
            f"each leg needs at least {INSTANTS} instants, got {counts} before and after the turn"
        )
    legs = (time - sensor.times[0], sensor.times[-1] - time)
    place, e = np.array(place), np.array([[np.sin(h), np.cos(h)] for h in (heading, heading_2)])
    p = target.position_at(time) - place
    way = np.hypot(*target.velocity) * max(abs(time - target.time), *legs)
    vertical = [target.depth, sensor.model.bottom_depth]
    length = max(np.abs([*place, *target.position, *p, way, speed * max(legs), *vertical]))
    turn = TurnMoment(time, legs, place, e, speed, p, target.velocity, target.depth, sensor.model, length)
    for w, end in zip(turn.w, turn.ends(p, turn.V_T), strict=True):
        radial = turn.level and not turn.overhead and abs(cross(p, w)) <= TOLERANCE * length * np.hypot(*w)
        if radial and p @ end < 0:
            raise ValueError("the target passes through the array during a leg, where it has no cosine")
    return turn
