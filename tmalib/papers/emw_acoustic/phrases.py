"""`emw-acoustic`: what the sentences of the text are measured by; the limits are in ``phrases.toml``.

Every measure is an `Ours` with its standard error, for `judging.judge_phrases`.
"""

from __future__ import annotations

import numpy as np

from ...judging import Ours
from ...montecarlo import statistics


def mean_nees(values):
    """Mean of normalised errors squared, ``(runs,)``; an efficient estimator has 4."""
    return Ours(float(np.mean(values)), se=float(np.std(values) / np.sqrt(len(values))))


def largest_bias(errors):
    """Largest mean of a component of the errors, ``(runs, 4)``, without sign, over its spread."""
    found = statistics(errors)
    return Ours(float(np.max(np.abs(found.bias) / found.std)), se=1 / np.sqrt(len(errors)))


def rms_over_bound(errors, bound):
    """Root mean square errors over the bound's standard deviations, four `Ours` for errors ``(runs, 4)``."""
    squares = np.asarray(errors) ** 2
    mean, error = squares.mean(axis=0), squares.std(axis=0) / np.sqrt(len(squares))
    ratios, relative = np.sqrt(mean) / bound, error / (2 * mean)
    return [Ours(float(value), se=float(value * off)) for value, off in zip(ratios, relative, strict=True)]


def least(measures):
    """The one with the smallest value."""
    return min(measures, key=lambda ours: ours.value)


def most(measures):
    """The one with the largest value."""
    return max(measures, key=lambda ours: ours.value)


def smallest_share(inside):
    """Smallest share of the runs at an instant, of booleans ``(runs, T)``."""
    share = np.mean(inside, axis=0).min()
    return Ours(float(share), se=float(np.sqrt(share * (1 - share) / len(inside))))


def share_far(errors, distance):
    """Share of the runs whose position, of errors ``(runs, 4)``, is off by more than ``distance`` metres."""
    return smallest_share((np.hypot(errors[:, 0], errors[:, 1]) > distance)[:, None])


def median_of(values):
    """Median of ``(runs,)``; its standard error is half of what lies between two order statistics."""
    half = 0.5 / np.sqrt(len(values))
    low, middle, high = np.quantile(values, [0.5 - half, 0.5, 0.5 + half])
    return Ours(float(middle), se=float((high - low) / 2))


def off_course(positions, target):
    """Median distances of positions ``(runs, T, 2)`` from the line a target sails on, in metres, T `Ours`."""
    across = np.array([-1.0, 1.0]) * target.velocity[::-1] / np.hypot(*target.velocity)
    off = np.abs((positions - target.position_at(0.0)) @ across)
    return [median_of(column) for column in off.T]


def covariance_off(errors, covariance):
    """Largest relative difference of the spread of errors from a covariance's, in any direction.

    With ``L`` the Cholesky factor of the covariance, the spreads along the eigenvectors of the covariance of
    ``L^-1 errors`` are the extremes; all are one where the two are equal.
    """
    scaled = np.linalg.solve(np.linalg.cholesky(covariance), np.asarray(errors).T).T
    _, directions = np.linalg.eigh(np.cov(scaled.T))
    found = statistics(scaled @ directions)
    worst = np.argmax(np.abs(found.std - 1))
    return Ours(float(abs(found.std[worst] - 1)), se=float(found.std_se()[worst]))
