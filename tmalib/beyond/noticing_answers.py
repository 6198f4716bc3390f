"""Noticing: what answers a target that turns, and how much harm a turn does before it is noticed.

Richer models, tests that choose between them, and filters with process noise, in the watch of
`tmalib.beyond.noticing`; and the harm of a turn in random watches.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import chi2, norm

from ..batch import fit
from ..bounds import crlb, whitened_jacobian
from ..charts import ModifiedPolar
from ..curved import AcceleratedBearing, TurningBearing
from ..departures import departure_effect
from ..motion import Target
from ..papers.robustness import scenarios as paper
from ..priors import prior_along_first_bearing
from ..process_noise import ProcessNoise
from ..recursive import ekf
from ..sensitivity import position_criterion
from ..study.cases import AT_SEA
from .noticing import (
    OWN_SPEED,
    OWN_TURN,
    STREAM,
    a_metre_of,
    own_course,
    p_values,
    target_of,
    turn_of,
    watch,
    watch_from,
)

LEVEL = 0.05
PRIOR = (8e3, 4e3, 5.0)  # of the filters: range and its standard deviation in m, speed in m/s
KNOWN, MISFIT = 0.3, 100.0  # of encounters: largest bound over the distance; largest misfit
NEAREST, WELL_SEEN = 1e3, 0.1  # of random watches: least distance in m, largest bound over the last range


def with_model(scenario, model):
    """The scenario with another model of the target's motion, and without a target."""
    sensors = [replace(sensor, model=model) for sensor in scenario.sensors]
    return replace(scenario, sensors=sensors, target=None)


def answered(seed, runs, size, densities):
    """Task: a turn answered in several ways; errors of the last position ``(runs, 2)``, and p-values.

    ``straight``, ``turning`` and ``accelerated`` are fits, ``filter_k`` filters with the k-th density of
    process noise (m^2/s^3). ``stated`` and ``covariance_k`` are what the first and the filters say of their
    errors, ``rise`` by how much the criterion of the straight fit exceeds that of the turning one.
    """
    target = target_of("turn", size)
    angles = watch().with_target(target).simulate(runs, seed)
    found, end = fit(watch(), angles), target.position_at(AT_SEA.length)
    results = p_values(found) | {"straight": found.state[:, :2] - end, "stated": found.covariance[:, :2, :2]}
    richer = {"turning": TurningBearing(), "accelerated": AcceleratedBearing()}
    for name, model in richer.items():
        start = np.column_stack([found.state, np.zeros((runs, len(model.coordinates) - 4))])
        fitted = fit(with_model(watch(), model), angles, start)
        results |= {name: fitted.state[:, :2] - end, f"{name}_converged": fitted.converged}
        if name == "turning":
            results["rise"] = found.cost - fitted.cost
    prior = prior_along_first_bearing(watch(), angles, *PRIOR)
    for k, density in enumerate(densities):
        track = ekf(watch(), angles, prior, chart=ModifiedPolar, process_noise=ProcessNoise(density))
        results |= {
            f"filter_{k}": track.state[:, -1, :2] - end,
            f"covariance_{k}": track.covariance[:, -1, :2, :2],
        }
    return results


def risk(shift, accept):
    """Mean square error of ``0 if accepted else z`` as estimate of a mean ``shift``, z normal about it.

    Parameters
    ----------
    shift : array_like, shape (...)
    accept : callable
        Chance with which z is accepted as nothing.
    """
    z = np.linspace(-12, 12, 24001)
    shift = np.asarray(shift, dtype=float)[..., None]
    kept = accept(z + shift)
    values = norm.pdf(z) * ((1 - kept) * z**2 + kept * shift**2)
    return values.sum(axis=-1) * (z[1] - z[0])


def accepted_by(freedom, level=LEVEL):
    """Chance that a chi-square test with ``freedom`` accepts when one of its normal numbers is z."""
    limit = chi2.isf(level, freedom)

    def accept(z):
        rest = limit - z**2
        return chi2.cdf(rest, freedom - 1) if freedom > 1 else (rest >= 0).astype(float)

    return accept


def wandering(scenario, density, slope):
    """The best linear estimate of the last position for a target with white acceleration, by batch.

    With ``K(a, b) = a^2 (3 b - a) / 6``, ``a <= b`` the times left, the displacements of the target from the
    uniform motion with its last state have the covariance ``density K`` in each component.

    Returns
    -------
    claimed, straight : ndarray, shape (2, 2)
        Its covariance by its own account; and if the target goes straight.
    gain : ndarray, shape (2,)
        Its error, without noise, where the standardised measurements are changed by ``slope`` ``(N,)``.
    """
    jacobian = whitened_jacobian(scenario)
    left = scenario.reference_time - scenario.times
    low, high = np.minimum.outer(left, left), np.maximum.outer(left, left)
    same = jacobian[:, :2] @ jacobian[:, :2].T
    spread = np.eye(len(left)) + density * same * low**2 * (3 * high - low) / 6
    weighted = np.linalg.solve(spread, jacobian)
    claimed = np.linalg.inv(jacobian.T @ weighted)
    map_ = (claimed @ weighted.T)[:2]
    return claimed[:2, :2], map_ @ map_.T, map_ @ slope


