"""How small the area could be at best: a floor under all courses, by relaxation and dynamic programming.

Let ``F_c`` be the information of course c, C the rows of the position, and ``area(F)`` that of the ellipse of
``C F^-1 C'``. For any positive definite ``F_0``, with ``L = F_0^-1 C' (C F_0^-1 C')^-1`` and
``S_0 = (C F_0^-1 C')^-1``::

    (C F^-1 C')^-1 <= L' F L           (L is one of the matrices with C L = 1, of which the left is the least)
    det(S_0^-1 L' F L)^(1/2) <= trace(S_0^-1 L' F L) / 2 = trace(G F) / 2,    G = L S_0^-1 L',

by the inequality of the means. So ``area(F_c) >= area(F_0) 2 / max_c trace(G F_c)``: a floor for all courses
at once. The trace is a sum over the measurements, ``sum_k g_k' G g_k``, and its maximum over courses a
problem of dynamic programming in place, heading and time. The best ``F_0`` is an average of the informations
of several courses, as if several platforms shared the measurements; they are found one by one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import objectives
from ..motion import Course, Leg

WEIGHT_STEPS = 400
SMALL = 1e-4  # weights below this are dropped


def slope(information, keep):
    """``G`` and the logarithm of the area of an information ``(n, n)``; ``keep``: the places of x and y."""
    length = np.sqrt(np.diag(information))
    inverse = np.linalg.inv(information / np.outer(length, length))
    corner = inverse[np.ix_(keep, keep)]
    root = inverse[:, keep]
    g = root @ np.linalg.solve(corner, root.T) / np.outer(length, length)
    log = 0.5 * np.linalg.slogdet(corner / np.outer(length[keep], length[keep]))[1]
    return g, log + np.log(np.pi * 2 * np.log(10))  # of 90 per cent


@dataclass(frozen=True, eq=False)
class Floor:
    """A floor of the area over all courses, and the mixture of courses that it comes from.

    Attributes
    ----------
    area : float
        In square metres.
    excess : float
        ``max_c trace(G F_c) / 2``, 1 for the best mixture.
    mixture : float
        The mixture's own area.
    courses, weights : list of Course, ndarray
    """

    area: float
    excess: float
    mixture: float
    courses: list
    weights: np.ndarray


class Here:
    """A motion that is at given places ``(M, 2)`` with given headings at M equal times: nodes of a grid."""

    def __init__(self, places, headings):
        self.places, self.headings = places, headings

    def position_at(self, t):
        return self.places

    def heading_at(self, t):
        return self.headings


class Grid:
    """Courses on a grid: one sensor, constant speed, turn rates of -1, 0, 1 of the limit.

    Parameters
    ----------
    scenario : Scenario
        With one sensor whose measurements are equally spaced; the platform says where the course begins.
    speed, turn_rate : float
        In m/s and rad/s.
    headings : int
        Of the grid; a stage lasts as long as the platform needs from one to the next.
    cell : float
        In metres.
    """

    def __init__(self, scenario, speed, turn_rate, headings=54, cell=250.0):
        (block,), (sensor,) = scenario.blocks, scenario.sensors
        begin, end = sensor.times[[0, -1]]
        self.scenario, self.speed, self.turn_rate = scenario, speed, turn_rate
        self.stage = 2 * np.pi / headings / turn_rate
        self.stages = round((end - begin) / self.stage)
        assert abs(self.stages * self.stage - (end - begin)) < 1e-6 * end, "stages must fill the time"
        self.cell, self.half = cell, int(np.ceil(speed * (end - begin) / cell))
        start = scenario.platform.position_at(begin)
        first = float(scenario.platform.heading_at(begin))
        axis = cell * np.arange(-self.half, self.half + 1)
        self.heading = first + 2 * np.pi * np.arange(headings) / headings
        shape = (headings, len(axis), len(axis))
        h, x, y = np.meshgrid(self.heading, start[0] + axis, start[1] + axis, indexing="ij")
        here = Here(np.column_stack([x.ravel(), y.ravel()]), h.ravel())
        count = (len(sensor) - 1) / self.stages  # measurements a stage
        self.gradient = []  # one (n, headings, x, y) a node in time
        state = np.broadcast_to(scenario.state[:, None], (len(scenario.coordinates), h.size))
        for k in range(self.stages + 1):
            time = np.full(h.size, begin + k * self.stage)
            observer = sensor.model.observer_state(here, time)
            gradient = block.predict(state, observer, time - scenario.reference_time)[1]
            weight = (count + 1) / 2 if k in (0, self.stages) else count
            scaled = gradient * np.sqrt(weight) / scenario.sigma[0]
            self.gradient.append(scaled.reshape(-1, *shape).astype(np.float32))

    def steps(self, side):
        """Displacements in cells for a turn rate of ``side`` times the limit, ``(2, headings)``."""
        half = side * self.turn_rate * self.stage / 2
        length = self.speed * self.stage * np.sinc(half / np.pi) / self.cell
        return length * np.stack([np.sin(self.heading + half), np.cos(self.heading + half)])

    def best(self, g):
        """The largest ``sum_k g_k' G g_k`` over courses from the start, and a course that comes near."""
        values, vectors = np.linalg.eigh(g)
        root = (vectors * np.sqrt(np.maximum(values, 0.0)))[:, -2:].astype(np.float32)  # G has rank two
        steps, ahead, choices = [self.steps(side) for side in (-1, 0, 1)], None, []
        for gradient in self.gradient[::-1]:
            gain = np.square(np.tensordot(root, gradient, (0, 0)), dtype=float).sum(axis=0)
            if ahead is not None:
                ways = np.stack([_moved(np.roll(ahead, -side, 0), steps[side + 1]) for side in (-1, 0, 1)])
                choices.append(ways.argmax(axis=0).astype(np.int8) - 1)
                gain += ways.max(axis=0)
            ahead = gain
        return float(ahead[0, self.half, self.half]), self._follow(choices[::-1], steps)

    def _follow(self, choices, steps):
        place, heading, legs = np.zeros(2), 0, []
        for choice in choices:
            i, j = np.clip(np.rint(place).astype(int) + self.half, 0, 2 * self.half)
            side = int(choice[heading, i, j])
            legs.append(Leg(self.stage, side * self.turn_rate))
            place = place + steps[side + 1][:, heading]
            heading = (heading + side) % len(self.heading)
        begin = self.scenario.times[0]
        start = self.scenario.platform.position_at(begin)
        return Course(start, self.speed, self.heading[0], legs, begin)


