"""A printed table as one random vector: its joint distribution over experiments of the paper's size.

The statistics of a table, biases and standard deviations over the same runs, are one vector. What it could
have been is drawn from our own runs: `EXPERIMENTS` experiments, each of

    k = n N / (n + N)

runs, with replacement, for the paper's n runs and our N. The spread of an experiment about ours is then
that of the *difference* between the paper's experiment and ours, ``1 / k = 1 / n + 1 / N``.

A cell has a two-sided probability, twice the smaller of the shares of experiments that are at most, and at
least, as large as the printed value. The table has one: the share of experiments whose normal scores are at
least as far out, in the norm of their correlation matrix. A printed value stands for everything within one
unit of its last digit, rounded or cut off, and the most favourable point counts. The levels come from the
experiments themselves: one in twenty of them has a cell at or below ``level`` or is at or below
``level_together`` as a whole, and both are equally frequent. Where our own runs, moved by two of their
standard errors, could have put a cell on the other side of its level, it is *at the limit*.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.optimize import lsq_linear
from scipy.special import ndtri
from scipy.stats import rankdata

from ..checks import as_numbers, check_count
from ..montecarlo import Stream

ALPHA = 0.05
POWER = 0.8
EXPERIMENTS = 20_000
BLOCK = 2_000  # experiments that are drawn at a time
STATISTICS = {
    "mean": lambda mean, std: mean,
    "magnitude": lambda mean, std: np.abs(mean),  # of a mean that is printed without its sign
    "std": lambda mean, std: std,
}
STREAM = Stream("experiments of the paper's size")


def statistic_of(runs, statistic, weights=None):
    """One of `STATISTICS` of runs ``(N,)`` with probabilities ``weights``; equal ones by default.

    >>> statistic_of([1.0, 2.0, 3.0], "std")
    1.0
    """
    runs, share = _checked(runs, weights)
    mean = share @ runs
    count = 1 / np.sum(share**2)
    return float(STATISTICS[statistic](mean, np.sqrt(share @ (runs - mean) ** 2 * count / (count - 1))))


def _checked(runs, weights):
    runs = as_numbers("runs", runs)
    if not (len(runs) > 1 and np.isfinite(runs).all()):
        raise ValueError(f"runs must be two finite numbers or more, got shape {runs.shape}")
    share = np.full(len(runs), 1 / len(runs)) if weights is None else as_numbers("weights", weights)
    if share.shape != runs.shape[:1] or not (np.all(share > 0) and abs(share.sum() - 1) < 1e-9):
        raise ValueError(f"weights must be {len(runs)} positive numbers with the sum 1, got {share.shape}")
    return runs, share


def draw_tables(runs, statistics, size, *, weights=None, experiments=EXPERIMENTS):
    """The `RandomTables` of a paper's experiments, drawn from our runs.

    Parameters
    ----------
    runs : array_like, shape (N, m)
        What each of our runs gives for the m cells; the same run in a row, so that correlation is seen.
    statistics : sequence of str
        What the paper prints of each: ``"mean"``, ``"magnitude"`` or ``"std"``.
    size : int
        Runs behind the printed table.
    weights : array_like, shape (N,), optional
        Probability of each run, with the sum 1: rare runs, of which more were looked for, have small ones.
    experiments : int

    Raises
    ------
    ValueError
        For runs that are not finite, wrong weights, an unknown statistic.

    Examples
    --------
    >>> import numpy as np
    >>> runs = np.random.default_rng(1).standard_normal((20_000, 1))
    >>> tables = draw_tables(runs[:, [0, 0]], ["mean", "std"], 500)
    >>> found = tables.compare([0.0, 0.8], [0.01, 0.01])
    >>> found.questioned
    array([False,  True])
    """
    runs, share = _checked(runs, weights)
    if unknown := set(statistics) - STATISTICS.keys():
        raise ValueError(f"statistics must be of {sorted(STATISTICS)}, got {sorted(unknown)}")
    ours = 1 / np.sum(share**2)
    k = round(check_count("size", size) * ours / (size + ours))
    centre = share @ runs
    each = runs - centre
    moments, rng = np.hstack([each, each**2]), np.random.default_rng(STREAM.chunk())
    first, second = [], []
    for count in [min(BLOCK, experiments - start) for start in range(0, experiments, BLOCK)]:
        chosen = rng.choice(len(runs), count * k, p=None if weights is None else share)
        places = np.arange(0, count * k + 1, k)
        sums = sparse.csr_array((np.ones(count * k), chosen, places), shape=(count, len(runs))) @ moments
        first.append(sums[:, : len(centre)] / k)
        second.append(sums[:, len(centre) :])
    mean = np.concatenate(first)
    std = np.sqrt((np.concatenate(second) - k * mean**2) / (k - 1))
    pairs = zip(statistics, (centre + mean).T, std.T, strict=True)
    drawn = np.stack([STATISTICS[name](*pair) for name, *pair in pairs], axis=1)
    columns = zip(runs.T, statistics, strict=True)
    values = np.array([statistic_of(*column, weights) for column in columns])
    return RandomTables(drawn, values, float(np.sqrt(k / ours)))


@dataclass(frozen=True, eq=False)
class Comparison:
    """A printed table against `RandomTables`; arrays have shape ``(m,)``, pairs ``(2, m)``.

    Attributes
    ----------
    probability, together, level, level_together
        Two-sided probability of each cell, that of all cells together, and the levels for both.
    alone : ndarray of bool
        Cells whose own probability is at or below the level.
    misfit : ndarray of bool
        Where the cells that do not fail clearly by themselves fail together: those that have to be left out
        until the rest agrees, first the ones at the limit, then the one that fits worst, by its score less
        what the others predict for it.
    at_limit : ndarray of bool
        Of the others, cells so near the level that our own runs could have decided otherwise.
    spread : ndarray
        Root mean square distance of an experiment from ours: the standard error of the printed value.
    accepted : ndarray
        Least and greatest printed value that alone is not questioned.
    detectable : ndarray
        Shifts down and up of a printed value that are found, cell by cell, with probability `POWER`. NaN
        where none is: a magnitude cannot be too small if zero is not.
    """

    probability: np.ndarray
    together: float
    level: float
    level_together: float
    alone: np.ndarray
    misfit: np.ndarray
    at_limit: np.ndarray
    spread: np.ndarray
    accepted: np.ndarray
    detectable: np.ndarray

    @property
    def questioned(self):
        """Cells that are not reproduced, alone or with the others."""
        return self.alone | self.misfit


@dataclass(frozen=True, eq=False)
class RandomTables:
    """Tables that could have been printed if every number is right.

    ``drawn``, ``(experiments, m)``, what all our runs give, ``ours``, ``(m,)``, and ``own``, our standard
    error over that of an experiment.
    """

    drawn: np.ndarray
    ours: np.ndarray
    own: float

    @cached_property
    def ordered(self):
        """The values of each cell in ascending order."""
        return np.sort(self.drawn, axis=0)

    @cached_property
    def ranks(self):
        """From 1, among the values of the same cell."""
        return rankdata(self.drawn, axis=0)

    @cached_property
    def scores(self):
        """Normal scores of the values, ``(experiments, m)``."""
        return ndtri((self.ranks - 0.5) / len(self.drawn))

    @cached_property
    def levels(self):
        """``level`` of a cell and ``level_together``: see the module."""
        count = len(self.drawn)
        least = 2 * np.minimum(self.ranks, count + 1 - self.ranks).min(axis=1) / (count + 1)
        by_cell = rankdata(least, method="max") / count
        as_whole = rankdata(-self._distances(np.arange(self.drawn.shape[1])), method="max") / count
        both = np.quantile(np.minimum(by_cell, as_whole), ALPHA, method="lower")
        return float(np.quantile(least, both, method="lower")), float(both)

    def _whitener(self, cells):
        size, axes = np.linalg.eigh(self.scores[:, cells].T @ self.scores[:, cells] / len(self.scores))
        kept = size > 1e-10 * size[-1]
        return (axes[:, kept] / np.sqrt(size[kept])).T

    def _distances(self, cells):
        return np.sum((self.scores[:, cells] @ self._whitener(cells).T) ** 2, axis=1)

    def _range(self, printed, unit):
        """How many experiments are below, and how many not above, what the printed values stand for."""
        sides = zip(self.ordered.T, printed - unit, printed + unit, strict=True)
        found = [(np.searchsorted(x, low), np.searchsorted(x, high, "right")) for x, low, high in sides]
        return np.array(found).T

    def _most_favourable(self, range_of_scores, cells):
        """The point of a box of normal scores that is least far out, and the whitener of these cells."""
        low, high = range_of_scores[:, cells]
        matrix = self._whitener(cells)
        return lsq_linear(matrix, np.zeros(len(matrix)), (low, high + 1e-9)).x, matrix

    def _together(self, range_of_scores, cells):
        point, matrix = self._most_favourable(range_of_scores, cells)
        beyond = np.sum(self._distances(cells) >= np.sum((matrix @ point) ** 2))
        return (1 + beyond) / (1 + len(self.drawn))

    def _beside_the_others(self, range_of_scores, cells):
        """Each cell's score less what the others predict for it, in standard deviations of that."""
        point, matrix = self._most_favourable(range_of_scores, cells)
        precision = matrix.T @ matrix
        return precision @ point / np.sqrt(np.diag(precision))

    def probability(self, printed, unit):
        """Two-sided, of each cell alone; ``printed`` and ``unit`` as in `compare`."""
        below, not_above = self._range(printed, unit)
        shares = (1 + np.minimum(not_above, len(self.drawn) - below)) / (1 + len(self.drawn))
        return np.minimum(1.0, 2 * shares)

    def compare(self, printed, unit):
        """The `Comparison` of printed values ``(m,)`` with units ``(m,)`` of their last digits."""
        printed, unit = as_numbers("printed", printed), as_numbers("unit", unit)
        probability, (level, level_together) = self.probability(printed, unit), self.levels
        scores = ndtri((self._range(printed, unit) + 0.5) / (len(self.drawn) + 1))
        limit = ndtri(1 - level / 2)
        beyond, cells = ndtri(1 - probability / 2) - limit, np.arange(len(probability))
        near = np.abs(beyond) <= 2 * self.own
        rest = cells[near | (beyond < 0)]
        together, agree = self._together(scores, cells), rest
        while len(agree) > 1 and self._together(scores, agree) <= level_together:
            apart = np.abs(self._beside_the_others(scores, agree))
            out = near[agree] if near[agree].any() else apart == apart.max()
            agree = agree[~out]
        misfit = np.isin(cells, rest) & ~np.isin(cells, agree)
        spread, accepted = np.sqrt(np.mean((self.drawn - self.ours) ** 2, axis=0)), self._accepted(unit)
        levels = (level, level_together)
        found = (probability <= level, misfit, near & ~misfit, spread, accepted)
        return Comparison(probability, together, *levels, *found, self._detectable(accepted, unit))

    def _accepted(self, unit):
        count, (level, _) = len(self.drawn), self.levels
        few = round(level * (1 + count) / 2)  # experiments beyond a printed value must be as many
        return np.stack([self.ordered[few - 1] - unit, self.ordered[count - few] + unit])

    def _detectable(self, accepted, unit):
        low, high = accepted
        step = np.where(unit > 0, unit, 1.0)
        printed = np.where(unit > 0, np.round(self.drawn / step) * step, self.drawn)
        found_down = (low > 0) | (self.ordered[0] < 0)
        down = np.quantile(printed, POWER, axis=0, method="higher") - low
        up = high - np.quantile(printed, 1 - POWER, axis=0, method="lower")
        beyond = 1 + 1e-9  # the ends themselves are accepted
        return np.stack([np.where(found_down, down, np.nan), up]) * beyond
