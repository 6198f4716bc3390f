"""The criterion with some components of the state held: what a position costs when all else fits as it may.

With the criterion ``C(X)`` of `tmalib.batch`, the *profile* of a position p is::

    D(p) = min { C(X) : position of X is p } - min C.

By the likelihood ratio ``D`` at the true position is chi-square with two degrees of freedom. That holds
exactly for a linear model, and in the coordinates in which a model is most nearly linear, whichever they are:
``D`` does not depend on coordinates. An ellipse needs that x and y are such coordinates.

The held components are held by a chart whose Jacobian has zero columns for them. The normal equations then
have zero rows there, and no step moves them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .batch import fit, without_gaps
from .charts import Cartesian, Chart, chart_of
from .checks import as_numbers, check_broadcast, check_is
from .levenberg_marquardt import minimise_in_blocks
from .scenario import Scenario
from .types import FloatArray
from .uniform import moving_pairs

TOLERANCE = 1e-3  # Newton decrement: the criterion is then right to its square
PASSES = 60


@dataclass(frozen=True, eq=False)
class Held:
    """A chart in which the components at ``places`` keep the values of the start."""

    chart: Chart
    places: Sequence[int]

    def from_state(self, state: FloatArray) -> FloatArray:
        return self.chart.from_state(state)

    def to_state(self, point: FloatArray) -> FloatArray:
        return self.chart.to_state(point)

    def jacobian(self, point: FloatArray) -> FloatArray:
        """That of the chart, zero for what is held, ``(..., n, n)``."""
        slope = np.array(self.chart.jacobian(point))
        slope[..., np.array(self.places)] = 0.0
        return slope

    def inverse_jacobian(self, point: FloatArray) -> FloatArray:
        """That of the chart; of what is held nothing is asked."""
        return self.chart.inverse_jacobian(point)


def lowest_of(
    scenario: Scenario, angles: FloatArray, starts: FloatArray, chart: Chart
) -> tuple[FloatArray, FloatArray]:
    """Of several starts a run, the state with the lowest criterion that a chart's steps reach.

    Parameters
    ----------
    scenario : Scenario
    angles : ndarray, shape (runs, N)
    starts : ndarray, shape (S, runs, n)
    chart : chart

    Returns
    -------
    state : ndarray, shape (runs, n)
    cost : ndarray, shape (runs,)
        Infinite, and the state NaN, for a run that no start helps.
    """
    count, runs, n = starts.shape
    many = np.broadcast_to(angles, (count, *angles.shape)).reshape(count * runs, -1)
    found = minimise_in_blocks(scenario, many, starts.reshape(-1, n), chart, True, TOLERANCE, PASSES)
    cost = np.where(np.isfinite(found.cost), found.cost, np.inf).reshape(count, runs)
    best = np.argmin(cost, axis=0), np.arange(runs)
    return found.state.reshape(starts.shape)[best], cost[best]


def starts_at(scenario: Scenario, state: FloatArray, position: FloatArray) -> FloatArray:
    """Starts ``(S, runs, n)`` at given positions: bearings kept, velocity kept, and at rest.

    ``state`` and ``position`` are ``(runs, n)`` and ``(runs, 2)``. To keep the bearings as they are, the
    velocity relative to the platform's mean velocity turns and grows with the displacement from it.
    """
    places, speeds = moving_pairs(scenario.coordinates)
    sensor = max(scenario.sensors, key=len)
    first, last = scenario.platform_of(sensor).position_at(sensor.times[[0, -1]])
    mean = (last - first) / max(sensor.times[-1] - sensor.times[0], 1.0)
    kept = state.copy()
    kept[:, places] = position
    rest, turned = kept.copy(), kept.copy()
    rest[:, speeds] = 0.0
    origin = chart_of(scenario).origin
    plane = np.array([1, 1j])  # east + i north
    with np.errstate(divide="ignore", invalid="ignore"):  # a state on the platform gives no start
        ratio = ((position - origin) @ plane) / ((state[:, places] - origin) @ plane)
    moved = mean @ plane + ratio * ((state[:, speeds] - mean) @ plane)
    turned[:, speeds] = np.stack([moved.real, moved.imag], axis=-1)
    return np.stack([turned, kept, rest])


def criterion_at(
    scenario: Scenario, angles: FloatArray, state: FloatArray, position: FloatArray, near: bool = False
) -> tuple[FloatArray, FloatArray]:
    """States and lowest criteria of runs ``(runs, N)`` with their positions ``(runs, 2)`` held.

    The steps start from states ``(runs, n)`` moved there; if these are ``near``, one start is enough.
    """
    starts = starts_at(scenario, state, position)
    chart = Held(Cartesian(), tuple(moving_pairs(scenario.coordinates)[0]))
    many = np.broadcast_to(angles, (len(position), angles.shape[-1]))
    return lowest_of(scenario, many, starts[:1] if near else starts, chart)


def profile_criterion(
    scenario: Scenario, angles: ArrayLike, position: ArrayLike, start: ArrayLike | None = None
) -> FloatArray:
    """The profile ``D`` of a position for every run: chi-square with two degrees of freedom at the true one.

    Parameters
    ----------
    scenario : Scenario
        With ``x, y, vx, vy`` in its state. Its target is not read.
    angles : array_like, shape (..., N)
        Measurements, in the scenario's order.
    position : array_like, shape (..., 2)
        Position at the reference time in metres; broadcasts against the runs.
    start : array_like, shape (..., n), optional
        As in `tmalib.fit`.

    Returns
    -------
    ndarray, shape (...)
        ``D >= 0``; infinite where no target at the position is predicted by the models. NaN for a run that is
        not finite.

    Raises
    ------
    ValueError
        For wrong shapes, and where `tmalib.fit` refuses.

    Notes
    -----
    Derived at the top of this file. The lowest criterion is the lower one of two fits: one as `tmalib.fit`
    makes it, which need not have converged, and one from the state that was fitted at the position.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 400, 5.0), sigma=0.01)
    >>> truth = tma.Target((2e3, 4e3), speed=6, heading=1.5)
    >>> scenario = tma.Scenario(ship, [ear], reference_time=400, target=truth)
    >>> d = tma.profile_criterion(scenario, scenario.simulate(runs=50, seed=1), truth.position_at(400))
    >>> d.shape, bool(0.7 < np.mean(d <= -2 * np.log(0.1)) < 1)
    ((50,), True)
    """
    angles = check_is("scenario", scenario, Scenario).check_measurements(angles)
    position = as_numbers("position", position)
    if position.ndim == 0 or position.shape[-1] != 2:
        raise ValueError(f"position must have shape (..., 2), got {position.shape}")
    found = fit(scenario, angles, start, tolerance=TOLERANCE)
    shape = check_broadcast(measurements=found.cost, position=position[..., 0])
    rows = [
        np.broadcast_to(part, (*shape, part.shape[-1])).reshape(-1, part.shape[-1])
        for part in (found.measured, found.state, position)
    ]
    cost, profile = np.broadcast_to(found.cost, shape).ravel(), np.full(np.prod(shape, dtype=int), np.nan)
    for rest, there, runs in without_gaps(scenario, rows[0]):
        measured, state, place = (row[runs] for row in rows)
        state, held = criterion_at(rest, measured[:, there], state, place)
        _, free = lowest_of(rest, measured[:, there], state[None], chart_of(rest))
        with np.errstate(invalid="ignore"):
            profile[runs] = held - np.fmin(free, cost[runs])
    return profile.reshape(shape)[()]
