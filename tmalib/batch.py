"""Batch estimation: the state that minimises the weighted sum of squared residuals, many runs at once.

For Gaussian noise the maximum likelihood estimate minimises (`emw-acoustic`, Section IV.A)::

    C(X) = sum_k (residual_k(X) / sigma_k)^2.

`fit` takes Gauss-Newton steps in a chart of the state, with a safeguard (see
`tmalib.levenberg_marquardt`). Runs go through the iteration together, in blocks that fit into the
processor's cache; results do not depend on the size of a block.
"""

from __future__ import annotations

import numpy as np

from . import levenberg_marquardt
from .charts import Cartesian, chart_of
from .checks import check_count, check_scalar
from .estimate import Fit
from .starts import find_start
from .uniform import PLANE, moving_pairs


def first_bearing(scenario):
    """Column of the earliest measurement that is a bearing, and the platform of its sensor.

    Of two at the same time the first sensor's. `ValueError` if no sensor measures bearings.
    """
    found = [block for block in scenario.blocks if getattr(block.sensor.model, "is_bearing", False)]
    if not found:
        names = [sensor.name for sensor in scenario.sensors]
        raise ValueError(f"a start along a bearing needs a sensor that measures bearings, got {names}")
    block = min(found, key=lambda block: block.sensor.times[0])
    return block.columns.start, scenario.platform_of(block.sensor)


def along_first_bearing(scenario, angles, range, others=None):
    """Start at rest at a chosen range along the first bearing of each run.

    ``X_init = r_init [sin theta(t_1), cos theta(t_1), 0, 0]`` from the platform's position at t_1, the
    earliest time at which a bearing was taken.

    Parameters
    ----------
    scenario : Scenario
    angles : array_like, shape (..., N)
    range : float
        In metres, positive.
    others : dict, optional
        Name of an unknown besides position and velocity to its value; by default what the models guess.

    Returns
    -------
    ndarray, shape (..., n)

    Notes
    -----
    Source: `emw-acoustic`, Section V. Of two bearings at t_1 the first sensor's is used.
    """
    angles, others = scenario.check_measurements(angles), scenario.offered("guess") | (others or {})
    range = check_scalar("range", range, above=0.0)
    missing = set(scenario.coordinates) - set(PLANE)
    if missing != others.keys():
        raise ValueError(f"others must have the unknowns {sorted(missing)}, got {sorted(others)}")
    (first, platform), (places, _) = first_bearing(scenario), moving_pairs(scenario.coordinates)
    theta = angles[..., first]
    start = np.zeros((*theta.shape, len(scenario.coordinates)))
    here = platform.position_at(scenario.times[first])
    start[..., places] = here + range * np.stack([np.sin(theta), np.cos(theta)], axis=-1)
    for name, value in others.items():
        start[..., scenario.coordinates.index(name)] = check_scalar(name, value)
    return start


def fit(scenario, angles, start=None, *, chart=None, safeguard=True, tolerance=1e-2, max_iterations=100):
    """Maximum likelihood (least squares) estimate of the state for every run.

    Parameters
    ----------
    scenario : Scenario
        What the estimator assumes: platform, sensors, reference time. Its target is not read.
    angles : array_like, shape (..., N)
        Measurements, in the scenario's order.
    start : array_like, shape (..., n), optional
        First guess(es) of the state at the reference time; broadcasts against the runs. Without one, and with
        a sensor that measures bearings, a start is found (see `tmalib.starts`).
    chart : callable, optional
        Coordinates in which the steps are taken, about the platform at the reference time: `ModifiedPolar` or
        `Cartesian` (see `tmalib.charts`). The default is the former, and the latter for a state with a depth
        or without position and velocity.
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
    ``fit(..., chart=Cartesian, safeguard=False)``.
    """
    angles = scenario.check_measurements(angles)
    without = start is None
    if without:
        found, _ = find_start(scenario, angles.reshape(-1, angles.shape[-1]))
        start = found.reshape(*angles.shape[:-1], -1)
    start = scenario.check_state(start)
    tolerance = check_scalar("tolerance", tolerance, above=0.0)
    max_iterations = check_count("max_iterations", max_iterations)
    settings = (chart_of(scenario, chart), safeguard, tolerance, max_iterations)
    shape = np.broadcast_shapes(angles.shape[:-1], start.shape[:-1])
    angles = np.broadcast_to(angles, (*shape, angles.shape[-1])).reshape(-1, angles.shape[-1])
    start = np.broadcast_to(start, (*shape, start.shape[-1])).reshape(-1, start.shape[-1])
    fields = levenberg_marquardt.minimise_in_blocks(scenario, angles, start, *settings)
    lost = np.flatnonzero(~fields[1] & (fields[2] != levenberg_marquardt.NOT_FINITE))
    if without and len(lost):  # one chart finds the way where the other does not
        settings = (chart_of(scenario, Cartesian), *settings[1:])
        again = levenberg_marquardt.minimise_in_blocks(scenario, angles[lost], start[lost], *settings)
        for part, other in zip(fields, again, strict=True):
            part[lost[again[1]]] = other[again[1]]
    found = [part.reshape(shape + part.shape[1:]) for part in fields]
    return Fit(*found, scenario, angles.reshape(*shape, -1))


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
