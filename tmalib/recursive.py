"""Extended Kalman filters, over many runs at once.

The target has no process noise, so its state at the reference time does not change: the filter carries
``X(t_ref)`` and needs no prediction step. This is the filter of `emw-acoustic`, Section IV.B, exactly:
``Phi`` moves mean, covariance and gradient to any other time. Each measurement is one scalar update::

    s = h' P h + sigma^2,   K = P h / s,   X <- X + K nu,   P <- P - K (P h)',

which equals the Joseph form in exact arithmetic. Measurements taken at the same time are linearised
at the same predicted state, as a joint update is: the second one's innovation is reduced by
``h_2' (X_1 - X_0)``, the change that the first one made.

*Modified polar coordinates.* The filter of Aidala and Hammel (1983) carries ``Y = psi_k(Phi_k X)``, the
target's state at the time of a measurement in modified polar coordinates about the platform. Its
transition is nonlinear, ``Y_k = psi_k(Phi psi_{k-1}^{-1}(Y_{k-1}))``, and without process noise its Jacobian
is ``D_k Phi D_{k-1}^{-1}`` with ``D = d psi / d X``, all taken at one state. In Cartesian coordinates these
factors cancel: between measurements the filter changes neither ``X(t_ref)`` nor ``P``. What is left of
the change of coordinates is the update. The step is straight in ``Y``, and the covariance follows it::

    Y^+ = psi(X^-) + D^- K nu,    X^+ = psi^{-1}(Y^+),
    P^+ = T (P - K (P h)') T',    T = (D^+)^{-1} D^-,

where gain, innovation and gradient are those of the Cartesian filter. Any chart of `tmalib.charts` can take
the place of ``psi``; the Cartesian one has ``T = I``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .batch import along_first_bearing, first_bearing
from .checks import check_scalar
from .sensors import in_order_of_time
from .uniform import moving_pairs, propagate, transition


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
    """What is known of the state before filtering: mean ``(..., n)``, covariance ``(..., n, n)``, ``time``.

    The prior holds all that was measured up to and at its time: `ekf` uses later measurements only.
    """

    mean: np.ndarray
    covariance: np.ndarray
    time: float


def prior_along_first_bearing(scenario, angles, range, range_sigma, velocity_sigma, others=None):
    """`Prior` of each run: at rest on the first bearing, at ``range``, more or less.

    Parameters
    ----------
    scenario : Scenario
    angles : array_like, shape (..., N)
    range, range_sigma : float
        Mean and standard deviation of the range at the first bearing, in metres.
    velocity_sigma : float
        Standard deviation of each component of the velocity, whose mean is zero, in m/s.
    others : dict, optional
        Name of every further unknown to its mean and standard deviation.

    Returns
    -------
    Prior
        At the time of the first bearing, which it uses up. Across the bearing the standard deviation
        is ``range`` times the bearing's. In modified polar coordinates about the platform this is a
        diagonal covariance: ``sigma``, ``range_sigma / range^2`` and twice ``velocity_sigma / range``.
    """
    others = others or {}
    mean = along_first_bearing(scenario, angles, range, {name: value for name, (value, _) in others.items()})
    range_sigma = check_scalar("range_sigma", range_sigma, above=0.0)
    velocity_sigma = check_scalar("velocity_sigma", velocity_sigma, above=0.0)
    first, _ = first_bearing(scenario)
    theta = np.asarray(angles, dtype=float)[..., first]
    axes = np.stack([np.sin(theta), np.cos(theta), np.cos(theta), -np.sin(theta)], axis=-1)
    axes = axes.reshape(*theta.shape, 2, 2)  # rows: along and across the bearing
    spread = np.array([range_sigma, range * scenario.sigma[first]])
    names = scenario.coordinates
    places, speeds = moving_pairs(names)
    covariance = np.zeros((*theta.shape, len(names), len(names)))
    covariance[..., places[:, None], places] = axes.mT @ (spread[:, None] ** 2 * axes)
    covariance[..., speeds, speeds] = velocity_sigma**2
    for name, (_, sigma) in others.items():
        covariance[..., names.index(name), names.index(name)] = check_scalar(name, sigma, above=0.0) ** 2
    return Prior(mean, covariance, float(scenario.times[first]))


def ekf(scenario, angles, prior, record=None, chart=None):
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
    chart : callable, optional
        Coordinates in which an update is a straight step, about the platform at the time (see
        `tmalib.charts`); with `ModifiedPolar` this is the filter in modified polar coordinates. The default
        is Cartesian.

    Returns
    -------
    Track
        A run whose inverse range becomes zero or negative has no state: it is NaN from there on, and
        ``finite`` says so.

    Raises
    ------
    ValueError
        For wrong shapes, a covariance that is not symmetric and positive definite, or a state whose motion is
        not uniform.

    Notes
    -----
    Sources: `emw-acoustic`, Section IV.B; in modified polar coordinates `robustness`, Section IV, and
    Aidala and Hammel (1983). Their rates are of the relative motion, those of `ModifiedPolar` the target's.
    """
    angles = scenario.check_measurements(angles)
    record = np.atleast_1d(np.asarray(scenario.reference_time if record is None else record, dtype=float))
    if np.any(np.diff(record) <= 0) or not np.all(np.isfinite(record)):
        raise ValueError(f"record must be finite and strictly increasing, got {record}")
    mean, covariance = _prior_at_reference(scenario, prior)
    shape, n = np.broadcast_shapes(angles.shape[:-1], mean.shape[:-1], covariance.shape[:-2]), mean.shape[-1]
    x = np.broadcast_to(mean, (*shape, n)).reshape(-1, n).T.copy()  # (n, runs): a component is contiguous
    runs = x.shape[1]
    measured = np.ascontiguousarray(np.broadcast_to(angles, (*shape, angles.shape[-1])).reshape(runs, -1).T)
    p = np.broadcast_to(covariance, (*shape, n, n)).reshape(runs, n, n).transpose(1, 2, 0).copy()

    kept_x, kept_p = np.empty((len(record), n, runs)), np.empty((len(record), n, n, runs))
    taken = 0
    with np.errstate(all="ignore"):  # a diverging run shows in `finite`
        for time, group in in_order_of_time(scenario, prior.time):
            while taken < len(record) and record[taken] < time:
                kept_x[taken], kept_p[taken] = x, p
                taken += 1
            moved, p = _update(x, p, [(*where, measured[column]) for column, *where in group])
            if chart is not None:
                platform = scenario.platform_of(group[0][1].sensor)
                here = chart(platform.position_at(time), scenario.coordinates)
                moved, p = _straight_in(here, x, moved, p, time - scenario.reference_time)
            x = moved
    kept_x[taken:], kept_p[taken:] = x, p

    elapsed = record - scenario.reference_time
    phi = transition(elapsed, scenario.coordinates)
    state = propagate(np.moveaxis(kept_x, -1, 0), elapsed, scenario.coordinates)
    state = state.reshape(*shape, len(record), n)
    claimed = (phi @ np.moveaxis(kept_p, -1, 0) @ phi.mT).reshape(*shape, len(record), n, n)
    finite = np.isfinite(state).all(axis=(-1, -2)) & np.isfinite(claimed).all(axis=(-1, -2, -3))
    return Track(record, state, claimed, finite)


