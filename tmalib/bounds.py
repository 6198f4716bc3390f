"""How well a state can be estimated, and whether an estimator says so of itself.

For independent Gaussian noise the Fisher information is ``F = sum_k g_k g_k' / sigma_k^2`` with the
gradient ``g_k`` of measurement k, and no unbiased estimator has a covariance below ``F^-1``, the
Cramér-Rao lower bound. Both come from the whitened Jacobian ``J`` (rows ``g_k' / sigma_k``): its columns
are scaled to unit length, ``J S = Q R`` is factored, and ``F^-1 = S R^-1 R^-T S``. Nothing is inverted
but a triangle whose condition number is that of the scaled ``J``, not its square.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_broadcast, check_count, check_is, check_probability
from .scenario import Scenario
from .types import FloatArray, IntArray
from .uniform import POSITION, is_uniform, moving_pairs, propagate

RANK_TOLERANCE = 1e-12  # singular value of the scaled Jacobian, relative to the largest
CLOSE = 1e-6  # below this, rounding is looked at
NEAR = 1e5  # metres
SINGULAR = 1e-14  # eigenvalue of a correlation matrix, relative to the largest: rounding is 1 per cent


def whitened_jacobian(scenario: Scenario, state: ArrayLike | None = None) -> FloatArray:
    """Gradient of every measurement over its standard deviation, shape ``(..., N, n)``.

    ``state``, shape ``(..., n)``, defaults to the truth. In a batch, a member is NaN where its state or its
    sum of squared gradients is not finite, as on the platform; for a single state that is a `ValueError`.
    """
    check_is("scenario", scenario, Scenario)
    state = scenario.check_state(scenario.state if state is None else state)
    with np.errstate(all="ignore"):  # what is not finite is found below
        jacobian = scenario.linearise(state)[1] / scenario.sigma[:, None]
        squares = np.vecdot(jacobian.mT, jacobian.mT)
    finite = np.isfinite(state).all(axis=-1) & np.isfinite(squares).all(axis=-1)
    if state.ndim == 1 and not finite:
        if not np.isfinite(state).all():
            raise ValueError(f"state must be finite, got {state}")
        raise ValueError(
            f"the measurements have no finite gradient at the state {state}: "
            "a target must be off the platform and slower than sound"
        )
    jacobian[~finite] = np.nan
    return jacobian


def fisher_information(scenario: Scenario, state: ArrayLike | None = None) -> FloatArray:
    """Fisher information matrix of the state at the reference time.

    Parameters
    ----------
    scenario : Scenario
    state : array_like, shape (..., n), optional
        Where to linearise; the true state by default.

    Returns
    -------
    ndarray, shape (..., n, n)
        Units: the inverse of the product of the state's (m, m/s). In a batch, NaN for a member at which the
        measurements have no finite gradient.

    Raises
    ------
    ValueError
        When the measurements have no finite gradient at a single state.

    Notes
    -----
    Source: `emw-acoustic`, Section III.
    """
    jacobian = whitened_jacobian(scenario, state)
    return jacobian.mT @ jacobian


class Factors(NamedTuple):
    """A whitened Jacobian with columns of unit length, factored; see `factor`."""

    triangle: FloatArray
    length: FloatArray
    singular: FloatArray
    rank: IntArray


def factor(scenario: Scenario, state: FloatArray, jacobian: FloatArray) -> Factors:
    """Factors of whitened Jacobians ``(..., N, n)`` at states ``(..., n)``; NaN where one is not finite.

    Returns
    -------
    Factors
        The triangle ``R`` ``(..., k, n)``, the lengths of the columns ``(..., n)``, the singular values
        ``(..., k)``, and the rank ``(...)``: -1 for a member that is not finite. Singular values below 1e-12
        of the largest count as zero, and near a platform those below what rounding does to directions.
    """
    length = np.sqrt(np.vecdot(jacobian.mT, jacobian.mT))
    length = np.where(length == 0, 1.0, length)
    scaled = jacobian / length[..., None, :]
    finite = np.isfinite(length).all(axis=-1)
    scaled[~finite] = 0.0  # LAPACK raises for all when one is NaN
    triangle: Any = np.linalg.qr(scaled, mode="r")  # an array
    singular = np.linalg.svd(triangle, compute_uv=False)
    least = np.full(finite.shape, RANK_TOLERANCE)
    close = finite & (singular[..., -1] < CLOSE * singular[..., 0])
    if close.any():
        least[close] = np.maximum(RANK_TOLERANCE, _rounding(scenario, state[close]))
    rank = np.sum(singular > least[..., None] * singular[..., :1], axis=-1)
    return Factors(triangle, length, singular, np.where(finite, rank, -1)[()])


def _rounding(scenario, state):
    """Relative rounding of a direction from a platform to states ``(m, n)``: of positions, over the range."""
    if not is_uniform(scenario.coordinates):
        return np.zeros(len(state))
    largest, nearest = np.zeros(len(state)), np.full(len(state), np.inf)
    for block in scenario.blocks:
        at = scenario.platform_of(block.sensor).position_at(block.sensor.times)
        target = propagate(state[:, None], block.elapsed, scenario.coordinates)
        places = [scenario.coordinates.index(name) for name in POSITION]
        largest = np.maximum(largest, np.abs(target[..., places]).max(axis=(1, 2)))
        nearest = np.minimum(nearest, np.hypot(*np.moveaxis(target[..., places] - at, -1, 0)).min(axis=1))
    with np.errstate(divide="ignore"):
        return 16 * np.finfo(float).eps * largest / nearest


def inverse_information(factors: Factors) -> FloatArray:
    """The inverse of the information, ``(..., n, n)``; NaN for a member without full rank."""
    n = factors.length.shape[-1]
    observable = np.asarray(factors.rank == n)
    bound = np.full((*factors.length.shape, n), np.nan)
    if observable.any():
        root = np.linalg.solve(factors.triangle[observable], np.eye(n))
        root /= factors.length[observable][..., :, None]
        bound[observable] = root @ root.mT
    return bound


def weakest_direction(factors: Factors) -> FloatArray:
    """The direction of the state ``(..., n)`` that the measurements tell least, its largest component one.

    Each component is measured in the standard deviation that it would have if all others were known.
    """
    scaled = np.linalg.svd(factors.triangle)[2][..., -1, :]
    direction = np.where(np.abs(scaled) > 1e-9, scaled, 0.0) / factors.length
    largest = np.argmax(np.abs(direction), axis=-1)[..., None]
    return direction / np.take_along_axis(direction, largest, axis=-1) + 0.0  # no -0


def in_words(names: Sequence[str], direction: FloatArray) -> str:
    """A direction of the state as ``(x, y) = (1, 0.5)``."""
    return f"({', '.join(names)}) = ({', '.join(f'{part:.3g}' for part in direction)})"


def information_rank(scenario: Scenario, state: ArrayLike | None = None) -> IntArray:
    """Rank of the Fisher information, shape ``(...)``: how many directions of the state are observable.

    Singular values of the column-scaled Jacobian below 1e-12 of the largest count as zero. In a batch, a
    member at which the measurements have no finite gradient has no rank: -1. For a single state that is a
    `ValueError`.
    """
    return _factored(scenario, state).rank


def brought_near(scenario: Scenario, state: FloatArray) -> FloatArray:
    """States ``(runs, n)`` with those far away scaled towards the platform: out there all ranks are lost."""
    if not is_uniform(scenario.coordinates):
        return state
    (places, speeds), state = moving_pairs(scenario.coordinates), state.copy()
    here = scenario.platform.position_at(scenario.times[0])
    away = state[:, places] - here
    share = np.minimum(1, NEAR / np.maximum(NEAR, np.hypot(*away.T)))[:, None]
    state[:, places], state[:, speeds] = here + share * away, share * state[:, speeds]
    return state


def _factored(scenario, state):
    jacobian = whitened_jacobian(scenario, state)
    return factor(scenario, scenario.check_state(scenario.state if state is None else state), jacobian)


def crlb(scenario: Scenario, state: ArrayLike | None = None) -> FloatArray:
    """Cramér-Rao lower bound, the inverse of the Fisher information.

    Parameters
    ----------
    scenario : Scenario
    state : array_like, shape (..., n), optional
        Where to linearise; the true state by default.

    Returns
    -------
    ndarray, shape (..., n, n)
        Covariance of the state at the reference time; m^2, m^2/s, m^2/s^2. In a batch, NaN for a member that
        is not finite or not observable; `information_rank` tells which of the two.

    Raises
    ------
    ValueError
        For a single state, when it is not finite or some direction of it is not observable. The message says
        which one, scaled to a largest component of one.

    Notes
    -----
    Source: `emw-acoustic`, Section III.
    """
    factors = _factored(scenario, state)
    n = len(scenario.coordinates)
    if np.ndim(factors.rank) == 0 and factors.rank < n:
        raise ValueError(
            f"the state is not observable: the Fisher information has rank {factors.rank} of {n}; the "
            f"measurements do not change along {in_words(scenario.coordinates, weakest_direction(factors))}"
        )
    return inverse_information(factors)


def crlb_sigma(scenario: Scenario, state: ArrayLike | None = None) -> FloatArray:
    """Square roots of the bound's diagonal, shape ``(..., n)``: the smallest standard deviations.

    NaN and `ValueError` as in `crlb`.
    """
    return np.sqrt(np.diagonal(crlb(scenario, state), axis1=-2, axis2=-1))


def nees(state: ArrayLike, truth: ArrayLike, covariance: ArrayLike) -> FloatArray:
    """Normalised estimation error squared ``(X^ - X)' P^-1 (X^ - X)``.

    Parameters
    ----------
    state : array_like, shape (..., n)
        Estimates.
    truth : array_like, shape (n,)
    covariance : array_like, shape (..., n, n)
        The covariance to test against: the bound, or the one that a filter claims.

    Returns
    -------
    ndarray, shape (...)
        Chi-square with n degrees of freedom when the errors are Gaussian with that covariance. NaN for a run
        that has no such number: its error or covariance is not finite, its covariance is not positive
        definite, to rounding, or the number is too large for a float.

    Raises
    ------
    ValueError
        When the shapes do not fit.

    Notes
    -----
    Source: `conical-angles`, Section 4.2.1.

    A covariance counts as singular when the smallest eigenvalue of its correlation matrix is below 1e-14 of
    the largest: rounding would then change the number by more than about one per cent.

    Examples
    --------
    >>> nees([[3.0, 0.0], [0.0, 2.0], [np.nan, 0.0]], [0.0, 0.0], np.diag([9.0, 1.0]))
    array([ 1.,  4., nan])
    """
    state, truth, covariance = map(as_numbers, ("state", "truth", "covariance"), (state, truth, covariance))
    check_broadcast(state=state, truth=truth)
    error = state - truth
    n = error.shape[-1] if error.ndim else 0
    if covariance.shape[-2:] != (n, n):
        raise ValueError(f"covariance must have shape (..., {n}, {n}), got {covariance.shape}")
    check_broadcast(state=error[..., 0], covariance=covariance[..., 0, 0])
    with np.errstate(all="ignore"):  # what is not a number is found below
        scale = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
        correlation = covariance / (scale[..., :, None] * scale[..., None, :])
        regular = np.isfinite(correlation).all(axis=(-1, -2))
        correlation = np.where(regular[..., None, None], correlation, np.eye(n))
        values = np.linalg.eigvalsh(correlation)
        regular &= values[..., 0] > SINGULAR * values[..., -1]
        correlation = np.where(regular[..., None, None], correlation, np.eye(n))
        scaled = error / scale
        found = np.vecdot(scaled, np.linalg.solve(correlation, scaled[..., None])[..., 0])
        return np.where(regular & (found >= 0) & (found < np.inf), found, np.nan)[()]


def nees_limits(n: int, runs: int, probability: float = 0.9) -> FloatArray:
    """Limits that hold the mean NEES of ``runs`` independent runs with the given probability.

    ``runs`` times the mean is chi-square with ``n runs`` degrees of freedom.
    """
    from scipy.stats import chi2  # imported here: it costs half a second

    probability = check_probability(probability)
    runs, n = check_count("runs", runs), check_count("n", n)
    tail = (1 - probability) / 2
    return chi2.ppf([tail, 1 - tail], n * runs) / runs
