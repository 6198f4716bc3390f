"""`robustness`, Section III and Proposition 7: periodic and random displacements of the target.

A displacement that is a cosine of time is taken at its worst phase. With the complex gain
``z = sum_k (C A)_k exp(2 pi i t_k / T)`` the shift of the criterion is ``Re(z exp(i phase))``, an ellipse
as the phase goes round: the worst shift is its major semi-axis, the largest singular value of
``[Re z, Im z]``.

A random displacement of two independent components, each with the covariance ``K_jk`` over the times of
measurement, displaces the criterion with the covariance ``C A (K * U U') (C A)'``, the product ``*`` taken
element by element. See `tmalib.sensitivity` for ``C``, ``A`` and ``U``.
"""

from __future__ import annotations

import numpy as np

from ...batch import fit
from ...bearings import Bearing
from ...checks import check_array, check_count, check_scalar
from ...scenario import Scenario, Sensor
from ...sensitivity import displaced_measurements, nearest_motion, position_criterion, response
from .scenarios import DURATION, PLATFORM_HEADING, PLATFORM_START, SIGMA, Geometry, weave

TOLERANCE = 1e-4  # standard deviations of the estimate; a third of a decimetre of the final position


def weaving(geometry, period):
    """The same circular target, seen from the reference platform with another weave period (s)."""
    return Geometry(weave(PLATFORM_START, PLATFORM_HEADING, period), geometry.target)


def sampled(geometry, count):
    """The uniform motion of a geometry, measured ``count`` times: in the middle of equal parts of 20 s.

    Sums over these measurements are midpoint rules for the integrals of the continuous problem.
    """
    count = check_count("count", count)
    times = (np.arange(count) + 0.5) * DURATION / count
    platform, target = geometry.platform, geometry.straight.target
    return Scenario(platform, [Sensor(Bearing(), times, SIGMA, "camera")], reference_time=0.0, target=target)


def end_gain(scenario):
    """``C A`` of the position at 20 s, shape ``(2, N)``: metres a metre across the line of sight."""
    return position_criterion(scenario, DURATION) @ response(scenario).gain


def worst_phase(scenario, period):
    """Shift of the final position for a cosine of one metre across the line of sight, worst over its phase.

    Parameters
    ----------
    scenario : Scenario
    period : array_like, shape (...)
        In seconds, positive.

    Returns
    -------
    ndarray, shape (...)
        To first order, in metres a metre.
    """
    return semi_axis(oscillation(scenario.times, period) @ end_gain(scenario).T)


def comb_tops(scenario, period, trials=21):
    """The largest `worst_phase` among periods of which up to half a period more or less fits into 20 s.

    Against the period, `worst_phase` is a comb: two boundary terms nearly cancel when a whole number of
    periods fits.
    """
    period = np.asarray(period, dtype=float)
    frequency = 1 / period[..., None] + np.linspace(-0.5, 0.5, check_count("trials", trials)) / DURATION
    return worst_phase(scenario, 1 / frequency).max(axis=-1)


def oscillation(times, period):
    """``exp(2 pi i t / T)``, shape ``(..., N)`` for periods ``(...)``."""
    period = np.asarray(period, dtype=float)
    if not np.all(np.isfinite(period) & (period > 0)):
        raise ValueError(f"period must be positive and finite, got {period}")
    return np.exp(2j * np.pi * times / period[..., None])


def semi_axis(z):
    """Major semi-axis of the ellipse ``Re(z exp(i phase))`` of complex vectors ``(..., 2)``."""
    return np.linalg.svd(np.stack([z.real, z.imag], axis=-1), compute_uv=False)[..., 0]


def end_errors(scenario, displacement, noise=0.0):
    """Errors of the final position of the batch estimate, fitted from the scenario's uniform motion.

    Parameters
    ----------
    scenario : Scenario
    displacement : array_like, shape (..., N, 2)
        Of the uniform motion, in metres.
    noise : array_like, shape (..., N), optional
        Added to the bearings, in radians.

    Returns
    -------
    errors : ndarray, shape (..., 2)
        Estimated minus undisplaced uniform motion at 20 s, in metres.
    converged : ndarray of bool, shape (...)
    """
    measured = displaced_measurements(scenario, displacement) + noise
    found = fit(scenario, measured, scenario.state, tolerance=TOLERANCE)
    return (found.state - scenario.state) @ position_criterion(scenario, DURATION).T, found.converged


