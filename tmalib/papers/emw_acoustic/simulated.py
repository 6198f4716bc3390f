"""Simulated papers: our own runs printed at a paper's precision, to test the test of `tmalib.judging`.

A simulated table of `emw-acoustic` is what 500 of our runs would have printed. It is judged against the other
runs, by the code that judges the printed table. Every number of it is right.
"""

from __future__ import annotations

from dataclasses import replace
from statistics import NormalDist

import numpy as np

from ...judging.verdict import same_digits
from ...montecarlo import CHUNK
from .paper import PAPER
from .tables import ROWS, TABLES, unsigned_bias_and_std

ESTIMATORS = ("mle", "ekf")


def _statistics(errors):
    """The 16 biases and standard deviations of a table, ``(row, column)`` to `Ours`."""
    return {
        key: ours
        for name in ESTIMATORS
        for i, row in enumerate(ROWS)
        for key, ours in unsigned_bias_and_std(row, 0, errors[name][:, [i]], name).items()
    }


def simulated_table(number, errors, part):
    """The Monte-Carlo rows of a simulated table, for `judge_rows`.

    Parameters
    ----------
    number : int
        Scenario 1 to 6: which table is imitated.
    errors : dict
        ``mle`` and ``ekf``, each ``(runs, 4)``, from `experiments.both_estimators`.
    part : int
        Runs ``500 part`` to ``500 part + 499`` are printed; the others are ours.

    Returns
    -------
    list of (Printed, Ours)
    """
    runs = len(errors[ESTIMATORS[0]])
    if not 0 <= part < runs // CHUNK:
        raise ValueError(f"part must be from 0 to {runs // CHUNK - 1} with {runs} runs, got {part}")
    theirs = np.arange(runs) // CHUNK == part
    simulated = _statistics({name: errors[name][theirs] for name in ESTIMATORS})
    ours = _statistics({name: errors[name][~theirs] for name in ESTIMATORS})
    like = {key: PAPER.printed(TABLES[number], *key) for key in ours}
    return [(_print(like[key], simulated[key].value), ours[key]) for key in ours]


def _print(row, value):
    return replace(row, printed=same_digits(value, row.printed))


def plant_error(rows, key, size):
    """The rows with an error planted: the printed value of ``key`` moved up by ``size`` standard errors."""
    if key not in {(row.row, row.column) for row, _ in rows}:
        raise ValueError(f"key must be a row and column of the table, got {key}")
    return [
        (_print(row, row.value + size * np.hypot(ours.se, ours.se_printed)), ours)
        if (row.row, row.column) == key
        else (row, ours)
        for row, ours in rows
    ]


def detection_probability(size, limit):
    """Probability that a planted error of ``size`` standard errors is found, with a Gaussian statistic."""
    normal = NormalDist()
    return np.vectorize(lambda s: normal.cdf(s - limit) + normal.cdf(-s - limit))(size)
