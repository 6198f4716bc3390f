"""`conical-angles`, Section 4.2: the experiment with a turning array.

Three estimators get the same measurements of one bottom-bounced ray: the MLE with the depth in the state
(Section 4.2.1), the MLE that assumes a depth of 200 m (4.2.2), and the conventional estimator, which takes
the cosine of the conical angle for that of a bearing (4.2.3). All three start at the true state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...batch import fit
from ...bounds import crlb, nees
from . import scenarios as conical
from .paper import PAPER

ASSUMED_DEPTH = 200.0  # m
PATIENCE = 2000  # evaluations: the conventional estimator needs up to several hundred


@dataclass(frozen=True)
class HeldNorth:
    """A platform whose array always points north: the numerator ``y_OT`` that Section 4.2 prints."""

    course: object

    def position_at(self, t):
        return self.course.position_at(t)

    def heading_at(self, t):
        return np.zeros_like(np.asarray(t, dtype=float))


def held_north(scenario):
    """The same scenario with an array that always points north: the numerator as printed."""
    return replace(scenario, platform=HeldNorth(scenario.platform))


def estimators(path="computed"):
    """The scenarios that the three estimators assume: ``plain``, ``reduced`` and ``conventional``.

    ``path`` as in `scenarios.section_4_2`: the course and heading as computed or as printed.
    """
    return {
        "plain": conical.section_4_2(path=path),
        "reduced": conical.section_4_2(ASSUMED_DEPTH, path),
        "conventional": conical.section_4_2(path=path, conventional=True),
    }


def reference_covariances(path="computed"):
    """Covariances that the printed NEES refer to: bounds at the true depth, with and without it in the
    state, and the inverse of the information of the conventional model at the true state.
    """
    scenarios = estimators(path)
    return {
        "plain": crlb(scenarios["plain"]),
        "reduced": crlb(conical.section_4_2(conical.TARGET_DEPTH, path)),
        "conventional": crlb(scenarios["conventional"]),
    }


def three_estimators(seed, runs, path="computed"):
    """One chunk of Section 4.2: all three estimators on the same measurements; ``path`` as in `estimators`.

    Returns
    -------
    dict
        For each name of `estimators` the errors of the initial state, estimate minus truth, ``(runs, n)``;
        and, ``(runs,)``, ``<name>_nees`` (against `reference_covariances`), ``_converged``,
        ``_iterations``, ``_cost``.
    """
    scenarios, covariances = estimators(path), reference_covariances(path)
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


def with_assumed_depth(seed, runs, depth):
    """Errors of an estimator that assumes ``depth``, ``{"errors": (runs, 4)}``; same measurements."""
    scenario = conical.section_4_2(assumed_depth=depth)
    result = fit(scenario, scenario.simulate(runs, seed), scenario.state, max_iterations=PATIENCE)
    return {"errors": result.state - scenario.state}


def random_starts(count, reach=20e3, speed=15.0):
    """Random starts all around the array, ``(count, 4)``: range up to ``reach``, speed up to ``speed``."""
    rng = np.random.default_rng(PAPER.stream("example").chunk())
    size, angle = rng.uniform(size=(2, count)), rng.uniform(0, 2 * np.pi, size=(2, count))
    east, north = size * np.sin(angle), size * np.cos(angle)
    return np.stack([reach * east[0], reach * north[0], speed * east[1], speed * north[1]], axis=1)
