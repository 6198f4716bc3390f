"""`robustness`: how bad a displacement is, who would notice, and whether a harder turn helps.

*A bound of what can be flown.* Let ``c_k`` be weights and D the second difference. For all y, one vector a
second difference, and all H with ``|H_k| <= b`` and ``|(D H)_j| <= a``::

    sum_k <c_k, H_k> = sum_k <(c - D'y)_k, H_k> + sum_j <y_j, (D H)_j>
                    <= b sum_k |(c - D'y)_k| + a sum_j |y_j|.

Whatever y is, the right side bounds the left: it certifies a displacement that comes near.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ... import sensitivity as sens
from ...batch import fit
from ...curved import AcceleratedBearing, TurningBearing
from ...motion import Course, Turn
from ...scenario import Sensor
from .periodic import platform_weave
from .scenarios import DURATION, SIGMA, WORST, Geometry

LEVEL = 0.05  # false alarms of the residual test


def residual_test_power(scenario, cost, level=LEVEL):
    """Chance that a chi-square test of the residuals notices that the model is wrong.

    The least criterion is chi-square with ``N - n`` degrees of freedom when the model is right and, to first
    order, noncentral chi-square when it is wrong.

    Parameters
    ----------
    scenario : Scenario
    cost : array_like, shape (...)
        Least criterion from noise-free measurements: the noncentrality.
    level : float
        Chance of noticing nothing real.

    Returns
    -------
    ndarray, shape (...)
    """
    from scipy.stats import chi2, ncx2  # imported here: it costs half a second

    freedom = len(scenario.times) - len(scenario.coordinates)
    return ncx2.sf(chi2.ppf(1 - level, freedom), freedom, np.maximum(cost, 1e-12))


@dataclass(frozen=True, eq=False)
class Damage:
    """What a displacement H, and its negative, do to the batch estimate.

    Attributes
    ----------
    linear : float
        Distance of estimate and undisturbed motion at the end, first order, in metres.
    actual : ndarray, shape (2,)
        The same in truth, for H and for -H.
    state : ndarray, shape (2, 4)
        The estimates.
    cost, power : ndarray, shape (2,)
        Least criterion without noise, and the chance that the residual test notices.
    acceleration : float
        Largest second difference of H over the sampling, in m/s^2.
    """

    linear: float
    actual: np.ndarray
    state: np.ndarray
    cost: np.ndarray
    power: np.ndarray
    acceleration: float


def damage(geometry, displacement):
    """`Damage` of a displacement of the geometry's uniform motion, shape ``(N, 2)``."""
    straight, final = geometry.straight, sens.position_criterion(geometry.straight, DURATION)
    measured = sens.displaced_measurements(straight, np.stack([displacement, -displacement]))
    found = fit(straight, measured, start=geometry.theta_star, tolerance=1e-6)
    second = np.diff(displacement, 2, axis=0) / np.diff(straight.times)[0] ** 2
    return Damage(
        linear=float(np.linalg.norm(final @ sens.differential(straight, displacement))),
        actual=np.linalg.norm((found.state - geometry.theta_star) @ final.T, axis=1),
        state=found.state,
        cost=found.cost,
        power=residual_test_power(straight, found.cost),
        acceleration=float(np.hypot(*second.T).max()),
    )


