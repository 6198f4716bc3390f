"""A start without a guess: linear equations of averaged bearings; where these say little, ranges are tried.

*Linear equations.* A bearing theta from the platform at p, s seconds after the reference time, says of the
state ``(x, y, vx, vy)`` without approximation::

    cos theta (x + s vx - px) - sin theta (y + s vy - py) = 0.

With noise the right side is about ``r sigma``, so each equation is weighted with ``1 / (r sigma)``, the range
taken from the round before. For a delayed bearing s is less by the delay ``r / c``. A few rounds on averaged
bearings, some sixty a sensor, give a state that needs no start at all; its bias is corrected by a fit of the
averaged bearings.

*Held range.* Where the bearings tell the range only by a delay, or hardly at all, the equations are nearly
singular: they give the state up to a scale. Then the range at the first bearing is held at each of `RANGES`,
the equations are solved, each solution is fitted to the averaged bearings in both charts, for each is lost
where the other is not, and the lowest criterion decides. This is done for the runs whose first fit has not
converged, does not explain the bearings, or is not slower than sound.

The linear equations are those of the pseudolinear estimator of bearings-only tracking.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import levenberg_marquardt as lm
from .averaging import average_measurements
from .charts import Cartesian, ModifiedPolar
from .uniform import PLANE, moving_pairs, propagate

KEPT = 60  # bearings a sensor, after averaging
ROUNDS = 6
RANGES = np.geomspace(200.0, 120e3, 16)  # metres, at the first bearing
FIRST_RANGE = 10e3
NEAREST, FARTHEST = 10.0, 1e6  # metres: between these the weights follow the range
HELD = 1e-3  # relative width of a held range
SUSPICIOUS = 4.0  # standard deviations by which a criterion exceeds its freedom
SUBSONIC = 0.95
TOLERANCE, PASSES = 1e-2, 60  # of the fits of averaged bearings


def averaged_bearings(scenario, angles):
    """The sensors of bearings with about `KEPT` means each, and these, ``(runs, N')``."""
    sensors, columns = [], []
    for block in scenario.blocks:
        if getattr(block.sensor.model, "is_bearing", False):
            together = max(1, len(block.sensor) // KEPT)
            count = len(block.sensor) // together * together
            part = replace(scenario, sensors=[replace(block.sensor, times=block.sensor.times[:count])])
            fewer, means = average_measurements(
                part, angles[:, block.columns.start : block.columns.start + count], together
            )
            sensors += fewer.sensors
            columns.append(means)
    if not sensors:
        names = [sensor.name for sensor in scenario.sensors]
        raise ValueError(
            f"a fit without a start needs a sensor that measures bearings, got {names}; give one"
        )
    return replace(scenario, sensors=sensors, target=None), np.concatenate(columns, axis=1)


class LinearEquations:
    """The equations of averaged bearings ``(runs, N)``, for a state at the middle of the times."""

    def __init__(self, scenario, angles):
        self.middle = (scenario.times.min() + scenario.times.max()) / 2
        self.elapsed = scenario.times - self.middle
        places = [scenario.platform_of(s).position_at(s.times) for s in scenario.sensors]
        self.platform = np.concatenate(places)
        self.origin = self.platform[np.argmin(scenario.times)]
        self.first = int(np.argmin(scenario.times))
        self.sigma = scenario.sigma
        speeds = [getattr(s.model, "c", np.inf) for s in scenario.sensors]
        self.slowness = np.concatenate(
            [np.full(len(s), 1 / c) for s, c in zip(scenario.sensors, speeds, strict=True)]
        )
        self.sin, self.cos = np.sin(angles), np.cos(angles)

    def solve(self, held=None):
        """States ``(runs, 4)`` at the middle of the times, for a held range in metres if one is given."""
        distance = np.full(self.sin.shape, FIRST_RANGE if held is None else held)
        away = self.platform - self.origin
        for _ in range(ROUNDS):
            s = self.elapsed - distance * self.slowness
            rows = np.stack([self.cos, -self.sin, s * self.cos, -s * self.sin], axis=-1)
            right = self.cos * away[:, 0] - self.sin * away[:, 1]
            weight = 1 / (self.sigma * distance)
            rows, right = rows * weight[..., None], right * weight
            if held is not None:
                rows, right = self._with_held(rows, right, s, away, held)
            state = _least_squares(rows, right)
            gap = state[:, None, :2] + s[..., None] * state[:, None, 2:] - away
            distance = np.clip(np.hypot(gap[..., 0], gap[..., 1]), NEAREST, FARTHEST)
            distance = np.where(np.isfinite(distance), distance, FIRST_RANGE)
        state[:, :2] += self.origin
        return state

    def _with_held(self, rows, right, s, away, held):
        """The equations with that of the range at the first bearing."""
        k = self.first
        sin, cos, late = self.sin[:, k], self.cos[:, k], s[:, k]
        row = np.stack([sin, cos, late * sin, late * cos], axis=-1)
        weight = 1 / (HELD * held)
        own = (held + sin * away[k, 0] + cos * away[k, 1]) * weight
        rows = np.concatenate([rows, (row * weight)[:, None]], axis=1)
        return rows, np.concatenate([right, own[:, None]], axis=1)


def _least_squares(rows, right):
    """Least squares solutions ``(runs, n)`` of ``rows x = right``, columns scaled; NaN where singular."""
    with np.errstate(all="ignore"):
        matrix, slope = rows.mT @ rows, np.vecdot(rows.mT, right[:, None, :])
        scale = 1 / np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
        scaled = matrix * (scale[:, :, None] * scale[:, None, :])
        n = slope.shape[-1]
        bad = ~np.isfinite(scaled).all(axis=(1, 2))
        scaled[bad] = np.eye(n)
        scaled[:, np.arange(n), np.arange(n)] += 1e-12
        solution = scale * np.linalg.solve(scaled, (scale * slope)[..., None])[..., 0]
    solution[bad] = np.nan
    return solution


def complete_state(scenario, plane, time):
    """States ``(runs, n)`` from ``(x, y, vx, vy)`` at a time; other unknowns as the models guess them."""
    guesses = scenario.offered("guess")
    names = scenario.coordinates
    missing = [name for name in names if name not in PLANE and name not in guesses]
    if missing:
        raise ValueError(f"a fit without a start needs a guess of {missing}; give a start")
    state = np.zeros((len(plane), len(names)))
    state[:, np.concatenate(moving_pairs(names))] = propagate(plane, scenario.reference_time - time)
    for name, value in guesses.items():
        state[:, names.index(name)] = value
    return state


def find_start(scenario, angles):
    """A start for every run, without any guess.

    Parameters
    ----------
    scenario : Scenario
        With a sensor that measures bearings.
    angles : ndarray, shape (runs, N)

    Returns
    -------
    start : ndarray, shape (runs, n)
        NaN for a run whose bearings are not finite.
    tried : ndarray of bool, shape (runs,)
        Whether ranges had to be tried.

    Raises
    ------
    ValueError
        Without bearings, or for a further unknown that no model has a guess of.
    """
    fewer, means = averaged_bearings(scenario, angles)
    equations = LinearEquations(fewer, means)
    start = complete_state(fewer, equations.solve(), equations.middle)
    state, cost = _fitted(fewer, means, start, ModifiedPolar)
    freedom = max(1, means.shape[1] - len(fewer.coordinates))
    explained = cost <= freedom + SUSPICIOUS * np.sqrt(2 * freedom)
    tried = ~(explained & _slower_than_sound(fewer, state)) & np.isfinite(means).all(axis=1)
    runs = np.flatnonzero(tried)
    if len(runs):
        equations = LinearEquations(fewer, means[runs])
        for held in RANGES:
            start = complete_state(fewer, equations.solve(held), equations.middle)
            for chart in (ModifiedPolar, Cartesian):
                other, lower = _fitted(fewer, means[runs], start, chart)
                better = lower < cost[runs]
                state[runs[better]], cost[runs[better]] = other[better], lower[better]
    plane = state[:, np.concatenate(moving_pairs(fewer.coordinates))]
    found = complete_state(scenario, plane, scenario.reference_time)
    common = [name for name in fewer.coordinates if name in scenario.coordinates]
    for name in common:
        found[:, scenario.coordinates.index(name)] = state[:, fewer.coordinates.index(name)]
    return found, tried


def _fitted(scenario, angles, start, chart):
    """Fitted states ``(runs, n)`` and their criteria, infinite for a run that has not converged."""
    nearest = scenario.times[np.argmin(np.abs(scenario.times - scenario.reference_time))]
    made = chart(scenario.platform.position_at(nearest), scenario.coordinates)
    state, converged, _, _, cost = lm.minimise_in_blocks(
        scenario, angles, start, made, True, TOLERANCE, PASSES
    )
    return state, np.where(converged & np.isfinite(cost), cost, np.inf)


def _slower_than_sound(scenario, state):
    """Whether the target is slower than the slowest sound by which it is heard."""
    speed = np.hypot(*state[:, moving_pairs(scenario.coordinates)[1]].T)
    return speed < SUBSONIC * min(getattr(sensor.model, "c", np.inf) for sensor in scenario.sensors)
