"""`conical-angles`, Section 5.2 with something that varies from run to run: in search of Tables 5 and 6.

A random factor on the whole state gives the printed numbers, as if a depth had varied. These are causes that
would make one, each with a single size to choose.
"""

from __future__ import annotations

import numpy as np

from ...batch import fit
from . import scenarios as conical
from .paper import PAPER
from .tables import PRINTED_RUNS, ROWS
from .variants import START

GROUPS = 25  # runs with similar assumptions share an estimator
ASSUMED = 300.0  # m
SETTINGS = {  # what varies in a run, from a generator, the number of runs, the bottom depth and a size
    "assumed depth, fixed": lambda rng, runs, bottom, size: {"depth": np.full(runs, size)},
    "assumed depth, 0 to a limit": lambda rng, runs, bottom, size: {"depth": rng.uniform(0, size, runs)},
    "assumed depth, 300 m to a limit": lambda rng, runs, bottom, size: {
        "depth": rng.uniform(ASSUMED, size, runs)
    },
    "assumed depth, to a share of the bottom": lambda rng, runs, bottom, size: {
        "depth": rng.uniform(0, size * bottom, runs)
    },
    "assumed bottom, too shallow by a share": lambda rng, runs, bottom, size: {
        "bottom": np.full(runs, bottom * (1 - size))
    },
    "assumed bottom, Gaussian about the true": lambda rng, runs, bottom, size: {
        "bottom": bottom * (1 + rng.normal(0, size, runs))
    },
    "assumed bottom, half Gaussian below it": lambda rng, runs, bottom, size: {
        "bottom": bottom * (1 - np.abs(rng.normal(0, size, runs)))
    },
    "array depth, 0 to a limit": lambda rng, runs, bottom, size: {"array": rng.uniform(0, size, runs)},
    "heading of the array": lambda rng, runs, bottom, size: {"heading": rng.normal(0, size, runs)},
    "pitch of the array": lambda rng, runs, bottom, size: {"pitch": rng.normal(0, size, runs)},
    "sound speed at the array": lambda rng, runs, bottom, size: {"speed": rng.normal(0, size, runs)},
    "cosines rounded": lambda rng, runs, bottom, size: {"rounding": size},
}


def varied_runs(seed, runs, bottom_depth, cause, size):
    """Errors of the initial state, ``(runs, 4)``, where one of `SETTINGS` varies.

    Parameters
    ----------
    seed : SeedSequence
    runs : int
    bottom_depth : float
        In metres.
    cause : str
        Of `SETTINGS`.
    size : float
        Metres, radians or a share, as the cause says. With a size of zero the last four change nothing.
    """
    described = conical.section_5_2(bottom_depth, ASSUMED)
    rng = np.random.default_rng([*seed.generate_state(2), len(cause)])
    changed = SETTINGS[cause](rng, runs, bottom_depth, size)
    depth = changed.pop("depth", np.full(runs, ASSUMED))
    bottom = changed.pop("bottom", np.full(runs, bottom_depth))
    measured = described.simulate(runs, seed)
    if unit := changed.pop("rounding", 0):
        measured = unit * np.round(measured / unit)
    if changed:
        measured = measured - described.measure() + cosines(described, bottom_depth, **changed)
    errors = np.empty((runs, 4))
    for group in np.array_split(np.lexsort((depth, bottom)), GROUPS):
        estimator = conical.section_5_2(bottom[group].mean(), depth[group].mean())
        errors[group] = fit(estimator, measured[group], np.array(START)).state - described.state
    return errors


def cosines(scenario, bottom_depth, array=None, heading=0.0, pitch=0.0, speed=0.0):
    """Both cosines without noise, ``(runs, N)``, for an array that is not what it is taken for.

    With ``a`` the array's axis, ``(sin h cos p, cos h cos p, sin p)``, and ``d`` the direction to the image,
    ``m = (1 + s) a . d``. Arguments ``(runs,)``: depth in metres, heading and pitch in radians, and the share
    ``s`` by which the assumed sound speed is too large.
    """
    array = conical.ARRAY_DEPTH if array is None else array
    *settings, array = (np.atleast_1d(value)[:, None] for value in (heading, pitch, speed, array))
    heading, pitch, speed = settings
    found = []
    for image, sensor in zip((1.0, -1.0), scenario.sensors, strict=True):
        x, y = scenario.target.position_at(sensor.times).T
        depth = conical.TARGET_DEPTH if image > 0 else 2 * bottom_depth - conical.TARGET_DEPTH
        zeta = depth - array
        along = np.cos(pitch) * (x * np.sin(heading) + y * np.cos(heading)) + np.sin(pitch) * zeta
        found.append((1 + speed) * along / np.sqrt(x**2 + y**2 + zeta**2))
    return np.concatenate(found, axis=-1)


def chi_square(table, errors):
    """Chi-square of the eight printed biases and spreads of a table together, to compare causes by.

    The deviations are correlated as the errors of the components are::

        chi^2 = d' C^-1 d,   C = cov(influence) (1 / 500 + 1 / runs) + unit^2 / 12

    with the influence of one run ``-e`` on a bias and ``(e^2 - s^2) / (2 s)`` on a standard deviation ``s``.

    Parameters
    ----------
    table : str
    errors : ndarray, shape (runs, 4)
        Estimate minus truth.

    Returns
    -------
    float
    """
    printed = [PAPER.printed(table, row, column) for column in ("bias", "std_sample") for row in ROWS]
    std, each = errors.std(axis=0, ddof=1), errors - errors.mean(axis=0)
    covariance = np.cov(np.concatenate([-each, (each**2 - std**2) / (2 * std)], axis=1).T)
    covariance *= 1 / PRINTED_RUNS + 1 / len(errors)
    covariance += np.diag(np.square([p.last_digit for p in printed])) / 12
    deviation = np.concatenate([-errors.mean(axis=0), std]) - [p.value for p in printed]
    return float(deviation @ np.linalg.solve(covariance, deviation))
