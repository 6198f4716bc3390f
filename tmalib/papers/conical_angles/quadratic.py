"""`conical-angles`, Section 3.2: coordinates in which a target may be at infinity, or beyond.

With one ray and a straight course to the north, let ``(x, y)`` and ``(u, w)`` be the target's position and
velocity relative to the array and ``zeta`` the image depth. Divided by ``y``, the measurement is::

    m(t) = (1 + p t) / sqrt((1 + p t)^2 + A + 2 B t + C t^2),
    p = w / y,   A = (x^2 + zeta^2) / y^2,   B = x u / y^2,   C = u^2 / y^2.

A state is finite if and only if ``A C > B^2``; a target at infinity has ``A C = B^2``. The model is smooth
there, and the least squares estimate of these *quadratic coordinates* may lie beyond. Then no finite state
minimises the criterion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...batch import fit
from ...cones import BOTTOM_BOUNCE, image_depth
from ...scenario import Scenario, Sensor


@dataclass(frozen=True)
class Quadratic:
    """One ray and a straight course to the north, in the coordinates ``(A, B, C, p)``; a measurement model.

    Parameters
    ----------
    truth : ConicalAngle
        What is measured.
    kappa : float, optional
        Hold ``(zeta / y)^2`` at this value, 0 for a target at infinity: ``A = f^2 + kappa``, ``B = f g``,
        ``C = g^2`` with ``f = x / y``, ``g = u / y``. The coordinates are then ``(f, g, p)``.
    """

    truth: object
    kappa: float | None = None

    @property
    def coordinates(self):
        """``(A, B, C, p)`` with ``kappa`` free, else ``(f, g, p)``."""
        return ("A", "B", "C", "p") if self.kappa is None else ("f", "g", "p")

    def observer_state(self, platform, times):
        return self.truth.observer_state(platform, times)

    def observe(self, target, platform, times):
        return self.truth.observe(target, platform, times)

    def residual(self, measured, predicted):
        return measured - predicted

    def value_and_gradient(self, state, observer, elapsed):
        *form, p = state
        if self.kappa is None:
            square = form[0] + (2 * form[1] + form[2] * elapsed) * elapsed
            slopes = [1.0, 2 * elapsed, elapsed**2]
        else:
            across = form[0] + form[1] * elapsed
            square = across**2 + self.kappa
            slopes = [2 * across, 2 * across * elapsed]
        along = 1 + p * elapsed
        scale = 1 / np.sqrt(along**2 + square)
        value = along * scale
        rows = [-value * scale**2 / 2 * slope for slope in slopes]
        return value, np.stack([*rows, elapsed * square * scale**3])


def quadratic_scenario(scenario, kappa=None):
    """A scenario of Section 3.2, estimated in quadratic coordinates; ``kappa`` as in `Quadratic`."""
    sensor = scenario.sensors[0]
    sensors = [Sensor(Quadratic(sensor.model, kappa), sensor.times, sensor.sigma)]
    return Scenario(scenario.platform, sensors, scenario.reference_time, scenario.target)


def _assumption(scenario):
    """Image depth at the assumed target depth, and the array's speed."""
    model = scenario.sensors[0].model
    zeta = image_depth(BOTTOM_BOUNCE, model.assumed_depth, model.array_depth, model.bottom_depth)
    return zeta, scenario.platform.position_at(1.0)[1] - scenario.platform.position_at(0.0)[1]


def to_quadratic(scenario, state):
    """``(A, B, C, p)`` of states ``(x, y, vx, vy)``, at the scenario's assumed depth."""
    zeta, speed = _assumption(scenario)
    x, y, u, vy = np.moveaxis(np.asarray(state, dtype=float), -1, 0)
    return np.stack([(x**2 + zeta**2) / y**2, x * u / y**2, (u / y) ** 2, (vy - speed) / y], axis=-1)


def from_quadratic(scenario, point):
    """State with ``x >= 0`` at the assumed depth; NaN unless ``A C > B^2``: at infinity or beyond."""
    zeta, speed = _assumption(scenario)
    a, b, c, p = np.moveaxis(np.asarray(point, dtype=float), -1, 0)
    finite = (c > 0) & (a * c > b * b)
    c = np.where(finite, c, np.nan)
    y = zeta / np.sqrt(np.where(finite, a - b * b / c, np.nan))
    side = np.where(b < 0, -1.0, 1.0)
    root = np.sqrt(c)
    return np.stack([side * b * y / root, y, side * root * y, p * y + speed], axis=-1)


def nearest_at_infinity(scenario):
    """The target at infinity whose measurements are nearest to the noise-free ones, a `Fit`.

    Its ``cost`` is ``K = |m - m_inf|^2 / sigma^2``.
    """
    x, y, u, _ = scenario.state
    start = [x / y, u / y, to_quadratic(scenario, scenario.state)[3]]
    at_infinity = quadratic_scenario(scenario, kappa=0.0)
    return fit(at_infinity, scenario.measure(), np.array(start), tolerance=1e-9)


def profile(scenario, measured, kappas):
    """Least criterion at given values of ``kappa = (zeta / y)^2``, shape ``(runs, len(kappas))``."""
    start = nearest_at_infinity(scenario).state
    fits = [fit(quadratic_scenario(scenario, kappa), measured, start) for kappa in kappas]
    return np.stack([np.where(found.converged, found.cost, np.nan) for found in fits], axis=-1)
