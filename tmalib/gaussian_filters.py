"""Filters that carry a mean and a covariance, by four kinds of updates, and a bank of them over ranges.

`gaussian_filter` is `tmalib.ekf` with another update (see `tmalib.gaussian_updates`). It carries the state at
the reference time, as `ekf` does; points and passes are of that state.

*Range-parametrised bank* (Peach, 1995). Where no range is known, one Gaussian along the first bearing is a
poor prior. `range_bank` runs a filter for each of several intervals of range; those of a geometric
progression all have the same relative width. With innovations ``nu`` and variances ``s`` the weights are::

    log w_i = - sum_k (nu_ik^2 / s_ik + log s_ik) / 2,   made to sum to one,

and the answer has the moments of the mixture: ``sum w_i X_i`` and ``sum w_i (P_i + (X_i - X)(X_i - X)')``.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from . import status as words
from .checks import check_array, check_is, check_scalar
from .gaussian_updates import UPDATES
from .kalman import check_record, checked_inputs, in_columns
from .priors import Prior, prior_along_first_bearing
from .process_noise import ProcessNoise
from .recursive import Track
from .scenario import Scenario
from .sensors import in_order_of_time
from .uniform import propagate, transition


def gaussian_filter(
    scenario: Scenario,
    angles: ArrayLike,
    prior: Prior,
    record: ArrayLike | None = None,
    *,
    update: str = "cubature",
    process_noise: ProcessNoise | None = None,
) -> Track:
    """A filter with a mean and a covariance, with the update of one's choice.

    Parameters
    ----------
    scenario, angles, prior, record, process_noise
        As in `ekf`. Measurements of one time are taken one after the other.
    update : {"extended", "iterated", "second-order", "cubature"}

    Returns
    -------
    Track
        A run whose covariance is no longer positive definite is NaN from there on.

    Raises
    ------
    ValueError
        As `ekf`, and for another update.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> watch = tma.Scenario(ship, [tma.Sensor(tma.Bearing(), np.arange(0, 601, 5.0), 0.01)], 600)
    >>> angles = watch.with_target(tma.Target((2e3, 4e3), 6, 1.5)).simulate(runs=3, seed=1)
    >>> prior = tma.prior_along_first_bearing(watch, angles, 5e3, 2e3, 10.0)
    >>> tma.gaussian_filter(watch, angles, prior, [300, 600], update="iterated").state.shape
    (3, 2, 4)
    """
    return _filtered(scenario, angles, prior, record, update, process_noise)[0]


def range_bank(
    scenario: Scenario,
    angles: ArrayLike,
    edges: ArrayLike,
    velocity_sigma: float,
    record: ArrayLike | None = None,
    *,
    update: str = "cubature",
    process_noise: ProcessNoise | None = None,
) -> Track:
    """A bank of `gaussian_filter`, one for each interval of range at the first bearing, as one estimate.

    Parameters
    ----------
    scenario, angles, record, update, process_noise
        As in `gaussian_filter`.
    edges : array_like, shape (M + 1,)
        Of the intervals, increasing, in metres. A filter starts in the middle of its interval, with the
        interval's standard deviation, ``width / sqrt(12)``.
    velocity_sigma : float
        Of each component of the target's velocity before the first bearing, in m/s.

    Returns
    -------
    Track
        Moments of the mixture.

    Raises
    ------
    ValueError
        As `gaussian_filter`, and for edges that are not positive and increasing.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> watch = tma.Scenario(ship, [tma.Sensor(tma.Bearing(), np.arange(0, 601, 5.0), 0.01)], 600)
    >>> angles = watch.with_target(tma.Target((2e3, 4e3), 6, 1.5)).simulate(runs=3, seed=1)
    >>> tma.range_bank(watch, angles, np.geomspace(1e3, 30e3, 6), velocity_sigma=5.0).state.shape
    (3, 1, 4)
    """
    edges = check_array("edges", edges, (None,))
    if len(edges) < 2 or edges[0] <= 0 or np.any(np.diff(edges) <= 0):
        raise ValueError(f"edges must be two or more, positive and increasing, got {edges}")
    check_scalar("velocity_sigma", velocity_sigma, above=0.0)
    angles = check_is("scenario", scenario, Scenario).check_measurements(angles)
    priors = [
        prior_along_first_bearing(
            scenario, angles, (low + high) / 2, (high - low) / np.sqrt(12), velocity_sigma
        )
        for low, high in pairwise(edges)
    ]
    together = Prior(
        np.stack([one.mean for one in priors]),
        np.stack([one.covariance for one in priors]),
        priors[0].time,
        priors[0].coordinates,
    )
    track, fits = _filtered(scenario, angles, together, record, update, process_noise)
    lost = ~(np.isfinite(track.state).all(axis=-1) & np.isfinite(track.covariance).all(axis=(-1, -2)))
    fits = np.where(lost | ~np.isfinite(fits), -np.inf, fits)
    with np.errstate(invalid="ignore"):  # a run that all members have lost is NaN
        weights = np.exp(fits - fits.max(axis=0))
        weights /= weights.sum(axis=0)
    states = np.where(weights[..., None] > 0, track.state, 0.0)
    spreads = np.where(weights[..., None, None] > 0, track.covariance, 0.0)
    state = np.sum(weights[..., None] * states, axis=0)
    away = np.where(weights[..., None] > 0, states - state, 0.0)
    covariance = np.sum(
        weights[..., None, None] * (spreads + away[..., :, None] * away[..., None, :]), axis=0
    )
    return Track(track.times, state, covariance, words.status_of_filter(state, covariance))


def _filtered(scenario, angles, prior, record, update, process_noise):
    """The track, and logarithms of likelihoods ``(..., T)`` at the recorded times."""
    if update not in UPDATES:
        raise ValueError(f"update must be one of {tuple(UPDATES)}, got {update!r}")
    angles, names = checked_inputs(scenario, angles, prior, process_noise, None)
    if names != scenario.coordinates:
        raise ValueError(f"prior must have the components {scenario.coordinates}, in this order, got {names}")
    reference, step = scenario.reference_time, UPDATES[update]
    record = check_record(record, reference, None if process_noise is None else prior)
    back = transition(reference - prior.time, names)
    mean, covariance = propagate(prior.mean, reference - prior.time, names), back @ prior.covariance @ back.T
    x, p, measured, shape = in_columns(mean, covariance, angles)
    nis, used = np.full(measured.shape, np.nan), np.zeros(measured.shape, dtype=bool)
    fits, kept, now = np.zeros(x.shape[1]), [], prior.time
    steps = [*in_order_of_time(scenario, prior.time), *((time, None) for time in record)]
    with np.errstate(all="ignore"):  # a lost run shows in `finite`
        for time, group in sorted(steps, key=lambda item: item[0]):
            if process_noise is not None:
                back = transition(reference - time, names)
                p = p + (back @ process_noise.covariance(time - now, names) @ back.T)[..., None]
                now = time
            if group is None:
                kept.append((x, p, fits))
                continue
            for i, block, observer, elapsed in group:
                x, p, nis[i], used[i], more = _taken(step, x, p, block, observer, elapsed, i, measured[i])
                fits = fits + more
    return _track(kept, record, reference, names, shape, nis, used, x, p)


def _taken(step, x, p, block, observer, elapsed, column, measured):
    """Mean and covariance after one measurement, its square, whether it was used, and what the fit gains."""
    model, sigma = block.sensor.model, block.sensor.sigma
    sigma = sigma[column - block.columns.start] if np.ndim(sigma) else sigma
    place = observer.reshape(-1, *(1,) * (x.ndim - 1))

    def predict(rows):
        return block.predict(rows, place.reshape(-1, *(1,) * (rows.ndim - 1)), elapsed)

    def offset(value, of=None):
        return model.residual(measured, value) if of is None else model.residual(value, of)

    moved, left, innovation, variance = step(x, p, predict, offset, sigma)
    square, used = innovation**2 / variance, ~np.isnan(measured)
    if not used.all():
        moved, left = np.where(used, moved, x), np.where(used, left, p)
    return moved, left, square, used, np.where(used, -(square + np.log(variance)) / 2, 0.0)


def _track(kept, record, reference, names, shape, nis, used, x, p):
    elapsed = record - reference
    phi = transition(elapsed, names)
    count = len(record)
    means = np.reshape([a for a, _, _ in kept], (count, *x.shape))
    spreads = np.reshape([b for _, b, _ in kept], (count, *p.shape))
    fits = np.reshape([c for *_, c in kept], (count, x.shape[1]))
    state = propagate(np.moveaxis(means, -1, 0), elapsed, names)
    claimed = phi @ np.moveaxis(spreads, -1, 0) @ phi.mT
    state, claimed = (part.reshape(shape + part.shape[1:]) for part in (state, claimed))
    nis, used = (part.T.reshape(*shape, len(part)) for part in (nis, used))
    track = Track(record, state, claimed, words.status_of_filter(state, claimed), nis, used)
    return track, fits.T.reshape(*shape, count)
