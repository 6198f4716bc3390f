"""`conical-angles`: the Monte-Carlo experiments of Sections 3.2 and 5.2, and how their tables are judged.

Each experiment is a task for `tmalib.monte_carlo`: a function of a seed and a number of runs.

With one ray and a straight course to the north, let ``(x, y)`` and ``(u, w)`` be the target's position and
velocity relative to the array and ``zeta`` the image depth. Divided by ``y``, the measurement is::

    m(t) = (1 + p t) / sqrt((1 + p t)^2 + A + 2 B t + C t^2),
    p = w / y,   A = (x^2 + zeta^2) / y^2,   B = x u / y^2,   C = u^2 / y^2.

A state is finite if and only if ``A C > B^2``; a target at infinity has ``A C = B^2``. The model is smooth
there, and the least squares estimate of these *quadratic coordinates* may lie beyond. Then no finite state
minimises the criterion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .. import claims
from ..batch import fit
from ..bounds import crlb, whitened_jacobian
from ..charts import Cartesian
from ..cones import BOTTOM_BOUNCE, image_depth
from ..montecarlo import statistics
from ..scenario import Scenario, Sensor
from . import conical_angles as conical


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

    def site(self, platform, times):
        return self.truth.site(platform, times)

    def observe(self, target, platform, times):
        return self.truth.observe(target, platform, times)

    def residual(self, measured, predicted):
        return measured - predicted

    def kernel(self, state, site, lag):
        *form, p = state
        if self.kappa is None:
            square = form[0] + (2 * form[1] + form[2] * lag) * lag
            slopes = [1.0, 2 * lag, lag**2]
        else:
            across = form[0] + form[1] * lag
            square = across**2 + self.kappa
            slopes = [2 * across, 2 * across * lag]
        along = 1 + p * lag
        scale = 1 / np.sqrt(along**2 + square)
        value = along * scale
        rows = [-value * scale**2 / 2 * slope for slope in slopes]
        return value, np.stack([*rows, lag * square * scale**3])


def quadratic(scenario, kappa=None):
    """A scenario of Section 3.2, estimated in quadratic coordinates; ``kappa`` as in `Quadratic`."""
    sensor = scenario.sensors[0]
    sensors = [Sensor(Quadratic(sensor.model, kappa), sensor.times, sensor.sigma)]
    return Scenario(scenario.target, scenario.platform, sensors, scenario.reference_time)


def _assumption(scenario):
    """Image depth at the assumed target depth, and the array's speed."""
    model = scenario.sensors[0].model
    zeta = image_depth(BOTTOM_BOUNCE, model.assumed_depth, model.array_depth, model.bottom_depth)
    return zeta, scenario.platform.position(1.0)[1] - scenario.platform.position(0.0)[1]


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


def one_ray(seed, runs, sigma, assumed_depth=200.0):
    """Section 3.2: the least squares estimate where there is one, and the criterion at infinity.

    Returns
    -------
    dict
        ``state``, ``(runs, 4)``, NaN without a finite minimiser; ``cost`` of the minimum in quadratic
        coordinates, ``cost_infinity`` of the best target at infinity; ``converged``, both fits; ``(runs,)``.
    """
    scenario = conical.section_3_2(sigma, assumed_depth)
    measured = scenario.simulate(runs, seed)
    free = fit(quadratic(scenario), measured, to_quadratic(scenario, scenario.state))
    far = fit(quadratic(scenario, kappa=0.0), measured, nearest_at_infinity(scenario).state)
    return {
        "state": from_quadratic(scenario, free.state),
        "cost": free.cost,
        "cost_infinity": far.cost,
        "converged": free.converged & far.converged,
    }


def nearest_at_infinity(scenario):
    """The target at infinity whose measurements are nearest to the noise-free ones, a `Fit`.

    Its ``cost`` is ``K = |m - m_inf|^2 / sigma^2``.
    """
    x, y, u, _ = scenario.state
    start = [x / y, u / y, to_quadratic(scenario, scenario.state)[3]]
    return fit(quadratic(scenario, kappa=0.0), scenario.measure(), np.array(start))


def profile(scenario, measured, kappas):
    """Least criterion at given values of ``kappa = (zeta / y)^2``, shape ``(runs, len(kappas))``."""
    start = nearest_at_infinity(scenario).state
    fits = [fit(quadratic(scenario, kappa), measured, start) for kappa in kappas]
    return np.stack([np.where(found.converged, found.cost, np.nan) for found in fits], axis=-1)


def one_ray_stopped(seed, runs, sigma, limit, safeguard=True, assumed_depth=200.0):
    """Section 3.2: ``{"state"}`` where an iteration from the truth stands after ``limit`` evaluations.

    Levenberg-Marquardt, or with ``safeguard=False`` Gauss-Newton. The state is finite whether or not the
    criterion has a minimiser.
    """
    scenario = conical.section_3_2(sigma, assumed_depth)
    measured = scenario.simulate(runs, seed)
    settings = {"chart": Cartesian(), "safeguard": safeguard, "max_iterations": limit}
    return {"state": fit(scenario, measured, scenario.state, **settings).state}


def two_rays(seed, runs, bottom_depth, assumed_depth=300.0, start=(8000.0, 8000.0, 0.0, 0.0), truth=None):
    """Section 5.2: the estimate with an assumed depth, ``{"state", "converged", "cost"}``.

    ``truth`` is a scenario to simulate instead of that of the section.
    """
    estimator = conical.section_5_2(bottom_depth, assumed_depth)
    measured = (truth or estimator).simulate(runs, seed)
    found = fit(estimator, measured, np.array(start))
    return {"state": found.state, "converged": found.converged, "cost": found.cost}


def first_order_bias(scenario, truth):
    """Truth minus mean estimate of a linear estimator that assumes a wrong depth, shape ``(n,)``.

    The estimator of ``scenario`` sees the noise-free measurements of its target at the state ``truth``:
    ``-(J'J)^-1 J' (m - h(truth)) / sigma`` with the whitened Jacobian of the assumption.
    """
    missing = (scenario.measure() - scenario.linearise(truth)[0]) / scenario.sigma
    return -crlb(scenario, truth) @ whitened_jacobian(scenario, truth).T @ missing


# -- the tables ----------------------------------------------------------------------------------------


def spread_claims(row, i, errors, erratum="", bias_erratum="", sign=1):
    """Bias and standard deviation of component ``i`` as `claims.Ours`, against 500 printed runs.

    ``errors``, ``(runs, n)``, are estimate minus truth. The paper's bias is truth minus mean estimate, and so
    is ours here; ``sign=-1`` turns it where the printed sign is an erratum. ``erratum`` and ``bias_erratum``
    name the corrections applied, to both numbers and to the bias only.
    """
    bias, std = claims.of_statistics(statistics(errors), i, conical.PRINTED_RUNS)
    errata = ", ".join(filter(None, [erratum, bias_erratum]))
    return {
        (row, "bias"): replace(bias, value=-sign * bias.value, erratum=errata),
        (row, "std_sample"): replace(std, erratum=erratum),
    }
