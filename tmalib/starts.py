"""A start without a guess: linear equations of condensed bearings; where these say little, ranges are tried.

*Condensed bearings.* Successive bearings of a sensor are replaced by two values of the straight line through
them, at the mean of their times plus and minus the standard deviation s of these: ``mean +- s slope``. For m
bearings of standard deviation sigma both have ``sigma sqrt(2 / m)`` and are not correlated, and a bearing
that changes as a parabola in time has the mean of its two values as its own mean. So a few dozen values tell
nearly all, and after a fit of them one or two steps with all the bearings are left.

*Linear equations.* A bearing theta from the platform at p, s seconds after the middle of the times, says of
the state ``(x, y, vx, vy)`` without approximation::

    cos theta (x + s vx - px) - sin theta (y + s vy - py) = 0.

With noise the right side is about ``r sigma``, so each equation is weighted with ``1 / (r sigma)``, the range
taken from the round before. For a delayed bearing s is less by the delay ``r / c``. A few rounds give a state
that needs no start at all; its bias is corrected by a fit of the condensed bearings.

*Held range.* Where the bearings tell the range only by a delay, or hardly at all, the equations are nearly
singular: they give the state up to a scale. Then the range at the first bearing is held at each of `RANGES`,
the equations are solved, and a few steps are taken with the condensed bearings from each solution. The lowest
few are fitted, in the other chart where they do not converge in the first, and the lowest criterion decides.
This is done for the runs whose first fit has not converged, does not explain the bearings, or is not slower
than sound. What is then not explained is fitted with all the bearings, and kept if this explains them.

The linear equations are those of the pseudolinear estimator of bearings-only tracking.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import levenberg_marquardt as lm
from .charts import Cartesian, ModifiedPolar, chart_of
from .scenario import Scenario
from .status import CONVERGED
from .uniform import PLANE, moving_pairs, propagate

GROUPS = range(30, 45)  # numbers of groups of a sensor's bearings, two values each
ROUNDS, HELD_ROUNDS = 2, 1  # with a held range and slow sound the delays of more rounds run away
RANGES = np.geomspace(200.0, 120e3, 16)  # metres, at the first bearing
FIRST_RANGE = 10e3
NEAREST, FARTHEST = 10.0, 1e6  # metres: between these the weights follow the range
HELD = 1e-3  # relative width of a held range
SUSPICIOUS = 4.0  # standard deviations by which a criterion exceeds its freedom
SUBSONIC = 0.95  # share of the slowest sound: of a fit
FASTEST = 0.8  # of a start, which must predict something
TOLERANCE, PASSES = 0.3, 30  # of a fit of condensed bearings
FIRST_PASSES = 12  # of the first one: where it takes longer, ranges are tried
FEW_PASSES, KEPT_RANGES = 6, 3  # from all ranges; those from which the fit goes on
BLOCK = 100  # runs whose ranges are tried at once


def condense(sensor, angles):
    """A sensor with two values for each group of successive bearings, and these values.

    ``angles`` is ``(runs, N)``; the values are ``(runs, 2 groups)``. A sensor with fewer than four bearings a
    group, or with a sigma for each bearing, stays as it is. All values share one standard deviation, so the
    number of groups is the one of `GROUPS` that divides the bearings best; groups differ by one bearing at
    most.
    """
    count, groups = len(sensor), min(GROUPS, key=lambda groups: len(sensor) % groups)
    if count < 4 * groups or np.ndim(sensor.sigma):
        return sensor, angles
    first = np.arange(groups) * count // groups
    size = np.diff(first, append=count)
    mean = np.add.reduceat(sensor.times, first) / size
    away = sensor.times - np.repeat(mean, size)
    spread = np.sqrt(np.add.reduceat(away**2, first) / size)
    spread[spread == 0] = 1.0  # bearings of one time have no slope: both values are their mean
    start = angles[:, first]  # the first of each group, so that no difference wraps
    offset = sensor.model.residual(angles, np.repeat(start, size, axis=1))
    middle = start + np.add.reduceat(offset, first, axis=1) / size
    tilt = np.add.reduceat(offset * away, first, axis=1) / (size * spread)
    times = np.stack([mean - spread, mean + spread], axis=-1).ravel()
    values = np.stack([middle - tilt, middle + tilt], axis=-1).reshape(len(angles), -1)
    return replace(sensor, times=times, sigma=sensor.sigma * np.sqrt(2 * groups / count)), values


def condensed_bearings(scenario, angles, condense=condense):
    """The scenario of condensed sensors of bearings, without a target, and the values ``(runs, N')``."""
    sensors, columns = [], []
    for block in scenario.blocks:
        if getattr(block.sensor.model, "is_bearing", False):
            sensor, values = condense(block.sensor, angles[:, block.columns])
            sensors.append(sensor)
            columns.append(values)
    if not sensors:
        names = [sensor.name for sensor in scenario.sensors]
        raise ValueError(
            f"a fit without a start needs a sensor that measures bearings, got {names}; give one"
        )
    fewer = Scenario(scenario.platform, sensors, scenario.reference_time)
    return fewer, np.concatenate(columns, axis=1)


class LinearEquations:
    """The equations of bearings ``(runs, N)``, for a state at the middle of the times."""

    def __init__(self, scenario, angles):
        self.middle = (scenario.times.min() + scenario.times.max()) / 2
        self.elapsed = scenario.times - self.middle
        self.first = int(np.argmin(scenario.times))
        places = np.concatenate([scenario.platform_of(s).position_at(s.times) for s in scenario.sensors])
        self.origin = places[self.first]
        self.away = np.ascontiguousarray((places - self.origin).T)
        self.sigma = scenario.sigma
        speeds = [getattr(s.model, "c", np.inf) for s in scenario.sensors]
        self.slowness = np.repeat(1 / np.array(speeds), [len(s) for s in scenario.sensors])
        self.across = np.stack([np.cos(angles), -np.sin(angles)], axis=1)
        self.right = self.across[:, 0] * self.away[0] + self.across[:, 1] * self.away[1]

    def solve(self, held=None):
        """States ``(runs, 4)`` at the middle of the times; for held ranges ``(runs,)`` if these are given."""
        distance = np.empty(self.right.shape)
        distance[:] = FIRST_RANGE if held is None else held[:, None]
        for _ in range(ROUNDS if held is None else HELD_ROUNDS):
            s = self.elapsed - distance * self.slowness
            weight = 1 / (self.sigma * distance)
            rows = np.empty((len(weight), 4, weight.shape[1]))
            np.multiply(self.across, weight[:, None], out=rows[:, :2])
            np.multiply(rows[:, :2], s[:, None], out=rows[:, 2:])
            matrix, slope = rows @ rows.mT, np.vecdot(rows, (self.right * weight)[:, None])
            if held is not None:
                self._hold(matrix, slope, s[:, self.first], held)
            state = _solve(matrix, slope)
            dx = state[:, :1] + s * state[:, 2:3] - self.away[0]
            dy = state[:, 1:2] + s * state[:, 3:] - self.away[1]
            distance = np.clip(np.sqrt(dx * dx + dy * dy), NEAREST, FARTHEST)
            distance = np.where(np.isfinite(distance), distance, FIRST_RANGE)
        state[:, :2] += self.origin
        mach = np.hypot(state[:, 2], state[:, 3]) * self.slowness.max()
        state[:, 2:] /= np.maximum(1.0, mach / FASTEST)[:, None]  # faster than sound predicts nothing
        return state

    def _hold(self, matrix, slope, s, held):
        """Add the equation of the range at the first bearing, which is where the platform is the origin."""
        cos, sin = self.across[:, 0, self.first], -self.across[:, 1, self.first]
        row = np.stack([sin, cos, s * sin, s * cos], axis=-1) / (HELD * held[:, None])
        matrix += row[:, :, None] * row[:, None, :]
        slope += row / HELD


def _solve(matrix, slope):
    """Solutions ``(runs, n)`` of normal equations, unknowns scaled; NaN where these are not finite."""
    n = slope.shape[-1]
    with np.errstate(all="ignore"):
        scale = 1 / np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
        scaled = matrix * (scale[:, :, None] * scale[:, None, :])
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
    fewer, values = condensed_bearings(scenario, angles)
    state, cost, explained = _fitted_from_equations(fewer, values)
    tried = ~(explained & (_mach(fewer, state) < SUBSONIC)) & np.isfinite(values).all(axis=1)
    runs = np.flatnonzero(tried)
    for part in (runs[i : i + BLOCK] for i in range(0, len(runs), BLOCK)):
        other, lower = _try_ranges(fewer, values[part])
        better = lower < cost[part]
        state[part[better]], cost[part[better]] = other[better], lower[better]
    left = np.flatnonzero(tried & (cost > _most(fewer)))
    if len(left) and len(fewer.times) < len(scenario.times):  # a target that passes close is no line
        every, values = condensed_bearings(scenario, angles[left], lambda *whole: whole)
        other, _, explained = _fitted_from_equations(every, values)
        state[left[explained]] = other[explained]
    speeds = moving_pairs(fewer.coordinates)[1]  # the last step may have passed the speed of sound
    state[:, speeds] /= np.maximum(1.0, _mach(fewer, state) / SUBSONIC)[:, None]
    if fewer.coordinates == scenario.coordinates:
        return state, tried
    plane = state[:, np.concatenate(moving_pairs(fewer.coordinates))]
    found = complete_state(scenario, plane, scenario.reference_time)
    for name in fewer.coordinates:
        found[:, scenario.coordinates.index(name)] = state[:, fewer.coordinates.index(name)]
    return found, tried


def _most(scenario):
    """The criterion above which a fit does not explain its bearings."""
    freedom = max(1, len(scenario.times) - len(scenario.coordinates))
    return freedom + SUSPICIOUS * np.sqrt(2 * freedom)


def _fitted_from_equations(scenario, values):
    """Fitted states ``(runs, n)``, their criteria, and whether they have converged and explain the values."""
    equations = LinearEquations(scenario, values)
    start = complete_state(scenario, equations.solve(), equations.middle)
    state, cost, converged = _fitted(scenario, values, start, ModifiedPolar, FIRST_PASSES)
    return state, cost, converged & (cost <= _most(scenario))


def _try_ranges(scenario, values):
    """Best states ``(runs, n)`` of fits from solutions with a held range, and their criteria.

    A few steps from all ranges show which few are worth a whole fit.
    """
    runs, many = len(values), np.repeat(values, len(RANGES), axis=0)
    equations = LinearEquations(scenario, many)
    start = complete_state(scenario, equations.solve(np.tile(RANGES, runs)), equations.middle)
    start, cost, _ = _fitted(scenario, many, start, ModifiedPolar, FEW_PASSES)
    order = np.argsort(cost.reshape(runs, -1), axis=1, kind="stable")[:, :KEPT_RANGES]
    kept = (order + len(RANGES) * np.arange(runs)[:, None]).ravel()
    state, cost, converged = _fitted(scenario, many[kept], start[kept], ModifiedPolar)
    left = np.flatnonzero(~converged)
    if len(left):
        other, lower, _ = _fitted(scenario, many[kept[left]], start[kept[left]], Cartesian)
        better = lower < cost[left]
        state[left[better]], cost[left[better]] = other[better], lower[better]
    best = np.argmin(cost.reshape(runs, -1), axis=1) + KEPT_RANGES * np.arange(runs)
    return state[best], cost[best]


def _fitted(scenario, values, start, chart, passes=PASSES):
    """Fitted states ``(runs, n)``, their criteria (infinite for none), and whether they have converged."""
    settings = (chart_of(scenario, chart), True, TOLERANCE, passes)
    state, status, _, cost, _ = lm.minimise_in_blocks(scenario, values, start, *settings)
    return state, np.where(np.isfinite(cost), cost, np.inf), status == CONVERGED


def _mach(scenario, state):
    """Speeds ``(runs,)`` as shares of that of the slowest sound by which the target is heard."""
    speed = np.hypot(*state[:, moving_pairs(scenario.coordinates)[1]].T)
    return speed / min(getattr(sensor.model, "c", np.inf) for sensor in scenario.sensors)


def starts_at_ranges(scenario, angles):
    """States ``(S, n)`` of one run of bearings ``(N,)``, one for each of `RANGES` at the first bearing."""
    fewer, values = condensed_bearings(scenario, angles[None])
    equations = LinearEquations(fewer, np.repeat(values, len(RANGES), axis=0))
    return complete_state(scenario, equations.solve(RANGES), equations.middle)
