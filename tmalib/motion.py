"""Courses: where a platform or a target is, and which way it heads, at a time.

A *motion* is anything with ``position(t)`` and ``heading(t)``. Four are here: `Target` (constant
velocity, the papers' target), `Course` (legs and turns), `SampledCourse` (given points) and, for an
estimator's state vector, the pair `propagate` and `transition`.

A leg of constant turn rate ``w`` that starts at ``p0`` with heading ``h0`` and speed ``v`` reaches,
after ``s`` seconds::

    p(s) = p0 + v s sinc(w s / 2) [sin(h0 + w s / 2), cos(h0 + w s / 2)],    h(s) = h0 + w s,

the chord of the arc: its length is ``v s sinc(w s / 2)`` (``sinc(u) = sin(u) / u``) and it points
half-way between the two headings. A straight leg is the case ``w = 0``; there is no other formula.

East is x, north is y, headings are clockwise from north, in radians; metres and seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._checks import check_array, check_scalar


def unit(heading):
    """Unit vector(s) ``[sin h, cos h]`` along a heading, shape ``(..., 2)``."""
    heading = np.asarray(heading, dtype=float)
    return np.stack([np.sin(heading), np.cos(heading)], axis=-1)


@dataclass(frozen=True, eq=False, init=False)
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
    """

    position_at_time: np.ndarray
    velocity: np.ndarray
    depth: float | None = None
    time: float = 0.0

    def __init__(self, position, speed, heading, depth=None, time=0.0):
        speed = check_scalar("speed", speed, minimum=0.0)
        velocity = speed * unit(check_scalar("heading", heading))
        self._set(position, velocity, depth, time)

    def _set(self, position, velocity, depth, time):
        object.__setattr__(self, "position_at_time", check_array("position", position, (2,)))
        object.__setattr__(self, "velocity", check_array("velocity", velocity, (2,)))
        object.__setattr__(self, "depth", None if depth is None else check_scalar("depth", depth))
        object.__setattr__(self, "time", check_scalar("time", time))

    @classmethod
    def from_velocity(cls, position, velocity, depth=None, time=0.0):
        """The target with a velocity vector ``(vx, vy)`` in m/s instead of speed and heading."""
        target = cls.__new__(cls)
        target._set(position, velocity, depth, time)
        return target

    def position(self, t):
        """Position at the times ``t``, shape ``t.shape + (2,)``, in metres."""
        elapsed = np.asarray(t, dtype=float) - self.time
        return self.position_at_time + elapsed[..., None] * self.velocity

    def heading(self, t):
        """Heading at the times ``t`` in radians: a constant."""
        return np.full(np.shape(t), np.arctan2(*self.velocity))

    def state(self, t, coordinates=("x", "y", "vx", "vy")):
        """State vector at time ``t`` in the named coordinates (``x, y, z, vx, vy``)."""
        t = check_scalar("t", t)
        (x, y), (vx, vy) = self.position(t), self.velocity
        if "z" in coordinates and self.depth is None:
            raise ValueError("the target has no depth, and the state asks for z; give Target(depth=...)")
        known = {"x": x, "y": y, "z": self.depth, "vx": vx, "vy": vy}
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

    def __post_init__(self):
        if not self.duration > 0:
            raise ValueError(f"duration of a leg must be positive, got {self.duration}")
        check_scalar("rate", self.rate)
        if self.speed is not None:
            check_scalar("speed", self.speed, minimum=0.0)
        if self.heading is not None:
            check_scalar("heading", self.heading)


def Straight(duration, speed=None, heading=None):
    """A straight leg of ``duration`` seconds (``numpy.inf`` for a last leg without end)."""
    return Leg(duration, 0.0, speed, heading)


def Turn(duration, rate, speed=None):
    """A turn of ``duration`` seconds at ``rate`` rad/s, positive to the right (clockwise)."""
    return Leg(duration, rate, speed)


