"""Bearings of a target that does not go straight: constant acceleration, constant turn rate.

At ``s`` seconds after the reference time the target is at::

    p(s) = (x, y) + s (vx, vy) + s^2 / 2 (ax, ay)                   constant acceleration,
    p(s) = (x, y) + s sinc(w s / 2) R(w s / 2) (vx, vy)             constant turn rate w,

where ``sinc(u) = sin(u) / u`` and ``R(u)`` turns clockwise by u. A bearing has the gradient
``[cos, -sin] / r`` with respect to p, and the chain rule gives the rest.

Both are measurement models (see `tmalib.bearings`): bounds and the batch estimate take them as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .bearings import bearing_unless_touching, wrap
from .types import FloatArray, Motion, StateRows


class _CurvedBearing:
    """Bearing of a target that moves as a subclass says in ``coordinates`` and ``motion``."""

    coordinates: ClassVar[tuple[str, ...]]

    def motion(self, state: StateRows, elapsed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Position ``(2, ...)`` and its derivative by the state, ``(n, 2, ...)``."""
        raise NotImplementedError

    def observer_state(self, platform: Motion, times: FloatArray) -> FloatArray:
        return np.ascontiguousarray(platform.position_at(times).T)

    def value_and_gradient(
        self, state: StateRows, observer: FloatArray, elapsed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        place, slope = self.motion(state, elapsed)
        dx, dy = place[0] - observer[0], place[1] - observer[1]
        return np.arctan2(dx, dy), (dy * slope[:, 0] - dx * slope[:, 1]) / (dx * dx + dy * dy)

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        return wrap(measured - predicted)

    def observe(self, target: Motion, platform: Motion, times: FloatArray) -> FloatArray:
        return bearing_unless_touching(target.position_at(times) - platform.position_at(times))

    def position_criterion(self, state: ArrayLike, elapsed: ArrayLike) -> FloatArray:
        """Derivative of the position ``elapsed`` seconds after the reference time, shape ``(2, n)``."""
        return self.motion(np.asarray(state), np.asarray(elapsed))[1].T


@dataclass(frozen=True)
class AcceleratedBearing(_CurvedBearing):
    """Bearing of a target with constant acceleration, state ``(x, y, vx, vy, ax, ay)``.

    Notes
    -----
    Source: the "polynomial" model of `robustness`, Section IV, of degree two.

    Examples
    --------
    >>> import numpy as np
    >>> position, slope = AcceleratedBearing().motion([0.0, 1000.0, 5.0, 0.0, 0.1, 0.0], np.array([10.0]))
    >>> position[:, 0]
    array([  55., 1000.])
    """

    coordinates = ("x", "y", "vx", "vy", "ax", "ay")

    def motion(self, state: StateRows, elapsed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Position ``(2, ...)`` and its derivative by the state, ``(6, 2, ...)``."""
        x, y, vx, vy, ax, ay = state
        place = np.stack([x + elapsed * (vx + elapsed / 2 * ax), y + elapsed * (vy + elapsed / 2 * ay)])
        slope = np.zeros((6, *place.shape))
        slope[0, 0] = slope[1, 1] = 1
        slope[2, 0] = slope[3, 1] = elapsed
        slope[4, 0] = slope[5, 1] = elapsed**2 / 2
        return place, slope


@dataclass(frozen=True)
class TurningBearing(_CurvedBearing):
    """Bearing of a target with constant speed and turn rate (rad/s), state ``(x, y, vx, vy, rate)``.

    Notes
    -----
    Source: the "uniform circular" model of `robustness`, Section IV.

    Examples
    --------
    >>> import numpy as np
    >>> position, slope = TurningBearing().motion([0.0, 0.0, 0.0, 5.0, np.pi / 20], np.array([10.0]))
    >>> position[:, 0].round(3)  # a quarter turn to the right from north
    array([31.831, 31.831])
    """

    coordinates = ("x", "y", "vx", "vy", "rate")

    def motion(self, state: StateRows, elapsed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Position ``(2, ...)`` and its derivative by the state, ``(5, 2, ...)``."""
        x, y, vx, vy, rate = state
        half = rate * elapsed / 2
        sinc, sin, cos = np.sinc(half / np.pi), np.sin(half), np.cos(half)
        small = np.abs(half) < 1e-4
        bend = np.where(small, -half / 3, (cos - sinc) / np.where(small, 1.0, half))  # of sinc
        along = np.stack(np.broadcast_arrays(cos * vx + sin * vy, cos * vy - sin * vx))
        across = np.stack([along[1], -along[0]])
        place = np.stack([x + elapsed * sinc * along[0], y + elapsed * sinc * along[1]])
        slope = np.zeros((5, *place.shape))
        slope[0, 0] = slope[1, 1] = 1
        slope[2, 0] = slope[3, 1] = elapsed * sinc * cos
        slope[2, 1], slope[3, 0] = -elapsed * sinc * sin, elapsed * sinc * sin
        slope[4] = elapsed**2 / 2 * (bend * along + sinc * across)
        return place, slope
