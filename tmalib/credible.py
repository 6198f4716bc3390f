"""The smallest region of positions with a given posterior probability, from weighted draws.

The density of the position is estimated with Gaussian kernels from one half of the draws; the other half
tells the level above which the wanted share of the probability lies. Kernels stand in coordinates in which
the draws have unit covariance: of bearing and logarithm of the range where there is an origin for these,
else of x and y. They are shrunk towards the mean by ``sqrt(1 - h^2)``, with the width h, so that they do
not widen what they show (West 1993).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers
from .types import BoolArray, FloatArray

ROWS = 256  # points at a time
MOST = 8000  # draws that are used, evenly taken: time grows with their square


@dataclass(frozen=True, eq=False)
class CredibleRegion:
    """The smallest region of positions with a given posterior probability: output of `Posterior.region`.

    Attributes
    ----------
    probability : float
    level : float
        A position is in the region if its ``density`` is at least this, in 1/m^2.
    area : float
        In square metres, from the draws.
    """

    probability: float
    level: float
    area: float
    origin: FloatArray | None  # of polar coordinates
    centres: FloatArray  # of the kernels, in whitened coordinates, (K, 2)
    weight: FloatArray
    middle: FloatArray
    whiten: FloatArray
    width: float

    def density(self, points: ArrayLike) -> FloatArray:
        """Posterior density of positions ``points (..., 2)``, in 1/m^2."""
        points = as_numbers("points", points)
        if points.ndim == 0 or points.shape[-1] != 2:
            raise ValueError(f"points must have shape (..., 2), got {points.shape}")
        flat, log_volume = polar(points.reshape(-1, 2), self.origin, self.middle[0])
        total = self._kernels((flat - self.middle) @ self.whiten.T)
        scale = np.abs(np.linalg.det(self.whiten)) / (2 * np.pi * self.width**2)
        return (total * scale * np.exp(-log_volume)).reshape(points.shape[:-1])[()]

    def _kernels(self, white):
        """Weighted sum of the kernels at whitened points."""
        white, centres = white / self.width, self.centres / self.width
        total = np.empty(len(white))
        for i in range(0, len(white), ROWS):
            rows = white[i : i + ROWS]
            square = np.vecdot(rows, rows)[:, None] + np.vecdot(centres, centres) - 2 * rows @ centres.T
            total[i : i + ROWS] = np.exp(-square / 2) @ self.weight
        return total

    def contains(self, points: ArrayLike) -> BoolArray:
        """Whether positions ``points (..., 2)`` are in the region, ``(...)``."""
        return self.density(points) >= self.level


def weighted_quantile(values: FloatArray, weight: FloatArray, probability: ArrayLike) -> FloatArray:
    """Quantiles ``(...)`` of values ``(M,)`` with weights of sum one."""
    order = np.argsort(values)
    place = np.searchsorted(np.cumsum(weight[order]), probability)
    return values[order][np.minimum(place, len(order) - 1)]


def polar(points: FloatArray, origin: FloatArray | None, near: float) -> tuple[FloatArray, FloatArray]:
    """Bearing within half a turn of ``near``, log range, ``(M, 2)``; the log of their volume in m^2."""
    if origin is None:
        return points, np.zeros(len(points))
    dx, dy = (points - origin).T
    with np.errstate(divide="ignore"):
        log = np.log(np.hypot(dx, dy))
    theta = near + np.remainder(np.arctan2(dx, dy) - near + np.pi, 2 * np.pi) - np.pi
    return np.stack([theta, log], axis=1), 2 * log


def credible_region(
    places: FloatArray, weight: FloatArray, probability: float, origin: FloatArray | None, effective: float
) -> CredibleRegion:
    """The `CredibleRegion` of weighted positions ``(M, 2)``, worth ``effective`` draws."""
    heaviest = places[[np.argmax(weight)]]
    step = -(-len(weight) // MOST)
    places, weight = places[::step], weight[::step] / weight[::step].sum()
    flat, _ = polar(places, origin, polar(heaviest, origin, 0.0)[0][0, 0])
    middle = weight @ flat
    off = flat - middle
    whiten = np.linalg.inv(np.linalg.cholesky((weight[:, None] * off).T @ off))
    width = float((effective / step / 2) ** (-1 / 6))  # of two halves
    halves = [weight[first::2] / weight[first::2].sum() for first in (0, 1)]
    centres = np.sqrt(1 - width**2) * off[::2] @ whiten.T
    region = CredibleRegion(probability, 0.0, np.nan, origin, centres, halves[0], middle, whiten, width)
    density = region.density(places[1::2])
    level = float(weighted_quantile(density, halves[1], 1 - probability))
    inside = density >= level
    area = float(np.sum(halves[1][inside] / density[inside]))
    return replace(region, level=level, area=area)
