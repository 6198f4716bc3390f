"""`emw-acoustic`: the clouds of both estimators against the ellipse of the bound, which Figures 2-7 draw."""

from __future__ import annotations

import numpy as np

from ...bounds import crlb, nees
from ...consistency import fit_over_time
from ...recursive import ekf
from . import scenarios as emw
from .experiments import check_times

LEVEL = -2 * np.log(0.1)  # of the 90 % ellipse: chi-square with two degrees of freedom


def against_bound(seed, runs, number, times=None):
    """Both estimators over time, measured by the bound and not by what they claim themselves.

    Parameters
    ----------
    seed : see `Scenario.simulate`
    runs : int
    number : int
        Scenario 1 to 6, the observer's path as computed.
    times : sequence of float, optional
        When to look, in seconds; at `experiments.check_times` without.

    Returns
    -------
    dict
        ``mle_inside`` and ``ekf_inside``, ``(runs, T)``: whether the estimated position lies in the 90 %
        ellipse of the bound about the true one. ``mle_along`` and ``ekf_along``, ``(runs, T)``: the error
        along the line of sight, outwards, in standard deviations of the bound in that direction.
    """
    now = emw.scenario(number)
    times = check_times(number) if times is None else np.asarray(times, dtype=float)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    tracks = {
        "mle": fit_over_time(now, angles, times, start),
        "ekf": ekf(emw.filter_scenario(now), angles, emw.prior(start), record=times),
    }
    truth = now.target.position_at(times)
    sight = truth - now.platform.position_at(times)
    sight /= np.linalg.norm(sight, axis=-1, keepdims=True)
    bound = np.stack([crlb(now.until(time))[:2, :2] for time in times])
    sigma = np.sqrt(np.einsum("ti,tij,tj->t", sight, bound, sight))
    found = {}
    for name, track in tracks.items():
        position = track.state[..., :2]
        found[f"{name}_inside"] = nees(position, truth, bound) < LEVEL
        found[f"{name}_along"] = np.sum((position - truth) * sight, axis=-1) / sigma
    return found
