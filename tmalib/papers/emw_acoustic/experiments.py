"""`emw-acoustic`: the Monte-Carlo experiments of Section V.

Each experiment is a task for `tmalib.monte_carlo`: a function of a seed and a number of runs.
"""

from __future__ import annotations

import numpy as np

from ...batch import fit
from ...bounds import crlb, nees
from ...consistency import compare_with_truth, fit_over_time
from ...ellipse import confidence_ellipse
from ...recursive import ekf
from . import scenarios as emw


def both_estimators(seed, runs, number):
    """One chunk of the experiment of Section V: both estimators on the same bearings.

    Parameters
    ----------
    seed : see `Scenario.simulate`
    runs : int
    number : int
        Scenario 1 to 6, the observer's path as computed.

    Returns
    -------
    dict
        ``mle`` and ``ekf``: errors of the final state, ``(runs, 4)``; ``mle_converged``; ``mle_nees``
        against the bound and ``ekf_nees`` against the covariance that the filter claims, ``(runs,)``.
    """
    now = emw.scenario(number)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    batch = fit(now, angles, start)
    track = ekf(emw.filter_scenario(now), angles, emw.prior(start))
    final, claimed = track.state[:, -1], track.covariance[:, -1]
    return {
        "mle": batch.state - now.state,
        "mle_converged": batch.converged,
        "mle_nees": nees(batch.state, now.state, crlb(now)),
        "ekf": final - now.state,
        "ekf_nees": nees(final, now.state, claimed),
    }


def filter_alone(seed, runs, number, gradient, first_again):
    """Errors of the EKF alone, ``{"ekf": (runs, 4)}``, for a variant of the filter.

    ``gradient`` as in `filter_scenario`, ``first_again`` as in `prior`. The bearings are those of
    `both_estimators`.
    """
    now = emw.scenario(number)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    track = ekf(emw.filter_scenario(now, gradient), angles, emw.prior(start, first_again))
    return {"ekf": track.state[:, -1] - now.state}


def positions_at_instants(seed, runs, number):
    """Estimated positions at the figure's `instants`: ``mle`` and ``ekf``, ``(runs, 3, 2)``, metres.

    The MLE at an instant uses the bearings up to it.
    """
    now = emw.scenario(number)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    times = emw.instants(number)
    batch = fit_over_time(now, angles, times, start)
    track = ekf(emw.filter_scenario(now), angles, emw.prior(start), record=times)
    return {"mle": batch.state[:, :, :2], "ekf": track.state[:, :, :2]}


def check_times(number):
    """Times at which `consistency_of_both` looks: twelve, multiples of 20 s, the last is t_M."""
    end = emw.scenario(number).reference_time
    return np.array([*(20.0 * np.round(np.linspace(end / 6, end, 12)[:-1] / 20)), end])


def consistency_of_both(seed, runs, number):
    """Do the estimators' errors have the size that their covariance says, and from when on?

    Returns
    -------
    dict
        ``mle_nees`` and ``ekf_nees``, ``(runs, T)`` at `check_times`: the normalised error squared of the
        state, for the MLE against the bound and for the EKF against the covariance it claims.
        ``mle_inside`` and ``ekf_inside``, ``(runs, T)``: whether the true position lies in the 90 %
        ellipse of that same covariance.
    """
    now, times = emw.scenario(number), check_times(number)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    tracks = {
        "mle": fit_over_time(now, angles, times, start),
        "ekf": ekf(emw.filter_scenario(now), angles, emw.prior(start), record=times),
    }
    found = {}
    for name, track in tracks.items():
        compared = compare_with_truth(now, track)
        found |= {f"{name}_nees": compared.nees, f"{name}_inside": compared.inside}
    return found


def ellipses(number, probability=0.9):
    """Confidence ellipses of the bound at the figure's `instants`, centred on the true position."""
    now = emw.scenario(number)
    thens = [now.until(time) for time in emw.instants(number)]
    return [confidence_ellipse(then.state, crlb(then), probability) for then in thens]
