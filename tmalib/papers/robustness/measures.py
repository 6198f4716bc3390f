"""`robustness`: what the text says of the least-squares estimate, measured in one geometry.

The paper says "bad", "good", "large" and gives no number. Each function here measures one phrase; `PHRASES`
in `phrases` says where it stands and within which limits it holds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...batch import fit
from ...bounds import crlb
from ...sensitivity import differential, displaced_measurements, position_criterion
from ...status import NO_MINIMUM, RAN_AWAY
from . import scenarios as paper
from .worst import other_models, worst_final

TENTH = 0.1  # the yardstick for what the paper calls bad, good or large
TOLERANCE = 1e-5  # standard deviations: the fits of noise-free bearings
SMALL = 20  # random small displacements for which the minimum is sought again
STARTS = 8
WEAVES = (4.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 30.0, 40.0)  # s


def fit_or_infinity(geometry, measured, start=None):
    """Least-squares estimates ``(..., 4)`` of a uniform motion.

    Infinite where there is no minimum at a finite range; NaN where the fit failed for another reason.
    """
    start = geometry.theta_star if start is None else start
    found = fit(geometry.straight, measured, start, tolerance=TOLERANCE, max_iterations=1000)
    state = np.where(found.converged[..., None], found.state, np.nan)
    return np.where(np.isin(found.status, [NO_MINIMUM, RAN_AWAY])[..., None], np.inf, state)


def final_position(state):
    """Position of a uniform motion at the end, ``(..., 2)``."""
    state = np.asarray(state)
    return state[..., :2] + paper.DURATION * state[..., 2:]


def distance(a, b):
    """Distance of two positions, in metres."""
    return np.hypot(*np.moveaxis(np.asarray(a) - np.asarray(b), -1, 0))


def circular_error(geometry):
    """Distance of estimate and circular target at the end, over the final range."""
    end = geometry.target.position_at(paper.DURATION)
    found = final_position(fit_or_infinity(geometry, geometry.circle.measure()))
    return float(distance(found, end) / geometry.final_range)


def circular_shifts(geometry):
    """Shift of the final position by the circle: the development's and the estimate's, shape ``(2, 2)``."""
    developed = geometry.theta_star + differential(geometry.straight, geometry.circle_displacement)
    found = fit_or_infinity(geometry, geometry.circle.measure())
    return final_position([developed, found]) - final_position(geometry.theta_star)


def development_error(geometry):
    """Distance of development and estimate at the end, over the estimate's shift; NaN if that is infinite."""
    developed, found = circular_shifts(geometry)
    with np.errstate(invalid="ignore"):
        return float(distance(developed, found) / np.hypot(*found))


def final_sigma(geometry):
    """Largest standard deviation of the final position by the bound, over the final range."""
    final = position_criterion(geometry.straight, paper.DURATION)
    covariance = final @ crlb(geometry.straight) @ final.T
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]) / geometry.final_range)


def worst_measurements(geometry):
    """Noise-free bearings of the target under plus and minus the worst perturbation, ``(2, N)``."""
    both = np.stack([geometry.worst_displacement, -geometry.worst_displacement])
    return displaced_measurements(geometry.straight, both)


def final_ends(geometry):
    """Where the target ends under plus and minus the worst perturbation, ``(2, 2)``."""
    end = final_position(geometry.theta_star)
    return np.stack([end + geometry.worst_displacement[-1], end - geometry.worst_displacement[-1]])


def worst_error(geometry):
    """Distance of estimate and target at the end over the final range, for the worse of the two signs."""
    found = fit_or_infinity(geometry, worst_measurements(geometry))
    return float(np.max(distance(final_position(found), final_ends(geometry))) / geometry.final_range)


def worst_speed(geometry):
    """Largest deviation of the speed from that of ``theta*``, over it, under the worst perturbation."""
    speed = np.hypot(*geometry.theta_star[2:])
    velocity = np.gradient(geometry.worst_displacement, geometry.straight.times, axis=0)
    speeds = [np.hypot(*(geometry.theta_star[2:] + sign * velocity).T) for sign in (1, -1)]
    return float(np.abs(np.array(speeds) - speed).max() / speed)


def displaced_error(geometry, displacement):
    """Distance of estimate and target at the end over the final range, for a displacement ``(N, 2)``."""
    found = fit_or_infinity(geometry, displaced_measurements(geometry.straight, displacement))
    end = final_position(geometry.theta_star) + displacement[-1]
    return float(distance(final_position(found), end) / geometry.final_range)


def share_of_global_minima(geometry, seed):
    """Share of small random perturbations for which no start finds a lower minimum than ``theta*`` does.

    The perturbations are smooth (a random acceleration, integrated, less its nearest uniform motion), with
    the printed largest value; the starts are ``theta*`` with range and velocity drawn anew within a factor
    of three.
    """
    rng = np.random.default_rng(seed)
    straight = geometry.straight
    count = len(straight.times)
    walk = np.cumsum(np.cumsum(rng.standard_normal((SMALL, count, 2)), axis=1), axis=1)
    basis = np.stack([np.ones(count), np.linspace(-1, 1, count)], axis=-1)
    walk -= basis @ (np.linalg.pinv(basis) @ walk)
    walk *= paper.WORST / np.hypot(walk[..., 0], walk[..., 1]).max(axis=1)[:, None, None]
    measured = displaced_measurements(straight, walk)
    here = geometry.platform.position_at(straight.times[0])
    nearer, slower = 3 ** rng.uniform(-1, 1, (2, STARTS, 1))
    places = here + nearer * (geometry.theta_star[:2] - here)
    starts = np.concatenate([places, slower * geometry.theta_star[2:]], axis=1)
    local = fit(straight, measured, geometry.theta_star, tolerance=TOLERANCE)
    other = fit(straight, measured[:, None], starts, tolerance=TOLERANCE)
    reached = np.where(other.converged, other.cost, np.inf).min(axis=1)
    alone = local.converged & (local.cost <= reached + 1e-6 * (1 + local.cost))
    return float(alone.mean())


def error_of_other_models(geometry):
    """Largest first-order error for 15 m over the final range, for the less sensitive of two other models.

    The estimator assumes constant acceleration, or a constant turn rate; the target moves as it assumes.
    """
    found = other_models(geometry)
    return min(found["polynomial"], found["circular"])


def error_of_the_best_weave(geometry):
    """Largest first-order error for 15 m over the final range, when the platform may choose its weave.

    The best of `WEAVES`, with the printed acceleration and from the same start and heading.
    """
    ratios = []
    for period in WEAVES:
        platform = paper.weave(geometry.platform.start, geometry.platform.heading, period)
        try:
            other = replace(geometry, platform=platform)
            ratios.append(worst_final(other) / other.final_range)
        except ValueError:  # this weave runs into the target, or leaves it unobservable
            ratios.append(np.inf)
    return float(min(ratios))
