"""Batch estimation: the state that minimises the weighted sum of squared residuals, many runs at once.

For Gaussian noise the maximum likelihood estimate minimises (`emw-acoustic`, Section IV.A)::

    C(X) = sum_k (residual_k(X) / sigma_k)^2.

With the whitened residuals ``e`` and the whitened gradient ``J``, a Gauss-Newton step solves
``(J'J) p = J'e``. Far from the minimum it may climb. The Levenberg-Marquardt safeguard then damps it::

    (J'J + lambda diag(J'J)) p = J'e,

which turns the step towards the gradient and shortens it; ``lambda`` is zero until a step fails to
lower the criterion, grows while steps fail and shrinks again after that. The iteration of a run stops
on the *Newton decrement* ``sqrt(p' J'e)``: the length of the step in standard deviations of the
estimate. It does not depend on units or on the choice of coordinates.

Runs go through the iteration together, in blocks that fit into the processor's cache. Each run has its
own ``lambda`` and its own verdict; none can raise, and none is dropped. Results do not depend on the
size of a block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._checks import check_count, check_scalar
from .charts import Cartesian, ModifiedPolar

BLOCK_ELEMENTS = 72_000  # runs x measurements of the largest sensor: about 600 kB an array
FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-8
MOST_DAMPING = 1e10
FAR = 1e9  # metres: an estimate beyond this is on its way to infinity
RIDGE = 1e-14  # on a unit diagonal: an exactly singular matrix must not stop the whole block

CONVERGED = "converged"
NOT_FINITE = "measurement or start not finite"
NO_DESCENT = "no step lowers the criterion"
TOO_LONG = "iteration limit"
TOO_FAR = "no minimum at a finite range"
REASONS = (CONVERGED, NOT_FINITE, NO_DESCENT, TOO_LONG, TOO_FAR)


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of `fit`; every array has the batch shape of the measurements.

    Attributes
    ----------
    state : ndarray, shape (..., n)
        Estimate at the reference time; NaN only where the input was not finite.
    converged : ndarray of bool
    reason : ndarray of str
        ``"converged"``, ``"iteration limit"``, ``"no step lowers the criterion"``, ``"no minimum at a
        finite range"`` (the estimate ran beyond 1e9 m) or ``"measurement or start not finite"``.
    iterations : ndarray of int
        Evaluations of the model, the one at the start included.
    cost : ndarray
        Criterion C at the last evaluation; about N - n for a good model.
    """

    state: np.ndarray
    converged: np.ndarray
    reason: np.ndarray
    iterations: np.ndarray
    cost: np.ndarray


def along_first_bearing(scenario, angles, range):
    """Start at rest at a chosen range along the first bearing of each run.

    ``X_init = r_init [sin theta(t_1), cos theta(t_1), 0, 0]`` from the platform's position at t_1, the
    earliest time at which a measurement was taken.

    Parameters
    ----------
    scenario : Scenario
    angles : array_like, shape (..., N)
    range : float
        In metres, positive.

    Returns
    -------
    ndarray, shape (..., 4)

    Notes
    -----
    Source: `emw-acoustic`, Section V. Of two measurements at t_1 the first sensor's is used.
    """
    angles = scenario.check_measurements(angles)
    range = check_scalar("range", range, above=0.0)
    if scenario.coordinates != ("x", "y", "vx", "vy"):
        raise ValueError(
            f"a start along a bearing needs the state (x, y, vx, vy), got {scenario.coordinates}"
        )
    first = int(np.argmin(scenario.times))
    here = scenario.platform.position(scenario.times[first])
    theta = angles[..., first]
    rest = np.zeros_like(theta)
    return np.stack([here[0] + range * np.sin(theta), here[1] + range * np.cos(theta), rest, rest], axis=-1)


