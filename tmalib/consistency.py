"""Does an estimator's error have the size that its covariance says, and from when on?

A `Track` holds estimates and covariances at several times. `fit_over_time` makes one of batch estimates,
each from the measurements up to its time; `tmalib.recursive.ekf` makes one of a filter.
`compare_with_truth` compares either with the truth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .batch import fit
from .bounds import crlb, nees
from .checks import check_array, check_is, check_probability
from .motion import Target
from .recursive import Track
from .scenario import Scenario
from .status import CONVERGED
from .types import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Consistency:
    """Output of `compare_with_truth`; a row a run, a column a time.

    Attributes
    ----------
    times : ndarray, shape (T,)
    nees : ndarray, shape (..., T)
        Normalised error squared of the state: chi-square with n degrees of freedom, if consistent. NaN where
        there is none (see `tmalib.nees`).
    inside : ndarray of bool, shape (..., T)
        Whether the true position lies in the confidence ellipse of the covariance; `False` without one.
    finite : ndarray of bool, shape (..., T)
        Whether there is something to compare: of these runs a share ``inside.sum(0) / finite.sum(0)`` is
        inside. A fit that ended far away is finite; the ``finite`` of its track tells that it failed.
    """

    times: FloatArray
    nees: FloatArray
    inside: BoolArray
    finite: BoolArray


def fit_over_time(scenario: Scenario, angles: ArrayLike, times: ArrayLike, start: ArrayLike) -> Track:
    """Batch estimates at several times, each from the measurements up to it, as a `Track`.

    Parameters
    ----------
    scenario : Scenario
        With its target: the covariance of an estimate is the bound at the true state.
    angles : array_like, shape (..., N)
    times : array_like, shape (T,)
    start : array_like, shape (..., n)
        First guess, as in `tmalib.batch.fit`.

    Returns
    -------
    Track
        ``state (..., T, n)``, ``covariance (T, n, n)``, and the first status that is not *converged*. A
        run that is lost at some time stays in the track, NaN or as far as its fit went.

    Raises
    ------
    ValueError
        For wrong shapes, no times, or a time at which the true state is not observable yet.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> course = tma.Course((0, 0), 8, 0.0, [tma.Straight(60), tma.Turn(60, 0.02), tma.Straight(60)])
    >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(181.0), sigma=0.01)
    >>> scenario = tma.Scenario(course, [ear], 180.0, tma.Target((3e3, 4e3), speed=5, heading=1.0))
    >>> angles = scenario.simulate(runs=5, seed=1)
    >>> track = fit_over_time(scenario, angles, [120, 180], start=scenario.state)
    >>> compare_with_truth(scenario, track).nees.shape
    (5, 2)
    """
    angles = check_is("scenario", scenario, Scenario).check_measurements(angles)
    times = check_array("times", times, (None,))
    if not len(times):
        raise ValueError("times is empty; a track needs at least one time")
    thens = [scenario.until(time) for time in times]
    bounds = np.stack([_bound(then) for then in thens])
    fits = [
        fit(then, angles[..., scenario.columns_until(time)], start)
        for then, time in zip(thens, times, strict=True)
    ]
    return Track(
        times,
        np.stack([found.state for found in fits], axis=-2),
        bounds,
        _worst([found.status for found in fits]),
    )


def _worst(statuses):
    """The first of several statuses ``(T, ...)`` of each run that is not *converged*, ``(...)``."""
    statuses = np.stack(statuses)
    first = np.argmax(statuses != CONVERGED, axis=0)
    return np.take_along_axis(statuses, first[None], axis=0)[0]


def _bound(scenario):
    try:
        return crlb(scenario)
    except ValueError as error:
        raise ValueError(f"times: no bound at {scenario.reference_time} s: {error}") from None


def compare_with_truth(scenario: Scenario, track: Track, probability: float = 0.9) -> Consistency:
    """Compare a track with the scenario's target, run by run and time by time.

    Parameters
    ----------
    scenario : Scenario
        With its target, in constant velocity motion.
    track : Track
    probability : float
        Of the confidence ellipse.

    Returns
    -------
    Consistency

    Notes
    -----
    The position lies in its ellipse when its normalised error squared is below ``-2 log(1 - p)``.
    """
    level = -2 * np.log1p(-check_probability(probability))
    target = check_is("the scenario's target", check_is("scenario", scenario, Scenario).target, Target)
    check_is("track", track, Track)
    truth = np.stack([target.state(time, scenario.coordinates) for time in track.times])
    position = nees(track.state[..., :2], truth[:, :2], track.covariance[..., :2, :2])
    whole = nees(track.state, truth, track.covariance)
    finite = np.isfinite(whole) & np.isfinite(position)
    return Consistency(track.times, whole, finite & (position <= level), finite)
