"""`emw-acoustic`: how often ellipse and likelihood region hold the truth, at a time before the last."""

from __future__ import annotations

import numpy as np

from ...batch import fit
from ...bounds import crlb, nees
from ...profile import profile_criterion
from . import scenarios as emw


def squares_at_the_truth(seed, runs, number, time):
    """One chunk: two squares of the error of the position, each chi-square with two degrees of freedom.

    Parameters
    ----------
    seed : see `Scenario.simulate`
    runs : int
    number : int
        Scenario 1 to 6, the observer's path as computed.
    time : float
        The measurements up to it are fitted, without a start.

    Returns
    -------
    dict
        ``ellipse (runs,)``: the normalised error squared, against the covariance of the fit; infinite where
        the fit has not converged and there is no ellipse. ``region (runs,)``: the profile of the criterion.
        The truth is inside where the square is at most ``-2 log(1 - probability)``.
    """
    now = emw.scenario(number).until(time)
    angles = now.simulate(runs, seed)
    found = fit(now, angles)
    off = nees(found.state[:, :2], now.state[:2], found.covariance[:, :2, :2])
    ellipse = np.where(found.converged & np.isfinite(off), off, np.inf)
    return {"ellipse": ellipse, "region": profile_criterion(now, angles, now.state[:2])}


def bound_over_range(number, time):
    """Bound on the range at a time, over the range."""
    now = emw.scenario(number).until(time)
    gap = now.state[:2] - now.platform.position_at(now.reference_time)
    distance = np.hypot(*gap)
    along = gap / distance
    return np.sqrt(along @ crlb(now)[:2, :2] @ along) / distance
