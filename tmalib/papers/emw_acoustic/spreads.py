"""`emw-acoustic`: how probable is a printed standard deviation, judged by our own runs?

The test of the tables is symmetric: it divides the deviation by a standard error that comes from the
kurtosis. Where a few stray runs decide a standard deviation, that error is as large as the standard deviation
itself, and no printed value is too small for the test, not even zero. Resampling has no such blind side.
"""

from __future__ import annotations

import numpy as np

from ...montecarlo import CHUNK

DRAWS = 10_000


def probability_of_spread(errors, printed, rng, runs=CHUNK):
    """Two-sided bootstrap probability of printed standard deviations.

    ``DRAWS`` experiments of ``runs`` runs are drawn with replacement from our own. Twice the smaller of the
    shares with a standard deviation of at most, and of at least, the printed one; at most 1.

    Parameters
    ----------
    errors : ndarray, shape (N, n)
    printed : array_like, shape (n,)
    rng : numpy.random.Generator
    runs : int
        Behind the printed value.

    Returns
    -------
    ndarray, shape (n,)
    """
    drawn = (errors[rng.integers(0, len(errors), runs)] for _ in range(DRAWS))
    found = np.array([sample.std(axis=0, ddof=1) for sample in drawn])
    smaller, larger = np.mean(found <= printed, axis=0), np.mean(found >= printed, axis=0)
    return np.minimum(1.0, 2 * np.minimum(smaller, larger))
