"""Where a criterion stays below a limit: the pieces of a region of positions, in polar coordinates.

The position is bearing and range about the platform at the reference time. The range is held at each of a
grid, the rest is fitted from eight bearings; where the criterion is lowest along the grid, all is fitted.
Whatever is below the limit is a *seed*. From the lowest seed the range grows and shrinks until the criterion
exceeds the limit: these are the limits of a *piece*. At some ranges between them the bearing goes left and
right until the criterion exceeds the limit: these are the sides of its boundary. Seeds inside the piece are
done with; from the lowest of the others the next piece starts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .bearings import wrap
from .charts import ModifiedPolar
from .motion import unit
from .profile import Held, criterion_at, lowest_of, starts_at
from .scenario import Scenario
from .types import BoolArray, FloatArray

FARTHEST, STEP = 1e6, 1.12  # metres; of the grid of ranges, a factor
BEARINGS = 8  # from which the rest is fitted
ROWS = 41  # ranges of a piece at which its sides are found, besides those of its seeds
HALVINGS = 20  # of a step of the range: to 1e-7
FIRST_ANGLE, GROWTH, ANGLE_HALVINGS = 1e-5, 4.0, 9  # radians; then a straight line between the last two
ANGLE_STEPS = ANGLE_HALVINGS + int(np.ceil(np.log(np.pi / FIRST_ANGLE) / np.log(GROWTH))) + 1


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of a region.

    Attributes
    ----------
    range : ndarray, shape (R,)
        Distances from the platform in metres, increasing.
    left, right : ndarray, shape (R,)
        Bearings of its sides at these ranges, in radians, not wrapped.
    cost : ndarray, shape (R,)
        Lowest criterion at each range.
    state : ndarray, shape (3 R, n)
        Fitted states: with that criterion, left and right.
    """

    range: FloatArray
    left: FloatArray
    right: FloatArray
    cost: FloatArray
    state: FloatArray

    def sides_at(self, distance: FloatArray) -> list[FloatArray]:
        """Bearings ``(...)`` of the two sides at some distances; NaN beyond the piece's limits."""
        within = (distance >= self.range[0] * (1 - 1e-6)) & (distance <= self.range[-1] * (1 + 1e-6))
        log = np.log(self.range)
        sides = (np.interp(np.log(distance), log, side) for side in (self.left, self.right))
        return [np.where(within, side, np.nan) for side in sides]

    def holds(self, theta: FloatArray, distance: FloatArray) -> BoolArray:
        """Whether positions, given as bearings and distances, are between the sides."""
        left, right = self.sides_at(distance)
        return np.abs(wrap(theta - (left + right) / 2)) <= (right - left) / 2 + 1e-9

    def boundary(self, origin: FloatArray) -> FloatArray:
        """The closed line, ``(2 R + 1, 2)``: out along the right side and back along the left."""
        out, back = (origin + self.range[:, None] * unit(side) for side in (self.right, self.left))
        return np.concatenate([out, back[::-1], out[:1]])


def area_of(pieces: Sequence[Piece]) -> float:
    """Area of the union of pieces in square metres: the integral of width times range, by trapezoids."""
    beyond = [piece.range[[0, -1]] * [1 - 2e-6, 1 + 2e-6] for piece in pieces]  # where it has no sides
    distance = np.unique(np.concatenate([*(piece.range for piece in pieces), *beyond]))
    left, right = np.swapaxes([piece.sides_at(distance) for piece in pieces], 0, 1)
    whole_turns = (left + right) / 2 - wrap((left + right) / 2)
    order = np.argsort(left - whole_turns, axis=0)
    left, right = (np.take_along_axis(side - whole_turns, order, axis=0) for side in (left, right))
    left, right = np.nan_to_num(left, nan=np.inf), np.nan_to_num(right, nan=-np.inf)
    before = np.maximum.accumulate(np.pad(right, ((1, 0), (0, 0)), constant_values=-np.inf), axis=0)[:-1]
    width = np.sum(np.maximum(0.0, right - np.maximum(left, before)), axis=0)
    return float(np.trapezoid(width * distance, distance))