def fit(scenario, angles, start, *, chart=None, safeguard=True, tolerance=1e-2, max_iterations=100):
    """Maximum likelihood (least squares) estimate of the state for every run.

    Parameters
    ----------
    scenario : Scenario
        What the estimator assumes: platform, sensors, reference time. Its target is not read.
    angles : array_like, shape (..., N)
        Measurements, in the scenario's order.
    start : array_like, shape (..., n)
        First guess(es) of the state at the reference time; broadcasts against the runs.
    chart : chart, optional
        Coordinates in which the steps are taken (see `tmalib.charts`). The default is modified polar
        about the platform for the state ``(x, y, vx, vy)`` and Cartesian for any other.
    safeguard : bool
        `False` gives plain Gauss-Newton: every step is taken, whatever it does to the criterion.
    tolerance : float
        Newton decrement, in standard deviations of the estimate, below which a step is the last.
        What remains after that step is second order: about 1e-4 standard deviations by default.
    max_iterations : int
        Most evaluations of the model for a run.

    Returns
    -------
    Fit

    Raises
    ------
    ValueError
        For wrong shapes. A run with a measurement or a start that is not finite is reported in
        ``reason``; it does not raise.

    Notes
    -----
    Source: `emw-acoustic`, Section IV.A, which prints plain Gauss-Newton in Cartesian coordinates:
    ``fit(..., chart=Cartesian(), safeguard=False)``.
    """
    angles = scenario.check_measurements(angles)
    start = scenario.check_state(start)
    tolerance = check_scalar("tolerance", tolerance, above=0.0)
    max_iterations = check_count("max_iterations", max_iterations)
    settings = (chart or default_chart(scenario), safeguard, tolerance, max_iterations)
    shape = np.broadcast_shapes(angles.shape[:-1], start.shape[:-1])
    angles = np.broadcast_to(angles, (*shape, angles.shape[-1])).reshape(-1, angles.shape[-1])
    start = np.broadcast_to(start, (*shape, start.shape[-1])).reshape(-1, start.shape[-1])
    block = max(1, BLOCK_ELEMENTS // max(len(sensor) for sensor in scenario.sensors))
    np.empty(1 << 21)  # glibc: one large array freed, and small ones are no longer returned to the system
    tiles = _tiles(scenario, min(block, len(angles)))
    parts = [
        _fit_block(tiles, angles[i : i + block], start[i : i + block], *settings)
        for i in range(0, len(angles), block)
    ]
    fields = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Fit(*(field.reshape(shape + field.shape[1:]) for field in fields))


def distinct_minima(scenario, angles, starts, *, separation=0.1, **options):
    """All the minima that fits from several starts reach, for one run: ghosts included.

    Where targets cannot be told apart, the criterion has several minima of the same value; where a model is
    wrong, a lower one may be far away.

    Parameters
    ----------
    scenario : Scenario
    angles : array_like, shape (N,)
        Measurements of one run.
    starts : array_like, shape (S, n)
    separation : float
        Two estimates count as one minimum when they are nearer than this, in standard deviations of the
        better one.
    **options
        Handed to `fit`.

    Returns
    -------
    states : ndarray, shape (M, n)
        The lowest minimum first; only fits that have converged count.
    costs : ndarray, shape (M,)
        Their criteria.
    hits : ndarray of int, shape (M,)
        How many starts ended at each.
    """
    angles, starts = scenario.check_measurements(angles), scenario.check_state(starts)
    if angles.ndim != 1 or starts.ndim != 2:
        raise ValueError(f"one run and a list of starts are needed, got {angles.shape} and {starts.shape}")
    found = fit(scenario, angles, starts, **options)
    states, costs, hits = [], [], []
    for k in np.argsort(np.where(found.converged, found.cost, np.inf))[: found.converged.sum()]:
        jacobian = scenario.linearise(found.state[k])[1] / scenario.sigma[:, None]
        near = [np.linalg.norm(jacobian @ (state - found.state[k])) <= separation for state in states]
        if any(near):
            hits[near.index(True)] += 1
        else:
            states.append(found.state[k])
            costs.append(found.cost[k])
            hits.append(1)
    n = starts.shape[-1]
    return np.array(states).reshape(-1, n), np.array(costs), np.array(hits, dtype=int)


def default_chart(scenario):
    """Modified polar about the platform at the reference time if the state is ``(x, y, vx, vy)``."""
    if scenario.coordinates != ("x", "y", "vx", "vy"):
        return Cartesian()
    nearest = scenario.times[np.argmin(np.abs(scenario.times - scenario.reference_time))]
    return ModifiedPolar(scenario.platform.position(nearest))


def _tiles(scenario, runs):
    """The scenario's pieces with site and lag repeated for every run of a block.

    NumPy pays a third of a microsecond for each row of a broadcast; arrays of one shape are free of it.
    """
    return [
        (sensor, columns, np.tile(site, (1, runs)), np.tile(lag, runs))
        for sensor, columns, site, lag in scenario.pieces
    ]


def _fit_block(tiles, angles, start, chart, safeguard, tolerance, max_iterations):
    """`fit` for a two-dimensional block of runs; returns the fields of `Fit` in order."""
    runs, n = start.shape
    state = np.full((runs, n), np.nan)
    reason = np.full(runs, NOT_FINITE, dtype=f"<U{max(map(len, REASONS))}")
    iterations = np.zeros(runs, dtype=int)
    cost = np.full(runs, np.nan)

    def finish(which, why, end):
        if which.any():
            run = active[which]
            state[run], reason[run], cost[run] = chart.to_state(end[which]), why, best_cost[which]
            iterations[run] = evaluations
            reason[run[np.hypot(state[run, 0], state[run, 1]) > FAR]] = TOO_FAR

    # One row for each run that still iterates; `active` says which run it is. `best`, `trial` and the
    # equations are in the chart's coordinates.
    origin = chart.from_state(start)
    active = np.flatnonzero(np.isfinite(angles).all(axis=-1) & np.isfinite(origin).all(axis=-1))
    trial = origin[active]
    measured = [angles[active, columns] for _, columns, _, _ in tiles]
    best, best_cost, damping = trial, np.full(len(active), np.inf), np.zeros(len(active))
    matrix, slope = np.zeros((len(active), n, n)), np.zeros((len(active), n))
    for evaluations in range(1, max_iterations + 1):
        if not len(active):
            break
        trial_cost, trial_matrix, trial_slope = _normal_equations(tiles, measured, trial, chart)
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
        short = decrement <= tolerance
        if short.any():  # a last step that leaves the chart is not a last step
            short &= np.isfinite(chart.to_state(best + step)).all(axis=-1)
        stuck = ~lost & (damping > MOST_DAMPING if safeguard else ~better)
        finish(short, CONVERGED, best + step)
        finish(stuck, NO_DESCENT, best)
        going = ~(short | stuck | lost)
        if not going.all():
            measured = [part[going] for part in measured]
            rows = (active, best, best_cost, damping, matrix, slope, step)
            active, best, best_cost, damping, matrix, slope, step = (row[going] for row in rows)
        trial = best + step
    finish(np.ones(len(active), dtype=bool), TOO_LONG, best)
    return state, reason == CONVERGED, reason, iterations, cost


def _normal_equations(tiles, measured, point, chart):
    """Criterion ``e'e``, ``J'J`` and ``J'e`` of whitened residuals, in the chart's coordinates.

    ``measured`` holds one ``(runs, N_s)`` array a sensor and ``point`` is ``(runs, n)``; the results are
    ``(runs,)``, ``(runs, n, n)`` and ``(runs, n)``. Every sum is a dot product of two contiguous rows of
    one run, so that the result for a run does not depend on the runs beside it.
    """
    runs, n = point.shape
    cost, slope, matrix = np.zeros(runs), np.zeros((n, runs)), np.zeros((n, n, runs))
    with np.errstate(all="ignore"):  # a state outside the model's domain gives NaN and is refused
        state = chart.to_state(point).T
        for (sensor, _, site, lag), angles in zip(tiles, measured, strict=True):
            size = angles.size
            value, gradient = sensor.model.kernel(
                np.repeat(state, angles.shape[1], axis=1), site[:, :size], lag[:size]
            )
            residual = sensor.model.residual(angles, value.reshape(angles.shape))
            gradient = gradient.reshape(n, *angles.shape)
            weight = sensor.sigma**-2
            cost += weight * np.vecdot(residual, residual)
            slope += weight * np.vecdot(gradient, residual)
            for i in range(n):
                matrix[i, i:] += weight * np.vecdot(gradient[i], gradient[i:])
        for i in range(n):
            matrix[i:, i] = matrix[i, i:]
        matrix, slope = np.moveaxis(matrix, -1, 0), slope.T
        if not isinstance(chart, Cartesian):
            jacobian = chart.jacobian(point)
            matrix = jacobian.mT @ matrix @ jacobian
            slope = np.vecdot(jacobian.mT, slope[:, None, :])
    return cost, matrix, slope


def _damped_step(matrix, slope, damping):
    """Levenberg-Marquardt step, and the Newton decrement of the undamped one; solved with a unit diagonal.

    Where the residuals stay large, as when the target leaves the model, a damped step can be the only one
    that descends even at the minimum; whether it is the last is decided by the undamped decrement.
    """
    n = slope.shape[-1]
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = matrix * (scale[:, :, None] * scale[:, None, :])
    scaled[:, np.arange(n), np.arange(n)] = 1.0 + RIDGE + damping[:, None]
    step = scale * np.linalg.solve(scaled, (scale * slope)[..., None])[..., 0]
    square = np.vecdot(step, slope)
    damped = damping > 0
    if damped.any():  # by eigenvalues: far away the undamped matrix may be singular
        bare, pull = scaled[damped], (scale * slope)[damped]
        bare[:, np.arange(n), np.arange(n)] = 1.0
        bare[~np.isfinite(bare).all(axis=(1, 2))] = np.eye(n)  # such a run never counts as converged: NaN
        values, vectors = np.linalg.eigh(bare)
        square[damped] = np.sum(
            np.vecdot(vectors.mT, pull[:, None]) ** 2 / np.maximum(values, RIDGE), axis=-1
        )
    with np.errstate(invalid="ignore"):
        return step, np.sqrt(square)
