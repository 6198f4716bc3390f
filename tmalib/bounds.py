"""How well a state can be estimated, and whether an estimator says so of itself.

For independent Gaussian noise the Fisher information is ``F = sum_k g_k g_k' / sigma_k^2`` with the
gradient ``g_k`` of measurement k, and no unbiased estimator has a covariance below ``F^-1``, the
Cramér-Rao lower bound. Both come from the whitened Jacobian ``J`` (rows ``g_k' / sigma_k``): its columns
are scaled to unit length, ``J S = Q R`` is factored, and ``F^-1 = S R^-1 R^-T S``. Nothing is inverted
but a triangle whose condition number is that of the scaled ``J``, not its square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .checks import check_array, check_count, check_probability

RANK_TOLERANCE = 1e-12  # singular value of the scaled Jacobian, relative to the largest
SINGULAR = 1e-14  # eigenvalue of a correlation matrix, relative to the largest: rounding is 1 per cent


def whitened_jacobian(scenario, state=None):
    """Gradient of every measurement over its standard deviation, shape ``(..., N, n)``.

    ``state``, shape ``(..., n)``, defaults to the truth. In a batch, a member is NaN where its state or its
    sum of squared gradients is not finite, as on the platform; for a single state that is a `ValueError`.
    """
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


def fisher_information(scenario, state=None):
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


def _factored(scenario, state):
    """Triangle ``R`` ``(..., k, n)``, lengths of the columns ``(..., n)``, and rank: -1 if not finite."""
    jacobian = whitened_jacobian(scenario, state)
    length = np.sqrt(np.vecdot(jacobian.mT, jacobian.mT))
    length = np.where(length == 0, 1.0, length)
    scaled = jacobian / length[..., None, :]
    finite = np.isfinite(length).all(axis=-1)
    scaled[~finite] = 0.0  # LAPACK raises for all when one is NaN
    triangle = np.linalg.qr(scaled, mode="r")
    singular = np.linalg.svd(triangle, compute_uv=False)
    rank = np.sum(singular > RANK_TOLERANCE * singular[..., :1], axis=-1)
    return triangle, length, np.where(finite, rank, -1)[()]


def information_rank(scenario, state=None):
    """Rank of the Fisher information, shape ``(...)``: how many directions of the state are observable.

    Singular values of the column-scaled Jacobian below 1e-12 of the largest count as zero. In a batch, a
    member at which the measurements have no finite gradient has no rank: -1. For a single state that is a
    `ValueError`.
    """
    return _factored(scenario, state)[2]


def crlb(scenario, state=None):
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
    triangle, length, rank = _factored(scenario, state)
    n = length.shape[-1]
    observable = np.asarray(rank == n)
    if observable.ndim == 0 and not observable:
        raise ValueError(
            f"the state is not observable: the Fisher information has rank {rank} of {n}; "
            f"the measurements do not change along {_weakest(scenario.coordinates, triangle, length)}"
        )
    bound = np.full((*length.shape, n), np.nan)
    if observable.any():
        root = np.linalg.solve(triangle[observable], np.eye(n)) / length[observable][..., :, None]
        bound[observable] = root @ root.mT
    return bound


def _weakest(names, triangle, length):
    """The direction of the state that the measurements tell least, in words."""
    scaled = np.linalg.svd(triangle)[2][-1]
    direction = np.where(np.abs(scaled) > 1e-9, scaled, 0.0) / length
    direction = direction / direction[np.argmax(np.abs(direction))] + 0.0  # no -0
    return f"({', '.join(names)}) = ({', '.join(f'{part:.3g}' for part in direction)})"


def crlb_sigma(scenario, state=None):
    """Square roots of the bound's diagonal, shape ``(..., n)``: the smallest standard deviations.

    NaN and `ValueError` as in `crlb`.
    """
    return np.sqrt(np.diagonal(crlb(scenario, state), axis1=-2, axis2=-1))


@dataclass(frozen=True)
class Ellipse:
    """A confidence ellipse: centre, semi-axes in metres (major first), heading of the major axis."""

    centre: np.ndarray
    semi_axes: np.ndarray
    heading: float
    probability: float

    def boundary(self, points=181):
        """Points on the ellipse, shape ``(points, 2)``, first and last the same."""
        angle = np.linspace(0, 2 * np.pi, check_count("points", points))
        along = np.array([np.sin(self.heading), np.cos(self.heading)])
        across = np.array([np.cos(self.heading), -np.sin(self.heading)])
        major, minor = self.semi_axes
        return self.centre + np.outer(major * np.cos(angle), along) + np.outer(minor * np.sin(angle), across)

    @property
    def area(self):
        """Area in square metres."""
        return float(np.pi * np.prod(self.semi_axes))


def confidence_ellipse(centre, covariance, probability=0.9):
    """Ellipse that holds a Gaussian point with the given probability.

    Parameters
    ----------
    centre : array_like, shape (2,) or (n,)
        Only the first two components, the position, are used.
    covariance : array_like, shape (2, 2) or (n, n)
        Only the position's block is used.
    probability : float
        Between 0 and 1.

    Raises
    ------
    ValueError
        For other shapes, a position or block that is not finite, and a block that is not positive
        semi-definite.

    Notes
    -----
    The level is the quantile of chi-square with two degrees of freedom, ``-2 log(1 - p)``.
    """
    probability = check_probability(probability)
    centre = check_array("centre", np.atleast_1d(np.asarray(centre, dtype=float))[..., :2], (2,))
    block = np.atleast_2d(np.asarray(covariance, dtype=float))[..., :2, :2]
    block = check_array("covariance of the position", block, (2, 2))
    values, vectors = np.linalg.eigh(block)
    if not values[0] >= -4 * np.finfo(float).eps * np.abs(values).max():
        raise ValueError(f"covariance must be positive semi-definite, got eigenvalues {values}")
    axes = np.sqrt(-2 * np.log1p(-probability) * np.maximum(values[::-1], 0.0))
    return Ellipse(centre, axes, float(np.arctan2(*vectors[:, 1])), probability)


def nees(state, truth, covariance):
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
    error = np.asarray(state, dtype=float) - np.asarray(truth, dtype=float)
    covariance = np.asarray(covariance, dtype=float)
    n = error.shape[-1] if error.ndim else 0
    if covariance.shape[-2:] != (n, n):
        raise ValueError(f"covariance must have shape (..., {n}, {n}), got {covariance.shape}")
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


def nees_limits(n, runs, probability=0.9):
    """Limits that hold the mean NEES of ``runs`` independent runs with the given probability.

    ``runs`` times the mean is chi-square with ``n runs`` degrees of freedom.
    """
    from scipy.stats import chi2  # imported here: it costs half a second

    probability = check_probability(probability)
    runs, n = check_count("runs", runs), check_count("n", n)
    tail = (1 - probability) / 2
    return chi2.ppf([tail, 1 - tail], n * runs) / runs
