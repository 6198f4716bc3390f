"""`conical-angles`: the Monte-Carlo experiments of Sections 3.2 and 5.2.

Each experiment is a task for `tmalib.monte_carlo`: a function of a seed and a number of runs.
"""

from __future__ import annotations

import numpy as np

from ...batch import fit
from ...bounds import crlb, whitened_jacobian
from ...charts import Cartesian
from . import scenarios as conical
from .quadratic import from_quadratic, nearest_at_infinity, quadratic_scenario, to_quadratic


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
