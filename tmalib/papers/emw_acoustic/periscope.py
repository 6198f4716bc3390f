"""`emw-acoustic`: both estimators in the short-range scenarios with other bearings of the periscope.

The conclusion says that the filter "seems to be insensitive to these additional measurements when the
sampling period is about 2 minutes". So the period is varied; an infinite one leaves the first bearing, which
makes the starting point, and no other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...batch import fit
from ...recursive import ekf
from . import scenarios as emw

SHORT_RANGE = (2, 4, 6)  # the scenarios with a periscope


def scenario_every(number, period):
    """A short-range scenario with a periscope's bearing every ``period`` seconds.

    Parameters
    ----------
    number : int
        2, 4 or 6.
    period : float
        A multiple of the sonar's 4 s, so that every bearing has one of the sonar beside it; or infinite, for
        the bearing at t_1 alone.

    Raises
    ------
    ValueError
        For another scenario or period.
    """
    if number not in SHORT_RANGE:
        raise ValueError(f"number must be one of {SHORT_RANGE}, which have a periscope, got {number!r}")
    now = emw.scenario(number)
    periscope, sonar = now.sensors
    if not (period > 0 and (np.isinf(period) or period % 4 == 0)):
        raise ValueError(f"period must be a positive multiple of 4 s, or infinite, got {period!r}")
    times = sonar.times[:1] if np.isinf(period) else sonar.times[sonar.times % period == 0]
    return replace(now, sensors=[replace(periscope, times=times), sonar])


def errors_every(seed, runs, number, period):
    """Task: errors of both estimators at the end, ``mle`` and ``ekf``, each ``(runs, 4)``."""
    now = scenario_every(number, period)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    track = ekf(now, angles, emw.prior(start))
    return {"mle": fit(now, angles, start).state - now.state, "ekf": track.state[:, -1] - now.state}
