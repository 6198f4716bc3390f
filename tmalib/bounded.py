"""Batch estimates while measurements come in, from a memory of bounded size.

A batch estimate needs all measurements, and these grow without end. A recursive filter keeps a mean and a
covariance instead, and with them all linearisations that it ever made: what it did while the range was not
known it cannot take back. `refit` goes between. It keeps at most a few dozen *values* a sensor (see
`tmalib.remembered`), and fits the state to them anew whenever measurements have come in. What it keeps are
measurements, so that an early estimate does no lasting harm, and no prior is needed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from . import status as words
from .batch import fit
from .bounded_runs import RunsAlike, can_start, take_in, together, with_same_gaps
from .checks import LARGEST, as_numbers, check_broadcast, check_count, check_is, check_scalar
from .estimate import Estimate
from .recursive import Track
from .scenario import Scenario
from .types import BoolArray, FloatArray, TextArray
from .uniform import KINEMATIC, moving_pairs, propagate, transition

MOST = 64  # values of a sensor
FEWEST = 8  # of them that a memory can be asked to have


@dataclass(frozen=True, eq=False)
class RunningFit:
    """What is known after `refit`: an estimate of every run, and the values that it came from.

    Attributes
    ----------
    time : float
        Of the last measurement, and of the state.
    coordinates : tuple of str
    state : ndarray, shape (..., n)
        NaN where there is no estimate yet.
    covariance : ndarray, shape (..., n, n)
        The bound at the estimate, from the values kept; NaN where there is no estimate yet.
    status : ndarray of str, shape (...)
        A word of `tmalib.status`: ``"converged"``, or why there is no estimate yet.
    most : int
        Values kept of a sensor, at most.
    """

    time: float
    coordinates: tuple[str, ...]
    state: FloatArray
    covariance: FloatArray
    status: TextArray
    most: int
    parts: tuple[RunsAlike, ...] = field(repr=False)

    @property
    def converged(self) -> BoolArray:
        """Which runs have an estimate, ``(...)``."""
        return self.status == words.CONVERGED

    @property
    def kept(self) -> int:
        """Values kept of all sensors together, of the run that has most."""
        return max((part.values.shape[1] for part in self.parts), default=0)

    def at(self, time: float) -> Estimate:
        """The `Estimate` at another time, for a target that goes on straight: ``Phi X``, ``Phi P Phi'``."""
        elapsed = check_scalar("time", time) - self.time
        phi = transition(elapsed, self.coordinates)
        state = propagate(self.state, elapsed, self.coordinates)
        return Estimate(self.time + elapsed, self.coordinates, state, phi @ self.covariance @ phi.T)


def refit(
    known: RunningFit | None,
    scenario: Scenario,
    measured: ArrayLike,
    *,
    start: ArrayLike | None = None,
    most: int = MOST,
) -> RunningFit:
    """Take in one more measurement, or many, and fit the state to what is kept of all.

    Parameters
    ----------
    known : RunningFit or None
        What the last call returned; `None` for the first.
    scenario : Scenario
        The sensors that have measured since, with their times. Sensors of one name are the same, and of its
        model and platform the last ones count. A platform must know where it was at all times up to now. The
        target is not read.
    measured : array_like, shape (..., N)
        In the scenario's order; NaN is a missing one. The same runs as in the last call.
    start : array_like, shape (..., n), optional
        First guess of the state at the scenario's reference time, for the first call. Needed where `fit`
        needs one, for sensors none of which measures bearings or cosines; it counts until a fit converges.
    most : int
        Values kept of a sensor, at most, from 8 on; that of the first call.

    Returns
    -------
    RunningFit
        At the last time of the scenario. Memory and time of a call do not depend on how many measurements
        there were before.

    Raises
    ------
    ValueError
        For wrong shapes, a measurement from before the last call, a sensor without a sigma, two sensors of
        one name, one whose kind of model has changed, or a state whose motion is not uniform.

    Notes
    -----
    Derived at the top of this file. Runs in which other measurements are missing are fitted apart.

    Examples
    --------
    Bearings as they come in; before the manoeuvre at 300 s they tell no range:

    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> def heard(*times):
    ...     return tma.Scenario(ship, [tma.Sensor(tma.Bearing(), times, 0.01)], reference_time=times[-1])
    >>> truth = heard(*range(0, 600, 5)).with_target(tma.Target((2e3, 4e3), speed=6, heading=1.5))
    >>> known = None
    >>> for time, bearing in zip(truth.times, truth.simulate(runs=1, seed=1)[0]):
    ...     known = tma.refit(known, heard(time), [bearing])
    ...     if time in (200, 595):
    ...         print(known.time, known.status, known.kept)
    200.0 not observable 41
    595.0 converged 56
    >>> known.at(900.0).state.shape
    (4,)
    """
    measured = check_is("scenario", scenario, Scenario).check_measurements(measured)
    scenario.sigma  # noqa: B018  refused here where one is not known
    moving_pairs(scenario.coordinates)
    names = [sensor.name for sensor in scenario.sensors]
    if len(set(names)) < len(names):
        raise ValueError(f"sensors must have different names, got {names}")
    now, first = float(scenario.times.max()), scenario.times.min()
    known = (
        _nothing(scenario, measured, start, most) if known is None else check_is("known", known, RunningFit)
    )
    if measured.shape[:-1] != known.status.shape:
        raise ValueError(f"measurements must be of runs {known.status.shape}, got {measured.shape[:-1]}")
    if first < known.time:
        raise ValueError(f"scenario must not measure before the last call's {known.time}, got {first}")
    scenario = replace(scenario, reference_time=now, target=None)
    rows = measured.reshape(-1, measured.shape[-1])
    parts = tuple(
        take_in(part, scenario.keep(there), rows[part.runs][:, there], known.most) if there.any() else part
        for part, there in with_same_gaps(known.parts, rows)
    )
    wanted = dict.fromkeys((*known.coordinates, *scenario.coordinates))
    order = (*(n for n in KINEMATIC if n in wanted), *(n for n in wanted if n not in KINEMATIC))
    return RunningFit(now, order, *together(parts, known.status.shape, order, now), known.most, parts)


