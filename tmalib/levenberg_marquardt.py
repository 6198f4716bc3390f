"""Levenberg-Marquardt in a chart, for a block of runs at once: the iteration behind `tmalib.batch.fit`.

With the whitened residuals ``e`` and the whitened gradient ``J``, a Gauss-Newton step solves
``(J'J) p = J'e``. Far from the minimum it may climb. The Levenberg-Marquardt safeguard then damps it::

    (J'J + lambda diag(J'J)) p = J'e,

which turns the step towards the gradient and shortens it; ``lambda`` is zero until a step fails to
lower the criterion, grows while steps fail and shrinks again after that. The iteration of a run stops
on the *Newton decrement* ``sqrt(p' J'e)`` of the undamped step: its length in standard deviations of the
estimate. It does not depend on units or on the choice of coordinates.

Each run has its own ``lambda`` and its own verdict; none can raise, and none is dropped. A run's result
does not depend on the runs beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from . import status as words
from .charts import Cartesian, Chart, ChartMaker
from .scenario import Scenario
from .sensors import SensorBlock
from .types import BoolArray, FloatArray, IntArray, TextArray

BLOCK_ELEMENTS = 72_000  # runs x measurements of the largest sensor: about 600 kB an array
FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-8
MOST_DAMPING = 1e10
FAR = 1e9  # metres: an estimate beyond this is on its way to infinity
RIDGE = 1e-14  # on a unit diagonal: an exactly singular matrix must not stop the whole block


class Settings(NamedTuple):
    """How a fit goes its way: the arguments of `tmalib.batch.fit` by these names.

    ``loss`` gives values and weights of squared residuals, as `tmalib.losses.value_and_weight` does; with
    `None` the squares are the criterion.
    """

    chart: ChartMaker | None
    safeguard: bool
    tolerance: float
    max_iterations: int
    loss: Callable[[FloatArray], tuple[FloatArray, FloatArray]] | None = None


class Outcome(NamedTuple):
    """Where the steps of runs ended: ``state (runs, n)``, ``status``, ``iterations``, ``cost`` as in `Fit`.

    ``volume`` is the determinant of the information at the last evaluation, scaled to a unit diagonal: one if
    the components of the state are told independently, about zero if they cannot be told apart.
    """

    state: FloatArray
    status: TextArray
    iterations: IntArray
    cost: FloatArray
    volume: FloatArray

    @property
    def converged(self) -> BoolArray:
        return self.status == words.CONVERGED

    def of(self, runs: Any) -> Outcome:
        """The outcome of some of the runs."""
        return Outcome(*(part[runs] for part in self))

    def put(self, runs: Any, other: Outcome) -> None:
        """Put another outcome in the places of some runs."""
        for part, new in zip(self, other, strict=True):
            part[runs] = new


def repeat_for_runs(scenario: Scenario, runs: int) -> Sequence[SensorBlock]:
    """The scenario's blocks with observer and elapsed times repeated for every run.

    NumPy pays a third of a microsecond for each row of a broadcast; arrays of one shape are free of it.
    """
    if runs == 1:
        return scenario.blocks
    np.empty(1 << 21)  # glibc: one large array freed, and small ones are no longer returned to the system
    return [
        block._replace(observer=np.tile(block.observer, (1, runs)), elapsed=np.tile(block.elapsed, runs))
        for block in scenario.blocks
    ]


def minimise_in_blocks(scenario: Scenario, angles: FloatArray, start: FloatArray, *settings: Any) -> Outcome:
    """`minimise` for runs ``(runs, N)`` from starts ``(runs, n)``, in blocks that stay in the cache."""
    block = max(1, BLOCK_ELEMENTS // max(len(sensor) for sensor in scenario.sensors))
    repeated = repeat_for_runs(scenario, min(block, len(angles)))
    parts = [
        minimise(repeated, angles[i : i + block], start[i : i + block], *settings)
        for i in range(0, max(1, len(angles)), block)
    ]
    return Outcome(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def minimise(
    blocks: Sequence[SensorBlock],
    angles: FloatArray,
    start: FloatArray,
    chart: Chart,
    safeguard: bool,
    tolerance: float,
    max_iterations: int,
    loss: Callable[..., Any] | None = None,
) -> Outcome:
    """The `Outcome` of a two-dimensional block of runs.

    A ``loss`` gives values and weights of squared residuals, as `tmalib.losses.value_and_weight` does;
    without one the squares are the criterion.
    """
    runs, n = start.shape
    state = np.full((runs, n), np.nan)
    status = np.full(runs, words.NOT_FINITE, dtype=f"<U{words.WIDTH}")
    iterations = np.zeros(runs, dtype=int)
    cost, volume = np.full(runs, np.nan), np.full(runs, np.nan)

    def finish(which, why, end):
        if which.any():
            run = active[which]
            state[run], status[run], cost[run] = chart.to_state(end[which]), why, best_cost[which]
            iterations[run] = evaluations
            status[run[np.hypot(state[run, 0], state[run, 1]) > FAR]] = words.RAN_AWAY
            volume[run] = _scaled_determinant(matrix[which], best[which], chart)

    # One row for each run that still iterates; `active` says which run it is. `best`, `trial` and the
    # equations are in the chart's coordinates.
    origin = chart.from_state(start)
    active = np.flatnonzero(np.isfinite(angles).all(axis=-1) & np.isfinite(origin).all(axis=-1))
    trial = origin[active]
    measured = [angles[active, block.columns] for block in blocks]
    best, best_cost, damping = trial, np.full(len(active), np.inf), np.zeros(len(active))
    matrix, slope = np.zeros((len(active), n, n)), np.zeros((len(active), n))
    for evaluations in range(1, max_iterations + 1):
        if not len(active):
            break
        trial_cost, trial_matrix, trial_slope = _normal_equations(blocks, measured, trial, chart, loss)
        better = trial_cost < best_cost if safeguard else np.isfinite(trial_cost)
        if better.all():
            best, best_cost, matrix, slope = trial, trial_cost, trial_matrix, trial_slope
        else:
            best = np.where(better[:, None], trial, best)
            best_cost = np.where(better, trial_cost, best_cost)
            matrix = np.where(better[:, None, None], trial_matrix, matrix)
            slope = np.where(better[:, None], trial_slope, slope)
        relaxed = np.where(damping > LEAST_DAMPING, damping / 10, 0.0)
        damping = np.where(better, relaxed, np.maximum(10 * damping, FIRST_DAMPING))
        step, decrement = _damped_step(matrix, slope, damping)

        lost = np.isinf(best_cost)
        short = ~lost & (decrement <= tolerance)
        if short.any():  # a last step that leaves the chart is not a last step
            short &= np.isfinite(chart.to_state(best + step)).all(axis=-1)
        stuck = ~lost & (damping > MOST_DAMPING if safeguard else ~better)
        finish(short, words.CONVERGED, best + step)
        finish(stuck, words.NO_DESCENT, best)
        going = ~(short | stuck | lost)
        if not going.all():
            measured = [part[going] for part in measured]
            rows = (active, best, best_cost, damping, matrix, slope, step)
            active, best, best_cost, damping, matrix, slope, step = (row[going] for row in rows)
        trial = best + step
    finish(np.ones(len(active), dtype=bool), words.ITERATION_LIMIT, best)
    return Outcome(state, status, iterations, cost, volume)


def _normal_equations(blocks, measured, point, chart, loss=None):
    """Criterion ``e'e``, ``J'J`` and ``J'e`` of whitened residuals, in the chart's coordinates.

    ``measured`` holds one ``(runs, N_s)`` array a sensor and ``point`` is ``(runs, n)``; the results are
    ``(runs,)``, ``(runs, n, n)`` and ``(runs, n)``. Every sum is a dot product of two contiguous rows of
    one run, so that the result for a run does not depend on the runs beside it.
    """
    runs, n = point.shape
    cost, slope, matrix = np.zeros(runs), np.zeros((n, runs)), np.zeros((n, n, runs))
    with np.errstate(all="ignore"):  # a state outside the model's domain gives NaN and is refused
        state = chart.to_state(point).T
        for block, angles in zip(blocks, measured, strict=True):
            size, sensor = angles.size, block.sensor
            value, gradient = block.predict(
                np.repeat(state, angles.shape[1], axis=1), block.observer[:, :size], block.elapsed[:size]
            )
            residual = sensor.model.residual(angles, value.reshape(angles.shape))
            gradient = gradient.reshape(n, *angles.shape)
            weight = sensor.sigma**-2
            if np.ndim(weight):  # a sigma for each measurement
                residual, gradient, weight = residual / sensor.sigma, gradient / sensor.sigma, 1.0
            if loss is None:
                cost += weight * np.vecdot(residual, residual)
            else:  # rows times the root of their weight: a step of iteratively reweighted least squares
                value, trust = loss(weight * residual**2)
                cost, root = cost + value.sum(axis=-1), np.sqrt(trust)
                residual, gradient = root * residual, root * gradient
            slope += weight * np.vecdot(gradient, residual)
            for i in range(n):
                matrix[i, i:] += weight * np.vecdot(gradient[i], gradient[i:])
        for i in range(n):
            matrix[i:, i] = matrix[i, i:]
        matrix, slope = np.ascontiguousarray(matrix.transpose(2, 0, 1)), slope.T
        if not isinstance(chart, Cartesian):
            jacobian = chart.jacobian(point)
            matrix = jacobian.mT @ matrix @ jacobian
            slope = np.vecdot(jacobian.mT, slope[:, None, :])
    return cost, matrix, slope


def _scaled_determinant(matrix, point, chart):
    """Determinant of the equations in the state's own coordinates, scaled to a unit diagonal.

    A chart may have a coordinate of which nothing is known, such as the inverse range of a motionless ship's
    target: scaled, what rounding leaves of it looks like any other. No component of the state is so.
    """
    with np.errstate(all="ignore"):  # without information there is no volume: NaN
        if not isinstance(chart, Cartesian):
            slope = chart.inverse_jacobian(point)
            matrix = slope.mT @ matrix @ slope
        return np.linalg.det(matrix) / np.prod(np.diagonal(matrix, axis1=-2, axis2=-1), axis=-1)


def _damped_step(matrix, slope, damping):
    """Levenberg-Marquardt step, and the Newton decrement of the undamped one; solved with a unit diagonal.

    Where the residuals stay large, as when the target leaves the model, a damped step can be the only one
    that descends even at the minimum; whether it is the last is decided by the undamped decrement.
    """
    n = slope.shape[-1]
    with np.errstate(all="ignore"):  # a run whose equations are not finite gets no step: NaN
        diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)
        scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        scaled = matrix * (scale[:, :, None] * scale[:, None, :])
        scaled[:, np.arange(n), np.arange(n)] = 1.0 + RIDGE + damping[:, None]
        step = scale * _solve(scaled, scale * slope)
        square = np.vecdot(step, slope)
        damped = damping > 0
        if damped.any():  # by eigenvalues: far away the undamped matrix may be singular
            bare, pull = scaled[damped], (scale * slope)[damped]
            bare[:, np.arange(n), np.arange(n)] = 1.0
            bare[~np.isfinite(bare).all(axis=(1, 2))] = np.eye(n)
            values, vectors = np.linalg.eigh(bare)
            along = np.vecdot(vectors.mT, pull[:, None])
            square[damped] = np.sum(along**2 / np.maximum(values, RIDGE), axis=-1)
        return step, np.sqrt(square)


def _solve(matrix, right):
    """Solve ``matrix x = right`` for every run; NaN for a run whose matrix is exactly singular."""
    try:
        return np.linalg.solve(matrix, right[..., None])[..., 0]
    except np.linalg.LinAlgError:
        if len(matrix) == 1:
            return np.full_like(right, np.nan)
        half = len(matrix) // 2
        return np.concatenate([_solve(matrix[:half], right[:half]), _solve(matrix[half:], right[half:])])
