"""All the minima of a criterion that can be found: targets that explain the measurements nearly as well.

A minimum that is ``C - C_min`` above the lowest has the likelihood ``exp(-(C - C_min) / 2)`` relative to that
of the estimate. If the two were equally plausible before, these are their odds.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .batch import fit
from .checks import check_is, check_scalar
from .cosine_starts import grid_of_motions, has_cosines
from .estimate import Fit
from .scenario import Scenario
from .starts import starts_at_ranges
from .types import FloatArray, IntArray

SAME = 0.1  # standard deviations of the estimate, as in `distinct_minima`


class Alternative(NamedTuple):
    """Another minimum of the criterion, and its likelihood relative to the estimate's."""

    state: FloatArray
    cost: float
    likelihood: float


def distinct_minima(
    scenario: Scenario, angles: ArrayLike, starts: ArrayLike, *, separation: float = 0.1, **options: Any
) -> tuple[FloatArray, FloatArray, IntArray]:
    """All the minima that fits from several starts reach, for one run: ghosts included.

    Where targets cannot be told apart, the criterion has several minima of the same value; where a model is
    wrong, a lower one may be far away.

    Parameters
    ----------
    scenario : Scenario
    angles : array_like, shape (N,)
        Measurements of one run.
    starts : array_like, shape (S, n)
    separation : float
        Two estimates count as one minimum when they are nearer than this, in standard deviations of the
        better one.
    **options
        Handed to `fit`.

    Returns
    -------
    states : ndarray, shape (M, n)
        The lowest minimum first; only fits that have converged count.
    costs : ndarray, shape (M,)
        Their criteria.
    hits : ndarray of int, shape (M,)
        How many starts ended at each.
    """
    angles = check_is("scenario", scenario, Scenario).check_measurements(angles)
    starts, separation = scenario.check_state(starts), check_scalar("separation", separation, above=0.0)
    if angles.ndim != 1 or starts.ndim != 2:
        raise ValueError(f"one run and a list of starts are needed, got {angles.shape} and {starts.shape}")
    found = fit(scenario, angles, starts, **options)
    states: list[FloatArray] = []
    costs: list[float] = []
    hits: list[int] = []
    for k in np.argsort(np.where(found.converged, found.cost, np.inf))[: found.converged.sum()]:
        jacobian = scenario.linearise(found.state[k])[1] / scenario.sigma[:, None]
        near = [bool(np.linalg.norm(jacobian @ (state - found.state[k])) <= separation) for state in states]
        if any(near):
            hits[near.index(True)] += 1
        else:
            states.append(found.state[k])
            costs.append(found.cost[k])
            hits.append(1)
    n = starts.shape[-1]
    return np.array(states).reshape(-1, n), np.array(costs), np.array(hits, dtype=int)


def alternatives(found: Fit, within: float = 9.0, max_iterations: int = 200) -> list[Alternative]:
    """Other minima of the criterion that a fit of one run might have been, the most likely first.

    Parameters
    ----------
    found : Fit
        Of one run, with bearings or with conical angles alone.
    within : float
        Largest difference of the criterion: 9 is a likelihood of one in ninety.
    max_iterations : int
        Most evaluations of the model from each start.

    Returns
    -------
    list of Alternative
        A search from many starts: what none leads to is missing. A ghost out of the water is listed;
        `admissible` tells it. There are none for a run that has not converged. With a robust loss they are
        minima of its criterion that trust more than half of the measurements; their likelihood is that of
        errors with the density ``exp(-rho / 2)``.

    Raises
    ------
    ValueError
        For more than one run, and for a scenario in which a fit needs a start.

    Examples
    --------
    An array that does not turn cannot tell right from left:

    >>> import numpy as np, tmalib as tma
    >>> array = tma.Course((0, 0), speed=5, heading=0.0, legs=[tma.Straight(600)])
    >>> rays = [tma.ConicalAngle(path, 200.0, 4000.0, 100.0) for path in (tma.DIRECT, tma.BOTTOM_BOUNCE)]
    >>> watch = tma.Scenario(array, [tma.Sensor(ray, np.arange(0, 601, 20), 0.001) for ray in rays], 0)
    >>> truth = tma.Target((5000, 7000), speed=4, heading=np.radians(45), depth=100)
    >>> found = tma.fit(watch, watch.with_target(truth).simulate(1, seed=1)[0])
    >>> (other,) = tma.alternatives(found)
    >>> bool(np.allclose(other.state, found.state * [-1, 1, -1, 1], rtol=1e-3)), round(other.likelihood, 3)
    (True, 1.0)
    """
    if check_is("found", found, Fit).state.ndim != 1:
        raise ValueError(f"alternatives are of one run, and these are {found.state.shape[:-1]}; fit one")
    within = check_scalar("within", within, above=0.0)
    if not found.converged:
        return []
    there = ~np.isnan(found.measured)
    scenario, measured = found.scenario.keep(there), found.measured[there]
    starts = (grid_of_motions if has_cosines(scenario) else starts_at_ranges)(scenario, measured)
    starts = np.concatenate([found.state[None], starts[np.isfinite(starts).all(axis=1)]])
    states, costs, _ = distinct_minima(
        scenario, measured, starts, max_iterations=max_iterations, loss=found.loss
    )
    jacobian = scenario.linearise(found.state)[1] / scenario.sigma[:, None]
    return [
        Alternative(state, float(cost), float(np.exp((found.cost - cost) / 2)))
        for state, cost in zip(states, costs, strict=True)
        if cost - found.cost < within and np.linalg.norm(jacobian @ (state - found.state)) > SAME
    ]
