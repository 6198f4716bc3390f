"""The moment at which the array turns from one straight leg to another, and the target relative to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..cones import ConicalAngle
from ..motion import Course, Target
from ..scenario import Scenario
from ..types import FloatArray, IntArray
from .family import ROUNDING, Family, check_one_array

INSTANTS = 5


@dataclass(frozen=True)
class TurnMoment:
    """The moment of the turn. Row i of ``e``, ``n``, ``V``, ``w`` belongs to leg i.

    Lengths are zero up to rounding relative to ``length``; ``slack`` is the length by which array and target
    may be moved to make them special, and ``tolerance`` what cosines and headings may change by that.
    """

    time: float
    durations: tuple[float, float]  # seconds observed before and after
    place: FloatArray
    e: FloatArray
    speed: float
    p: FloatArray
    V_T: FloatArray
    depth: float
    model: ConicalAngle
    length: float
    instants: FloatArray  # seconds since the turn
    measured: FloatArray
    given: tuple[FloatArray, FloatArray, FloatArray, float]  # e, p, V_T and depth of the scenario
    slack: float
    tolerance: float

    @property
    def cosines(self) -> FloatArray:
        """All measurements; NaN on the array."""
        leg = (self.instants >= 0).astype(int)
        across, ahead = np.moveaxis(self.p + self.instants[:, None] * self.w[leg], -1, 0)
        with np.errstate(invalid="ignore", divide="ignore"):
            distance = np.sqrt(across**2 + ahead**2 + self.zeta**2)
            return (across * self.e[leg, 0] + ahead * self.e[leg, 1]) / distance

    def if_holds(self, **changes: Any) -> TurnMoment | None:
        """This moment with other values, if it is the scenario's for the numbers given; None otherwise."""
        other = replace(self, **changes)
        e, p, velocity, depth = self.given
        moved: list[Any] = [other.p - p, (other.V_T - velocity) * max(self.durations), other.depth - depth]
        moved += [(other.e - e) * self.speed * max(self.durations)]
        near = max(np.max(np.abs(part)) for part in moved) <= self.slack
        near = near and np.max(np.abs(other.e - e)) <= self.tolerance
        return other if near and np.all(np.abs(other.cosines - self.measured) <= self.tolerance) else None

    @cached_property
    def n(self) -> FloatArray:
        """Normals of the two headings."""
        return self.e[:, ::-1] * [1, -1]

    @cached_property
    def V(self) -> FloatArray:
        """Velocities of the array."""
        return self.speed * self.e

    @cached_property
    def chord(self) -> FloatArray:
        """Change of the array's velocity, ``V_2 - V_1``."""
        return self.V[1] - self.V[0]

    @cached_property
    def w(self) -> FloatArray:
        """Velocities of the target relative to the array."""
        return self.V_T - self.V

    @cached_property
    def slope(self) -> float:
        """Change of the image's depth with the target's: 1 or -1."""
        return self.model.path.image(self.model.bottom_depth)[0]

    @cached_property
    def zeta(self) -> float:
        """Depth of the image below the array."""
        slope, offset = self.model.path.image(self.model.bottom_depth)
        return slope * self.depth + (offset - self.model.array_depth)  # in the order of `ConicalAngle`

    @cached_property
    def level(self) -> bool:
        """Whether the image is at the array's depth."""
        return self.zero(self.zeta)

    @cached_property
    def overhead(self) -> bool:
        """Whether the image is right above or below the array."""
        return self.zero(self.p)

    def zero(self, length: ArrayLike) -> bool:
        return bool(np.all(np.abs(length) <= ROUNDING * self.length))

    def still(self, velocity: FloatArray) -> bool:
        """Whether a velocity moves nothing, for the numbers given."""
        return bool(np.all(np.abs(velocity) * max(self.durations) <= self.slack))

    def mirrored(self, i: int, vector: FloatArray) -> FloatArray:
        return 2 * (self.e[i] @ vector) * self.e[i] - vector

    def ends(self, p: FloatArray, velocity: FloatArray) -> list[FloatArray]:
        """Relative positions at the first and the last instant."""
        return [
            p + s * (velocity - V)
            for s, V in zip((-self.durations[0], self.durations[1]), self.V, strict=True)
        ]

    def member(self, p: FloatArray, velocity: FloatArray, depth: float) -> Target:
        """The target at ``p`` from the array at the turn."""
        on_array = self.zero(p) and self.zero(self.zeta + self.slope * (depth - self.depth))
        if on_array and not (self.overhead and self.level):
            raise ValueError(f"depth = {depth} puts the ghost on the array at the turn")
        return Target.from_velocity(self.place + p, velocity, depth=depth, time=self.time)

    def depth_at(self, zeta: float) -> float:
        return self.depth + (zeta - self.zeta) / self.slope

    def family(self, case: str, make: Callable[..., Target], **parameters: tuple[float, float]) -> Family:
        return Family(case, "conical-angles, Theorem 2", make, parameters)

    def isolated(self, case: str, beta: float, velocity: FloatArray, sign: int = 1) -> Family:
        depth = self.depth_at(sign * beta * self.zeta)
        return self.family(case, partial(self.member, beta * self.p, velocity, depth))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Third component of the vector product."""
    return a[0] * b[1] - a[1] * b[0]


def measured_legs(scenario: Scenario) -> IntArray:
    """Indices of the legs of a `Course` on which there are measurements."""
    course: Any = scenario.platform
    return np.unique(np.searchsorted(course.leg_starts[:, 0], scenario.times, side="right") - 1)


def measured_on_a_turn(scenario: Scenario, tolerance: float) -> bool:
    """Whether there are measurements on two legs, of different headings."""
    if not isinstance(scenario.platform, Course) or len(legs := measured_legs(scenario)) != 2:
        return False
    first, second = scenario.platform.leg_starts[legs, 3]
    return not _same_heading(first, second, tolerance)


def _same_heading(first, second, tolerance):
    return abs(np.sin(second - first)) <= tolerance and np.cos(second - first) > 0


def turn_of(scenario: Scenario, tolerance: float) -> TurnMoment:
    """The moment of the turn, or `ValueError` for a scenario that is not covered."""
    check_one_array(scenario)
    target = scenario.target
    course: Any = scenario.platform
    if not isinstance(target, Target) or target.depth is None:
        raise ValueError(f"target must be a Target with a depth, got {target!r}")
    if len(scenario.sensors) != 1 or not isinstance(scenario.sensors[0].model, ConicalAngle):
        names = [type(sensor.model).__name__ for sensor in scenario.sensors]
        raise ValueError(f"sensors must be one ConicalAngle sensor, got {names}")
    (sensor,) = scenario.sensors
    model: Any = sensor.model
    if model.heading_lag:
        raise ValueError(f"heading_lag must be 0, got {model.heading_lag}")
    legs: Any = measured_legs(scenario) if isinstance(course, Course) else []
    straight = [not course.legs[i].rate for i in legs]
    if len(legs) != 2 or legs[1] != legs[0] + 1 or not all(straight):
        raise ValueError(
            f"platform must be a Course with measurements on two Straight legs, one after the other, "
            f"got measurements on the legs {list(map(int, legs))} of {course!r}"
        )
    (*_, heading, speed, _), (time, *place, heading_2, speed_2, _) = course.leg_starts[legs]
    if _same_heading(heading, heading_2, tolerance):
        raise ValueError("both legs have the same heading: there is no turn, use one leg")
    counts = [int(np.sum(sensor.times < time)), int(np.sum(sensor.times > time))]
    if min(counts) < INSTANTS:
        raise ValueError(
            f"each leg needs at least {INSTANTS} instants, got {counts} before and after the turn"
        )
    instants = sensor.times - time
    durations = (-instants[0], instants[-1])
    e = np.array([[np.sin(h), np.cos(h)] for h in (heading, heading_2)])
    p, depth, velocity = target.position_at(time) - place, target.depth, target.velocity
    way = np.hypot(*velocity) * max(abs(time - target.time), *durations)
    vertical = [depth, model.bottom_depth]
    length = max(np.abs([*place, *target.position, *p, way, speed * max(durations), *vertical]))
    turn = TurnMoment(
        time, durations, np.array(place), e, speed, p, velocity, depth, model, length,
        instants, scenario.measure(), (e, p, velocity, depth), ROUNDING * length, tolerance,
    )  # fmt: skip
    reach = max(np.max(np.abs(part)) for part in (p, *turn.ends(p, velocity), turn.zeta))
    turn = replace(turn, slack=max(turn.slack, tolerance * reach))
    uneven = abs(speed_2 - speed) * durations[1] > turn.slack
    if not speed > 0 or uneven or not turn.if_holds():
        raise ValueError(f"both legs must have the same positive speed, got {speed} and {speed_2}")
    for w, end in zip(turn.w, turn.ends(p, turn.V_T), strict=True):
        radial = turn.level and not turn.overhead and abs(cross(p, w)) <= ROUNDING * length * np.hypot(*w)
        if radial and p @ end < 0:
            raise ValueError("the target passes through the array during a leg, where it has no cosine")
    return turn
