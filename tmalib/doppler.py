"""The frequency at which a tone of unknown frequency is heard.

What is heard at ``t`` was emitted at ``t - tau``, where ``c tau = |P_T(t - tau) - P_O(t)|``. Wave crests are
emitted ``f0`` a second and none is lost, so the crests that arrive between t and t + dt are those emitted in
``dt (1 - d tau / dt)``. With ``u = (sin theta, cos theta)`` the direction *from the observer to the emission
point*, ``V_O`` the observer's velocity *at reception* and ``V`` the source's *at emission*, the derivative of
the definition of tau gives ``c tau' = u.(V (1 - tau') - V_O)`` and so::

    f = f0 (1 - tau') = f0 k,      k = (c + V_O.u) / (c + V.u).

This is the formula for a moving source and a moving observer. It is exact, for any course of the two, with u
at the emission point, and only with it: with u towards the place of the source at reception it is wrong by a
relative ``(v / c)^2``, about what ``f0 (1 - r' / c)`` neglects, and 0.01 Hz in 300 Hz at 9 m/s in water is
what a narrow-band sonar can see. The emission point costs nothing, for its closed form is that of
`tmalib.bearings.DelayedBearing`, as is the gradient of theta. With ``e = (cos theta, -sin theta)``, which is
``du / d theta``::

    df / d(x, y, vx, vy) = f0 [ (V_O - k V).e d theta / d(x, y, vx, vy) - k (0, 0, sin, cos) ] / (c + V.u),
    df / d f0 = k.

Metres, seconds, hertz.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .bearings import TOUCHING, delay_of_motion, delayed_bearing, sound_if_faster
from .checks import check_scalar
from .types import FloatArray, Motion, StateRows

STEP = 1e-3  # seconds, of the differences that give a velocity


def velocity_of(motion: Motion, times: ArrayLike) -> FloatArray:
    """Velocity of any motion from differences of its position, ``(N, 2)`` in m/s.

    Central differences over one millisecond to each side, one-sided within a millisecond of an end of the
    motion, where ``position_at`` raises `ValueError`.

    Parameters
    ----------
    motion : motion
    times : array_like, shape (N,)

    Raises
    ------
    ValueError
        At a time for which the position is known neither before nor after.

    Notes
    -----
    Errors: of rounding, about 1e-8 m/s within 100 km of the origin; in a turn of rate w at speed v, ``v w^2
    STEP^2 / 6``, less than that; at an end, ``STEP / 2`` times the acceleration, 1e-4 m/s for 0.2 m/s^2. At
    a corner of the course it is the mean of the velocities before and after.

    Examples
    --------
    >>> import tmalib as tma
    >>> velocity_of(tma.Course((0, 0), speed=5, heading=0.0, legs=[tma.Straight(60)]), [0.0, 30.0]).round(6)
    array([[0., 5.],
           [0., 5.]])
    """
    times = np.asarray(times, dtype=float)
    first, last = (_moved_inside(motion, times, step) for step in (-STEP, STEP))
    if not np.all(last > first):
        lost = times[np.argmin(last > first)]
        raise ValueError(f"no velocity at t = {lost} s: no position is known {STEP} s before or after it")
    return (motion.position_at(last) - motion.position_at(first)) / (last - first)[:, None]


def _moved_inside(motion, times, step):
    """``times + step`` where the motion has a position then, the time itself elsewhere."""
    try:
        motion.position_at(times + step)
    except ValueError:
        if len(times) == 1:
            return times
        half = len(times) // 2
        return np.concatenate([_moved_inside(motion, part, step) for part in (times[:half], times[half:])])
    return times + step


@dataclass(frozen=True)
class DopplerFrequency:
    """Frequency heard from a source of unknown base frequency, state ``(x, y, vx, vy, f0)``, in Hz.

    Parameters
    ----------
    c : float
        Speed of sound in m/s, positive.
    f0 : float, optional
        A plausible first value of the base frequency in Hz, the model's ``guess``; no prediction reads it.
    true_f0 : float, optional
        The true base frequency in Hz, which `observe` (simulation) alone reads; the first value where it is
        not given.

    Notes
    -----
    Derived at the top of this file: moving source and moving observer, propagation delay included. The
    observer's velocity comes from its positions (`velocity_of`). A state that is not slower than sound
    predicts NaN.

    Examples
    --------
    A tone of 300 Hz that comes nearer at 15 m/s: 300 / (1 - 15 / 1500).

    >>> import numpy as np, tmalib as tma
    >>> still = tma.Course((0, 0), speed=0, heading=0.0, legs=[tma.Straight(60)])
    >>> model = DopplerFrequency(c=1500, f0=299, true_f0=300)
    >>> model.observe(tma.Target((0, 4000), speed=15, heading=np.pi), still, np.array([0.0])).round(4)
    array([303.0303])
    >>> model.guess
    {'f0': 299.0}
    """

    c: float = 1500.0
    f0: float | None = None
    true_f0: float | None = None

    coordinates = ("x", "y", "vx", "vy", "f0")

    def __post_init__(self) -> None:
        check_scalar("c", self.c, above=0.0)
        for name in ("f0", "true_f0"):
            if getattr(self, name) is not None:
                check_scalar(name, getattr(self, name), above=0.0)

    @property
    def truth(self) -> dict[str, float]:
        """The base frequency in simulation, if there is one."""
        f0 = self.f0 if self.true_f0 is None else self.true_f0
        return {} if f0 is None else {"f0": f0}

    @property
    def guess(self) -> dict[str, float]:
        """First value of the base frequency in Hz; empty if none was given."""
        return {} if self.f0 is None else {"f0": float(self.f0)}

    def observer_state(self, platform: Motion, times: FloatArray) -> FloatArray:
        """Position and velocity of the platform, shape ``(4, N)``; `ValueError` if it outruns sound."""
        velocity = velocity_of(platform, times)
        fastest = np.max(np.hypot(*velocity.T), initial=0.0)
        if not fastest < self.c:
            raise ValueError(f"the platform must be slower than c = {self.c} m/s, got {fastest} m/s")
        return np.concatenate([platform.position_at(times).T, velocity.T])

    def value_and_gradient(
        self, state: StateRows, observer: FloatArray, elapsed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        x, y, vx, vy, f0 = state
        ox, oy, ovx, ovy = observer
        c = sound_if_faster(self.c, vx, vy)
        _, slope, sin, cos = delayed_bearing((x, y, vx, vy), (ox, oy), elapsed, c)
        away = c + vx * sin + vy * cos
        k = (c + ovx * sin + ovy * cos) / away
        turn = ((ovx - k * vx) * cos - (ovy - k * vy) * sin) / away  # of k with theta
        gradient = np.empty((5, *k.shape))
        np.multiply(f0 * turn, slope, out=gradient[:4])
        gradient[2] -= f0 * k * sin / away
        gradient[3] -= f0 * k * cos / away
        gradient[4] = k
        return f0 * k, gradient

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        """Plain difference, in Hz."""
        return measured - predicted

    def observe(self, target: Motion, platform: Motion, times: FloatArray) -> FloatArray:
        """Frequency heard from any motion slower than sound, ``(N,)``, in Hz; NaN for one on the platform."""
        f0 = self.f0 if self.true_f0 is None else self.true_f0
        if f0 is None:
            raise ValueError("a simulated frequency needs true_f0; give DopplerFrequency(true_f0=...)")
        times, (ox, oy, ovx, ovy) = np.asarray(times, dtype=float), self.observer_state(platform, times)
        here = np.stack([ox, oy], axis=-1)
        emitted = times - delay_of_motion(target, here, times, self.c)
        dx, dy = (target.position_at(emitted) - here).T
        vx, vy = velocity_of(target, emitted).T
        distance = np.where(np.hypot(dx, dy) > TOUCHING, np.hypot(dx, dy), np.nan)
        sin, cos = dx / distance, dy / distance
        return f0 * (self.c + ovx * sin + ovy * cos) / (self.c + vx * sin + vy * cos)
