"""Charts: coordinates of the state in which an estimator takes its steps.

A minimum does not depend on the coordinates; the way to it does. In Cartesian coordinates a bearing is
a strongly curved function of range. *Modified polar* coordinates (Aidala and Hammel, 1983) about an
origin ``o`` separate what bearings show at once from what they show late::

    Y = (theta, rho, a, b),   x - o = u / rho,   V = (a u + b u') / rho,
    u = (sin theta, cos theta),   u' = (cos theta, -sin theta):

bearing, inverse range, and the radial and the transverse velocity divided by range. The direction to
the target from a platform that has moved by ``m`` is that of ``u + s (a u + b u') - rho m``, which is
linear in all but the bearing. Gauss-Newton from a start of the wrong range then needs fewer steps and
seldom fails.

A chart has ``from_state``, ``to_state`` and ``jacobian``, all over leading batch axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .checks import check_array, set_fields


@dataclass(frozen=True)
class Cartesian:
    """The state itself: steps are taken in metres and metres per second."""

    def from_state(self, state):
        return state

    def to_state(self, point):
        return point

    def jacobian(self, point):
        """Derivative of the state with respect to the chart's coordinates, ``(..., n, n)``."""
        return np.broadcast_to(np.eye(point.shape[-1]), (*point.shape, point.shape[-1]))


@dataclass(frozen=True, eq=False)
class ModifiedPolar:
    """Bearing (rad), inverse range (1/m), radial and transverse velocity over range (1/s).

    Parameters
    ----------
    origin : array_like, shape (2,)
        Usually the platform's position at the reference time, in metres.

    Notes
    -----
    Source: Aidala and Hammel (1983), with the observer's own velocity left out.
    """

    origin: np.ndarray

    def __post_init__(self):
        set_fields(self, origin=check_array("origin", self.origin, (2,)))

    def from_state(self, state):
        """Coordinates ``(..., 4)`` of states ``(x, y, vx, vy)``; not finite for a target at the origin."""
        x, y, vx, vy = np.moveaxis(np.asarray(state, dtype=float), -1, 0)
        dx, dy = x - self.origin[0], y - self.origin[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            rho = 1 / np.hypot(dx, dy)
            radial = (vx * dx + vy * dy) * rho**2
            transverse = (vx * dy - vy * dx) * rho**2
        return np.stack([np.arctan2(dx, dy), rho, radial, transverse], axis=-1)

    def to_state(self, point):
        """States ``(..., 4)``; NaN where the inverse range is not positive."""
        theta, rho, radial, transverse = np.moveaxis(np.asarray(point, dtype=float), -1, 0)
        sin, cos = np.sin(theta), np.cos(theta)
        r = 1 / np.where(rho > 0, rho, np.nan)
        x = self.origin[0] + r * sin
        y = self.origin[1] + r * cos
        return np.stack(
            [x, y, r * (radial * sin + transverse * cos), r * (radial * cos - transverse * sin)], axis=-1
        )

    def jacobian(self, point):
        """Derivative of the state with respect to ``(theta, rho, a, b)``, shape ``(..., 4, 4)``."""
        theta, rho, radial, transverse = np.moveaxis(np.asarray(point, dtype=float), -1, 0)
        sin, cos = np.sin(theta), np.cos(theta)
        r = 1 / np.where(rho > 0, rho, np.nan)
        vx, vy = r * (radial * sin + transverse * cos), r * (radial * cos - transverse * sin)
        slope = np.zeros((*theta.shape, 4, 4))
        slope[..., 0, 0], slope[..., 1, 0], slope[..., 2, 0], slope[..., 3, 0] = r * cos, -r * sin, vy, -vx
        slope[..., 0, 1], slope[..., 1, 1], slope[..., 2, 1], slope[..., 3, 1] = (
            -r * r * sin,
            -r * r * cos,
            -r * vx,
            -r * vy,
        )
        slope[..., 2, 2], slope[..., 3, 2] = r * sin, r * cos
        slope[..., 2, 3], slope[..., 3, 3] = r * cos, -r * sin
        return slope

    def inverse_jacobian(self, point):
        """Derivative of ``(theta, rho, a, b)`` with respect to the state, shape ``(..., 4, 4)``."""
        theta, rho, radial, transverse = np.moveaxis(np.asarray(point, dtype=float), -1, 0)
        sin, cos = np.sin(theta), np.cos(theta)
        rho = np.where(rho > 0, rho, np.nan)
        slope = np.zeros((*theta.shape, 4, 4))
        slope[..., 0, 0], slope[..., 0, 1] = rho * cos, -rho * sin
        slope[..., 1, 0], slope[..., 1, 1] = -rho * rho * sin, -rho * rho * cos
        slope[..., 2, 0] = rho * (transverse * cos - radial * sin)
        slope[..., 2, 1] = slope[..., 3, 0] = -rho * (radial * cos + transverse * sin)
        slope[..., 3, 1] = rho * (radial * sin - transverse * cos)
        slope[..., 2, 2], slope[..., 2, 3] = rho * sin, rho * cos
        slope[..., 3, 2], slope[..., 3, 3] = rho * cos, -rho * sin
        return slope
