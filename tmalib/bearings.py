"""Bearings that arrive at once and bearings that arrive late: value and gradient together.

The target has the state ``X = (x, y, vx, vy)`` at the reference time and constant velocity. A
bearing taken at time ``t``, ``s = t - t_ref`` seconds later, sees the relative position::

    d = (x + s vx - xo, y + s vy - yo) = r (sin theta, cos theta).

*Instantaneous bearing* (`emw-acoustic`, equation (6))::

    theta = atan2(dx, dy),      grad theta = [cos theta, -sin theta, s cos theta, -s sin theta] / r.

*Delayed bearing.* What is heard at ``t`` was emitted at ``t - tau``, where
``c tau = |P_T(t - tau) - P_O(t)|``. Squared, this is a quadratic in ``tau``; its one non-negative
root for ``|V| < c`` is (Section II)::

    tau = (sqrt((V.d)^2 + (c^2 - |V|^2) |d|^2) - V.d) / (c^2 - |V|^2).

With ``(sin, cos)`` the direction of the emission point, ``R = c tau`` its range and
``q = (vy sin - vx cos) / (c + vx sin + vy cos)``, equations (2)-(5) and (7) are::

    d theta / dx = (cos + q sin) / R,      d theta / dvx = (s - tau) d theta / dx,
    d theta / dy = (-sin + q cos) / R,     d theta / dvy = (s - tau) d theta / dy.

Both are measurement models (see `tmalib.models`).

Angles are in radians, clockwise from north; metres, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_broadcast, check_scalar
from .types import FloatArray, Motion, StateRows

TWO_PI = 2 * np.pi
TOUCHING = 1e-6  # metres: a target nearer than this is on the platform and has no bearing


def wrap(angle: ArrayLike) -> FloatArray:
    """The angle in radians brought into [-pi, pi], the one place where angles are wrapped."""
    angle = as_numbers("angle", angle)
    return angle - TWO_PI * np.rint(angle / TWO_PI)


def _vectors(name, value):
    """``value`` as a float array ``(..., 2)``."""
    value = as_numbers(name, value)
    if value.ndim == 0 or value.shape[-1] != 2:
        raise ValueError(f"{name} must have shape (..., 2), got {value.shape}")
    return value


def bearing(displacement: ArrayLike) -> FloatArray:
    """Bearing ``atan2(dx, dy)`` of displacements ``(..., 2)``, in radians clockwise from north."""
    dx, dy = np.moveaxis(_vectors("displacement", displacement), -1, 0)
    return np.arctan2(dx, dy)


def bearing_unless_touching(displacement: FloatArray) -> FloatArray:
    """`bearing`, NaN for a target on the platform, which has none."""
    return np.where(np.hypot(*np.moveaxis(displacement, -1, 0)) > TOUCHING, bearing(displacement), np.nan)


def propagation_delay(displacement: ArrayLike, velocity: ArrayLike, c: float) -> FloatArray:
    """Time that sound needs from a target in constant velocity motion to the observer.

    Parameters
    ----------
    displacement : array_like, shape (..., 2)
        Target minus observer at the time of *reception*, in metres.
    velocity : array_like, shape (..., 2)
        Velocity of the target, in m/s.
    c : float
        Speed of sound in m/s.

    Returns
    -------
    ndarray, shape (...)
        The delay ``tau`` in seconds, the closed form at the top of this file.

    Raises
    ------
    ValueError
        For ``c <= 0`` and for a target that is not slower than sound.

    Notes
    -----
    Source: `emw-acoustic`, Section II.

    Examples
    --------
    A target 1500 m away that does not move is heard one second late:

    >>> float(propagation_delay([0.0, 1500.0], [0.0, 0.0], c=1500.0))
    1.0
    """
    c = check_scalar("c", c, above=0.0)
    dx, dy = np.moveaxis(_vectors("displacement", displacement), -1, 0)
    vx, vy = np.moveaxis(_vectors("velocity", velocity), -1, 0)
    check_broadcast(displacement=dx, velocity=vx)
    fastest = np.max(np.hypot(vx, vy), initial=0.0)
    if not fastest < c:
        raise ValueError(f"the target must be slower than c = {c} m/s, got a speed of {fastest} m/s")
    return delay_of(dx, dy, vx, vy, c)


def delay_of(
    dx: FloatArray, dy: FloatArray, vx: FloatArray, vy: FloatArray, c: float | FloatArray
) -> FloatArray:
    radial = vx * dx + vy * dy
    slack = c * c - (vx * vx + vy * vy)
    if not np.min(slack, initial=np.inf) > 0:  # as fast as sound: such a state predicts nothing
        slack = np.where(slack > 0, slack, np.nan)
    return (np.sqrt(radial * radial + slack * (dx * dx + dy * dy)) - radial) / slack


def displacement(state: StateRows, observer: StateRows, elapsed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Target minus platform at the measurement times, as two fresh arrays."""
    x, y, vx, vy = state
    dx, dy = elapsed * vx, elapsed * vy
    dx += x
    dx -= observer[0]
    dy += y
    dy -= observer[1]
    return dx, dy


