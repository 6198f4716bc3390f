"""`conical-angles`, Section 4.2: the experiment with a turning array, and the judgement of Tables 3 and 4.

Three estimators get the same measurements of one bottom-bounced ray: the MLE with the depth in the state
(Section 4.2.1), the MLE that assumes a depth of 200 m (4.2.2), and the conventional estimator, which takes
the cosine of the conical angle for that of a bearing (4.2.3). All three start at the true state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import claims
from ..batch import fit
from ..bounds import crlb, nees
from ..montecarlo import stream
from . import conical_angles as conical
from .conical_experiments import spread_claims

ASSUMED_DEPTH = 200.0  # m
STREAM = "conical/4.2"
PATIENCE = 2000  # evaluations: the conventional estimator needs up to several hundred
ERRATA = "conical-19, conical-20"


@dataclass(frozen=True)
class HeldNorth:
    """A platform whose array always points north: the numerator ``y_OT`` that Section 4.2 prints."""

    course: object

    def position(self, t):
        return self.course.position(t)

    def heading(self, t):
        return np.zeros_like(np.asarray(t, dtype=float))


def held_north(scenario):
    """The same scenario with an array that always points north: the numerator as printed."""
    return scenario.with_(platform=HeldNorth(scenario.platform))


def estimators():
    """The scenarios that the three estimators assume: ``plain``, ``reduced`` and ``conventional``."""
    return {
        "plain": conical.section_4_2(),
        "reduced": conical.section_4_2(assumed_depth=ASSUMED_DEPTH),
        "conventional": conical.section_4_2(conventional=True),
    }


def references():
    """Covariances that the printed NEES refer to: bounds at the true depth, with and without it in the
    state, and the inverse of the information of the conventional model at the true state.
    """
    scenarios = estimators()
    return {
        "plain": crlb(scenarios["plain"]),
        "reduced": crlb(conical.section_4_2(assumed_depth=conical.TARGET_DEPTH)),
        "conventional": crlb(scenarios["conventional"]),
    }


def experiment(seed, runs):
    """One chunk of Section 4.2: all three estimators on the same measurements.

    Returns
    -------
    dict
        For each name of `estimators` the errors of the initial state, estimate minus truth, ``(runs, n)``;
        and, ``(runs,)``, ``<name>_nees`` (against `references`), ``_converged``, ``_iterations``, ``_cost``.
    """
    scenarios, covariances = estimators(), references()
    measured = scenarios["plain"].simulate(runs, seed)
    found = {}
    for name, scenario in scenarios.items():
        truth = scenario.state
        result = fit(scenario, measured, truth, max_iterations=PATIENCE)
        found[name] = result.state - truth
        found[f"{name}_nees"] = nees(result.state, truth, covariances[name])
        found[f"{name}_converged"] = result.converged
        found[f"{name}_iterations"] = result.iterations
        found[f"{name}_cost"] = result.cost
    return found


def assumed_depth(seed, runs, depth):
    """Errors of an estimator that assumes ``depth``, ``{"errors": (runs, 4)}``; same measurements."""
    scenario = conical.section_4_2(assumed_depth=depth)
    result = fit(scenario, scenario.simulate(runs, seed), scenario.state, max_iterations=PATIENCE)
    return {"errors": result.state - scenario.state}


def random_starts(count, reach=20e3, speed=15.0):
    """Random starts all around the array, ``(count, 4)``: range up to ``reach``, speed up to ``speed``."""
    rng = np.random.default_rng(stream("example"))
    size, angle = rng.uniform(size=(2, count)), rng.uniform(0, 2 * np.pi, size=(2, count))
    east, north = size * np.sin(angle), size * np.cos(angle)
    return np.stack([reach * east[0], reach * north[0], speed * east[1], speed * north[1]], axis=1)


# -- the tables ----------------------------------------------------------------------------------------


def judge_table(table, errors, bound, erratum_bound=ERRATA):
    """Judge all rows of Table 3 or 4 from the errors ``(runs, n)`` and the bound ``(n, n)``."""
    plain = len(bound) == 5
    rows = conical.ROWS_WITH_DEPTH if plain else conical.ROWS
    truth = estimators()["plain" if plain else "reduced"].state
    ours = {}
    for i, row in enumerate(rows):
        ours[row, "true"] = claims.Ours(truth[i])
        ours |= spread_claims(row, i, errors, ERRATA)
        ours[row, "std_crlb"] = claims.Ours(float(np.sqrt(bound[i, i])), erratum=erratum_bound)
    return claims.judge(conical.PAPER, table, ours)


def mean_nees(values, erratum=ERRATA):
    """Mean NEES as `claims.Ours`, against 500 printed runs."""
    std = float(np.std(values, ddof=1))
    return claims.Ours(
        float(np.mean(values)), std / np.sqrt(len(values)), std / np.sqrt(conical.PRINTED_RUNS), std, erratum
    )
