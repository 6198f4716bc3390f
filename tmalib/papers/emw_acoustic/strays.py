"""`emw-acoustic`: runs of the EKF of scenario 6 that stray, and what one among 500 does to Table VI."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...montecarlo import CHUNK
from ...recursive import ekf
from . import experiments, tables
from . import scenarios as emw
from .paper import PAPER

STREAM = PAPER.stream("emw/6")
SEED = 2016  # of the search
SEARCHED = 4000  # chunks of the stream: two million runs, about four minutes on one core
FOUND = (  # chunk and row of all runs in them that `search` finds beyond `FAR`
    (89, 476), (236, 84), (430, 199), (714, 177), (880, 282), (1086, 449), (1532, 350), (1725, 42),
    (2594, 10), (2742, 96), (2846, 232), (3291, 353), (3325, 28), (3598, 360), (3824, 491), (3847, 455),
)  # fmt: skip
FAR = 2168.0  # metres of error in x: half of what Table VI asks of one run, from the mean on

as_used = partial(experiments.filter_alone, number=6, gradient="correct", first_again=False)


def search(chunks):
    """Chunk and row of every run whose error in x is beyond `FAR`, in chunks of the stream."""
    found = ((chunk, as_used(STREAM.chunk(chunk, SEED), CHUNK)["ekf"]) for chunk in chunks)
    return tuple((chunk, int(row)) for chunk, e in found for row in np.flatnonzero(np.abs(e[:, 0]) > FAR))


def rare_runs():
    """The runs of `FOUND`, both estimators, as `tables.RareRuns`."""
    made = [(experiments.both_estimators(STREAM.chunk(chunk, SEED), CHUNK, 6), row) for chunk, row in FOUND]
    mle, ekf = (np.array([found[name][row] for found, row in made]) for name in ("mle", "ekf"))
    return tables.RareRuns(mle, ekf, SEARCHED * CHUNK, FAR)


def errors_again(where):
    """Errors ``(k, 4)`` of the runs with these chunks and rows."""
    return np.array([as_used(STREAM.chunk(chunk, SEED), CHUNK)["ekf"][row] for chunk, row in where])


@dataclass(frozen=True)
class EarlyEstimates:
    """Where runs are early on.

    ``distance (k,)`` of the estimates from the observer and ``true_distance``, metres; ``error_over_sigma
    (k,)``, the error of the position over the standard deviation that the filter claims for it.
    """

    distance: np.ndarray
    true_distance: float
    error_over_sigma: np.ndarray


def after(time, where):
    """The `EarlyEstimates` of the runs with these chunks and rows at a time."""
    now = emw.scenario(6)
    angles = np.array([now.simulate(CHUNK, STREAM.chunk(chunk, SEED))[row] for chunk, row in where])
    track = ekf(now, angles, emw.prior(emw.start(now, angles, 6)), record=[time])
    place, covariance = track.state[:, 0, :2], track.covariance[:, 0, :2, :2]
    here, there = now.platform.position_at(time), now.target.position_at(time)
    claimed = np.sqrt(np.trace(covariance, axis1=1, axis2=2))
    return EarlyEstimates(
        np.hypot(*(place - here).T), np.hypot(*(there - here)), np.hypot(*(place - there).T) / claimed
    )


def deviation_needed(printed, std, runs=tables.PRINTED_RUNS):
    """How far from the mean one of ``runs`` has to be, so that a standard deviation is the printed one.

    The others have ``std``; see `with_one_run`.
    """
    return np.sqrt(runs * (printed**2 - std**2) + std**2)


def with_one_run(usual, deviation, runs=tables.PRINTED_RUNS):
    """Expected bias and standard deviation of ``runs`` runs, one of them at a deviation d from the mean.

    The others have mean m and standard deviation s: the bias is ``m + d / n``, the variance
    ``s^2 + (d^2 - s^2) / n``.

    Parameters
    ----------
    usual : Statistics
    deviation : array_like, shape (..., 4)

    Returns
    -------
    bias, std : ndarray, shape (..., 4)
    """
    deviation = np.asarray(deviation, dtype=float)
    return usual.bias + deviation / runs, np.sqrt(usual.std**2 + (deviation**2 - usual.std**2) / runs)


def largest_z(usual, deviation):
    """Largest deviation from the eight EKF numbers of Table VI with one such run, standard errors, ``(...)``.

    The standard errors are those of the other runs.
    """
    bias, std = with_one_run(usual, deviation)
    runs = tables.PRINTED_RUNS
    off_bias = (np.abs(bias) - tables.printed_values(6, "bias_ekf")) / usual.bias_se(runs)
    off_std = (std - tables.printed_values(6, "std_ekf")) / usual.std_se(runs)
    return np.abs(np.concatenate([off_bias, off_std], axis=-1)).max(axis=-1)