def _moved(values, step):
    """Values ``(headings, x, y)`` at places moved by ``step`` ``(2, headings)``: a parabola through three."""
    for axis, f in zip((1, 2), step[:, :, None, None], strict=True):
        padded = np.pad(
            values, [(1, 1) if k == axis else (0, 0) for k in range(3)], mode="reflect", reflect_type="odd"
        )
        before, here, after = (np.take(padded, range(k, k + values.shape[axis]), axis=axis) for k in range(3))
        values = f * (f - 1) / 2 * before + (1 - f * f) * here + f * (f + 1) / 2 * after
    return values


def informations(scenario, courses):
    """Fisher information of each course at the true state, ``(B, n, n)``."""
    found = []

    def keep(jacobian):
        found.append(jacobian.mT @ jacobian)
        return np.ones(jacobian.shape[:-2])

    objectives.objective_of_courses(scenario, courses, keep)
    return found[0][:, 0]


def weigh(informations_, weights, keep):
    """Weights of the mixture of informations with the smallest area, by multiplication."""
    for _ in range(WEIGHT_STEPS):
        g, _ = slope(np.tensordot(weights, informations_, 1), keep)
        gain = np.einsum("ij,kij->k", g, informations_) / 2
        weights = weights * gain
        if gain.max() < 1 + 1e-6:
            break
    return weights / weights.sum()


def floor_of_area(grid, rounds=16, courses=()):
    """`Floor` of the area of the 90 % ellipse at the reference time, over all courses of a `Grid`.

    ``courses`` are where the mixture begins; a full turn to either side by default.
    """
    scenario = grid.scenario
    keep = [scenario.coordinates.index(name) for name in ("x", "y")]
    whole = [Leg(grid.stages * grid.stage, side * grid.turn_rate) for side in (-1, 1)]
    start, first = scenario.platform.position_at(scenario.times[0]), grid.heading[0]
    courses = [*courses] or [Course(start, grid.speed, first, [leg], scenario.times[0]) for leg in whole]
    parts, weights, best = informations(scenario, courses), np.ones(len(courses)) / len(courses), None
    for _ in range(rounds):
        weights = weigh(parts, weights, keep)
        large = weights > SMALL
        parts, weights = parts[large], weights[large] / weights[large].sum()
        courses = [course for course, kept in zip(courses, large, strict=True) if kept]
        g, log = slope(np.tensordot(weights, parts, 1), keep)
        most, course = grid.best(g)
        own = informations(scenario, [course])[0]
        excess = max(most, np.sum(g * own), 2.0) / 2
        if best is None or np.exp(log) / excess > best.area:
            best = Floor(
                float(np.exp(log) / excess), float(excess), float(np.exp(log)), list(courses), weights
            )
        courses, parts = [*courses, course], np.concatenate([parts, own[None]])
        weights = np.append(0.9 * weights, 0.1)
    return best
