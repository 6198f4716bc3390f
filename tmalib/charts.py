"""Charts: coordinates of the state in which an estimator takes its steps.

A minimum does not depend on the coordinates; the way to it does. In Cartesian coordinates a bearing is
a strongly curved function of range. *Modified polar* coordinates (Aidala and Hammel, 1983) about an
origin ``o`` separate what bearings show at once from what they show late::

    Y = (theta, rho, a, b),   x - o = u / rho,   V = (a u + b u') / rho,
    u = (sin theta, cos theta),   u' = (cos theta, -sin theta):

bearing, inverse range, and the radial and the transverse velocity divided by range. The direction to
the target from a platform that has moved by ``m`` is that of ``u + s (a u + b u') - rho m``, which is
linear in all but the bearing. Gauss-Newton from a start of the wrong range then needs fewer steps.

A chart is made for an origin and the names of a state: ``chart(origin, coordinates)``, and has
``from_state``, ``to_state``, ``jacobian`` and ``inverse_jacobian``, all over leading batch axes. Components
of the state other than ``x, y, vx, vy`` stay what they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .checks import check_array, set_fields
from .types import Array, FloatArray, Motion
from .uniform import PLANE, is_uniform, moving_pairs


class Chart(Protocol):
    """Coordinates of the state; all methods take and give arrays with leading batch axes."""

    def from_state(self, state: FloatArray, /) -> FloatArray: ...

    def to_state(self, point: FloatArray, /) -> FloatArray: ...

    def jacobian(self, point: FloatArray, /) -> FloatArray: ...

    def inverse_jacobian(self, point: FloatArray, /) -> FloatArray: ...


ChartMaker: TypeAlias = Callable[..., Any]  # of origin and names of the state, as a chart's class


@dataclass(frozen=True, eq=False)
class Cartesian:
    """The state itself: steps are taken in metres and metres per second. Takes the arguments of a chart."""

    origin: object = None
    coordinates: Sequence[str] = PLANE

    def from_state(self, state: FloatArray) -> FloatArray:
        return state

    def to_state(self, point: FloatArray) -> FloatArray:
        return point

    def jacobian(self, point: FloatArray) -> FloatArray:
        """Derivative of the state with respect to the chart's coordinates, ``(..., n, n)``."""
        return np.broadcast_to(np.eye(point.shape[-1]), (*point.shape, point.shape[-1]))

    inverse_jacobian = jacobian


@dataclass(frozen=True, eq=False)
class ModifiedPolar:
    """Bearing (rad), inverse range (1/m), radial and transverse velocity over range (1/s).

    They take the places of ``x, y, vx, vy`` in the state.

    Parameters
    ----------
    origin : array_like, shape (2,)
        Usually the platform's position at the reference time, in metres.
    coordinates : sequence of str
        Names of the state's components, in order.

    Raises
    ------
    ValueError
        For a state without position and velocity in the plane.

    Notes
    -----
    Source: Aidala and Hammel (1983), with the observer's own velocity left out.
    """

    origin: Array
    coordinates: Sequence[str] = PLANE

    def __post_init__(self) -> None:
        set_fields(self, origin=check_array("origin", self.origin, (2,)), coordinates=tuple(self.coordinates))
        moving_pairs(self.coordinates)

    @cached_property
    def places(self) -> list[int]:
        """Where x, y, vx and vy stand in the state."""
        return [int(place) for place in np.concatenate(moving_pairs(self.coordinates))]

    def _parts(self, point):
        point = np.asarray(point, dtype=float)
        return [point[..., place] for place in self.places]

    def _with(self, state, parts):
        """The state with these four parts in their places."""
        changed = np.array(state, dtype=float)
        for place, part in zip(self.places, parts, strict=True):
            changed[..., place] = part
        return changed

    def _spread(self, block):
        """A ``(..., 4, 4)`` matrix of the four components as one of the whole state."""
        n = len(self.coordinates)
        if self.coordinates == PLANE:
            return block
        whole = np.zeros((*block.shape[:-2], n, n))
        whole[..., np.arange(n), np.arange(n)] = 1.0
        places = np.array(self.places)
        whole[..., places[:, None], places] = block
        return whole

    def from_state(self, state: ArrayLike) -> FloatArray:
        """Coordinates ``(..., n)`` of states ``(..., n)``; not finite for a target at the origin."""
        x, y, vx, vy = self._parts(state)
        dx, dy = x - self.origin[0], y - self.origin[1]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            rho = 1 / np.hypot(dx, dy)
            radial = (vx * dx + vy * dy) * rho**2
            transverse = (vx * dy - vy * dx) * rho**2
        return self._with(state, [np.arctan2(dx, dy), rho, radial, transverse])

    def to_state(self, point: ArrayLike) -> FloatArray:
        """States ``(..., n)``; NaN where the inverse range is not positive."""
        theta, rho, radial, transverse = self._parts(point)
        sin, cos = np.sin(theta), np.cos(theta)
        r = 1 / np.where(rho > 0, rho, np.nan)
        x = self.origin[0] + r * sin
        y = self.origin[1] + r * cos
        return self._with(
            point, [x, y, r * (radial * sin + transverse * cos), r * (radial * cos - transverse * sin)]
        )

    def jacobian(self, point: ArrayLike) -> FloatArray:
        """Derivative of the state with respect to the chart's coordinates, shape ``(..., n, n)``."""
        theta, rho, radial, transverse = self._parts(point)
        sin, cos = np.sin(theta), np.cos(theta)
        r = 1 / np.where(rho > 0, rho, np.nan)
        vx, vy = r * (radial * sin + transverse * cos), r * (radial * cos - transverse * sin)
        slope = np.zeros((*theta.shape, 4, 4))
        slope[..., 0, 0], slope[..., 1, 0], slope[..., 2, 0], slope[..., 3, 0] = r * cos, -r * sin, vy, -vx
        slope[..., 0, 1], slope[..., 1, 1] = -r * r * sin, -r * r * cos
        slope[..., 2, 1], slope[..., 3, 1] = -r * vx, -r * vy
        slope[..., 2, 2], slope[..., 3, 2] = r * sin, r * cos
        slope[..., 2, 3], slope[..., 3, 3] = r * cos, -r * sin
        return self._spread(slope)

    def inverse_jacobian(self, point: ArrayLike) -> FloatArray:
        """Derivative of the chart's coordinates with respect to the state, shape ``(..., n, n)``."""
        theta, rho, radial, transverse = self._parts(point)
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
        return self._spread(slope)


class Watch(Protocol):
    """What a chart has to know of a scenario, which lies above."""

    @property
    def platform(self) -> Motion: ...

    @property
    def times(self) -> FloatArray: ...

    @property
    def reference_time(self) -> float: ...

    @property
    def coordinates(self) -> tuple[str, ...]: ...


def check_chart(chart: object) -> None:
    """`ValueError` for what makes no charts."""
    if not callable(chart) or (isinstance(chart, type) and not hasattr(chart, "to_state")):
        raise ValueError(f"chart must be a class such as ModifiedPolar or Cartesian, got {chart!r}")


def chart_of(scenario: Watch, chart: ChartMaker | None = None) -> Any:
    """A chart about the platform at the measurement nearest to the reference time; the default of `fit`."""
    if chart is None:
        flat = is_uniform(scenario.coordinates) and "z" not in scenario.coordinates
        chart = ModifiedPolar if flat else Cartesian
    check_chart(chart)
    nearest = scenario.times[np.argmin(np.abs(scenario.times - scenario.reference_time))]
    return chart(scenario.platform.position_at(nearest), scenario.coordinates)
