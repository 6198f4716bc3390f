"""`robustness`: what the text says of its simulations, measured, in one geometry or in many.

The paper says "bad", "good", "large" and gives no number. One yardstick serves for all: *a tenth*. An estimate
is bad when it ends a tenth of the final range or more from the target, and good below that; an approximation is
good when it leaves a tenth of what it approximates. Each phrase has one measure and one limit, `LIMITS`, fixed
before anything was computed.
"""

from __future__ import annotations

import numpy as np

from .. import claims
from ..batch import fit
from ..bounds import crlb
from ..sensitivity import differential, displaced_measurements, position_at
from . import robustness as paper

TABLE = "Text"
TENTH = 0.1
TOLERANCE = 1e-5  # standard deviations: the fits of noise-free bearings
NO_FINITE_MINIMUM = "no minimum at a finite range"
SMALL = 20  # random small displacements for which the minimum is sought again
STARTS = 8

# Phrase -> the limits within which it holds. What is measured is said in `phrases`.
LIMITS = {
    "BLS, circular target": {"at_least": TENTH},
    "first order, circular target": {"at_most": TENTH},
    "information": {"at_most": TENTH},
    "local minimum": {"at_least": 0.95},
    "BLS, worst perturbation": {"at_least": TENTH},
    "speeds, worst perturbation": {"at_most": TENTH},
    "BLS, periodic perturbation": {"at_most": TENTH},
}


def estimate(geometry, measured, start=None):
    """Least-squares estimates ``(..., 4)`` of a uniform motion; infinite where there is no finite minimum."""
    start = geometry.theta_star if start is None else start
    found = fit(geometry.straight, measured, start, tolerance=TOLERANCE)
    lost = found.reason == NO_FINITE_MINIMUM
    if not np.all(found.converged | lost):
        raise ValueError(f"a fit failed: {set(found.reason.ravel())}")
    return np.where(lost[..., None], np.inf, found.state)


def final_position(state):
    """Position of a uniform motion at the end, ``(..., 2)``."""
    state = np.asarray(state)
    return state[..., :2] + paper.DURATION * state[..., 2:]


def distance(a, b):
    """Distance of two positions, in metres."""
    return np.hypot(*np.moveaxis(np.asarray(a) - np.asarray(b), -1, 0))


def circular_phrases(geometry):
    """The circular target: the estimate, and its first-order development.

    Returns a dict: "BLS, circular target", the distance of estimate and target at the end over the range of the
    target there; "first order, circular target", the distance of development and estimate at the end over that
    of the estimate and ``theta*``.
    """
    found = estimate(geometry, geometry.circle.measure())
    end = geometry.target.position(paper.DURATION)
    shift = differential(geometry.straight, geometry.circle_displacement)
    developed = final_position(geometry.theta_star + shift)
    moved = distance(final_position(found), final_position(geometry.theta_star))
    with np.errstate(invalid="ignore"):  # an infinite estimate has no development: NaN does not hold
        rest = distance(developed, final_position(found)) / moved
    return {
        "BLS, circular target": float(distance(final_position(found), end) / geometry.final_range),
        "first order, circular target": float(rest),
    }


def information_phrase(geometry):
    """Largest standard deviation of the final position by the bound, over the final range."""
    final = position_at(geometry.straight, paper.DURATION)
    covariance = final @ crlb(geometry.straight) @ final.T
    return {"information": float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]) / geometry.final_range)}


def worst_phrases(geometry):
    """The paper's worst perturbation: the estimate for the worse of its two signs, and the target's speed.

    "speeds" is the largest deviation of the displaced target's speed from that of ``theta*``, over the latter.
    """
    found = estimate(geometry, worst_measurements(geometry))
    error = distance(final_position(found), final_ends(geometry))
    speed = np.hypot(*geometry.theta_star[2:])
    velocity = np.gradient(geometry.worst_displacement, geometry.straight.times, axis=0)
    speeds = [np.hypot(*(geometry.theta_star[2:] + sign * velocity).T) for sign in (1, -1)]
    return {
        "BLS, worst perturbation": float(np.max(error) / geometry.final_range),
        "speeds, worst perturbation": float(np.abs(np.array(speeds) - speed).max() / speed),
    }


