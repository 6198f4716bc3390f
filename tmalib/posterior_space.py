"""Coordinates in which a posterior is drawn, and where the draws begin.

A state with position and velocity is drawn in bearing, logarithm of the range, and velocity over range: the
modified polar coordinates of `tmalib.charts` with the logarithm of the range for the inverse range. The
posterior density in them has the volume ``|dX / dq|``, the fourth power of the range. Other states are
drawn as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from .charts import ModifiedPolar, chart_of
from .checks import as_numbers
from .mixtures import Mixture
from .profile import Held, lowest_of
from .scenario import Scenario
from .types import FloatArray
from .uniform import is_uniform

BESIDE = 1.5  # standard deviations along the direction that is told least
AWAY = 2.0 ** np.arange(-3, 4)  # of the fitted range: where the first proposal stands
RANGES = np.geomspace(250.0, 128e3, 10)  # metres: where it stands if the fit is lost
WIDEST = (1.0, 0.5)  # of its parts: radians of the bearing, natural logarithm of the range
FASTEST = 30.0  # m/s: by which their rates are limited
LEAST_EIGENVALUE = 1e-8  # of the scaled information, where nothing else limits a direction
LogDensity: TypeAlias = Callable[[FloatArray], Any]


@dataclass(frozen=True, eq=False)
class PosteriorSpace:
    """The coordinates in which the posterior of one run is drawn, and its density there.

    ``measured (N,)`` has no gaps. ``log_prior`` is that of `tmalib.posterior.sample_posterior`.
    """

    scenario: Scenario
    measured: FloatArray
    log_prior: LogDensity | None

    @cached_property
    def polar(self) -> Any:
        """The chart behind the coordinates of a state with position and velocity, or `None`."""
        uniform = is_uniform(self.scenario.coordinates)
        return chart_of(self.scenario, ModifiedPolar) if uniform else None

    def point(self, state: FloatArray) -> FloatArray:
        """Coordinates ``(..., n)`` of states."""
        if self.polar is None:
            return np.array(state)
        point = self.polar.from_state(state)
        point[..., self.polar.places[1]] = -np.log(point[..., self.polar.places[1]])
        return point

    def _modified_polar(self, point):
        inverse = np.array(point)
        inverse[..., self.polar.places[1]] = np.exp(-point[..., self.polar.places[1]])
        return inverse

    def state(self, point: FloatArray) -> FloatArray:
        """States ``(..., n)`` of coordinates."""
        return np.array(point) if self.polar is None else self.polar.to_state(self._modified_polar(point))

    def along_the_range(self, states: FloatArray, lost: bool) -> FloatArray:
        """States at several ranges, all else fitted; and the states themselves, unless they are lost."""
        range_place = self.polar.places[1]
        count = len(RANGES if lost else AWAY)
        inverse = self.polar.from_state(states)[:, None].repeat(count, axis=1)
        distance = RANGES if lost else AWAY / inverse[..., range_place]
        inverse[..., range_place] = 1 / distance
        starts = self.polar.to_state(inverse).reshape(1, -1, states.shape[1])
        many = np.broadcast_to(self.measured, (starts.shape[1], len(self.measured)))
        found, cost = lowest_of(self.scenario, many, starts, Held(self.polar, (range_place,)))
        found = found[np.isfinite(cost)]
        return found if lost and len(found) else np.concatenate([states, found])

    def information(self, state: FloatArray) -> FloatArray:
        """Fisher information in the coordinates of the draws, ``(n, n)``."""
        jacobian = self.scenario.linearise(state)[1] / self.scenario.sigma[:, None]
        if self.polar is not None:
            chart = self._modified_polar(self.point(state))
            slope = self.polar.jacobian(chart)
            slope[:, self.polar.places[1]] *= -chart[self.polar.places[1]]
            jacobian = jacobian @ slope
        return jacobian.T @ jacobian

    def limits(self, state: FloatArray) -> FloatArray:
        """Largest standard deviations of a first proposal, ``(n,)``; infinite where nothing limits."""
        limits = np.full(len(state), np.inf)
        if self.polar is not None:
            rate = FASTEST * np.exp(-self.point(state)[self.polar.places[1]])
            limits[self.polar.places] = [*WIDEST, rate, rate]
        return limits

    def log_density(self, point: FloatArray) -> FloatArray:
        """Logarithm of the posterior density of the coordinates, ``(M,)``; ``-inf`` where there is none."""
        with np.errstate(all="ignore"):
            state = self.state(point)
            predicted = self.scenario.linearise(state)[0]
            standard = self.scenario.residual(self.measured, predicted) / self.scenario.sigma
            value = -np.sum(standard**2, axis=-1) / 2
            if self.polar is not None:
                value = value + 4 * point[:, self.polar.places[1]]
        value = np.where(np.isfinite(value) & np.isfinite(state).all(axis=1), value, -np.inf)
        good = np.isfinite(value)
        if self.log_prior is not None and good.any():
            prior = as_numbers("log_prior", self.log_prior(state[good]))
            if prior.shape != (good.sum(),) or np.isnan(prior).any() or np.any(prior == np.inf):
                raise ValueError(
                    f"log_prior must give a number or -inf for each of {good.sum()} states, got {prior}"
                )
            value[good] += prior
        return value


def first_mixture(space: PosteriorSpace, states: FloatArray, lost: bool) -> Mixture:
    """The mixture of the first round, from states ``(k, n)``: along the range, or what is told least."""
    centres, roots = [], []
    for state in states if space.polar is None else space.along_the_range(states, lost):
        limit = space.limits(state) ** -2.0
        information, centre = space.information(state) + np.diag(limit), space.point(state)
        length = np.sqrt(np.diagonal(information))
        length = np.where(length > 0, length, 1.0)
        values, vectors = np.linalg.eigh(information / length / length[:, None])
        spread = 1 / np.sqrt(np.maximum(values, LEAST_EIGENVALUE * values[-1]))
        scaled = vectors * spread / length[:, None]
        root = np.linalg.cholesky(scaled @ scaled.T)
        if space.polar is None:
            steps: tuple[float, ...] = (-BESIDE, 0.0, BESIDE)
        else:  # rates that nothing tells go towards zero
            steps, rates = (0.0,), space.polar.places[2:]
            centre = centre - scaled @ scaled.T[:, rates] @ (limit[rates] * centre[rates])
        centres += [centre + step * scaled[:, 0] for step in steps]
        roots += [root] * len(steps)
    return Mixture(np.full(len(centres), 1 / len(centres)), np.array(centres), np.array(roots))
