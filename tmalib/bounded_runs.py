"""Runs with the same gaps: what is kept of their measurements, and the fit to it; behind `tmalib.bounded`.

*Looking again.* A fit starts from the state before. Where it does not converge, or leaves a criterion that
exceeds its freedom by more than `SUSPICIOUS` standard deviations, a fit without a start is made as well, and
the lower one is kept: a run that went astray is found again. Time and memory of a call are bounded.

Where more measurements come at once than there is room for, they are taken in by pieces, with a fit to each,
for residuals to be taken from a fresh estimate. Runs that have none are looked at again after 1, 2, 4, 8 ...
pieces, and after the last.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from . import status as words
from .batch import fit
from .cosine_starts import has_cosines
from .remembered import condense, merge, next_piece
from .scenario import Scenario
from .types import BoolArray, FloatArray, IntArray, TextArray
from .uniform import moving_pairs, propagate, transition

PASSES = 30  # evaluations of the model in a fit, at most
SUSPICIOUS = 4.0  # standard deviations by which a criterion exceeds its freedom
SHARP = 0.1  # share of the range up to which its sigma makes a good estimate


class RunsAlike(NamedTuple):
    """Runs with the same gaps: their values ``(runs, K)`` as measurements of a scenario, and an estimate.

    ``state``, of ``names`` at ``time``, is where the next fit starts: the last that converged, or the first
    guess; NaN without one. ``end`` is where the last fit ended, whatever it said.
    ``pieces`` counts how often measurements were taken in.
    """

    runs: IntArray
    scenario: Scenario | None
    values: FloatArray
    pieces: int
    time: float
    names: tuple[str, ...]
    state: FloatArray
    end: FloatArray
    covariance: FloatArray
    status: TextArray

    def of(self, rows: Any) -> RunsAlike:
        """The part of some of its runs."""
        per_run = ("runs", "values", "state", "end", "covariance", "status")
        return self._replace(**{name: getattr(self, name)[rows] for name in per_run})


def can_start(scenario: Scenario) -> bool:
    """Whether a fit can begin without a start."""
    bearings = (getattr(sensor.model, "is_bearing", False) for sensor in scenario.sensors)
    return any(bearings) or has_cosines(scenario)


def with_same_gaps(parts: Sequence[RunsAlike], rows: FloatArray) -> Iterator[tuple[RunsAlike, BoolArray]]:
    """Parts with the same gaps in new measurements ``(runs, N)``, and the mask of what is there, ``(N,)``."""
    for part in parts:
        there = ~np.isnan(rows[part.runs])
        if not len(there):
            yield part, np.ones(rows.shape[1], dtype=bool)
        patterns, of = np.unique(there, axis=0, return_inverse=True)
        for k, there in enumerate(patterns):
            yield (part if len(patterns) == 1 else part.of(of.ravel() == k)), there


def take_in(part: RunsAlike, scenario: Scenario, measured: FloatArray, most: int) -> RunsAlike:
    """Runs with further measurements ``(runs, N)``, none missing, as many at a time as there is room for."""
    left = np.ones(len(scenario.times), dtype=bool)
    while True:
        kept, values = part.scenario, part.values
        if kept is not None:
            kept, values = condense(kept, values, part.end, _well_known(part), most)
        piece = next_piece(scenario, left, kept, most)
        kept, values = merge(kept, values, scenario.keep(piece), measured[:, piece])
        left &= ~piece
        pieces, last = part.pieces + 1, not left.any()
        part = _at(part, kept)._replace(scenario=kept, values=values, pieces=pieces)
        part = _fitted(part, look=last or not pieces & (pieces - 1))
        if last:
            return part


def _well_known(part):
    """Which estimates tell the range, ``(runs,)``: those from which residuals are taken."""
    places = moving_pairs(part.names)[0]
    away = part.state[:, places] - part.scenario.platform.position_at(part.time)
    variance = np.trace(part.covariance[:, places[:, None], places], axis1=1, axis2=2)
    return (part.status == words.CONVERGED) & (np.sqrt(variance) < SHARP * np.hypot(*away.T))


def _at(part, scenario):
    """The part with its states at the scenario's reference time, in its coordinates."""
    time, names = scenario.reference_time, scenario.coordinates
    state, end = (propagate(x, time - part.time, part.names) for x in (part.state, part.end))
    if names != part.names:
        state, end = (_in(names, x, part.names, scenario.offered("guess")) for x in (state, end))
    return part._replace(time=time, names=names, state=state, end=end)


def _in(names, state, old, guess):
    """States in other coordinates; what is new as the models guess it, or NaN."""
    values = guess | dict(zip(old, state.T, strict=True))
    return np.stack([np.broadcast_to(values.get(name, np.nan), len(state)) for name in names], axis=1)


def _fitted(part, look):
    """The part with a new estimate; where that is doubtful, from another look without a start."""
    scenario, values = part.scenario, part.values
    found = fit(scenario, values, part.state, max_iterations=PASSES)
    state, status = found.state.copy(), found.status.copy()
    status[~np.isfinite(part.state).all(axis=1)] = words.NOT_OBSERVABLE
    covariance = found.covariance.copy()
    cost = np.where(found.converged, found.cost, np.inf)
    freedom = max(1, values.shape[1] - len(part.names))
    doubtful = np.flatnonzero(~(cost <= freedom + SUSPICIOUS * np.sqrt(2 * freedom)))
    if look and len(doubtful) and can_start(scenario):
        other = fit(scenario, values[doubtful], max_iterations=PASSES)
        better = np.where(other.converged, other.cost, np.inf) < cost[doubtful]
        better |= ~found.converged[doubtful]
        rows = doubtful[better]
        state[rows], status[rows] = other.state[better], other.status[better]
        covariance[rows] = other.covariance[better]
    converged, ended = (status == words.CONVERGED)[:, None], np.isfinite(state).all(axis=1)[:, None]
    kept = np.where(converged, state, part.state)
    return part._replace(
        state=kept, end=np.where(ended, state, part.end), covariance=covariance, status=status
    )


def together(
    parts: Sequence[RunsAlike], shape: tuple[int, ...], names: tuple[str, ...], time: float
) -> tuple[FloatArray, FloatArray, TextArray]:
    """State, covariance and status of all runs at a time; NaN where there is no estimate."""
    runs, n = sum(len(part.runs) for part in parts), len(names)
    state, covariance = np.full((runs, n), np.nan), np.full((runs, n, n), np.nan)
    status = np.full(runs, words.NOT_OBSERVABLE, dtype=f"<U{words.WIDTH}")
    for part in parts:
        if part.names != names:
            continue  # nothing was measured that tells the others
        phi = transition(time - part.time, names)
        there = part.runs[part.status == words.CONVERGED]
        of = part.of(part.status == words.CONVERGED)
        state[there], covariance[there] = (
            propagate(of.state, time - of.time, names),
            phi @ of.covariance @ phi.T,
        )
        status[part.runs] = part.status
    return state.reshape(*shape, n), covariance.reshape(*shape, n, n), status.reshape(shape)[()]
