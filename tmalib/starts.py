"""A fit without a guess: equations, a fit of condensed bearings, and ranges where that is not enough.

A run goes through these attempts until it is *settled*: its fit has converged, explains the bearings and is
slower than sound. The lowest criterion counts.

1. A fit from the solution of pseudolinear equations (see `tmalib.pseudolinear`); where these do not tell the
   range, it is held at `MIDDLE_RANGE`.
2. A fit from the best of `RANGES`, each held in the equations: the one of the lowest criterion.
3. A few steps from all ranges, and fits from where the best few have got to.
4. The first and the third with all bearings, where nothing explains the condensed ones: those of a target
   that passes close are no lines.

Where the equations should tell the range and do not, the second is always made: a target that goes along
with the platform, at no distance, has any bearing, and where little tells the range that may be a minimum.

The attempts use condensed bearings, a few dozen values (see `tmalib.condensed`); one or two steps with all
measurements are left then. Where there is nothing to condense, the first attempt is the fit itself.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from . import levenberg_marquardt as lm
from .charts import Cartesian, chart_of
from .condensed import Condensed, lines, means, unchanged
from .pseudolinear import Equations, Places
from .scenario import Scenario
from .status import NOT_FINITE
from .types import FloatArray
from .uniform import PLANE, moving_pairs, propagate

ROUNDS = 2  # of the equations
RANGES = np.geomspace(200.0, 120e3, 16)  # metres, at the first bearing
MIDDLE_RANGE = 20e3
WEAK = 0.15  # relative standard deviation of a range that the equations do not tell
SUSPICIOUS = 4.0  # standard deviations by which a criterion exceeds its freedom
SUBSONIC = 0.95  # share of the slowest sound
TOLERANCE = 0.3  # of a fit of condensed bearings
FIRST_PASSES, PASSES = 10, 30  # of a fit; where the first takes longer, ranges are tried
FEW_PASSES, KEPT_RANGES = 6, 3  # from all ranges; those from which the fit goes on
BLOCK = 100  # runs whose ranges are tried at once


class _Prepared:
    """What does not depend on the bearings: a scenario made into fewer values, and into fewer still."""

    def __init__(self, scenario, make=lines, make_fewer=means):
        middle = (scenario.times.min() + scenario.times.max()) / 2
        self.fine = Condensed(scenario, make, middle)
        self.scenario = self.fine.scenario
        self.coarse = Condensed(self.scenario, make_fewer, middle)
        self.places = Places(self.coarse.scenario)
        self.chart, self.few_chart = chart_of(self.scenario), chart_of(self.coarse.scenario)
        self.plane = np.concatenate(moving_pairs(self.scenario.coordinates))
        freedom = max(1, len(self.scenario.times) - len(self.scenario.coordinates))
        self.most = freedom + SUSPICIOUS * np.sqrt(2 * freedom)  # of a criterion that explains the values

    def fit(self, values, start, passes=PASSES):
        """`Outcome` of a fit of values ``(runs, N')``."""
        return lm.minimise_in_blocks(self.scenario, values, start, self.chart, True, TOLERANCE, passes)

    def equations(self, values):
        """The pseudolinear equations of means of values ``(runs, N')``."""
        return Equations(self.places, self.coarse.of(values))

    def complete(self, plane):
        """States of the scenario from those of the equations."""
        return complete_state(self.scenario, plane, self.scenario.reference_time)

    def state_of(self, scenario, state):
        """States ``(runs, n)`` at the reference time of a scenario with these bearings, from those here."""
        whole = complete_state(scenario, state[:, self.plane], self.scenario.reference_time)
        for i, name in enumerate(self.scenario.coordinates):
            if name not in PLANE:
                whole[:, scenario.coordinates.index(name)] = state[:, i]
        return whole

    def back(self, scenario, state):
        """The inverse of `state_of` for a scenario of the same unknowns."""
        duration = self.scenario.reference_time - scenario.reference_time
        return propagate(state, duration, self.scenario.coordinates)

    def mach(self, state):
        """Speeds ``(runs,)`` as shares of that of the slowest sound by which the target is heard."""
        return np.hypot(*state[:, self.plane[2:]].T) / self.places.slowest_sound

    def settled(self, found):
        """Whether fits need no further attempt, ``(runs,)``."""
        return found.converged & (found.cost <= self.most) & (self.mach(found.state) < SUBSONIC)


_prepared = lru_cache(maxsize=16)(_Prepared)


def fit_without_start(scenario: Scenario, angles: FloatArray, *settings: Any) -> Any:
    """The `Outcome` of runs ``(runs, N)``, without any guess.

    Parameters
    ----------
    scenario : Scenario
        With a sensor that measures bearings.
    angles : ndarray, shape (runs, N)
    *settings
        Of the fit with all measurements: chart, safeguard, tolerance and most evaluations.

    Returns
    -------
    Outcome

    Raises
    ------
    ValueError
        Without bearings, or for a further unknown that no model has a guess of.
    """
    ready = _prepared(scenario)
    with np.errstate(invalid="ignore"):  # bearings that are not finite
        values = ready.fine.of(angles)
        start, doubtful = _from_equations(ready, values)
    if ready.fine.same:
        first = *settings[:3], min(settings[3], FIRST_PASSES)
        found = lm.minimise_in_blocks(scenario, angles, ready.state_of(scenario, start), *first)
    else:
        found = ready.fit(values, start, FIRST_PASSES)
    settled = ready.settled(found) & ~doubtful | (found.status == NOT_FINITE)
    tried = np.flatnonzero(~settled)
    if ready.fine.same:
        if len(tried):
            before = found.of(tried)
            before = before._replace(state=ready.back(scenario, before.state))
            start = ready.state_of(scenario, _search(scenario, ready, angles[tried], before).state)
            found.put(tried, _in_both_charts(scenario, angles[tried], start, settings))
        return found
    if len(tried):
        found.put(tried, _search(scenario, ready, angles[tried], found.of(tried)))
    return _in_both_charts(scenario, angles, ready.state_of(scenario, found.state), settings)


def _in_both_charts(scenario, angles, start, settings):
    """The fit with all measurements; one chart finds the way where the other does not."""
    found = lm.minimise_in_blocks(scenario, angles, start, *settings)
    lost = np.flatnonzero(~found.converged & (found.status != NOT_FINITE))
    if len(lost):
        settings = (chart_of(scenario, Cartesian), *settings[1:])
        again = lm.minimise_in_blocks(scenario, angles[lost], start[lost], *settings)
        found.put(lost[again.converged], again.of(again.converged))
    return found


def _search(scenario, ready, angles, found):
    """The outcome of the further attempts where they find a lower criterion, slower than sound."""
    values, every = ready.fine.of(angles), np.ones(len(angles), dtype=bool)
    _improve(_best_range, ready, values, found, every)
    _improve(_all_ranges, ready, values, found, ~ready.settled(found))
    runs = np.flatnonzero(~(found.cost <= ready.most))
    if len(runs) and not (ready.fine.same and ready.coarse.same):
        whole = _prepared(scenario, unchanged, unchanged)
        found.put(runs, _with_all(whole, angles[runs], found.state[runs]))
    found.state[:, ready.plane[2:]] /= np.maximum(1.0, ready.mach(found.state) / SUBSONIC)[:, None]
    return found


def _with_all(ready, angles, start):
    """The outcome of fits with all bearings, for those of a target that passes close are no lines."""
    values = ready.fine.of(angles)
    found = ready.fit(values, start)
    _improve(_equations, ready, values, found, ~(found.cost <= ready.most))
    _improve(_all_ranges, ready, values, found, ~found.converged)
    return found


def _improve(attempt, ready, values, found, which):
    """Put the outcome of an attempt, for some runs, where it finds a lower criterion."""
    runs = np.flatnonzero(which)
    for part in (runs[i : i + BLOCK] for i in range(0, len(runs), BLOCK)):
        other = attempt(ready, values[part])
        lower = other.cost < np.nan_to_num(found.cost[part], nan=np.inf)
        found.put(part[lower], other.of(lower))


def _from_equations(ready, values):
    """States ``(runs, n)`` from the equations, and whether these should tell the range but do not."""
    equations = ready.equations(values)
    plane, spread = equations.free(ROUNDS)
    weak = ~(spread < WEAK)
    held = np.flatnonzero(weak | ~ready.places.turns)
    if len(held):
        plane[held] = equations.held([MIDDLE_RANGE], held)[:, 0]
    return ready.complete(plane), weak & ready.places.turns


def _equations(ready, values):
    """Outcome of fits from the equations."""
    return ready.fit(values, _from_equations(ready, values)[0])


def _best_range(ready, values):
    """Outcome of fits from the held range, or solution, of the lowest criterion."""
    return ready.fit(values, _from_ranges(ready, values, kept=1, passes=1))


def _all_ranges(ready, values):
    """Outcome of the best of a few fits; a few steps from all ranges show where these should start."""
    start = _from_ranges(ready, values, KEPT_RANGES, FEW_PASSES)
    found = ready.fit(np.repeat(values, KEPT_RANGES, axis=0), start)
    return found.of(_lowest(found.cost, len(values), 1))


def _from_ranges(ready, values, kept, passes):
    """States ``(runs x kept, n)``, the lowest after some passes from the solution and each of `RANGES`."""
    equations, few = ready.equations(values), ready.coarse.of(values)
    plane = np.concatenate([equations.free(ROUNDS)[0][:, None], equations.held(RANGES)], axis=1)
    start, many = ready.complete(plane.reshape(-1, 4)), np.repeat(few, plane.shape[1], axis=0)
    settings = ready.few_chart, True, TOLERANCE, passes
    found = lm.minimise_in_blocks(ready.coarse.scenario, many, start, *settings)
    return found.state[_lowest(found.cost, len(values), kept)]


def _lowest(cost, runs, count):
    """Places of the lowest few criteria of each run, ``(runs x count,)``."""
    cost = cost.reshape(runs, -1)
    order = np.argsort(cost, axis=1, kind="stable")[:, :count]
    return (order + cost.shape[1] * np.arange(runs)[:, None]).ravel()


def starts_at_ranges(scenario: Scenario, angles: FloatArray) -> FloatArray:
    """States ``(S, n)`` of one run ``(N,)``, one for each of `RANGES` at the first bearing."""
    ready = _prepared(scenario)
    plane = ready.equations(ready.fine.of(angles[None])).held(RANGES)[0]
    return ready.state_of(scenario, ready.complete(plane))


def complete_state(scenario: Scenario, plane: FloatArray, time: float) -> FloatArray:
    """States ``(..., n)`` from ``(x, y, vx, vy)`` at a time; other unknowns as the models guess them."""
    names, duration = scenario.coordinates, scenario.reference_time - time
    if duration:
        plane = propagate(plane, duration)
    if names == PLANE:
        return plane
    guesses = scenario.offered("guess")
    missing = [name for name in names if name not in PLANE and name not in guesses]
    if missing:
        raise ValueError(f"a fit without a start needs a guess of {missing}; give a start")
    state = np.zeros((*plane.shape[:-1], len(names)))
    state[..., np.concatenate(moving_pairs(names))] = plane
    for name, value in guesses.items():
        state[..., names.index(name)] = value
    return state
