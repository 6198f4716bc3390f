"""Bearings that arrive late when the speed of sound is not known.

The bearing of `tmalib.bearings.DelayedBearing` depends on the speed of sound c through the delay alone. With
``d`` the displacement at reception and ``u = (sin theta, cos theta)`` towards the emission point::

    d - tau V = R u,      R = c tau.

Differentiated by c, along u and along ``e = (cos theta, -sin theta)``, which is ``du / d theta``::

    -(d tau / dc) u.V = tau + c d tau / dc,          d tau / dc = -tau / (c + u.V),
    -(d tau / dc) e.V = R d theta / dc,              d theta / dc = e.V / (c (c + u.V)) = -q / c,

with the ``q`` of that file. The slope is about the transverse speed over ``c^2``: bearings of a target that
crosses tell c, where something else, an instantaneous bearing or a manoeuvre, tells where it is; those of a
target that keeps its bearing do not.

Angles are in radians, clockwise from north; metres, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .bearings import DelayedBearing, delayed_bearing, sound_if_faster, wrap
from .checks import check_scalar
from .types import FloatArray, Motion, StateRows


@dataclass(frozen=True)
class DelayedBearingUnknownSpeed:
    """`DelayedBearing` with the speed of sound as an unknown, state ``(x, y, vx, vy, c)``.

    Parameters
    ----------
    c : float
        A plausible first value in m/s, the model's ``guess``; no prediction reads it.
    true_c : float, optional
        The true speed, which `observe` (simulation) alone reads; the first value where it is not given.

    Notes
    -----
    Derived at the top of this file. A state that is not slower than its c predicts NaN.

    Examples
    --------
    A target that passes a kilometre north at 100 m/s, in air, is heard where it was:

    >>> import numpy as np, tmalib as tma
    >>> still = tma.Course((0, 0), speed=0, heading=0.0, legs=[tma.Straight(60)])
    >>> target = tma.Target((0, 1000), speed=100, heading=np.pi / 2)
    >>> model = DelayedBearingUnknownSpeed(c=340, true_c=331)
    >>> np.degrees(model.observe(target, still, np.array([0.0]))).round(2)  # arcsin(100 / 331)
    array([-17.58])
    >>> model.guess
    {'c': 340.0}
    """

    c: float = 1500.0
    true_c: float | None = None

    coordinates = ("x", "y", "vx", "vy", "c")
    is_bearing = True

    def __post_init__(self) -> None:
        check_scalar("c", self.c, above=0.0)
        if self.true_c is not None:
            check_scalar("true_c", self.true_c, above=0.0)

    @property
    def truth(self) -> dict[str, float]:
        """The speed of sound in simulation."""
        return {"c": self.c if self.true_c is None else self.true_c}

    @property
    def guess(self) -> dict[str, float]:
        """First value of the speed of sound, in m/s."""
        return {"c": float(self.c)}

    def observer_state(self, platform: Motion, times: FloatArray) -> FloatArray:
        """Position of the platform, shape ``(2, N)``."""
        return np.ascontiguousarray(platform.position_at(times).T)

    def value_and_gradient(
        self, state: StateRows, observer: FloatArray, elapsed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        x, y, vx, vy, c = state
        c = sound_if_faster(c, vx, vy)
        value, gradient, sin, cos = delayed_bearing((x, y, vx, vy), observer, elapsed, c)
        q = (vy * sin - vx * cos) / (c + vx * sin + vy * cos)
        return value, np.concatenate([gradient, (-q / c)[None]])

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        """Difference of two angles, in [-pi, pi]."""
        return wrap(measured - predicted)

    def observe(self, target: Motion, platform: Motion, times: FloatArray) -> FloatArray:
        """Delayed bearing of any motion slower than sound, ``(N,)``, in radians."""
        return DelayedBearing(self.c if self.true_c is None else self.true_c).observe(target, platform, times)
