"""Mixtures of Student's t distributions that weighted draws move: proposals of `tmalib.posterior`.

Each part of a mixture takes the mean and the covariance of the weighted draws for which it is responsible,
that is, weighted once more by its share of the mixture's density there (population Monte Carlo, Cappé et
al. 2008). With four degrees of freedom the tails are heavier than those of any Gaussian, so that no draw
gets a weight beyond all bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .types import FloatArray

FREEDOM = 4.0
LEAST_SHARE = 0.02  # of a part, before normalisation: none dies
ENOUGH, CLIPPED = (
    5,
    3,
)  # effective draws for each unknown that move a part; largest weights that are made equal
JITTER = 1e-9  # on a unit diagonal


@dataclass(frozen=True, eq=False)
class Mixture:
    """Student's t distributions: shares ``(K,)``, centres ``(K, n)``, roots of their scales ``(K, n, n)``."""

    share: FloatArray
    centre: FloatArray
    root: FloatArray

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Draws ``(count, n)``."""
        which = rng.choice(len(self.share), size=count, p=self.share)
        normal = rng.standard_normal((count, self.centre.shape[1]))
        normal /= np.sqrt(rng.chisquare(FREEDOM, count) / FREEDOM)[:, None]
        return self.centre[which] + np.einsum("ijk,ik->ij", self.root[which], normal)

    def log_parts(self, points: FloatArray) -> FloatArray:
        """Logarithms of share times density of each, up to one constant, ``(K, M)``."""
        n, parts = points.shape[1], []
        for share, centre, root in zip(self.share, self.centre, self.root, strict=True):
            white = np.linalg.inv(root) @ (points - centre).T
            volume = np.sum(np.log(np.abs(np.diagonal(root))))
            tail = (FREEDOM + n) / 2 * np.log1p(np.vecdot(white.T, white.T) / FREEDOM)
            parts.append(np.log(share) - volume - tail)
        return np.array(parts)

    def log_density(self, points: FloatArray) -> FloatArray:
        """Logarithm of the density at points ``(M, n)``, up to one constant for all mixtures, ``(M,)``."""
        return np.logaddexp.reduce(self.log_parts(points), axis=0)

    def moved(self, points: FloatArray, weight: FloatArray) -> Mixture:
        """The mixture with means and covariances of the draws for which each part is responsible."""
        parts = self.log_parts(points)
        blame = np.exp(parts - np.logaddexp.reduce(parts, axis=0)) * weight
        share, centre, root = self.share.copy(), self.centre.copy(), self.root.copy()
        n = points.shape[1]
        for k, own in enumerate(blame):
            total = own.sum()
            if total <= 0 or total**2 / np.sum(own**2) < ENOUGH * n:
                continue
            own = own / total
            mean = own @ points
            off = points - mean
            size = np.sqrt(own @ off**2)
            correlation = (own[:, None] * off / size).T @ (off / size)
            share[k], centre[k] = total, mean
            root[k] = size[:, None] * np.linalg.cholesky(correlation + JITTER * np.eye(n))
        share = np.maximum(share, LEAST_SHARE)
        return Mixture(share / share.sum(), centre, root)


def log_mean_density(mixtures: Sequence[tuple[float, Mixture]], points: FloatArray) -> FloatArray:
    """Logarithm of the mean density of mixtures, each with its share of the draws, ``(M,)``."""
    parts = np.array([np.log(share) + mixture.log_density(points) for share, mixture in mixtures])
    return np.logaddexp.reduce(parts, axis=0)


def clipped(weight: FloatArray, unknowns: int) -> FloatArray:
    """Weights of sum one, the largest made equal: a mixture that one draw moves collapses."""
    positive = np.sort(weight[weight > 0])
    level = positive[-min(CLIPPED * unknowns, len(positive))]
    found = np.minimum(weight, level)
    return found / found.sum()