def fitted_phases(scenario, period, amplitude, phases=24):
    """`end_errors`, their lengths, for cosines across the line of sight at equally spaced phases.

    Parameters
    ----------
    scenario : Scenario
    period : array_like, shape (P,)
    amplitude : float
        In metres.
    phases : int

    Returns
    -------
    errors : ndarray, shape (P, phases)
    converged : ndarray of bool, shape (P, phases)
    """
    amplitude = check_scalar("amplitude", amplitude, above=0.0)
    turn = np.exp(2j * np.pi * np.arange(check_count("phases", phases)) / phases)
    wave = amplitude * (oscillation(scenario.times, period)[:, None, :] * turn[:, None]).real
    errors, converged = end_errors(scenario, response(scenario).displacement(wave))
    return np.linalg.norm(errors, axis=-1), converged


def platform_weave(scenario):
    """The platform's path split into a uniform motion and the rest.

    Returns
    -------
    straight : ndarray, shape (4,)
        The uniform motion nearest in least squares, at the reference time.
    weave : ndarray, shape (N, 2)
        Platform minus that motion, in metres.
    """
    path = scenario.platform.position_at(scenario.times)
    straight = nearest_motion(scenario.times, path, scenario.reference_time, norm="squares")
    elapsed = scenario.times - scenario.reference_time
    return straight, path - straight[:2] - elapsed[:, None] * straight[2:]


def independent(times):
    """Covariance of independent components of unit variance, shape ``(N, N)``."""
    return np.eye(len(times))


def markov(times, correlation_time):
    """``exp(-|t_j - t_k| / tau)``: at equal steps a first-order autoregression, AR(1). Shape ``(N, N)``."""
    correlation_time = check_scalar("correlation_time", correlation_time, above=0.0)
    return np.exp(-np.abs(np.subtract.outer(times, times)) / correlation_time)


def random_phase(times, period):
    """``cos(2 pi (t_j - t_k) / T)``: a sine of unit variance and random phase. Shape ``(N, N)``."""
    period = check_scalar("period", period, above=0.0)
    return np.cos(2 * np.pi * np.subtract.outer(times, times) / period)


def random_acceleration(times):
    """What a state equation driven by white noise does to a track, shape ``(N, N)``.

    White acceleration, twice integrated from rest, minus the nearest uniform motion, scaled to a mean
    variance of one: ``P Q P`` with ``Q_jk = s^2 (3 t - s) / 6``, where s is the earlier of ``t_j`` and
    ``t_k``, t the later, and P takes a uniform motion away.
    """
    early, late = np.minimum.outer(times, times), np.maximum.outer(times, times)
    basis, _ = np.linalg.qr(np.stack([np.ones_like(times), times], axis=-1))
    rest = np.eye(len(times)) - basis @ basis.T
    covariance = rest @ (early**2 * (3 * late - early) / 6) @ rest
    return covariance / np.mean(np.diagonal(covariance))


def end_covariance(scenario, covariance):
    """Covariance ``(2, 2)`` of the final position for the covariance ``(N, N)`` of either component of H."""
    count = len(scenario.times)
    covariance = check_array("covariance", covariance, (count, count))
    gain, direction = end_gain(scenario), response(scenario).direction
    return gain @ (covariance * (direction @ direction.T)) @ gain.T


def end_spread(scenario, covariance):
    """Root mean square length of the shift of the final position, to first order: ``sqrt(tr cov)``."""
    return np.sqrt(np.trace(end_covariance(scenario, covariance)))


def gaussian(rng, covariance, runs):
    """Gaussian displacements ``(runs, N, 2)`` with a given covariance ``(N, N)`` of either component."""
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    normal = np.random.default_rng(rng).standard_normal((check_count("runs", runs), 2, len(values)))
    return np.moveaxis(normal @ root.T, 1, -1)


def random_sines(rng, times, period, runs):
    """Displacements ``(runs, N, 2)``: in either component a sine of unit variance and random phase."""
    phase = np.random.default_rng(rng).uniform(0, 2 * np.pi, (check_count("runs", runs), 1, 2))
    return np.sqrt(2) * np.cos(2 * np.pi * np.asarray(times)[:, None] / period + phase)


def second_order_bias(scenario, covariance, step=1.0):
    """Bias of the final position to second order, for a displacement of covariance ``(N, N)`` a component.

    With the eigenvectors ``e_i`` and eigenvalues ``lambda_i`` of the covariance of all 2 N components, the
    mean of the second-order term is ``1/2 sum_i lambda_i theta''(e_i, e_i)``. The second derivatives are
    differences of fits at ``±step sqrt(lambda_i) e_i``.

    Returns
    -------
    ndarray, shape (2,)
        In metres, to be multiplied by the square of the standard deviation.
    """
    step = check_scalar("step", step, above=0.0)
    values, vectors = np.linalg.eigh(covariance)
    used = values > 1e-9 * values[-1]
    along = (vectors[:, used] * np.sqrt(values[used])).T * step
    total = np.zeros(2)
    for axis in np.eye(2):
        shift = along[:, :, None] * axis
        for sign in (1, -1):
            total += end_errors(scenario, sign * shift)[0].sum(axis=0)
    return total / (2 * step**2)
