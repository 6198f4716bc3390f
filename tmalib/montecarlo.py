"""Monte-Carlo experiments: named random streams, chunks of runs over an executor, statistics with errors.

An experiment is a *task*, a function of a seed and a number of runs that returns named arrays with one
row a run. `monte_carlo` calls it for chunks of 500 runs. Chunk k of a stream always gets the seed
``SeedSequence(entropy=seed, spawn_key=(stream, k))``, so the first 500 runs of a long experiment are
the short experiment, and the result does not depend on who computes which chunk.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._checks import check_count

SEED = 2016
CHUNK = 500

# Name of a stream -> its number. Add at the end; never renumber.
STREAMS = {
    "emw/1": 0,
    "emw/2": 1,
    "emw/3": 2,
    "emw/4": 3,
    "emw/5": 4,
    "emw/6": 5,
    "example": 6,
    "conical/3.2": 7,
    "conical/4.2": 8,
    "conical/5.2": 9,
    "robustness/noise": 10,
    "robustness/stochastic": 11,
    "robustness/geometries": 12,
    "robustness/filters": 13,
}


def stream(name, chunk=0, seed=SEED):
    """Seed of a chunk of a named stream, a `numpy.random.SeedSequence`."""
    if name not in STREAMS:
        raise ValueError(f"stream must be one of {sorted(STREAMS)}, got {name!r}")
    return np.random.SeedSequence(entropy=seed, spawn_key=(STREAMS[name], chunk))


def monte_carlo(task, runs, name, *, seed=SEED, executor=None):
    """Run a task ``runs`` times and return its arrays, one row a run.

    Parameters
    ----------
    task : callable
        ``task(seed, runs)`` returns a dict of arrays with leading axis ``runs``. With a process pool it
        must be picklable: a function of a module, or a `functools.partial` of one.
    runs : int
    name : str
        Name of the random stream.
    seed : int
    executor : concurrent.futures.Executor, optional
        Anything with an ordered ``map``: a process pool, dask's or mpi4py's executor. Serial by default.

    Returns
    -------
    dict of ndarray
        Bit-identical for every executor and number of workers.
    """
    runs = check_count("runs", runs)
    counts = [min(CHUNK, runs - first) for first in range(0, runs, CHUNK)]
    seeds = [stream(name, chunk, seed) for chunk in range(len(counts))]
    parts = list((executor.map if executor else map)(task, seeds, counts))
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}


@dataclass(frozen=True)
class Statistics:
    """Mean and spread of an error over runs; arrays of shape ``(n,)``.

    Attributes
    ----------
    runs, used : int
        Runs made, and runs with finite errors that went into the statistics.
    bias, std : ndarray
        Mean, and standard deviation with ``used - 1`` in the denominator.
    kurtosis : ndarray
        ``m4 / m2^2``, 3 for a Gaussian.
    """

    runs: int
    used: int
    bias: np.ndarray
    std: np.ndarray
    kurtosis: np.ndarray

    def bias_se(self, runs=None):
        """Standard error ``s / sqrt(n)`` of a bias from ``runs`` runs (default: those used)."""
        return self.std / np.sqrt(self.used if runs is None else runs)

    def std_se(self, runs=None):
        """Standard error of a standard deviation from ``runs`` runs (default: those used).

        ``s / 2 sqrt((kurtosis - (n - 3) / (n - 1)) / n)``; for a Gaussian ``s / sqrt(2 (n - 1))``.
        """
        n = self.used if runs is None else runs
        return self.std / 2 * np.sqrt((self.kurtosis - (n - 3) / (n - 1)) / n)


def statistics(errors):
    """`Statistics` of errors ``(runs, n)``. A row that is not finite is counted, not used."""
    errors = np.asarray(errors, dtype=float)
    if errors.ndim != 2:
        raise ValueError(f"errors must have shape (runs, n), got {errors.shape}")
    good = errors[np.isfinite(errors).all(axis=1)]
    if len(good) < 4:
        raise ValueError(
            f"statistics need at least 4 runs with finite errors, got {len(good)} of {len(errors)}"
        )
    bias = good.mean(axis=0)
    centred = good - bias
    m2, m4 = np.mean(centred**2, axis=0), np.mean(centred**4, axis=0)
    return Statistics(len(errors), len(good), bias, good.std(axis=0, ddof=1), m4 / m2**2)
