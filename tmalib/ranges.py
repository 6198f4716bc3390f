"""Distances in the plane: what a radar or an active sonar tells besides the bearing.

The target has the state ``(x, y, vx, vy)`` at the reference time. A range taken ``s`` seconds later is the
length of ``d = (x + s vx - xo, y + s vy - yo)``; its gradient is the unit vector towards the target::

    r = sqrt(dx^2 + dy^2),      grad r = [dx, dy, s dx, s dy] / r.

Metres, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .bearings import TOUCHING, displacement
from .types import FloatArray, Motion, StateRows


@dataclass(frozen=True)
class Range:
    """Distance in the plane at the time of the measurement, in metres; a model (see `tmalib.models`).

    Notes
    -----
    Derived at the top of this file. There is no propagation delay in it: the ``times`` of the sensor are
    those at which the target is that far from where the platform is then.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> still = tma.Course((0, 0), speed=0, heading=0.0, legs=[tma.Straight(60)])
    >>> Range().observe(tma.Target((3000, 4000), speed=5, heading=0.0), still, np.array([0.0, 60.0])).round(1)
    array([5000. , 5243.1])
    """

    coordinates = ("x", "y", "vx", "vy")

    def observer_state(self, platform: Motion, times: FloatArray) -> FloatArray:
        """Position of the platform, shape ``(2, N)``."""
        return np.ascontiguousarray(platform.position_at(times).T)

    def value_and_gradient(
        self, state: StateRows, observer: FloatArray, elapsed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        dx, dy = displacement(state, observer, elapsed)
        value = np.hypot(dx, dy)
        gradient = np.empty((4, *value.shape))
        np.divide(dx, value, out=gradient[0, ...])
        np.divide(dy, value, out=gradient[1, ...])
        np.multiply(elapsed, gradient[:2], out=gradient[2:])
        return value, gradient

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        """Plain difference, in metres."""
        return measured - predicted

    def observe(self, target: Motion, platform: Motion, times: FloatArray) -> FloatArray:
        """Range ``(N,)`` in metres; NaN for a target on the platform, where the range has no gradient."""
        distance = np.linalg.norm(target.position_at(times) - platform.position_at(times), axis=-1)
        return np.where(distance > TOUCHING, distance, np.nan)