@dataclass(frozen=True, eq=False)
class PolarSearch:
    """The criterion of one run, ``measured (N,)``, over the positions from a distance ``nearest`` on.

    ``chart`` is `ModifiedPolar`, in which the range can be held.
    """

    scenario: Scenario
    measured: FloatArray
    chart: ModifiedPolar
    nearest: float

    def polar(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bearings and distances ``(...)`` of states ``(..., n)``."""
        dx, dy = np.moveaxis(state[..., self.chart.places[:2]] - self.chart.origin, -1, 0)
        return np.arctan2(dx, dy), np.hypot(dx, dy)

    def position(self, theta: ArrayLike, distance: ArrayLike) -> FloatArray:
        """Positions ``(..., 2)`` of bearings and distances."""
        return self.chart.origin + np.asarray(distance)[..., None] * unit(theta)

    def fitted(self, starts: FloatArray, held: bool = True) -> tuple[FloatArray, FloatArray]:
        """States and criteria from starts ``(S, M, n)``, with the range held or not."""
        many = np.broadcast_to(self.measured, (starts.shape[1], len(self.measured)))
        chart = Held(self.chart, (self.chart.places[1],)) if held else self.chart
        return lowest_of(self.scenario, many, starts, chart)

    def at_range(self, state: FloatArray, distance: FloatArray) -> tuple[FloatArray, FloatArray]:
        """States and criteria with the range held, from states ``(M, n)`` at other ranges."""
        return self.fitted(starts_at(self.scenario, state, self.position(self.polar(state)[0], distance)))

    def seeds(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """States and criteria along the grid, and at the minima near to its lowest ones and to a state."""
        steps = int(np.ceil(np.log(FARTHEST / self.nearest) / np.log(STEP)))
        grid = np.geomspace(self.nearest, FARTHEST, steps + 1)
        around = self.polar(state)[0] + 2 * np.pi * np.arange(BEARINGS) / BEARINGS
        theta, distance = (part.ravel() for part in np.meshgrid(around, grid))
        place = self.position(theta, distance)
        found, cost = self.fitted(starts_at(self.scenario, np.tile(state, (len(theta), 1)), place))
        table = np.pad(cost.reshape(-1, BEARINGS), ((1, 1), (0, 0)), constant_values=np.inf)
        low = np.isfinite(table[1:-1]) & (table[1:-1] <= np.minimum(table[:-2], table[2:]))
        free, lower = self.fitted(np.concatenate([found[low.ravel()], state[None]])[None], held=False)
        away = self.polar(free)[1]
        lower = np.where((away >= self.nearest) & (away <= FARTHEST), lower, np.inf)
        return np.concatenate([found, free]), np.concatenate([cost, lower])

    def pieces(self, seeds: FloatArray, cost: FloatArray, limit: float) -> list[Piece]:
        """Each `Piece` with a criterion up to a limit, from the lowest seed on."""
        seeds, cost, found = seeds[cost <= limit], cost[cost <= limit], []
        while len(seeds):
            lowest = np.argmin(cost)
            found.append(self._piece(seeds[lowest], self.polar(seeds)[1], limit))
            left = ~found[-1].holds(*self.polar(seeds))
            left[lowest] = False
            seeds, cost = seeds[left], cost[left]
        return found

    def _piece(self, seed, wanted, limit):
        """The piece around a seed, with rows at those of the ranges ``wanted`` that it has."""
        down, near = self._until_outside(seed, 1 / STEP, limit)
        up, far = self._until_outside(seed, STEP, limit)
        along = np.concatenate([down[::-1], up[1:]])
        rows = near * (far / near) ** ((1 - np.cos(np.linspace(0, np.pi, ROWS))) / 2)
        wanted = np.exp(np.unique(np.log(wanted[(wanted > near) & (wanted < far)]).round(6)))
        rows = np.clip(np.unique([*rows, near, far, *wanted]), near, far)
        closest = np.argmin(np.abs(np.log(rows[:, None] / self.polar(along)[1])), axis=1)
        state, cost = self.at_range(along[closest], rows)
        middle = np.unwrap(self.polar(state)[0])
        left, on_left = self._side(state, cost, middle, rows, -1, limit)
        right, on_right = self._side(state, cost, middle, rows, 1, limit)
        return Piece(rows, middle - left, middle + right, cost, np.concatenate([state, on_left, on_right]))

    def _until_outside(self, seed, factor, limit):
        """States at ranges that grow by a factor from the seed's while inside, and the limit of the range."""
        state, inside = seed[None], float(self.polar(seed)[1])
        states, end = [seed], FARTHEST if factor > 1 else self.nearest
        while inside != end:
            outside = float(np.clip(inside * factor, self.nearest, FARTHEST))
            there, cost = self.at_range(state, np.array([outside]))
            if not cost[0] <= limit:
                break
            state, inside = there, outside
            states.append(state[0])
        else:
            return np.array(states), end
        for _ in range(HALVINGS):
            middle = np.sqrt(inside * outside)
            there, cost = self.at_range(state, np.array([middle]))
            if cost[0] <= limit:
                state, inside = there, middle
            else:
                outside = middle
        return np.array(states), inside

    def _side(self, state, cost, theta, distance, side, limit):
        """How far the bearing can go to one side at each range, ``(R,)``, and the states ``(R, n)`` there."""
        inside, outside = np.zeros(len(theta)), np.full(len(theta), np.inf)
        within, beyond = cost, np.full(len(theta), np.inf)
        for _ in range(ANGLE_STEPS):
            grown = np.clip(GROWTH * inside, FIRST_ANGLE, np.pi)
            step = np.where(np.isfinite(outside), (inside + outside) / 2, grown)
            place = self.position(theta + side * step, distance)
            there, found = criterion_at(self.scenario, self.measured, state, place, near=True)
            good = found <= limit
            state = np.where(good[:, None], there, state)
            inside, within = np.where(good, step, inside), np.where(good, found, within)
            outside, beyond = np.where(good, outside, step), np.where(good, beyond, found)
        with np.errstate(invalid="ignore"):  # inside to the opposite bearing, or nothing is predicted beyond
            share = np.clip((limit - within) / (beyond - within), 0.0, 1.0)
            between = inside + share * (outside - inside)
        return np.where(np.isfinite(between), between, inside), state