def flyable_limit(scenario, bound, acceleration, direction, criterion, sides=16):
    """No flyable displacement shifts the criterion more than this in a direction, in metres.

    Parameters
    ----------
    scenario : Scenario
    bound, acceleration : float
        ``|H_k| <= bound`` and ``|H''| <= acceleration``, as in `sensitivity.worst_flyable`.
    direction : array_like, shape (m,)
        Unit vector w: the shift meant is ``<w, C D(H)>``.
    criterion : array_like, shape (m, n)
    sides : int
        Sides of the polygons *around* the discs with which a linear programme proposes y; even. The
        limit itself is evaluated with the discs.
    """
    from scipy import sparse  # imported here: they cost half a second
    from scipy.optimize import linprog

    map_ = sens.response(scenario)
    weights = (np.asarray(direction) @ criterion @ map_.gain)[:, None] * map_.direction
    scale = np.abs(weights).max()
    count = len(weights)
    step = np.diff(scenario.times)[0]
    second = sparse.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(count - 2, count))
    limit = acceleration * step**2 / bound  # of second differences, where the discs have radius 1
    angle = 2 * np.pi * np.arange(sides // 2) / sides
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    rows = sparse.vstack([
        sparse.kron(normals, sparse.eye_array(count)), sparse.kron(normals, second / limit)
    ]).tocsr()  # fmt: skip
    rows = sparse.vstack([rows, -rows])
    found = linprog(
        -(weights / scale).T.ravel(), rows, np.ones(rows.shape[0]), bounds=(None, None), method="highs-ipm"
    )
    if not found.success:
        raise ValueError(f"the linear programme was not solved: {found.message}")
    forces = -found.ineqlin.marginals.reshape(2, -1)
    forces = (forces[0] - forces[1])[len(normals) * count :].reshape(len(normals), count - 2)
    y = (normals.T @ forces).T / limit
    rest = weights / scale - second.T @ y
    return float(bound * scale * (np.hypot(*rest.T).sum() + limit * np.hypot(*y.T).sum()))


def harder(geometry, factor):
    """The geometry with a platform that turns ``factor`` times as hard, at the same times."""
    course = geometry.platform
    legs = [Turn(leg.duration, factor * leg.rate) for leg in course.legs]
    return Geometry(Course(course.start, course.speed, course.heading, legs), geometry.target)


def weave_across(geometry):
    """The platform's departure from its nearest uniform motion, across the line of sight, shape ``(N,)``.

    In metres, along ``U_k``. It is the baseline of the parallax from which the range is known. A target that
    weaves along, ``H_k = rho w_k``, looks ``1 / (1 - rho)`` times as far away.
    """
    _, weave = platform_weave(geometry.straight)
    return sens.response(geometry.straight).along(weave)


def times_the_rule(geometry, bound=WORST):
    """Worst first-order errors over ``range * bound / amplitude of the weave``, a dict.

    ``"rule"`` is ``bound`` over the amplitude; ``"stealth"`` and ``"sup"`` how many times as large the error
    over the final range of the worst stealthy displacement is, and of the worst of all. A copied weave is
    stealthy and attains the rule, so that neither is below one, but for the platform's own way from its
    nearest uniform motion at the end, a share ``amplitude / range``.
    """
    final = sens.position_criterion(geometry.straight, DURATION)
    rule = bound / np.abs(weave_across(geometry)).max()
    stealthy, _ = sens.worst_stealth(geometry.straight, bound, criterion=final)
    unseen = np.linalg.norm(final @ sens.differential(geometry.straight, stealthy))
    errors = {"stealth": unseen, "sup": worst_final(geometry, bound)}
    return {"rule": rule} | {name: error / geometry.final_range / rule for name, error in errors.items()}


def worst_final(geometry, bound=WORST):
    """Largest first-order error at the end for displacements of at most ``bound``, in metres."""
    return _worst_shift(geometry.straight, bound, None, sens.position_criterion(geometry.straight, DURATION))


def _worst_shift(scenario, bound, state, criterion):
    """Largest first-order shift of a criterion for displacements of at most ``bound``."""
    found = sens.worst_sup(scenario, bound, state=state, criterion=criterion)
    return float(np.linalg.norm(criterion @ sens.differential(scenario, found, state)))


def manoeuvre_gain(geometry):
    """`worst_final` with twice the platform's acceleration over that with the printed one."""
    return worst_final(harder(geometry, 2.0)) / worst_final(geometry)


def other_models(geometry, bound=WORST):
    """`worst_final` over the final range when the estimator assumes another model.

    Returns
    -------
    dict
        ``"linear"``, ``"polynomial"`` (about the uniform motion) and ``"circular"`` (about the circle).
    """
    turning = geometry.target.legs[0].rate
    heading, speed = geometry.target.heading, geometry.target.speed
    circle = [*geometry.target.start, speed * np.sin(heading), speed * np.cos(heading), turning]
    assumed = {
        "polynomial": (AcceleratedBearing(), geometry.straight, [*geometry.theta_star, 0.0, 0.0]),
        "circular": (TurningBearing(), geometry.circle, circle),
    }
    ratios = {"linear": worst_final(geometry, bound) / geometry.final_range}
    for name, (model, truth, state) in assumed.items():
        scenario = replace(truth, sensors=[Sensor(model, truth.times, SIGMA)])
        final = model.position_criterion(state, DURATION)
        error = _worst_shift(scenario, bound, state, final)
        gap = truth.target.position_at(DURATION) - truth.platform.position_at(DURATION)
        ratios[name] = float(error / np.hypot(*gap))
    return ratios
