"""Conical angles: what a towed line array measures along a direct or a bounced ray.

A line array measures the cosine of the angle between its axis and a ray. Straight rays between a flat
surface (z = 0) and a flat bottom (z = D) unfold into straight lines to an *image* of the target, the
target mirrored at each bounce in turn. With the horizontal displacement ``d = (dx, dy)`` from the array
to the target, the array's heading ``h`` and the depth ``zeta`` of the image below the array
(`conical-angles`, Section 2)::

    m = (dx sin h + dy cos h) / R,      R = sqrt(dx^2 + dy^2 + zeta^2),
    zeta = -2 delta nB (-1)^(nS + nB) D - zO + (-1)^(nS + nB) zT.

The gradient with respect to ``(x, y, z, vx, vy)`` at the reference time, ``s`` seconds before, is::

    dm/dx = (sin h - m dx / R) / R,    dm/dy = (cos h - m dy / R) / R,
    dm/dz = -m zeta / R^2 dzeta/dz,    dm/dvx = s dm/dx,    dm/dvy = s dm/dy.

Depths are positive downwards, in metres. The measurement has no unit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .bearings import TOUCHING, displacement
from .checks import check_is, check_scalar
from .types import FloatArray, Motion, StateRows


@dataclass(frozen=True)
class RayPath:
    """A ray from the target to the array: first direction and numbers of bounces.

    Parameters
    ----------
    delta : {+1, -1}
        +1 if the ray leaves the target downwards, -1 if upwards.
    bottom, surface : int
        Number of bounces off the bottom, ``nB``, and off the surface, ``nS``.

    Raises
    ------
    ValueError
        For a path that cannot be: bounces alternate, and the first is off the bottom for ``delta = +1``
        and off the surface for ``delta = -1``.

    Notes
    -----
    Source: the triplet ``(delta, nB, nS)`` of `conical-angles`, Section 2.
    """

    delta: int
    bottom: int
    surface: int

    def __post_init__(self) -> None:
        triplet = (self.delta, self.bottom, self.surface)
        if check_scalar("delta", self.delta) not in (1, -1):
            raise ValueError(f"delta must be +1 or -1, got {self.delta!r}")
        for name in ("bottom", "surface"):
            count = check_scalar(name, getattr(self, name))
            if count != int(count) or count < 0:
                raise ValueError(f"{name} must be a number of bounces, got {count!r}")
        if self.delta * (self.bottom - self.surface) not in (0, 1):
            raise ValueError(
                f"no ray has the path {triplet}: bounces alternate, the first one off the "
                f"{'bottom' if self.delta == 1 else 'surface'}"
            )

    @property
    def is_direct(self) -> bool:
        """Whether the ray does not bounce."""
        return self.bottom == self.surface == 0

    def image(self, bottom_depth: float) -> tuple[float, float]:
        """Coefficients ``(a, b)``: the image of a target at depth z is at depth ``a z + b``."""
        sign = (-1) ** (self.bottom + self.surface)
        return float(sign), -2.0 * self.delta * self.bottom * sign * bottom_depth


DIRECT = RayPath(1, 0, 0)
BOTTOM_BOUNCE = RayPath(1, 1, 0)
SURFACE_BOUNCE = RayPath(-1, 0, 1)


def image_depth(path: RayPath, target_depth: float, array_depth: float, bottom_depth: float) -> float:
    """Depth of the target's image below the array, ``zeta_OT``, in metres; negative above it.

    Notes
    -----
    Source: `conical-angles`, Section 2.

    Examples
    --------
    >>> image_depth(BOTTOM_BOUNCE, target_depth=100, array_depth=200, bottom_depth=4000)
    7700.0
    """
    bottom_depth = check_scalar("bottom_depth", bottom_depth, above=0.0)
    slope, offset = check_is("path", path, RayPath).image(bottom_depth)
    array_depth = check_scalar("array_depth", array_depth)
    return slope * check_scalar("target_depth", target_depth) + offset - array_depth


@dataclass(frozen=True)
class ConicalAngle:
    """Cosine of the conical angle along a ray path, a measurement model.

    Parameters
    ----------
    path : RayPath
    array_depth, bottom_depth : float
        ``zO`` and ``D`` in metres, ``0 <= zO <= D``.
    assumed_depth : float, optional
        Depth that an estimator assumes for the target. The state is then ``(x, y, vx, vy)``; without it
        the state is ``(x, y, z, vx, vy)``. What is *measured* always uses the target's true depth.
    heading_lag : float
        Seconds by which the array's heading lags the platform's course; the first heading holds before
        the first measurement.

    Raises
    ------
    ValueError
        For depths outside the water.

    Notes
    -----
    Source: `conical-angles`, Sections 2 and 3.2.
    """

    path: RayPath
    array_depth: float
    bottom_depth: float
    assumed_depth: float | None = None
    heading_lag: float = 0.0

    def __post_init__(self) -> None:
        check_is("path", self.path, RayPath)
        bottom = check_scalar("bottom_depth", self.bottom_depth, above=0.0)
        for name in ("array_depth", "assumed_depth"):
            depth = getattr(self, name)
            if depth is not None and not 0 <= check_scalar(name, depth) <= bottom:
                raise ValueError(f"{name} must be between 0 and bottom_depth = {bottom}, got {depth}")
        check_scalar("heading_lag", self.heading_lag, minimum=0.0)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """``(x, y, vx, vy)`` with an assumed depth, ``(x, y, z, vx, vy)`` without."""
        return ("x", "y", "z", "vx", "vy") if self.assumed_depth is None else ("x", "y", "vx", "vy")

    def observer_state(self, platform: Motion, times: FloatArray) -> FloatArray:
        """Position, sine and cosine of the array's heading, shape ``(4, N)``."""
        times = np.asarray(times, dtype=float)
        ship: Any = platform  # one that has a heading
        heading = ship.heading_at(np.maximum(times - self.heading_lag, times[0]))
        return np.stack([*platform.position_at(times).T, np.sin(heading), np.cos(heading)])

    def value_and_gradient(
        self, state: StateRows, observer: FloatArray, elapsed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        x, y, *depth, vx, vy = state
        dx, dy = displacement((x, y, vx, vy), observer, elapsed)
        zeta = self._zeta(depth[0] if depth else self.assumed_depth)
        scale = 1.0 / np.sqrt(dx * dx + dy * dy + zeta * zeta)
        sin, cos = observer[2], observer[3]
        value = (dx * sin + dy * cos) * scale
        gradient = np.empty((len(state), *value.shape))
        along = value * scale
        np.multiply(sin - along * dx, scale, out=gradient[0, ...])
        np.multiply(cos - along * dy, scale, out=gradient[1, ...])
        if depth:
            np.multiply(along * scale, -zeta * self.path.image(self.bottom_depth)[0], out=gradient[2, ...])
        np.multiply(elapsed, gradient[:2], out=gradient[-2:])
        return value, gradient

    def _zeta(self, target_depth):
        slope, offset = self.path.image(self.bottom_depth)
        return slope * target_depth + (offset - self.array_depth)

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        """Plain difference: a cosine does not wrap."""
        return measured - predicted

    def observe(self, target: Motion, platform: Motion, times: FloatArray) -> FloatArray:
        """Cosine of the conical angle of the target, at its true depth, shape ``(N,)``.

        A depth out of the water is taken as it is: a ghost may be there, and `tmalib.admissible` tells.
        """
        depth = getattr(target, "depth", None)
        if depth is None:
            raise ValueError("a conical angle needs the target's depth; give Target(depth=...)")
        dx, dy = (target.position_at(times) - platform.position_at(times)).T
        _, _, sin, cos = self.observer_state(platform, times)
        distance = np.sqrt(dx**2 + dy**2 + self._zeta(depth) ** 2)
        far = distance > TOUCHING  # a target right above the array has a cosine, one in it has none
        return np.where(far, dx * sin + dy * cos, np.nan) / np.where(far, distance, 1.0)
