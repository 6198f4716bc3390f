"""Recursive estimators on the six scenarios of the first paper: what `notebooks/beyond/filters` compares.

All start where the paper's filter does, at rest on the first bearing, with its prior or with an honest one;
but for the bank of filters, which has a prior for each range, and `tmalib.running_fit`, which needs none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from ..batch import fit
from ..bounded import running_fit
from ..bounds import crlb, nees
from ..charts import ModifiedPolar
from ..consistency import compare_with_truth, fit_over_time
from ..gaussian_filters import gaussian_filter, range_bank
from ..montecarlo import Stream
from ..papers.emw_acoustic import scenarios as emw
from ..priors import Prior, prior_along_first_bearing
from ..recursive import ekf
from ..scenario import Scenario
from ..sensors import Sensor
from ..types import BoolArray, FloatArray
from ..uniform import PLANE, propagate

NUMBERS = range(1, 7)
STREAM = Stream("beyond/filters")
INSTANTS = 16  # a scenario, from when the bound is below half the range
RANGE_SIGMA = np.sqrt(emw.PRIOR_VARIANCE[0])  # metres, as the paper has it
VELOCITY_SIGMA = 5 / np.sqrt(2)  # m/s, of each component: a speed of 5 m/s is an ordinary one
EDGES = np.geomspace(1e3, 60e3, 9)  # of the bank's intervals of range, metres
RANGES = 1e3 * np.array([1, 3, 30, 60])  # metres, of other starts
PRINTED, CORRECT, POLAR = "EKF, as printed", "EKF, correct", "EKF, modified polar"
ITERATED, SECOND, CUBATURE = "iterated EKF", "second-order EKF", "cubature"
BANK, BOUNDED, BATCH, MODE = "bank of ranges", "bounded memory", "batch", "mode of the posterior"
WITH_PRIOR = (PRINTED, CORRECT, POLAR, ITERATED, SECOND, CUBATURE)


def _updated_by(kind: str) -> Callable[..., Any]:
    return lambda now, angles, prior, times: gaussian_filter(now, angles, prior, times, update=kind)


FILTERS: dict[str, Callable[..., Any]] = {
    PRINTED: lambda now, angles, prior, times: ekf(emw.filter_scenario(now), angles, prior, times),
    CORRECT: ekf,
    POLAR: lambda now, angles, prior, times: ekf(now, angles, prior, times, chart=ModifiedPolar),
    ITERATED: _updated_by("iterated"),
    SECOND: _updated_by("second-order"),
    CUBATURE: _updated_by("cubature"),
    BANK: lambda now, angles, prior, times: range_bank(now, angles, EDGES, VELOCITY_SIGMA, times),
    BOUNDED: lambda now, angles, prior, times: running_fit(now, angles, times),
}


def range_at(number: int, time: float) -> float:
    """Distance of target and observer, in metres."""
    now = emw.scenario(number)
    return float(np.hypot(*(now.target.position_at(time) - now.platform.position_at(time))))


def bound_over_range(number: int, time: float) -> float:
    """Root of the position's bound at a time, over the range then."""
    then = emw.scenario(number).until(time)
    bound = crlb(then, then.state[None])[0]
    return float(np.sqrt(np.trace(bound[:2, :2])) / range_at(number, time))


@cache
def instants(number: int) -> tuple[float, ...]:
    """Times at which the estimators are compared: from when the bound is below half the range, to the end."""
    end = emw.scenario(number).reference_time
    early = np.arange(20.0, end, 20.0)
    first = next(time for time in early if bound_over_range(number, time) < 0.5)
    return tuple(np.linspace(first, end, INSTANTS).tolist())


def prior_of(
    number: int, angles: FloatArray, honest: bool = False, first_range: float | None = None
) -> Prior:
    """The paper's prior, from its starting range or another; or an honest one with the same range.

    The honest one knows what the first bearing tells, across it, and gives the velocity room for 5 m/s.
    """
    now = emw.scenario(number)
    start = emw.start(now, angles, number, first_range)
    if not honest:
        return emw.prior(start)
    distance = float(np.hypot(*start[0, :2]))  # the observer begins at the origin
    return prior_along_first_bearing(now, angles, distance, RANGE_SIGMA, VELOCITY_SIGMA)


def filters_over_time(
    seed: Any, runs: int, number: int, names: tuple[str, ...], honest: bool = False
) -> dict[str, FloatArray]:
    """Filters on the same bearings, at the `instants`.

    Returns
    -------
    dict
        For each name ``"<name>: error"`` ``(runs, T, 4)``, NaN where there is no estimate, ``"<name>: nees"``
        ``(runs, T)`` with the covariance that it claims, and ``"<name>: inside"`` ``(runs, T)``: whether the
        target is inside the ellipse of 90 per cent. The batch estimate has only the first; its fit starts at
        the true state.
    """
    now, times = emw.scenario(number), np.array(instants(number))
    angles = now.simulate(runs, seed)
    truth = np.stack([now.target.state(time) for time in times])
    prior, found = prior_of(number, angles, honest), {}
    for name in names:
        if name == BATCH:
            track = fit_over_time(now, angles, times, now.state)
        else:
            track = FILTERS[name](now, angles, prior, times)
            compared = compare_with_truth(now, track)
            found |= {f"{name}: nees": compared.nees, f"{name}: inside": compared.inside}
        found[f"{name}: error"] = track.state - truth
    return found