def _prior_at_reference(scenario, prior):
    mean = scenario.check_state(prior.mean)
    n = mean.shape[-1]
    covariance = np.asarray(prior.covariance, dtype=float)
    if covariance.shape[-2:] != (n, n) or not np.allclose(covariance, covariance.mT, equal_nan=True):
        raise ValueError(
            f"prior covariance must be symmetric, of shape (..., {n}, {n}), got shape {covariance.shape}"
        )
    if np.any(np.linalg.eigvalsh(covariance) <= 0):
        raise ValueError("prior covariance must be positive definite")
    elapsed = scenario.reference_time - check_scalar("prior time", prior.time)
    phi = transition(elapsed, scenario.coordinates)
    return propagate(mean, elapsed, scenario.coordinates), phi @ covariance @ phi.T


def _update(x, p, group):
    """Joint update of states ``(n, runs)`` and covariances ``(n, n, runs)`` by scalar steps."""
    predicted = x
    for block, observer, elapsed, measured in group:
        value, h = block.predict(predicted, observer, elapsed)
        sensor = block.sensor
        innovation = sensor.model.residual(measured, value)
        if x is not predicted:
            innovation = innovation - np.sum(h * (x - predicted), axis=0)
        ph = np.sum(p * h, axis=1)
        gain = ph / (np.sum(h * ph, axis=0) + sensor.sigma**2)
        x = x + gain * innovation
        p = p - gain[:, None] * ph
    return x, p


def _straight_in(chart, x, moved, p, elapsed):
    """The step from ``x`` to ``moved`` made straight in the chart's coordinates; the covariance follows."""
    names = chart.coordinates
    phi, back = transition(elapsed, names), transition(-elapsed, names)
    point = chart.from_state(propagate(x.T, elapsed, names))
    before = chart.inverse_jacobian(point)
    point = point + np.vecdot(before @ phi, np.ascontiguousarray((moved - x).T)[:, None, :])
    turn = back @ chart.jacobian(point) @ before @ phi
    p = turn @ np.ascontiguousarray(np.moveaxis(p, -1, 0)) @ turn.mT
    return propagate(chart.to_state(point), -elapsed, names).T, np.moveaxis(p, 0, -1)