def running_fit(
    scenario: Scenario,
    angles: ArrayLike,
    record: ArrayLike | None = None,
    *,
    start: ArrayLike | None = None,
    most: int = MOST,
) -> Track:
    """`refit` for all measurements of a scenario, with its estimates at the recorded times.

    Parameters
    ----------
    scenario : Scenario
        What is assumed; its target is not read.
    angles : array_like, shape (..., N)
        Measurements, in the scenario's order; NaN is a missing one.
    record : array_like, shape (T,), optional
        Times of the estimates, each from the measurements up to it; by default the reference time.
    start, most : optional
        As in `refit`.

    Returns
    -------
    Track
        Its ``status`` and ``finite`` have a column a time here, ``(..., T)``: a run without an estimate at a
        time is NaN there, and may have one at the next.

    Raises
    ------
    ValueError
        As `refit`, and for times that do not increase.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> ear = tma.Sensor(tma.Bearing(), np.arange(0, 600, 1.0), sigma=0.02)
    >>> watch = tma.Scenario(ship, [ear], reference_time=599)
    >>> angles = watch.with_target(tma.Target((2e3, 4e3), speed=6, heading=1.5)).simulate(runs=3, seed=1)
    >>> track = tma.running_fit(watch, angles, [200, 400, 599])
    >>> track.state.shape, track.finite[:, -1]
    ((3, 3, 4), array([ True,  True,  True]))
    """
    angles = check_is("scenario", scenario, Scenario).check_measurements(angles)
    record = np.atleast_1d(as_numbers("record", scenario.reference_time if record is None else record))
    if record.ndim != 1 or np.any(np.diff(record) <= 0) or not np.all(np.abs(record) <= LARGEST):
        raise ValueError(f"record must be finite and strictly increasing, got {record}")
    known, before, names = _nothing(scenario, angles, start, most), -np.inf, scenario.coordinates
    sensors = [replace(sensor, name=f"{k} {sensor.name}") for k, sensor in enumerate(scenario.sensors)]
    scenario = replace(scenario, sensors=sensors, target=None)
    shape, n, count = angles.shape[:-1], len(names), len(record)
    state, covariance = np.full((*shape, count, n), np.nan), np.full((*shape, count, n, n), np.nan)
    status = np.full((*shape, count), words.NOT_OBSERVABLE, dtype=f"<U{words.WIDTH}")
    for k, time in enumerate(record):
        new = (scenario.times > before) & (scenario.times <= time)
        if new.any():
            known = refit(known, scenario.keep(new), angles[..., new])
        found = together(known.parts, shape, names, time)
        state[..., k, :], covariance[..., k, :, :], status[..., k] = found
        before = time
    return Track(record, state, covariance, status)


def _nothing(scenario, measured, start, most):
    """What is known before the first measurement."""
    most, shape, names = check_count("most", most, least=FEWEST), measured.shape[:-1], scenario.coordinates
    runs, n = int(np.prod(shape)), len(names)
    state = np.full((runs, n), np.nan)
    if start is not None:
        start = scenario.check_state(start)
        check_broadcast(measurements=measured[..., 0], start=start[..., 0])
        state[:] = np.broadcast_to(start, (*shape, n)).reshape(-1, n)
    elif not can_start(scenario):
        fit(scenario, measured)  # raises, and says what it needs
    status = np.full(runs, words.NOT_OBSERVABLE, dtype=f"<U{words.WIDTH}")
    covariance, time = np.full((runs, n, n), np.nan), scenario.reference_time
    part = RunsAlike(
        np.arange(runs), None, np.empty((runs, 0)), 0, time, names, state, state, covariance, status
    )
    none = np.full((*shape, n), np.nan), covariance.reshape(*shape, n, n), status.reshape(shape)
    return RunningFit(-np.inf, names, *none, most, (part,))
