"""Measurements kept as few values: how a memory of bounded size takes more of them in.

*Condensing.* When there are too many values of a sensor, their span of time is divided into equal intervals.
In each of them the residuals ``r_k`` from an estimate, with weights ``w_k = 1 / sigma_k^2`` at times ``t_k``,
are replaced by two values of the weighted line through them, at the nodes of the two-point Gauss rule of the
times::

    W = sum w,   m = sum w t / W,   s^2 = sum w (t - m)^2 / W,   g = sum w (t - m)^3 / (W s^3),
    z = (g -+ sqrt(g^2 + 4)) / 2,   nodes m + s z,   weights W / (1 + z^2),   values r + b s z,

with the mean ``r`` and the slope ``b`` of the residuals. The prediction at the nodes is added. The two z have
the product -1, so that the two values are not correlated; their standard deviations are ``weight^(-1/2)``.
Together they tell of a line what the residuals tell. The nodes lie between the times, and have the sums of w,
w t, w t^2 and w t^3 of these. The residuals from a good estimate have little curvature to lose. An
uncertain one may bend where nothing bends; it is used where its lines leave less than those of the values
themselves, taken from the first of each interval, by a sum of squares of `BENT`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .scenario import Scenario
from .sensors import Sensor
from .types import BoolArray, FloatArray

BENT = 4.0  # least fall of the weighted squares with which an uncertain estimate is better than none
FOURTH = 4  # a full memory is divided into a fourth as many intervals, of two values each


def line_at_gauss_nodes(times: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes, their weights, and what takes residuals to the values of their line at the nodes.

    Parameters
    ----------
    times, weights : ndarray, shape (m,)

    Returns
    -------
    nodes, weights : ndarray, shape (2,)
        Or ``(1,)`` if all times are the same.
    line : ndarray, shape (2, m)
        The values are ``line @ residuals``.

    Notes
    -----
    Derived at the top of this file.

    Examples
    --------
    >>> import numpy as np
    >>> nodes, weights, line = line_at_gauss_nodes(np.array([0.0, 1.0, 5.0]), np.ones(3))
    >>> weights.round(2), bool(nodes.max() < 5)
    (array([1.93, 1.07]), True)
    >>> np.allclose(line @ [1.0, 3.0, 11.0], 1 + 2 * nodes)
    True
    """
    total = weights.sum()
    mean = weights @ times / total
    away = times - mean
    spread = np.sqrt(weights @ away**2 / total)
    if not spread > 0:
        return times[:1], np.array([total]), weights[None] / total
    skew = weights @ away**3 / (total * spread**3)
    z = (skew + np.array([-1.0, 1.0]) * np.hypot(skew, 2.0)) / 2
    line = weights / total * (1 + z[:, None] * away / spread)
    return np.clip(mean + spread * z, times[0], times[-1]), total / (1 + z**2), line


