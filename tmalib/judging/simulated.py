"""Simulated tables, whose every number is right, to test the test of `tmalib.judging.vector`.

They are made of our own runs, with the digits of a real table, or of synthetic errors of a known kind.
"""

from dataclasses import dataclass

import numpy as np

from .vector import EXPERIMENTS, STATISTICS, RandomTables, draw_tables
from .verdict import same_digits

FOLDS = 4


@dataclass(frozen=True, eq=False)
class SimulatedTables:
    """Printed tables ``printed (k, m)`` and the `RandomTables` that they are judged by."""

    printed: np.ndarray
    unit: np.ndarray
    tables: RandomTables

    def questioned(self):
        """Whether each table has a cell that is questioned, alone or with the others, ``(k,)``."""
        return np.array([self.tables.compare(row, self.unit).questioned.any() for row in self.printed])

    def probabilities(self):
        """Those of all cells alone, ``(k, m)``."""
        return np.array([self.tables.probability(row, self.unit) for row in self.printed])

    def found(self, shift):
        """Whether errors are found, each cell alone: ``shift (m,)`` is added to it; ``(k, m)``.

        What cannot be below zero is printed as zero.
        """
        lowest = np.where(self.tables.ordered[0] < 0, -np.inf, 0.0)
        wrong = np.maximum(self.printed + shift, lowest)
        return np.array([self.tables.probability(row, self.unit) for row in wrong]) <= self.tables.levels[0]


def monte_carlo_rows(paper, table, ours):
    """Pairs of Monte-Carlo `Printed` and `Ours` of a table; ``ours`` as in `judge`."""
    pairs = ((paper.printed(table, *key), value) for key, value in ours.items())
    return [pair for pair in pairs if pair[0].kind == "monte-carlo"]


def tables_from_runs(family):
    """A list of `SimulatedTables` like a real one, from the runs of its `monte_carlo_rows`.

    In turn a quarter of our runs is printed, as many tables as it has experiments of the paper's size, with
    the paper's digits, and judged by the other three.
    """
    (first, _), *_ = family
    runs = np.stack([ours.runs for _, ours in family], axis=1)
    statistics = [ours.statistic for _, ours in family]
    unit = np.array([row.last_digit for row, _ in family])
    size = len(runs) // FOLDS
    found = []
    for start in range(0, FOLDS * size, size):
        theirs, place = runs[start : start + size], np.arange(len(runs))
        ours = runs[(place < start) | (place >= start + size)]
        parts = theirs[: size // first.runs * first.runs].reshape(-1, first.runs, len(family))
        printed = [
            [float(same_digits(x, row.printed)) for x, (row, _) in zip(values, family, strict=True)]
            for values in _statistics(parts, statistics)
        ]
        found.append(SimulatedTables(np.array(printed), unit, draw_tables(ours, statistics, first.runs)))
    return found


def _statistics(parts, statistics):
    """Statistics ``(k, m)`` of parts ``(k, n, m)``."""
    mean, std = parts.mean(axis=1), parts.std(axis=1, ddof=1)
    return np.stack([STATISTICS[s](mean[:, i], std[:, i]) for i, s in enumerate(statistics)], axis=1)


def correlated_errors(rng, runs, cells, correlation=0.0, freedom=None):
    """Errors ``(runs, cells)`` with one correlation, Gaussian or Student's with degrees of freedom.

    A run that is far out is so in all cells.
    """
    common = rng.standard_normal((runs, 1))
    found = np.sqrt(correlation) * common
    found = found + np.sqrt(1 - correlation) * rng.standard_normal((runs, cells))
    return found if freedom is None else found / np.sqrt(rng.chisquare(freedom, (runs, 1)) / freedom)


def synthetic_tables(
    rng, cells, papers, *, size=500, runs=20_000, folded=False, experiments=EXPERIMENTS, **kind
):
    """`SimulatedTables` with so many cells, every other one a standard deviation, the others biases.

    ``kind`` goes to `correlated_errors`; bias and standard deviation are of the same error, 0.02 standard
    deviations from zero, and printed to a thousandth. ``folded`` biases have no sign.
    """
    statistics = ["std" if i % 2 else "magnitude" if folded else "mean" for i in range(cells)]
    columns = np.arange(cells) // 2

    def errors(count):
        return correlated_errors(rng, count, columns[-1] + 1, **kind)[:, columns] + 0.02

    printed = np.round(_statistics(np.stack([errors(size) for _ in range(papers)]), statistics), 3)
    tables = draw_tables(errors(runs), statistics, size, experiments=experiments)
    return SimulatedTables(printed, np.full(cells, 1e-3), tables)
