"""An encounter tried out: bearings of the recorded target simulated many times, fitted as a straight line."""

from __future__ import annotations

import numpy as np

from ..batch import fit
from ..bounds import crlb
from ..scenario import Scenario
from ..sensors import Sensor
from .encounters import best_line, largest_departure

ELLIPSE = 0.9  # probability of the ellipse that is to hold the true position
LEVELS = (0.05, 0.01)  # of the p-value below which a straight line is refused
CLOSE = 1e-3  # two criteria that differ by less, of one plus themselves, are of one minimum


def watch_of(encounter, rules, model):
    """The `Scenario` of an own ship, the state wanted at the last bearing."""
    sensor = Sensor(model, rules.times, rules.sigma)
    return Scenario(encounter.platform, [sensor], reference_time=float(rules.times[-1]))


def nearest_line(watch, exact, start):
    """The straight line that explains exact bearings best, and its criterion: the better of two fits."""
    both = [fit(watch, exact), fit(watch, exact, start)]
    best = min(both, key=lambda found: found.cost if found.converged else np.inf)
    return (best.state, float(best.cost)) if best.converged else (np.full(4, np.nan), np.nan)


def lost_runs(found, known):
    """Of fits of the same runs: which of ``found`` are lost, and which have no minimum that any has found.

    ``known`` are fits from good starts. A run is lost if one of them has converged, and ``found`` has not, or
    to a criterion that is higher.
    """
    best = np.min([np.where(one.converged, one.cost, np.inf) for one in known], axis=0)
    ours = np.where(found.converged, found.cost, np.inf)
    none = np.isinf(ours) & np.isinf(best)
    with np.errstate(invalid="ignore"):  # inf - inf, of the runs without a minimum
        return (ours - best > CLOSE * (1 + best)) & ~none, none


def try_encounter(encounter, rules, model, rng):
    """Measures of one encounter, a dict of numbers.

    The target is where it was recorded; the noise of its bearings is drawn ``rules.draws`` times, and each
    draw fitted without a start. *Line* is the straight line of constant velocity nearest to the recorded
    track. The same noise is then given to a target on the line; what `outcomes` counts of that begins with
    ``line_``.

    =============  =====================================================================
    ``distance``   metres, from own ship to target at the last bearing
    ``departure``  metres, largest distance of the target from its line
    ``misfit``     criterion of the straight line that explains exact bearings best; NaN without one
    ``bias``       metres, from that line's last position to the target
    ``bound``      metres, root of the trace of the bound of the last position, at the line
    ``draws``      how many
    =============  =====================================================================
    """
    watch, last = watch_of(encounter, rules, model), float(rules.times[-1])
    scenario, line = watch.with_target(encounter.motion), best_line(encounter.motion, rules.times)
    exact, truth = scenario.measure(), encounter.motion.position_at(last)
    state, misfit = nearest_line(watch, exact, line.state(last))
    noise = rng.standard_normal((rules.draws, len(exact))) * watch.sigma
    straight = watch.with_target(line).measure() + noise
    ours = outcomes(watch, exact + noise, truth, [line.state(last), state])
    control = outcomes(watch, straight, line.position_at(last), [line.state(last)])
    return {
        "distance": float(np.hypot(*(truth - encounter.platform.position_at(last)))),
        "departure": largest_departure(encounter.motion, rules.times),
        "misfit": misfit,
        "bias": float(np.hypot(*(state[:2] - truth))),
        "bound": float(_size(crlb(watch.with_target(line))[:2, :2])),
        "draws": rules.draws,
        **ours,
        **{f"line_{name}": value for name, value in control.items()},
    }


def outcomes(watch, angles, truth, starts):
    """What becomes of many fits without a start, and how far they end from the true last position.

    ======================  ==============================================================================
    ``converged``           runs; the next two are of all runs, all others of these
    ``lost``, ``none``      runs that are lost; that have no minimum at a finite range, as far as is known
    ``refused_5``, ``_1``   runs with a p-value below 5, 1 per cent
    ``inside``              runs whose own 90 % ellipse holds the true position
    ``inside_accepted``     those of them with a p-value of 1 per cent and more
    ``median_error``        metres, of the last position
    ``rms_error``           the same as root mean square
    ``stated``              median of what the fits state for it
    ======================  ==============================================================================
    """
    found = fit(watch, angles)
    lost, none = lost_runs(found, [fit(watch, angles, start) for start in starts])
    there = found.converged
    error, covariance = found.state[there, :2] - truth, found.covariance[there, :2, :2]
    square = np.einsum("ri,rij,rj->r", error, np.linalg.inv(covariance), error)
    inside = square <= -2 * np.log(1 - ELLIPSE)  # chi-square of two degrees of freedom
    p_value, length = found.p_value[there], np.hypot(*error.T)
    return {
        "converged": int(there.sum()),
        "lost": int(lost.sum()),
        "none": int(none.sum()),
        "refused_5": int((p_value < LEVELS[0]).sum()),
        "refused_1": int((p_value < LEVELS[1]).sum()),
        "inside": int(inside.sum()),
        "inside_accepted": int((inside & (p_value >= LEVELS[1])).sum()),
        "median_error": _over(np.median, length),
        "rms_error": _over(lambda e: np.sqrt(np.mean(e**2)), length),
        "stated": _over(np.median, _size(covariance)),
    }


def _size(covariance):
    return np.sqrt(np.trace(covariance, axis1=-2, axis2=-1))


def _over(statistic, values):
    return float(statistic(values)) if len(values) else np.nan