def condense(
    scenario: Scenario, values: FloatArray, state: FloatArray, sure: BoolArray, most: int
) -> tuple[Scenario, FloatArray]:
    """The scenario with ``most / 2`` values, or fewer, of every sensor that has ``most``, and the values.

    Parameters
    ----------
    scenario : Scenario
    values : ndarray, shape (runs, K)
    state : ndarray, shape (runs, n)
        From which residuals are taken; NaN without one.
    sure : ndarray of bool, shape (runs,)
        Whether it is a good estimate. Another one is used where the values say that it is better than none.
    most : int

    Returns
    -------
    scenario : Scenario
    values : ndarray, shape (runs, K')
    """
    sensors, parts = [], []
    for block in scenario.blocks:
        sensor, part = block.sensor, values[:, block.columns]
        if len(sensor) >= most:
            sensor, part = _of_lines(block, part, state, sure, scenario.platform_of(sensor), most // FOURTH)
        sensors.append(sensor)
        parts.append(part)
    return replace(scenario, sensors=sensors), np.concatenate(parts, axis=1)


def _of_lines(block, values, state, sure, platform, intervals):
    """The sensor with two values in each interval of time, and these, ``(runs, K')``."""
    sensor, times, model = block.sensor, block.sensor.times, block.sensor.model
    weights = np.broadcast_to(np.asarray(sensor.sigma), len(sensor)) ** -2.0
    edges = np.linspace(times[0], times[-1], intervals + 1)[1:-1]
    first = np.unique(np.append(0, np.searchsorted(times, edges)))
    first = first[first < len(times)]
    ends = np.append(first[1:], len(times))
    found = [line_at_gauss_nodes(times[i:j], weights[i:j]) for i, j in zip(first, ends, strict=True)]
    nodes, sharper = (np.concatenate([part[k] for part in found]) for k in (0, 1))
    line, row = np.zeros((len(nodes), len(times))), 0
    for i, j, (*_, part) in zip(first, ends, found, strict=True):
        line[row : row + len(part), i:j] = part
        row += len(part)
    rows, start = state.T[:, :, None], values[:, first]
    old, new = np.repeat(start, ends - first, axis=1), np.repeat(start, [len(f[0]) for f in found], axis=1)
    with np.errstate(all="ignore"):  # without an estimate, or for values that are not finite
        before, _ = block.predict(rows, block.observer[:, None], block.elapsed)
        observer, elapsed = model.observer_state(platform, nodes), block.elapsed[0] + (nodes - times[0])
        after, _ = block.predict(rows, observer[:, None], elapsed)
        aided = _lines_of(model.residual(values, before), line, weights, sharper)
        plain = _lines_of(model.residual(values, old), line, weights, sharper)
        known = np.isfinite(aided[0]).all(axis=1) & np.isfinite(after).all(axis=1)
        use = (known & (sure | (plain[1] - aided[1] > BENT)))[:, None]
        return replace(sensor, times=nodes, sigma=sharper**-0.5), np.where(
            use, after + aided[0], new + plain[0]
        )


def _lines_of(residual, line, weights, sharper):
    """Values ``(runs, K')`` at the nodes, and the weighted squares ``(runs,)`` that the lines leave."""
    values = np.vecdot(residual[:, None, :], line)  # run by run: none depends on the runs beside it
    return values, np.vecdot(residual * weights, residual) - np.vecdot(values * sharper, values)


def merge(
    kept: Scenario | None, values: FloatArray, new: Scenario, measured: FloatArray
) -> tuple[Scenario, FloatArray]:
    """What is kept, and new measurements ``(runs, N)`` after it, as one scenario with the new platform.

    `ValueError` for a sensor whose kind of model has changed.
    """
    if kept is None:
        return new, measured
    old = {block.sensor.name: block for block in kept.blocks}
    sensors, parts = [], []
    for block in new.blocks:
        sensor, columns = block.sensor, [measured[:, block.columns]]
        before = old.pop(sensor.name, None)
        if before is not None:
            sensor = _joined(before.sensor, sensor)
            columns.insert(0, values[:, before.columns])
        sensors.append(sensor)
        parts.extend(columns)
    for block in old.values():
        sensors.append(block.sensor)
        parts.append(values[:, block.columns])
    return replace(new, sensors=sensors), np.concatenate(parts, axis=1)


def _joined(old: Sensor, new: Sensor) -> Sensor:
    if type(old.model) is not type(new.model):
        kinds = type(old.model).__name__, type(new.model).__name__
        raise ValueError(f"sensors of one name must have one kind of model, got {kinds} of {new.name!r}")
    sigma = [np.broadcast_to(np.asarray(part.sigma), len(part)) for part in (old, new)]
    return replace(new, times=np.concatenate([old.times, new.times]), sigma=np.concatenate(sigma))


def next_piece(scenario: Scenario, left: BoolArray, kept: Scenario | None, most: int) -> BoolArray:
    """Which measurements there is room for, in order of time: a mask ``(N,)`` of some of those ``left``."""
    count = {} if kept is None else {sensor.name: len(sensor) for sensor in kept.sensors}
    waiting, last = [], np.inf
    for block in scenario.blocks:
        columns = block.columns.start + np.flatnonzero(left[block.columns])
        room = most - count.get(block.sensor.name, 0)
        if len(columns) > room:
            columns = columns[:room]
            last = min(last, scenario.times[columns[-1]])
        waiting.append(columns)
    piece = np.zeros(len(left), dtype=bool)
    piece[np.concatenate(waiting)] = True
    return piece & (scenario.times <= last)
