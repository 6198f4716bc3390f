"""Courses: where a platform or a target is, and which way it heads, at a time.

A *motion* is anything with ``position_at(t)`` and ``heading_at(t)`` (see `tmalib.types.Motion`).
Three are here: `Target` (constant velocity, the papers' target), `Course` (legs and turns) and
`SampledCourse` (given points).

A leg of constant turn rate ``w`` that starts at ``p0`` with heading ``h0`` and speed ``v`` reaches,
after ``s`` seconds::

    p(s) = p0 + v s sinc(w s / 2) [sin(h0 + w s / 2), cos(h0 + w s / 2)],    h(s) = h0 + w s,

the chord of the arc: its length is ``v s sinc(w s / 2)`` (``sinc(u) = sin(u) / u``) and it points
half-way between the two headings. A straight leg is the case ``w = 0``; there is no other formula.

East is x, north is y, headings are clockwise from north, in radians; metres and seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_array, check_scalar, check_sequence, set_fields
from .types import Array, FloatArray


def unit(heading: ArrayLike) -> FloatArray:
    """Unit vector(s) ``[sin h, cos h]`` along a heading, shape ``(..., 2)``."""
    heading = np.asarray(heading, dtype=float)
    return np.stack([np.sin(heading), np.cos(heading)], axis=-1)


@dataclass(frozen=True, eq=False)
class Target:
    """A target in constant velocity motion, ``P(t) = P(0) + t V``.

    Parameters
    ----------
    position : array_like, shape (2,)
        Horizontal position at ``time``, in metres.
    speed : float
        Speed in m/s, not negative.
    heading : float
        Heading in radians, clockwise from north.
    depth : float, optional
        Constant depth in metres, positive downwards. Only models with a depth need it.
    time : float
        The time at which the target is at ``position``.

    Notes
    -----
    Source: the state vector of `emw-acoustic`, Section II.

    Examples
    --------
    >>> from dataclasses import replace
    >>> target = Target((3000, 4000), speed=5, heading=0.0)
    >>> replace(target, speed=3).position_at(10.0)
    array([3000., 4030.])
    """

    position: Array
    speed: float
    heading: float
    depth: float | None = None
    time: float = 0.0
    velocity: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_fields(
            self,
            position=check_array("position", self.position, (2,)),
            speed=check_scalar("speed", self.speed, minimum=0.0),
            heading=check_scalar("heading", self.heading),
            depth=None if self.depth is None else check_scalar("depth", self.depth),
            time=check_scalar("time", self.time),
        )
        set_fields(self, velocity=self.speed * unit(self.heading))

    @classmethod
    def from_velocity(
        cls, position: ArrayLike, velocity: ArrayLike, depth: float | None = None, time: float = 0.0
    ) -> Target:
        """The target with a velocity vector ``(vx, vy)`` in m/s instead of speed and heading."""
        velocity = check_array("velocity", velocity, (2,))
        target = cls(position, np.hypot(*velocity), np.arctan2(*velocity), depth, time)
        set_fields(target, velocity=velocity)  # as given, without the rounding of speed and heading
        return target

    def position_at(self, t: ArrayLike) -> FloatArray:
        """Position at the times ``t``, shape ``t.shape + (2,)``, in metres."""
        elapsed = as_numbers("t", t) - self.time
        return self.position + elapsed[..., None] * self.velocity

    def heading_at(self, t: ArrayLike) -> FloatArray:
        """Heading at the times ``t`` in radians: a constant."""
        return np.full(as_numbers("t", t).shape, self.heading)

    def state(self, t: float, coordinates: Sequence[str] = ("x", "y", "vx", "vy")) -> FloatArray:
        """State vector at time ``t`` in the named coordinates (``x, y, z, vx, vy``)."""
        t = check_scalar("t", t)
        (x, y), (vx, vy) = self.position_at(t), self.velocity
        if "z" in coordinates and self.depth is None:
            raise ValueError("the target has no depth, and the state asks for z; give Target(depth=...)")
        known = {"x": x, "y": y, "z": self.depth, "vx": vx, "vy": vy}
        unknown = [name for name in coordinates if name not in known]
        if unknown:
            raise ValueError(f"a target has position, depth and velocity, and no {unknown}")
        return np.array([known[name] for name in coordinates], dtype=float)


@dataclass(frozen=True)
class Leg:
    """A part of a course with constant speed and turn rate; make one with `Straight` or `Turn`.

    ``speed`` and ``heading`` of `None` mean: as at the end of the leg before.
    """

    duration: float
    rate: float = 0.0
    speed: float | None = None
    heading: float | None = None

    def __post_init__(self) -> None:
        duration = as_numbers("duration", self.duration)  # it may be infinite
        if duration.ndim or not duration > 0:
            raise ValueError(f"duration of a leg must be positive, got {self.duration!r}")
        check_scalar("rate", self.rate)
        if self.speed is not None:
            check_scalar("speed", self.speed, minimum=0.0)
        if self.heading is not None:
            check_scalar("heading", self.heading)


def Straight(duration: float, speed: float | None = None, heading: float | None = None) -> Leg:
    """A straight leg of ``duration`` seconds (``numpy.inf`` for a last leg without end)."""
    return Leg(duration, 0.0, speed, heading)


def Turn(duration: float, rate: float, speed: float | None = None) -> Leg:
    """A turn of ``duration`` seconds at ``rate`` rad/s, positive to the right (clockwise)."""
    return Leg(duration, rate, speed)


@dataclass(frozen=True, eq=False)
class Course:
    """A course made of legs and turns, each at constant speed and turn rate.

    Parameters
    ----------
    start : array_like, shape (2,)
        Position at ``start_time``, in metres.
    speed, heading : float
        Speed in m/s and heading in radians at the start.
    legs : sequence of Leg
        `Straight` and `Turn` legs in order.
    start_time : float

    Raises
    ------
    ValueError
        For no legs, a bad number, or (in `position` and `heading`) a time outside the course.

    Examples
    --------
    >>> import numpy as np
    >>> course = Course((0, 0), speed=7, heading=np.pi / 2, legs=[Straight(200)])
    >>> course.position_at(100.0).round(6)
    array([700.,   0.])
    """

    start: Array
    speed: float
    heading: float
    legs: Sequence[Leg]
    start_time: float = 0.0

    def __post_init__(self) -> None:
        set_fields(
            self,
            start=check_array("start", self.start, (2,)),
            speed=check_scalar("speed", self.speed, minimum=0.0),
            heading=check_scalar("heading", self.heading),
            legs=check_sequence("legs", self.legs, Leg),
            start_time=check_scalar("start_time", self.start_time),
        )
        if not self.legs:
            raise ValueError("legs is empty; a course needs at least one Straight or Turn")
        endless = [i for i, leg in enumerate(self.legs[:-1]) if not np.isfinite(leg.duration)]
        if endless:
            raise ValueError(f"legs must be finite but for the last, got one without end: legs[{endless[0]}]")

    @cached_property
    def leg_starts(self) -> FloatArray:
        """Time, x, y, heading, speed and turn rate at the start of every leg, shape ``(legs, 6)``."""
        time, place, heading, speed = self.start_time, self.start, self.heading, self.speed
        rows = []
        for leg in self.legs:
            heading = heading if leg.heading is None else leg.heading
            speed = speed if leg.speed is None else leg.speed
            rows.append([time, *place, heading, speed, leg.rate])
            if np.isfinite(leg.duration):
                place = place + _chord(speed, heading, leg.rate, leg.duration)
                heading = heading + leg.rate * leg.duration
            time = time + leg.duration
        return np.array(rows)

    @property
    def end_time(self) -> float:
        """Time at which the last leg ends, in seconds."""
        return self.leg_starts[-1, 0] + self.legs[-1].duration

    def _leg_at(self, t):
        t = as_numbers("t", t)
        table, end = self.leg_starts, self.end_time
        slack = 1e-9 * (1 + abs(end)) if np.isfinite(end) else 0.0
        outside = ~((t >= self.start_time - slack) & (t <= end + slack))
        if np.any(outside):
            first = np.ravel(t)[np.argmax(np.ravel(outside))]
            raise ValueError(
                f"time {first} is outside the course, which lasts from {self.start_time} to {end}"
            )
        row = table[np.clip(np.searchsorted(table[:, 0], t, side="right") - 1, 0, None)]
        return row, t - row[..., 0]

    def position_at(self, t: ArrayLike) -> FloatArray:
        """Position at the times ``t``, shape ``t.shape + (2,)``, in metres."""
        row, elapsed = self._leg_at(t)
        return row[..., 1:3] + _chord(row[..., 4], row[..., 3], row[..., 5], elapsed)

    def heading_at(self, t: ArrayLike) -> FloatArray:
        """Heading at the times ``t``, in radians, not wrapped."""
        row, elapsed = self._leg_at(t)
        return row[..., 3] + row[..., 5] * elapsed


def _chord(speed, heading, rate, elapsed):
    """Displacement after ``elapsed`` seconds of a constant turn (see the top of the file)."""
    half = rate * elapsed / 2
    length = speed * elapsed * np.sinc(half / np.pi)
    return np.asarray(length)[..., None] * unit(heading + half)


@dataclass(frozen=True, eq=False)
class SampledCourse:
    """A course given by samples; straight lines between them.

    Parameters
    ----------
    times : array_like, shape (N,)
        Increasing, in seconds.
    positions : array_like, shape (N, 2)
        In metres.
    headings : array_like, shape (N,), optional
        In radians, not wrapped. Only models that use the heading need them.

    Raises
    ------
    ValueError
        For unsorted times, wrong shapes, NaN, and for a time outside the samples.
    """

    times: Array
    positions: Array
    headings: Array | None = None

    def __post_init__(self) -> None:
        times = check_array("times", self.times, (None,))
        if not len(times) or np.any(np.diff(times) <= 0):
            raise ValueError(f"times must be strictly increasing and not empty, got {times}")
        headings = None if self.headings is None else check_array("headings", self.headings, times.shape)
        set_fields(
            self,
            times=times,
            positions=check_array("positions", self.positions, (len(times), 2)),
            headings=headings,
        )

    def _inside(self, t):
        t = as_numbers("t", t)
        if np.any(~((t >= self.times[0]) & (t <= self.times[-1]))):
            raise ValueError(
                f"a time is outside the samples, which last from {self.times[0]} to {self.times[-1]}"
            )
        return t

    def position_at(self, t: ArrayLike) -> FloatArray:
        """Position at the times ``t``, shape ``t.shape + (2,)``, in metres."""
        inside = self._inside(t)
        return np.stack([np.interp(inside, self.times, column) for column in self.positions.T], axis=-1)

    def heading_at(self, t: ArrayLike) -> FloatArray:
        """Heading at the times ``t``, in radians."""
        if self.headings is None:
            raise ValueError("this SampledCourse has no headings; give SampledCourse(headings=...)")
        return np.interp(self._inside(t), self.times, self.headings)
