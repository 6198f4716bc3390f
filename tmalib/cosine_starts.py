"""Starts from conical angles alone: two instants leave ranges, sides and a depth to be tried.

A cosine m of a target at distance R, whose image is ``zeta`` below the array, tells the displacement along
the axis, ``R m``, and that across it up to its side, ``+-sqrt(R^2 (1 - m^2) - zeta^2)``. So the first and the
last instant of a sensor give a uniform motion for each choice of two ranges, two sides and a depth.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .cones import ConicalAngle
from .levenberg_marquardt import minimise_in_blocks
from .scenario import Scenario
from .sensors import Sensor, SensorBlock
from .types import BoolArray, FloatArray, Motion
from .uniform import propagate

RANGES = np.geomspace(500.0, 64e3, 8)  # metres, at either end
DEPTHS = (0.02, 0.25, 0.5, 0.75, 0.98)  # of the depth of the water
FEW_STEPS, MORE_STEPS, KEPT = 10, 200, 32  # from all of the grid; from those kept, in and out of the water
TOLERANCE = 1e-2
LEAST_ACROSS = 1e-3  # of the range, where a depth leaves nothing across


def has_cosines(scenario: Scenario) -> bool:
    """Whether all sensors measure conical angles of a target in the water."""
    return all(isinstance(sensor.model, ConicalAngle) for sensor in scenario.sensors)


def motions_through(
    sensor: Sensor, platform: Motion, cosines: FloatArray, ranges: ArrayLike, depths: ArrayLike
) -> FloatArray:
    """Uniform motions with given cosines at the first and the last instant of a sensor.

    Parameters
    ----------
    sensor : Sensor
        Of a `ConicalAngle`.
    platform : motion
    cosines : array_like, shape (2,)
    ranges : array_like, shape (k, 2)
        In metres, at either end.
    depths : array_like, shape (d,)

    Returns
    -------
    ndarray, shape (4 d k^2, 5)
        ``(x, y, z, vx, vy)`` at the first instant: every depth with every pair of ranges and of sides.
    """
    model: Any = sensor.model
    x, y, sin, cos = model.observer_state(platform, sensor.times)[:, [0, -1]]
    slope, offset = model.path.image(model.bottom_depth)
    (near, far), sides = np.asarray(ranges).T, (-1, 1)
    z, *grid = np.meshgrid(depths, near, far, sides, sides, indexing="ij")
    z, r, side = z.ravel(), np.reshape(grid[:2], (2, -1)).T, np.reshape(grid[2:], (2, -1)).T
    zeta = slope * z + offset - model.array_depth
    ahead = r * cosines
    across = side * np.sqrt(np.maximum(r**2 - ahead**2 - zeta[:, None] ** 2, (LEAST_ACROSS * r) ** 2))
    places = np.stack([x + across * cos + ahead * sin, y - across * sin + ahead * cos])  # (2, S, ends)
    velocity = np.diff(places, axis=-1)[..., 0] / (sensor.times[-1] - sensor.times[0])
    return np.stack([*places[..., 0], z, *velocity], axis=-1)


def longest_sensor(scenario: Scenario) -> SensorBlock:
    """The sensor's block with the longest time of observation; `ValueError` if that is one instant."""
    block = max(scenario.blocks, key=lambda block: np.ptp(block.sensor.times))
    if not np.ptp(block.sensor.times) > 0:
        raise ValueError(f"a sensor needs two instants or more, got {[len(s) for s in scenario.sensors]}")
    return block


def grid_of_motions(scenario: Scenario, measured: FloatArray) -> FloatArray:
    """States from which a fit of one run ``(N,)`` may start, ``(S, n)``, for conical angles alone."""
    block = longest_sensor(scenario)
    sensor, names = block.sensor, scenario.coordinates
    model: Any = sensor.model
    depths = np.multiply(DEPTHS, model.bottom_depth) if "z" in names else [model.assumed_depth]
    cosines = np.clip(measured[block.columns][[0, -1]], -1, 1)
    ranges = np.stack([RANGES, RANGES], axis=-1)
    found = motions_through(sensor, scenario.platform_of(sensor), cosines, ranges, depths)
    every = ("x", "y", "z", "vx", "vy")
    found = propagate(found, scenario.reference_time - sensor.times[0], every)
    return found[:, [every.index(name) for name in names]]


def lowest_of_grid(scenario: Scenario, angles: FloatArray, chart: Any) -> FloatArray:
    """A start for every run ``(runs, N)``: where a few steps from the grid lead lowest, in the water if any.

    A ghost out of the water may be as low as the target; no target is there.
    """
    found = np.full((len(angles), len(scenario.coordinates)), np.nan)
    for run, measured in enumerate(angles):
        if not np.isfinite(measured).all():
            continue
        grid = grid_of_motions(scenario, measured)
        state, cost = _few_steps(scenario, measured, grid, chart, FEW_STEPS)
        wet = in_water(scenario, state)
        kept = np.concatenate([_lowest(cost, wet, KEPT), _lowest(cost, ~wet, KEPT)])
        state, cost = _few_steps(scenario, measured, state[kept], chart, MORE_STEPS)
        wet = in_water(scenario, state)
        best = _lowest(cost, wet if np.isfinite(cost[wet]).any() else ~wet, 1)
        found[run] = state[best[0]] if len(best) else np.nan
    return found


def in_water(scenario: Scenario, state: FloatArray) -> BoolArray:
    """Whether states ``(S, n)`` are between surface and bottom; an assumed depth is."""
    if "z" not in scenario.coordinates:
        return np.ones(len(state), dtype=bool)
    depth = state[:, scenario.coordinates.index("z")]
    models: list[Any] = [sensor.model for sensor in scenario.sensors]
    bottom = min(model.bottom_depth for model in models)
    return (depth >= 0) & (depth <= bottom)


def _lowest(cost, among, count):
    """Indices of the lowest finite criteria among some."""
    order = np.argsort(np.where(among, cost, np.inf), kind="stable")[:count]
    return order[among[order] & np.isfinite(cost[order])]


def _few_steps(scenario, measured, starts, chart, steps):
    angles = np.broadcast_to(measured, (len(starts), len(measured)))
    found = minimise_in_blocks(scenario, angles, starts, chart, True, TOLERANCE, steps)
    finite = np.isfinite(found.cost) & np.isfinite(found.state).all(axis=1)
    return found.state, np.where(finite, found.cost, np.inf)
