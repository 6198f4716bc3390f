"""`emw-acoustic`: from where a fit reaches the lowest minimum that is known, and what it costs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...batch import along_first_bearing, fit
from ...bearings import Bearing, propagation_delay
from ...motion import Target, unit

SAME = 0.1**2  # of a criterion: within a tenth of a standard deviation of the minimum


def lost(*fits):
    """Which runs each of some fits loses: it has not converged where another has, or converged above it.

    Parameters
    ----------
    *fits : Fit
        Of the same runs; their shapes broadcast.

    Returns
    -------
    ndarray of bool, shape (fits, ...)
        A run that no fit brings to a minimum is lost by none.
    """
    criteria = np.stack(np.broadcast_arrays(*(np.where(f.converged, f.cost, np.inf) for f in fits)))
    return criteria > criteria.min(axis=0) + SAME


def lost_from(scenario, angles, guesses, truth, **way):
    """The fits from some guesses, and which of them are lost beside a fit from the truth.

    ``way`` is given to `tmalib.fit`.
    """
    fits = fit(scenario, angles, guesses, **way)
    return fits, lost(fits, fit(scenario, angles, truth))[0]


def lost_from_ranges(scenario, angles, ranges, truth, **way):
    """`lost_from` of starts at rest along the first bearing, a leading axis for the ranges in metres."""
    guesses = np.stack([along_first_bearing(scenario, angles, distance) for distance in ranges])
    return lost_from(scenario, angles, guesses, truth, **way)


def random_target(scenario, distance, speed, rng):
    """The scenario with a target in a random direction from the origin, on a random heading."""
    direction, heading = rng.uniform(0, 2 * np.pi, 2)
    return scenario.with_target(Target(distance * unit(direction), speed=speed, heading=heading))


def targets_on_a_grid(side, speed, rng):
    """States ``(S, S, 4)`` of targets at the points of a grid, first axis north, on random headings."""
    places = np.stack(np.meshgrid(side, side), axis=-1)
    return np.concatenate([places, speed * unit(rng.uniform(0, 2 * np.pi, places.shape[:-1]))], axis=-1)


def sightings(scenario, states, runs, rng):
    """Simulated measurements of many targets, ``(..., runs, N)``, from states ``(..., 4)``."""
    exact = scenario.linearise(states)[0][..., None, :]
    return exact + rng.normal(size=(*exact.shape[:-2], runs, exact.shape[-1])) * scenario.sigma


@dataclass(frozen=True)
class _Counted(Bearing):
    """A bearing that counts how many have been computed."""

    counts: list = field(default_factory=list, compare=False)

    def value_and_gradient(self, state, observer, elapsed):
        value, gradient = super().value_and_gradient(state, observer, elapsed)
        self.counts.append(value.size)
        return value, gradient


def evaluations(scenario, angles, start=None, **way):
    """Mean evaluations of the whole model in the fit of a run, with all that is tried to find a start.

    Parameters
    ----------
    scenario : Scenario
        Its sensors measure instantaneous bearings.
    angles, start, **way
        As in `tmalib.fit`.

    Returns
    -------
    float
        Bearings that were computed, over those that were measured. Pseudolinear equations compute none.
    """
    model = _Counted()
    sensors = [replace(sensor, model=model) for sensor in scenario.sensors]
    counted = replace(scenario, sensors=sensors, target=None)
    model.counts.clear()
    fit(counted, angles, start, **way)
    return sum(model.counts) / np.size(angles)


def off_the_line(scenario, sensor, c=np.inf):
    """What is left of the pseudolinear equation for the exact bearings of a sensor, ``(N,)``, metres.

    ``cos theta (x - px) - sin theta (y - py)``, the target where it was when the sound, of speed ``c``, left.
    """
    times = sensor.times
    here, target = scenario.platform.position_at(times), scenario.target
    exact = sensor.model.observe(target, scenario.platform, times)
    if np.isfinite(c):
        times = times - propagation_delay(target.position_at(times) - here, target.velocity, c)
    x, y = (target.position_at(times) - here).T
    return np.cos(exact) * x - np.sin(exact) * y
