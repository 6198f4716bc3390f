"""`robustness`, Proposition 1: where the local minimum ceases to exist, and where another one comes from.

`theory.follow` traces the minimum that continues the line while the displacement grows from 0 to H.
"""

from __future__ import annotations

import numpy as np

from ...sensitivity import displaced_measurements
from .theory import newton_estimate


def fold(scenario, displacement, path, halvings=30):
    """Where the minimum that `theory.follow` loses ceases to exist, by bisection.

    Parameters
    ----------
    scenario : Scenario
    displacement : array_like, shape (N, 2)
        ``H``, in metres.
    path : ndarray, shape (steps + 1, 4)
        What `theory.follow` returns for it, with rows that are NaN.
    halvings : int
        Of the step in which the minimum is lost.

    Returns
    -------
    fraction : float
        Of the displacement: the largest for which the minimum was found.
    state : ndarray, shape (4,)
        The minimum there.
    """
    found, steps = int(np.isfinite(path[:, 0]).sum()), len(path) - 1
    if found > steps:
        raise ValueError("the minimum exists up to the full displacement: there is no fold")
    low, high, state = (found - 1) / steps, found / steps, path[found - 1]
    ones = np.ones(len(scenario.times))
    for _ in range(halvings):
        middle = (low + high) / 2
        measured = displaced_measurements(scenario, middle * displacement)
        try:
            state, low = newton_estimate(scenario, ones, measured, state), middle
        except ValueError:
            high = middle
    return low, state


def follow_back(scenario, displacement, state, local):
    """Another minimum than the one that continues the line, traced from the full displacement back to it.

    Parameters
    ----------
    scenario : Scenario
    displacement : array_like, shape (N, 2)
        ``H``, in metres.
    state : array_like, shape (4,)
        Next to that other minimum for the full displacement.
    local : ndarray, shape (steps + 1, 4)
        What `theory.follow` returns for the displacement.

    Returns
    -------
    ndarray, shape (steps + 1, 4)
        For the fractions of ``local``. NaN where the other minimum does not exist: no minimum is next to the
        last one found, or the next one is ``local``.
    """
    states = np.full(np.shape(local), np.nan)
    fractions = np.linspace(0, 1, len(local))
    ones = np.ones(len(scenario.times))
    for k in range(len(local) - 1, -1, -1):
        measured = displaced_measurements(scenario, fractions[k] * displacement)
        try:
            state = newton_estimate(scenario, ones, measured, state)
        except ValueError:
            break
        if np.allclose(state, local[k], rtol=1e-3):
            break
        states[k] = state
    return states
