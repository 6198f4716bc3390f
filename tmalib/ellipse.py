"""Confidence ellipses of a position: where the measurements tell it, if errors are Gaussian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_array, check_count, check_probability
from .types import FloatArray


@dataclass(frozen=True)
class Ellipse:
    """A confidence ellipse: centre, semi-axes in metres (major first), heading of the major axis."""

    centre: FloatArray
    semi_axes: FloatArray
    heading: float
    probability: float

    def boundary(self, points: int = 181) -> FloatArray:
        """Points on the ellipse, shape ``(points, 2)``, first and last the same."""
        angle = np.linspace(0, 2 * np.pi, check_count("points", points))
        along = np.array([np.sin(self.heading), np.cos(self.heading)])
        across = np.array([np.cos(self.heading), -np.sin(self.heading)])
        major, minor = self.semi_axes
        return self.centre + np.outer(major * np.cos(angle), along) + np.outer(minor * np.sin(angle), across)

    @property
    def area(self) -> float:
        """Area in square metres."""
        return float(np.pi * np.prod(self.semi_axes))


def confidence_ellipse(centre: ArrayLike, covariance: ArrayLike, probability: float = 0.9) -> Ellipse:
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
    centre = check_array("centre", np.atleast_1d(as_numbers("centre", centre))[..., :2], (2,))
    block = np.atleast_2d(as_numbers("covariance", covariance))[..., :2, :2]
    block = check_array("covariance of the position", block, (2, 2))
    values, vectors = np.linalg.eigh(block)
    if not values[0] >= -4 * np.finfo(float).eps * np.abs(values).max():
        raise ValueError(f"covariance must be positive semi-definite, got eigenvalues {values}")
    axes = np.sqrt(-2 * np.log1p(-probability) * np.maximum(values[::-1], 0.0))
    return Ellipse(centre, axes, float(np.arctan2(*vectors[:, 1])), probability)
