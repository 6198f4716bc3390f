"""Extended Kalman filters, over many runs at once.

The target has no process noise, so its state at the reference time does not change: the filter carries
``X(t_ref)`` and needs no prediction step. This is the filter of `emw-acoustic`, Section IV.B, exactly:
``Phi`` moves mean, covariance and gradient to any other time. Each measurement is one scalar update::

    s = h' P h + sigma^2,   K = P h / s,   X <- X + K nu,   P <- P - K (P h)',

which equals the Joseph form in exact arithmetic. Measurements taken at the same time are linearised
at the same predicted state, as a joint update is: the second one's innovation is reduced by
``h_2' (X_1 - X_0)``, the change that the first one made.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._checks import check_scalar
from .motion import propagate, transition


@dataclass(frozen=True, eq=False)
class Track:
    """Output of `ekf` at the recorded times.

    Attributes
    ----------
    times : ndarray, shape (T,)
    state : ndarray, shape (..., T, n)
        Filtered state *at* each of the times.
    covariance : ndarray, shape (..., T, n, n)
        What the filter claims of it.
    finite : ndarray of bool, shape (...)
        `False` for a run in which some estimate is not a finite number; the run stays in the track.
    """

    times: np.ndarray
    state: np.ndarray
    covariance: np.ndarray
    finite: np.ndarray


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of the state before filtering: mean ``(..., n)``, covariance ``(n, n)``, at ``time``.

    The prior holds all that was measured up to and at its time: `ekf` uses later measurements only.
    """

    mean: np.ndarray
    covariance: np.ndarray
    time: float


def ekf(scenario, angles, prior, record=None):
    """Extended Kalman filter for a target in constant velocity motion.

    Parameters
    ----------
    scenario : Scenario
        What the filter assumes; its target is not read.
    angles : array_like, shape (..., N)
        Measurements, in the scenario's order.
    prior : Prior
    record : array_like, shape (T,), optional
        Times at which to keep the estimate; measurements at a recorded time are used first. The
        default is the reference time alone.

    Returns
    -------
    Track

    Raises
    ------
    ValueError
        For wrong shapes, or a covariance that is not symmetric and positive definite.

    Notes
    -----
    Source: `emw-acoustic`, Section IV.B.
    """
    angles = scenario.check_measurements(angles)
    record = np.atleast_1d(np.asarray(scenario.reference_time if record is None else record, dtype=float))
    if np.any(np.diff(record) <= 0) or not np.all(np.isfinite(record)):
        raise ValueError(f"record must be finite and strictly increasing, got {record}")
    mean, covariance = _prior_at_reference(scenario, prior)
    shape, n = np.broadcast_shapes(angles.shape[:-1], mean.shape[:-1]), mean.shape[-1]
    x = np.broadcast_to(mean, (*shape, n)).reshape(-1, n).T.copy()  # (n, runs): a component is contiguous
    runs = x.shape[1]
    measured = np.ascontiguousarray(np.broadcast_to(angles, (*shape, angles.shape[-1])).reshape(runs, -1).T)
    p = np.repeat(covariance[:, :, None], runs, axis=2)

    kept_x, kept_p = np.empty((len(record), n, runs)), np.empty((len(record), n, n, runs))
    taken = 0
    with np.errstate(all="ignore"):  # a diverging run shows in `finite`
        for time, group in _in_order(scenario, prior.time):
            while taken < len(record) and record[taken] < time:
                kept_x[taken], kept_p[taken] = x, p
                taken += 1
            x, p = _update(x, p, [(*where, measured[column]) for column, *where in group])
    kept_x[taken:], kept_p[taken:] = x, p

    elapsed = record - scenario.reference_time
    phi = transition(elapsed, n)
    state = propagate(np.moveaxis(kept_x, -1, 0), elapsed).reshape(*shape, len(record), n)
    claimed = (phi @ np.moveaxis(kept_p, -1, 0) @ phi.mT).reshape(*shape, len(record), n, n)
    finite = np.isfinite(state).all(axis=(-1, -2)) & np.isfinite(claimed).all(axis=(-1, -2, -3))
    return Track(record, state, claimed, finite)


def _prior_at_reference(scenario, prior):
    mean = scenario.check_state(prior.mean)
    n = mean.shape[-1]
    covariance = np.asarray(prior.covariance, dtype=float)
    if covariance.shape != (n, n) or not np.allclose(covariance, covariance.T):
        raise ValueError(
            f"prior covariance must be a symmetric ({n}, {n}) matrix, got shape {covariance.shape}"
        )
    if not np.all(np.linalg.eigvalsh(covariance) > 0):
        raise ValueError("prior covariance must be positive definite")
    elapsed = scenario.reference_time - check_scalar("prior time", prior.time)
    phi = transition(elapsed, n)
    return propagate(mean, elapsed), phi @ covariance @ phi.T


def _in_order(scenario, after):
    """Measurements later than ``after``, time by time: ``(time, [(column, sensor, site, lag), ...])``."""
    groups = {}
    for sensor, columns, site, lag in scenario.pieces:
        for i in np.flatnonzero(sensor.times > after):
            group = groups.setdefault(sensor.times[i], [])
            group.append((columns.start + i, sensor, site[:, i], lag[i]))
    return sorted(groups.items())


def _update(x, p, group):
    """Joint update of states ``(n, runs)`` and covariances ``(n, n, runs)`` by scalar steps."""
    predicted = x
    for sensor, site, lag, measured in group:
        value, h = sensor.model.kernel(predicted, site, lag)
        innovation = sensor.model.residual(measured, value)
        if x is not predicted:
            innovation = innovation - np.sum(h * (x - predicted), axis=0)
        ph = np.sum(p * h, axis=1)
        gain = ph / (np.sum(h * ph, axis=0) + sensor.sigma**2)
        x = x + gain * innovation
        p = p - gain[:, None] * ph
    return x, p