def delayed_bearing(
    state: StateRows, observer: StateRows, elapsed: FloatArray, c: float | FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Bearing theta of the emission point, its gradient by ``x, y, vx, vy``, and sine and cosine of theta."""
    _, _, vx, vy = state
    dx, dy = displacement(state, observer, elapsed)
    tau = delay_of(dx, dy, vx, vy, c)
    dx -= tau * vx
    dy -= tau * vy
    scale = 1.0 / (c * tau)
    sin, cos = dx * scale, dy * scale
    q = (vy * sin - vx * cos) / (c + vx * sin + vy * cos)
    gradient = np.empty((4, *dx.shape))
    np.multiply(cos + q * sin, scale, out=gradient[0, ...])
    np.multiply(q * cos - sin, scale, out=gradient[1, ...])
    np.multiply(elapsed - tau, gradient[:2], out=gradient[2:])
    return np.arctan2(dx, dy), gradient, sin, cos


def delay_of_motion(
    target: Motion,
    here: FloatArray,
    times: FloatArray,
    c: float,
    tolerance: float = 1e-12,
    max_iterations: int = 2000,
) -> FloatArray:
    """Delay of what is heard at the places ``here``, ``(N, 2)``, at the ``times``, of any motion.

    It is the fixed point of ``tau = |P_T(t - tau) - P_O(t)| / c``; the iteration contracts by the ratio of
    speeds. It needs the target's position before the first time. `ValueError` where it does not end.
    """
    tau = np.zeros_like(times)
    with np.errstate(over="ignore", invalid="ignore"):  # it need not end
        for _ in range(max_iterations):
            gap = target.position_at(times - tau) - here
            before, tau = tau, np.hypot(gap[..., 0], gap[..., 1]) / c
            if not np.isfinite(tau).all():
                break
            if np.max(np.abs(tau - before), initial=0.0) <= tolerance * (1 + np.max(tau, initial=0.0)):
                return tau
    raise ValueError(f"no propagation delay found for c = {c} m/s: is the target slower than sound?")


def sound_if_faster(c: float | FloatArray, vx: FloatArray, vy: FloatArray) -> FloatArray:
    """``c`` where sound is faster than the target, NaN elsewhere: such a state predicts nothing."""
    return np.where(c > np.hypot(vx, vy), c, np.nan)


class _Angle:
    """What the two bearing models share."""

    coordinates = ("x", "y", "vx", "vy")
    is_bearing = True

    def observer_state(self, platform: Motion, times: FloatArray) -> FloatArray:
        """Position of the platform, shape ``(2, N)``."""
        return np.ascontiguousarray(platform.position_at(times).T)

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        """Difference of two angles, in [-pi, pi]."""
        return wrap(measured - predicted)


@dataclass(frozen=True)
class Bearing(_Angle):
    """Instantaneous bearing (electromagnetic or optical), `emw-acoustic` equation (6)."""

    def value_and_gradient(
        self, state: StateRows, observer: FloatArray, elapsed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        dx, dy = displacement(state, observer, elapsed)
        scale = 1.0 / (dx * dx + dy * dy)
        gradient = np.empty((4, *dx.shape))
        np.multiply(dy, scale, out=gradient[0, ...])
        np.multiply(dx, -scale, out=gradient[1, ...])
        np.multiply(elapsed, gradient[:2], out=gradient[2:])
        return np.arctan2(dx, dy), gradient

    def observe(self, target: Motion, platform: Motion, times: FloatArray) -> FloatArray:
        """Bearing of the target at the ``times``, in radians, shape ``(N,)``."""
        return bearing_unless_touching(target.position_at(times) - platform.position_at(times))


@dataclass(frozen=True)
class DelayedBearing(_Angle):
    """Acoustic bearing that arrives after the propagation delay, `emw-acoustic` (2)-(5), (7).

    Parameters
    ----------
    c : float
        Speed of sound in m/s, positive.
    """

    c: float = 1500.0

    def __post_init__(self) -> None:
        check_scalar("c", self.c, above=0.0)

    def value_and_gradient(
        self, state: StateRows, observer: FloatArray, elapsed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        return delayed_bearing(state, observer, elapsed, self.c)[:2]

    def observe(
        self,
        target: Motion,
        platform: Motion,
        times: FloatArray,
        tolerance: float = 1e-12,
        max_iterations: int = 2000,
    ) -> FloatArray:
        """Delayed bearing of any motion slower than sound, shape ``(N,)``, in radians."""
        times, here = np.asarray(times, dtype=float), platform.position_at(times)
        tau = delay_of_motion(target, here, times, self.c, tolerance, max_iterations)
        return bearing_unless_touching(target.position_at(times - tau) - here)