def filters_at_the_end(
    seed: Any, runs: int, number: int, names: tuple[str, ...], honest: bool, first_range: float | None = None
) -> dict[str, FloatArray]:
    """Errors ``{name: (runs, 4)}`` at the last time, of filters and of the `posterior_mode`, from a prior."""
    now = emw.scenario(number)
    angles, last = now.simulate(runs, seed), [now.reference_time]
    prior = prior_of(number, angles, honest, first_range)
    found = {name: FILTERS[name](now, angles, prior, last).state[:, 0] - now.state for name in names}
    if honest:  # the same prior before the first bearings, which are then measurements like all others
        variance = [RANGE_SIGMA**2, RANGE_SIGMA**2, VELOCITY_SIGMA**2, VELOCITY_SIGMA**2]
        prior = Prior(emw.start(now, angles, number, first_range), np.diag(variance), np.nextafter(0.0, -1.0))
    return found | {MODE: posterior_mode(now, angles, prior) - now.state}


def distances_by_memory(seed: Any, runs: int, number: int, sizes: tuple[int, ...]) -> dict[str, FloatArray]:
    """Squared distances of the bounded-memory and the batch estimate at the end, by size of the memory.

    Each ``(runs,)``, in the metric of the bound: as the NEES, whose mean is four.
    """
    now = emw.scenario(number)
    angles, bound = now.simulate(runs, seed), crlb(now)
    batch, found = fit(now, angles, now.state).state, {}
    for most in sizes:
        shift = running_fit(now, angles, most=most).state[:, 0] - batch
        found[str(most)] = nees(shift, np.zeros(4), bound)
    return found


# -- what is compared ---------------------------------------------------------------------------------


def lost(number: int, error: FloatArray, time: float) -> BoolArray:
    """Which runs have no estimate at a time, or one that is off by more than half the range, ``(runs,)``."""
    return ~(np.hypot(error[:, 0], error[:, 1]) < range_at(number, time) / 2)


def over_batch(error: FloatArray, batch: FloatArray, kept: BoolArray) -> FloatArray:
    """Root mean square errors ``(4,)`` over those of the batch estimate, of the same runs."""
    return np.sqrt(np.mean(error[kept] ** 2, axis=0) / np.mean(batch[kept] ** 2, axis=0))


def interval_over_batch(
    error: FloatArray, batch: FloatArray, kept: BoolArray, draws: int = 2000
) -> FloatArray:
    """Ends ``(2,)`` of a 95 % interval of the largest ratio of `over_batch`: a bootstrap of the runs."""
    worst = int(np.argmax(over_batch(error, batch, kept)))
    squares = np.stack([error[kept, worst] ** 2, batch[kept, worst] ** 2])
    runs = squares.shape[1]
    counts = np.random.default_rng(STREAM.chunk(1000)).multinomial(runs, np.full(runs, 1 / runs), size=draws)
    above, below = counts @ squares.T[:, 0], counts @ squares.T[:, 1]
    return np.quantile(np.sqrt(above / below), [0.025, 0.975])


# -- what the prior alone does ------------------------------------------------------------------------


class Component:
    """A direct measurement of a component of the state: one of them makes an independent part of a prior."""

    coordinates = PLANE

    def __init__(self, place: int) -> None:
        self.place = place

    def observer_state(self, platform: Any, times: FloatArray) -> FloatArray:
        return np.zeros((1, len(times)))

    def value_and_gradient(self, state: Any, observer: FloatArray, elapsed: FloatArray) -> Any:
        x, y, vx, vy = state
        value = (x + elapsed * vx, y + elapsed * vy, vx, vy)[self.place] + 0 * observer[0]
        gradient = np.zeros((4, *value.shape))
        gradient[self.place] = 1.0
        if self.place < 2:
            gradient[self.place + 2] = elapsed
        return value, gradient

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        return measured - predicted


def posterior_mode(now: Scenario, angles: FloatArray, prior: Prior) -> FloatArray:
    """The most probable states ``(runs, 4)``, given a prior of independent components and what follows.

    What a filter would give that linearises nothing for good.
    """
    later = now.times > prior.time
    sigma = np.sqrt(np.diagonal(prior.covariance))
    parts = [Sensor(Component(i), [prior.time], sigma[i], f"prior {i}") for i in range(4)]
    kept = now.keep(later)
    known = replace(kept, sensors=[*kept.sensors, *parts], target=None)
    mean = np.broadcast_to(prior.mean, (len(angles), 4))
    start = propagate(mean, now.reference_time - prior.time)
    measured = np.concatenate([angles[:, later], mean], axis=1)
    from_truth = fit(known, measured, now.state)
    from_prior = fit(known, measured, start)
    lower = np.where(from_prior.converged, from_prior.cost, np.inf) < from_truth.cost
    return np.where(lower[:, None], from_prior.state, from_truth.state)
