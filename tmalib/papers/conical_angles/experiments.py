"""`conical-angles`: the Monte-Carlo experiments of Sections 3.2 and 5.2.

Each experiment is a task for `tmalib.monte_carlo`: a function of a seed and a number of runs.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from ...batch import fit
from ...bounds import crlb, whitened_jacobian
from ...charts import Cartesian
from . import scenarios as conical
from .quadratic import from_quadratic, nearest_at_infinity, quadratic_scenario, to_quadratic

CLOSE_START = (650.0, 640.0, 400.0, -1.0, -1.5)  # m and m/s


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
    free = fit(quadratic_scenario(scenario), measured, to_quadratic(scenario, scenario.state))
    far = fit(quadratic_scenario(scenario, kappa=0.0), measured, nearest_at_infinity(scenario).state)
    return {
        "state": from_quadratic(scenario, free.state),
        "cost": free.cost,
        "cost_infinity": far.cost,
        "converged": free.converged & far.converged,
    }


def one_ray_stopped(seed, runs, sigma, limit, safeguard=True, assumed_depth=200.0):
    """Section 3.2: ``{"state"}`` where an iteration from the truth stands after ``limit`` evaluations.

    Levenberg-Marquardt, or with ``safeguard=False`` Gauss-Newton. The state is finite whether or not the
    criterion has a minimiser.
    """
    scenario = conical.section_3_2(sigma, assumed_depth)
    measured = scenario.simulate(runs, seed)
    settings = {"chart": Cartesian, "safeguard": safeguard, "max_iterations": limit}
    return {"state": fit(scenario, measured, scenario.state, **settings).state}


def one_ray_by_scipy(seed, runs, sigma, tolerance, assumed_depth=200.0):
    """Section 3.2: ``{"state"}`` where the Levenberg-Marquardt of MINPACK, from the truth, stops by itself.

    ``tolerance`` is its ``ftol``: it stops when a step is to lower the criterion, and lowers it, by less than
    this share. Unknowns are scaled by the columns of the Jacobian. The state is finite whether or not the
    criterion has a minimiser.
    """
    scenario = conical.section_3_2(sigma, assumed_depth)

    def stops_at(angles):
        def residuals(state):
            return (scenario.linearise(state)[0] - angles) / sigma

        def jacobian(state):
            return scenario.linearise(state)[1] / sigma

        found = least_squares(residuals, scenario.state, jacobian, method="lm", x_scale="jac", ftol=tolerance)
        return found.x

    return {"state": np.stack([stops_at(angles) for angles in scenario.simulate(runs, seed)])}


def two_rays(seed, runs, bottom_depth, assumed_depth=300.0, start=(8000.0, 8000.0, 0.0, 0.0), truth=None):
    """Section 5.2: the estimate with an assumed depth, ``{"state", "converged", "cost"}``.

    ``truth`` is a scenario to simulate instead of that of the section.
    """
    estimator = conical.section_5_2(bottom_depth, assumed_depth)
    measured = (truth or estimator).simulate(runs, seed)
    found = fit(estimator, measured, np.array(start))
    return {"state": found.state, "converged": found.converged, "cost": found.cost}


def two_rays_by_gauss_newton(seed, runs, bottom_depth, assumed_depth=300.0, start=(8000.0, 8000.0, 0.0, 0.0)):
    """Section 5.2 by Gauss-Newton without a safeguard, as the paper has it: ``{"state", "converged"}``."""
    estimator = conical.section_5_2(bottom_depth, assumed_depth)
    measured = estimator.simulate(runs, seed)
    found = fit(estimator, measured, np.array(start), chart=Cartesian, safeguard=False)
    return {"state": found.state, "converged": found.converged}


def close_target_runs(seed, runs):
    """`scenarios.close_target`, depth in the state, from `CLOSE_START`: ``{"errors", "converged"}``."""
    scenario = conical.close_target()
    found = fit(scenario, scenario.simulate(runs, seed), np.array(CLOSE_START))
    return {"errors": found.state - scenario.state, "converged": found.converged}


def first_order_bias(scenario, truth):
    """Truth minus mean estimate of a linear estimator that assumes a wrong depth, shape ``(n,)``.

    The estimator of ``scenario`` sees the noise-free measurements of its target at the state ``truth``:
    ``-(J'J)^-1 J' (m - h(truth)) / sigma`` with the whitened Jacobian of the assumption.
    """
    missing = (scenario.measure() - scenario.linearise(truth)[0]) / scenario.sigma
    return -crlb(scenario, truth) @ whitened_jacobian(scenario, truth).T @ missing