@dataclass(frozen=True, eq=False, init=False)
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
    >>> course.position(100.0).round(6)
    array([700.,   0.])
    """

    start: np.ndarray
    speed: float
    heading_at_start: float
    legs: tuple
    start_time: float = 0.0

    def __init__(self, start, speed, heading, legs, start_time=0.0):
        put = object.__setattr__
        put(self, "start", check_array("start", start, (2,)))
        put(self, "speed", check_scalar("speed", speed, minimum=0.0))
        put(self, "heading_at_start", check_scalar("heading", heading))
        put(self, "start_time", check_scalar("start_time", start_time))
        put(self, "legs", tuple(legs))
        if not self.legs:
            raise ValueError("legs is empty; a course needs at least one Straight or Turn")
        put(self, "_table", self._leg_table())

    def _leg_table(self):
        """One row a leg: start time, position, heading, speed, rate at its start."""
        time, place, heading, speed = self.start_time, self.start, self.heading_at_start, self.speed
        rows = []
        for leg in self.legs:
            heading = heading if leg.heading is None else leg.heading
            speed = speed if leg.speed is None else leg.speed
            rows.append([time, *place, heading, speed, leg.rate])
            if np.isfinite(leg.duration):
                place = place + _chord(speed, heading, leg.rate, leg.duration)
                heading = heading + leg.rate * leg.duration
            time = time + leg.duration
        return np.array(rows), time

    @property
    def end_time(self):
        """Time at which the last leg ends, in seconds."""
        return self._table[1]

    def _leg_at(self, t):
        t = np.asarray(t, dtype=float)
        table, end = self._table
        slack = 1e-9 * (1 + abs(end)) if np.isfinite(end) else 0.0
        outside = ~((t >= self.start_time - slack) & (t <= end + slack))
        if np.any(outside):
            first = np.ravel(t)[np.argmax(np.ravel(outside))]
            raise ValueError(
                f"time {first} is outside the course, which lasts from {self.start_time} to {end}"
            )
        row = table[np.clip(np.searchsorted(table[:, 0], t, side="right") - 1, 0, None)]
        return row, t - row[..., 0]

    def position(self, t):
        """Position at the times ``t``, shape ``t.shape + (2,)``, in metres."""
        row, elapsed = self._leg_at(t)
        return row[..., 1:3] + _chord(row[..., 4], row[..., 3], row[..., 5], elapsed)

    def heading(self, t):
        """Heading at the times ``t``, in radians, not wrapped."""
        row, elapsed = self._leg_at(t)
        return row[..., 3] + row[..., 5] * elapsed


def _chord(speed, heading, rate, elapsed):
    """Displacement after ``elapsed`` seconds of a constant turn (see the top of the file)."""
    half = rate * elapsed / 2
    length = speed * elapsed * np.sinc(half / np.pi)
    return np.asarray(length)[..., None] * unit(heading + half)


@dataclass(frozen=True, eq=False, init=False)
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

    times: np.ndarray
    positions: np.ndarray
    headings: np.ndarray | None = None

    def __init__(self, times, positions, headings=None):
        times = check_array("times", times, (None,))
        if np.any(np.diff(times) <= 0):
            raise ValueError("times must be strictly increasing")
        n = len(times)
        put = object.__setattr__
        put(self, "times", times)
        put(self, "positions", check_array("positions", positions, (n, 2)))
        put(self, "headings", None if headings is None else check_array("headings", headings, (n,)))

    def _inside(self, t):
        t = np.asarray(t, dtype=float)
        if np.any(~((t >= self.times[0]) & (t <= self.times[-1]))):
            raise ValueError(
                f"a time is outside the samples, which last from {self.times[0]} to {self.times[-1]}"
            )
        return t

    def position(self, t):
        """Position at the times ``t``, shape ``t.shape + (2,)``, in metres."""
        t = self._inside(t)
        return np.stack([np.interp(t, self.times, column) for column in self.positions.T], axis=-1)

    def heading(self, t):
        """Heading at the times ``t``, in radians."""
        if self.headings is None:
            raise ValueError("this SampledCourse has no headings; give SampledCourse(headings=...)")
        return np.interp(self._inside(t), self.times, self.headings)


def transition(duration, n=4):
    """Transition matrix ``Phi`` of a constant velocity state over ``duration`` seconds.

    Shape ``duration.shape + (n, n)``; ``n`` is 4 for ``(x, y, vx, vy)`` and 5 with the depth.
    Source: `emw-acoustic`, equation (1).
    """
    if n not in (4, 5):
        raise ValueError(f"n must be 4 or 5, got {n}")
    duration = np.asarray(duration, dtype=float)
    phi = np.zeros((*duration.shape, n, n))
    phi[..., np.arange(n), np.arange(n)] = 1.0
    phi[..., 0, n - 2] = duration
    phi[..., 1, n - 1] = duration
    return phi


def propagate(state, duration):
    """State ``(..., n)`` after ``duration`` seconds of constant velocity motion, ``Phi X``."""
    state = np.array(state, dtype=float)
    duration = np.asarray(duration, dtype=float)
    moved = np.broadcast_to(
        state, (*np.broadcast_shapes(state.shape[:-1], duration.shape), state.shape[-1])
    ).copy()
    moved[..., :2] += duration[..., None] * moved[..., -2:]
    return moved
