"""Pseudolinear equations of bearings: a state from bearings alone, without a guess and without iterations.

A bearing theta from the platform at p, s seconds after the reference time, says of the state
``(x, y, vx, vy)`` without approximation::

    cos theta (x + s vx - px) - sin theta (y + s vy - py) = 0.

With noise the right side is about ``r sigma``, so each equation is weighted with ``1 / (r sigma)``, the range
taken from the round before. For a delayed bearing s is less by the delay ``r / c``.

*Bias.* The noise is in the coefficients as well, and the normal equations hold their products: sines and
cosines of ``2 theta``, which noise makes smaller, ``exp(-2 sigma^2)`` in the mean. This pulls the target
towards the platform. So they are divided by that factor.

*Held range.* Where the bearings tell the range only by a delay, or hardly at all, the equations are nearly
singular: they give the state up to a scale. With one more equation, the range at the first bearing, they
give it all.

Source: Lindgren and Gong (1978); bias: Nardone, Lindgren and Gong (1984), here removed from the products.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .scenario import Scenario
from .types import FloatArray

FIRST_RANGE = 10e3  # metres: of all bearings in the first round
NEAREST, FARTHEST = 10.0, 1e6  # metres: between these the weights follow the range
HELD = 1e-3  # relative width of a held range
NEVER_SINGULAR = 1e-12 * np.eye(4)  # added to equations with a unit diagonal
FASTEST = 0.8  # share of the speed of sound: a faster state predicts nothing

# The normal matrix has ``sum w^2 a a' s^k``, its right side ``sum w^2 a (a'p) s^k`` with a = (cos, -sin).
_I, _J = np.indices((4, 4))
_PRODUCT, _POWER = _I % 2 + _J % 2, _I // 2 + _J // 2
_RIGHT, _RIGHT_POWER = 3 + np.arange(4) % 2, np.arange(4) // 2


class Places:
    """What the equations have to know of a scenario of bearings: times, places of the platforms, sigmas.

    ``turns`` tells whether the platforms depart from a uniform motion enough to tell a range of 10 km; if
    not, only a delay can tell it. ``speed`` is that of the uniform motion.
    """

    def __init__(self, scenario: Scenario) -> None:
        times, sensors = scenario.times, scenario.sensors
        self.elapsed = times - scenario.reference_time
        self.first, self.nearest = int(np.argmin(times)), int(np.argmin(np.abs(self.elapsed)))
        places = np.concatenate([scenario.platform_of(s).position_at(s.times) for s in sensors])
        self.origin = places[self.first]
        self.away = np.ascontiguousarray((places - self.origin).T)
        self.sigma = scenario.sigma
        self.clearer = np.exp(2 * np.minimum(self.sigma, 1.0) ** 2) / 2
        sound = [getattr(sensor.model, "c", np.inf) for sensor in sensors]
        self.slowness = np.repeat(1 / np.array(sound), [len(sensor) for sensor in sensors])
        self.slowest_sound = min(sound)
        uniform = np.stack([np.ones(len(times)), self.elapsed], axis=-1)
        (_, *velocity), *_ = motion = np.linalg.lstsq(uniform, self.away.T)
        self.speed = np.hypot(*np.ravel(velocity))
        turned = np.hypot(*(self.away - (uniform @ motion[0]).T))
        self.turns = np.linalg.norm(turned / self.sigma) > FIRST_RANGE

    def ranges(self, state: FloatArray) -> FloatArray:
        """Ranges ``(runs, N)`` at which what is measured was emitted, of states ``(runs, 4)``."""
        x, y, vx, vy = slower_than_sound(state, self.slowest_sound).T[:, :, None]
        dx, dy = self.elapsed * vx, self.elapsed * vy
        dx += x - self.away[0]
        dy += y - self.away[1]
        if not self.slowness.any():
            return np.sqrt(dx * dx + dy * dy)
        late = self.slowness * (vx * dx + vy * dy)
        slack = 1 - self.slowness**2 * (vx * vx + vy * vy)
        return (np.sqrt(late * late + slack * (dx * dx + dy * dy)) - late) / slack


class Equations:
    """The equations of bearings ``(runs, N)``, for a state at the reference time."""

    def __init__(self, places: Places, angles: FloatArray) -> None:
        self.places, self.angles = places, angles
        (px, py), double = places.away, (2 * angles).astype(np.float32)  # enough for a start, and faster
        cos, sin = places.clearer * np.cos(double), places.clearer * np.sin(double)
        self.products = np.empty((len(angles), 5, angles.shape[1]))
        xx, xy, yy, x, y = self.products.swapaxes(0, 1)
        np.add(0.5, cos, out=xx)
        np.negative(sin, out=xy)
        np.subtract(0.5, cos, out=yy)
        x[:], y[:] = xx * px + xy * py, xy * px + yy * py

    def free(self, rounds: int) -> tuple[FloatArray, FloatArray]:
        """States ``(runs, 4)``, and the relative standard deviations of their ranges, ``(runs,)``."""
        here = self.places
        s = here.elapsed - FIRST_RANGE * here.slowness
        weight = 1 / (FIRST_RANGE * np.hypot(here.sigma, here.speed * here.slowness))
        for _ in range(rounds - 1):
            matrix, right = _normal_equations(self.products @ _powers(s, weight).mT)
            distance = here.ranges(_solve(matrix, right[..., None])[..., 0])
            distance = np.where(np.isfinite(distance), np.clip(distance, NEAREST, FARTHEST), FIRST_RANGE)
            s = here.elapsed - distance * here.slowness
            weight = 1 / (here.sigma * distance)
        matrix, right = _normal_equations(self.products @ _powers(s, weight).mT)
        theta = self.angles[:, here.nearest]
        sides = np.zeros((len(right), 4, 2))
        sides[..., 0], sides[:, 0, 1], sides[:, 1, 1] = right, np.sin(theta), np.cos(theta)
        solved = _solve(matrix, sides)
        with np.errstate(invalid="ignore"):  # without its bias a matrix need not be positive
            spread = np.sqrt(np.vecdot(sides[..., 1], solved[..., 1])) / distance[:, here.nearest]
        return self._finished(solved[..., 0]), spread

    def held(self, ranges: ArrayLike, runs: Any = slice(None)) -> FloatArray:
        """States ``(runs, H, 4)`` for every one of the ranges ``(H,)`` at the first bearing."""
        here, theta = self.places, self.angles[runs, self.places.first]
        ranges = np.asarray(ranges)[:, None]
        s = here.elapsed - ranges * here.slowness
        powers = _powers(s, 1 / (here.sigma * ranges)).reshape(-1, s.shape[1])  # (3 H, N)
        moments = self.products[runs] @ powers.T
        moments = moments.reshape(*moments.shape[:2], len(ranges), 3).swapaxes(1, 2)
        matrix, right = _normal_equations(moments)
        row = np.empty((*right.shape[:2], 4))
        row[..., 0], row[..., 1] = np.sin(theta)[:, None], np.cos(theta)[:, None]
        row[..., 2:] = s[:, here.first, None] * row[..., :2]
        row /= HELD * ranges
        matrix += row[..., :, None] * row[..., None, :]
        right += row / HELD
        return self._finished(_solve(matrix, right[..., None])[..., 0])

    def _finished(self, state):
        """States about the origin of the scenario, none of them as fast as sound."""
        state = slower_than_sound(state, self.places.slowest_sound)
        state[..., :2] += self.places.origin
        return state


def slower_than_sound(state: FloatArray, sound: float) -> FloatArray:
    """The states ``(..., 4)`` with speeds of at most `FASTEST` of that of sound."""
    if np.isinf(sound):
        return state
    state = state.copy()
    mach = np.hypot(state[..., 2], state[..., 3]) / sound
    state[..., 2:] /= np.maximum(1.0, mach / FASTEST)[..., None]
    return state


def _powers(s, weight):
    """Squares of the weights times 1, s and s squared, ``(..., 3, N)``."""
    powers = np.empty((*s.shape[:-1], 3, s.shape[-1]))
    one, first, second = np.moveaxis(powers, -2, 0)
    np.multiply(weight, weight, out=one)
    np.multiply(one, s, out=first)
    np.multiply(first, s, out=second)
    return powers


def _normal_equations(moments):
    """Normal matrices ``(..., 4, 4)`` and right sides ``(..., 4)`` from sums of products, ``(..., 5, 3)``."""
    return moments[..., _PRODUCT, _POWER], moments[..., _RIGHT, _RIGHT_POWER]


def _solve(matrix, right):
    """Solutions ``(..., n, m)`` of normal equations, unknowns scaled; NaN for a matrix that is not finite."""
    with np.errstate(all="ignore"):
        scale = 1 / np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))[..., None]
        scaled = matrix * (scale * scale.mT) + NEVER_SINGULAR
        return scale * np.linalg.solve(scaled, scale * right)
