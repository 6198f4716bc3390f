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


def whitened_jacobian(scenario, state=None):
    """Gradient of every measurement over its standard deviation, shape ``(..., N, n)``.

    ``state``, shape ``(..., n)``, defaults to the truth.
    """
    _, gradient = scenario.linearise(scenario.state if state is None else state)
    return gradient / scenario.sigma[:, None]


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
        Units: the inverse of the product of the state's (m, m/s).

    Notes
    -----
    Source: `emw-acoustic`, Section III.
    """
    jacobian = whitened_jacobian(scenario, state)
    return jacobian.mT @ jacobian


def _scaled(scenario, state):
    jacobian = whitened_jacobian(scenario, state)
    length = np.sqrt(np.vecdot(jacobian.mT, jacobian.mT))
    return jacobian / np.where(length > 0, length, 1.0)[..., None, :], length


def information_rank(scenario, state=None):
    """Rank of the Fisher information: the number of directions of the state that are observable.

    Singular values of the column-scaled Jacobian below 1e-12 of the largest count as zero.
    """
    singular = np.linalg.svd(_scaled(scenario, state)[0], compute_uv=False)
    return np.sum(singular > RANK_TOLERANCE * singular[..., :1], axis=-1)


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
        Covariance of the state at the reference time; m^2, m^2/s, m^2/s^2.

    Raises
    ------
    ValueError
        When the information is singular: some direction of the state is not observable.

    Notes
    -----
    Source: `emw-acoustic`, Section III.
    """
    scaled, length = _scaled(scenario, state)
    triangle = np.linalg.qr(scaled, mode="r")
    pivots = np.abs(np.diagonal(triangle, axis1=-2, axis2=-1))
    n = length.shape[-1]
    if scaled.shape[-2] < n or not np.all(pivots.min(axis=-1) > RANK_TOLERANCE):
        rank = np.min(information_rank(scenario, state))
        raise ValueError(f"the state is not observable: the Fisher information has rank {rank} of {n}")
    root = np.linalg.solve(triangle, np.eye(n)) / length[..., :, None]
    return root @ root.mT


def crlb_sigma(scenario, state=None):
    """Square roots of the bound's diagonal, shape ``(..., n)``: the smallest standard deviations."""
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

    Notes
    -----
    The level is the quantile of chi-square with two degrees of freedom, ``-2 log(1 - p)``.
    """
    probability = check_probability(probability)
    centre = check_array("centre", np.asarray(centre, dtype=float)[..., :2], (2,))
    block = check_array("covariance", np.asarray(covariance, dtype=float)[..., :2, :2], (2, 2))
    values, vectors = np.linalg.eigh(block)
    if values[0] < 0:
        raise ValueError(f"covariance must be positive semi-definite, got eigenvalues {values}")
    level = -2 * np.log1p(-probability)
    return Ellipse(centre, np.sqrt(level * values[::-1]), float(np.arctan2(*vectors[:, 1])), probability)


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
        Chi-square with n degrees of freedom when the errors are Gaussian with that covariance.

    Notes
    -----
    Source: `conical-angles`, Section 4.2.1.
    """
    error = np.asarray(state, dtype=float) - np.asarray(truth, dtype=float)
    covariance = np.asarray(covariance, dtype=float)
    scale = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    correlation = covariance / (scale[..., :, None] * scale[..., None, :])
    scaled = error / scale
    return np.vecdot(scaled, np.linalg.solve(correlation, scaled[..., None])[..., 0])


def nees_limits(n, runs, probability=0.9):
    """Limits that hold the mean NEES of ``runs`` independent runs with the given probability.

    ``runs`` times the mean is chi-square with ``n runs`` degrees of freedom.
    """
    from scipy.stats import chi2  # imported here: it costs half a second

    probability = check_probability(probability)
    runs, n = check_count("runs", runs), check_count("n", n)
    tail = (1 - probability) / 2
    return chi2.ppf([tail, 1 - tail], n * runs) / runs