def watch_of_legs(legs):
    """The watch of the chapter with an own ship that turns to and fro, on a number of equal legs."""
    own = own_course(OWN_SPEED, [OWN_TURN * (k % 2) for k in range(legs)])
    return watch_from(own, watch().target)


def random_watch(legs, rng):
    """A watch with a number of legs in which the last position is known to a tenth of the range."""
    while True:
        turns = np.radians(rng.uniform(45, 120, legs - 1)) * (-1) ** np.arange(legs - 1)
        own = own_course(rng.uniform(4, 10), np.append(0.0, np.cumsum(turns)))
        distance, direction = rng.uniform(3e3, 15e3), rng.uniform(0, 2 * np.pi)
        place = distance * np.array([np.sin(direction), np.cos(direction)])
        scenario = watch_from(own, Target(place, rng.uniform(2, 10), rng.uniform(0, 2 * np.pi)))
        gap = scenario.target.position_at(scenario.times) - own.position_at(scenario.times)
        apart = np.hypot(*gap.T)
        if apart.min() < NEAREST:
            continue
        with np.errstate(invalid="ignore"):
            bound = np.sqrt(np.trace(crlb(scenario, scenario.state[None])[0, :2, :2]))
        if bound < WELL_SEEN * apart[-1]:
            return scenario


def price_of_turn(scenario, time=None):
    """What a turn does at the edge of noticing, a dict of numbers.

    ``harm`` is the error over the bound where the noncentrality is one, ``size`` that of the turn in metres,
    ``price`` that of a model that turns, ``bound`` the bound in metres, and ``drift`` the error in metres at
    which the test of drift notices every second turn.
    """
    found = departure_effect(scenario, a_metre_of(scenario, turn_of(scenario)), time)
    size, bound = 1 / np.sqrt(float(found.noncentrality(1.0))), np.sqrt(np.trace(found.bound))
    drift = float(found.error(found.hidden(0.5, "drift")))
    harm = float(found.error(size) / bound)
    return {"harm": harm, "size": size, "price": found.price, "bound": bound, "drift": drift}


def harms_of_watches(legs, count):
    """`price_of_turn` in random watches, a dict of arrays ``(count,)``; ``bound`` is over the last range."""
    rng = np.random.default_rng(STREAM.chunk(100 + legs))
    rows = []
    for _ in range(count):
        scenario = random_watch(legs, rng)
        row, end = price_of_turn(scenario), scenario.reference_time
        gap = scenario.target.position_at(end) - scenario.platform.position_at(end)
        rows.append(row | {"bound": row["bound"] / np.hypot(*gap)})
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _well_known(rows):
    """Encounters of the study with a best straight line whose bound is small enough to go by."""
    return np.isfinite(rows["misfit"] * rows["bias"]) & (rows["bound"] < KNOWN * rows["distance"])


def harms_of_tracks(rows):
    """Harm of what recorded targets did, by a table of the study: error over bound and root of the misfit.

    With ``size``: the departure from the best straight line over the root of the misfit, in metres.
    """
    chosen = _well_known(rows) & (rows["misfit"] <= MISFIT)
    part = {name: column[chosen] for name, column in rows.items()}
    root = np.sqrt(part["misfit"])
    return {"harm": part["bias"] / part["bound"] / root, "size": part["departure"] / root}


def hidden_of_tracks(rows, misfit):
    """Encounters with a misfit below a limit: how many, and how many of these err by more than the bound."""
    chosen = _well_known(rows) & (rows["misfit"] < misfit)
    ratio = rows["bias"][chosen] / rows["bound"][chosen]
    return {"hidden": int(chosen.sum()), "harmful": int((ratio > 1).sum())}


def bound_that_turns(scenario, rate=0.0):
    """Root of the trace of the bound of the last position for a model that turns, at a turn rate in rad/s."""
    found = crlb(with_model(scenario, TurningBearing()), [*scenario.state, rate])
    return float(np.sqrt(np.trace(found[:2, :2])))


def paper_bound():
    """Root of the trace of the bound of the last position in the reference geometry of `robustness`."""
    straight = paper.reference().straight
    final = position_criterion(straight, paper.DURATION)
    return float(np.sqrt(np.trace(final @ crlb(straight) @ final.T)))