def worst_measurements(geometry):
    """Noise-free bearings of the target under plus and minus the worst perturbation, ``(2, N)``."""
    both = np.stack([geometry.worst_displacement, -geometry.worst_displacement])
    return displaced_measurements(geometry.straight, both)


def final_ends(geometry):
    """Where the target ends under plus and minus the worst perturbation, ``(2, 2)``."""
    end = final_position(geometry.theta_star)
    return np.stack([end + geometry.worst_displacement[-1], end - geometry.worst_displacement[-1]])


def periodic_phrase(geometry):
    """Error of the estimate at the end over the final range, for the periodic perturbation of Figure 9."""
    displacement = paper.periodic(geometry)
    found = estimate(geometry, displaced_measurements(geometry.straight, displacement))
    end = final_position(geometry.theta_star) + displacement[-1]
    return {"BLS, periodic perturbation": float(distance(final_position(found), end) / geometry.final_range)}


def local_minimum_phrase(geometry, seed):
    """Share of small random perturbations for which no start finds a lower minimum than ``theta*`` does.

    The perturbations are smooth (a random acceleration, integrated), with the printed largest value; the
    starts are ``theta*`` with its range and speed drawn anew within a factor of three.
    """
    rng = np.random.default_rng(seed)
    straight = geometry.straight
    count = len(straight.times)
    walk = np.cumsum(np.cumsum(rng.standard_normal((SMALL, count, 2)), axis=1), axis=1)
    basis = np.stack([np.ones(count), np.linspace(-1, 1, count)], axis=-1)
    walk -= basis @ (np.linalg.pinv(basis) @ walk)
    walk *= paper.WORST / np.hypot(walk[..., 0], walk[..., 1]).max(axis=1)[:, None, None]
    measured = displaced_measurements(straight, walk)
    here = geometry.platform.position(straight.times[0])
    sight = geometry.theta_star[:2] - here
    factor = 3 ** rng.uniform(-1, 1, (STARTS, 1))
    starts = np.concatenate(
        [
            here + factor * sight,
            geometry.theta_star[2:] * 3 ** rng.uniform(-1, 1, (STARTS, 1)),
        ],
        axis=1,
    )
    local = fit(straight, measured, geometry.theta_star, tolerance=TOLERANCE)
    other = fit(straight, measured[:, None], starts, tolerance=TOLERANCE)
    reached = np.where(other.converged, other.cost, np.inf).min(axis=1)
    alone = local.converged & (local.cost <= reached + 1e-6 * (1 + local.cost))
    return {"local minimum": float(alone.mean())}


def phrases(geometry, seed):
    """All measures in one geometry, a dict from phrase to number."""
    return (
        circular_phrases(geometry)
        | information_phrase(geometry)
        | local_minimum_phrase(geometry, seed)
        | worst_phrases(geometry)
        | periodic_phrase(geometry)
    )


def holds(name, value):
    """Whether a phrase holds, for one value or an array of them; a value that is not finite does not."""
    limits = LIMITS[name]
    value = np.asarray(value, dtype=float)
    return (value >= limits.get("at_least", -np.inf)) & (value <= limits.get("at_most", np.inf))


def judge_phrases(here, elsewhere):
    """Judge the phrases: in the reference geometry, with the share of random ones in which they hold.

    Parameters
    ----------
    here : dict
        Phrase to number, in the reference geometry.
    elsewhere : dict
        Phrase to numbers ``(G,)``, in random geometries.
    """
    ours = {}
    for name, limits in LIMITS.items():
        among = holds(name, elsewhere[name])
        assumption = f"geometry assumed; holds in {among.sum()} of {len(among)} random ones"
        ours[name, "claim"] = claims.Ours(here[name], assumption=assumption, **limits)
    return claims.judge(paper.PAPER, TABLE, ours)
