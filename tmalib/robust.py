"""How a batch of runs is fitted with a robust loss, whose criterion has many minima.

1. Wild measurements that stand out among their neighbours are replaced (see `tmalib.losses.without_wild`),
   and the runs are fitted by squares: this gives a start, whatever else there is to start from.
2. From there a robust fit of all measurements, as they are.
3. Where that does not explain the measurements that looked good, robust fits from a range of ranges; the
   lowest criterion counts.

A minimum that trusts no more than half of the measurements is none. So an estimate is given only if more than
half of them agree on a target; this is the point of breakdown.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from . import status as words
from .bounds import factor
from .charts import chart_of
from .levenberg_marquardt import Settings, minimise_in_blocks
from .losses import value_and_weight, without_wild
from .scenario import Scenario
from .types import FloatArray

CLOSER = 100  # a robust step leaves a tenth or so of the way, not its square
TRUSTED, EXPLAINED = 0.5, 0.85  # sums of weights over all measurements, and over those that look good
FLAT = 1e-9  # as in `tmalib.batch`


def fit_robustly(
    scenario: Scenario,
    angles: FloatArray,
    settings: Settings,
    by_squares: Callable[..., Any],
    look: Callable[..., None],
) -> tuple[Any, ...]:
    """State, status, iterations and criterion of runs ``(runs, N)`` without a gap.

    Parameters
    ----------
    scenario : Scenario
    angles : ndarray, shape (runs, N)
    settings : Settings
        With a loss.
    by_squares : callable
        The four of a fit by squares, of measurements ``(runs, N)``.
    look : callable
        ``look(run, found, tame)`` puts a lower minimum into the outcome of a run, if it finds one.
    """
    finite, n = np.all(np.isfinite(angles), axis=1), len(scenario.coordinates)
    tame, wild = without_wild(scenario, np.where(finite[:, None], angles, 0.0))
    tame[~finite] = np.nan
    start, seen, *_ = by_squares(tame)
    found = minimise_in_blocks(scenario, angles, start, chart_of(scenario, settings.chart), *settings[1:])
    explained = _weights(scenario, angles, found.state).sum(axis=1) >= EXPLAINED * np.sum(~wild, axis=1)
    for run in np.flatnonzero(finite & ~(found.converged & explained)):
        look(run, found, tame)
    state, status, iterations, cost, volume = found
    status[status == words.RAN_AWAY] = words.NO_MINIMUM
    weights, converged = _weights(scenario, angles, state), found.converged
    status[converged & ~(weights.sum(axis=1) > TRUSTED * angles.shape[1])] = words.NO_DESCENT
    lost = ~found.converged & (seen == words.NOT_OBSERVABLE)
    flat = np.flatnonzero(found.converged & ~(volume > FLAT))
    if len(flat):
        jacobian = scenario.linearise(state[flat])[1] / scenario.sigma[:, None]
        lost[flat] = factor(scenario, state[flat], np.sqrt(weights[flat])[..., None] * jacobian).rank < n
    status[lost & finite] = words.NOT_OBSERVABLE
    return state, status, iterations, cost


def _weights(scenario, angles, state):
    """Weights of measurements ``(runs, N)`` at states ``(runs, n)``; zero where nothing is predicted."""
    with np.errstate(all="ignore"):
        off = scenario.residual(angles, scenario.linearise(state)[0]) / scenario.sigma
        return np.nan_to_num(value_and_weight(off**2)[1])
