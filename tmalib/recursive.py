"""Extended Kalman filters: `ekf` takes all measurements at once, `predict` and `update` one after the other.

*Without process noise* the target's state at the reference time does not change: `ekf` carries ``X(t_ref)``
and needs no prediction step. This is the filter of `emw-acoustic`, Section IV.B, exactly: ``Phi`` moves mean,
covariance and gradient to any other time. The step of a measurement is that of `tmalib.kalman`.

*With process noise* `ekf` carries ``Phi(t_ref - t) X(t)``, the state at the reference time of a target that
nothing disturbs after t. From t to t + T this mean stays, and its covariance grows by ``Phi Q(T) Phi'`` with
``Phi = Phi(t_ref - t - T)``: the textbook's prediction ``Phi(T) P Phi(T)' + Q(T)``, in other coordinates.
`predict` and `update` carry the state at the time itself. The results are the same.

*Modified polar coordinates.* The filter of Aidala and Hammel (1983) carries ``Y = psi_k(Phi_k X)``, the
target's state at the time of a measurement in modified polar coordinates about the platform. Its
transition is nonlinear, ``Y_k = psi_k(Phi psi_{k-1}^{-1}(Y_{k-1}))``, and its Jacobian is
``D_k Phi D_{k-1}^{-1}`` with ``D = d psi / d X``, all taken at one state. In Cartesian coordinates these
factors cancel: between measurements the filter does what the Cartesian one does. Process noise disturbs the
Cartesian state and changes nothing of this. What is left of the change of coordinates is the update (see
`tmalib.kalman`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import status as words
from .charts import ChartMaker
from .checks import check_is, check_scalar
from .kalman import (
    chart_at,
    check_noise,
    check_record,
    checked_inputs,
    gate_limit,
    in_columns,
    in_state,
    update_state,
)
from .priors import FilterState, Prior
from .process_noise import ProcessNoise
from .scenario import Scenario
from .sensors import in_order_of_time
from .types import BoolArray, FloatArray, TextArray
from .uniform import propagate, transition


@dataclass(frozen=True, eq=False)
class Track:
    """Output of `ekf` at the recorded times, and what became of the N measurements.

    Attributes
    ----------
    times : ndarray, shape (T,)
    state : ndarray, shape (..., T, n)
        Filtered state *at* each of the times.
    covariance : ndarray, shape (..., T, n, n)
        What the filter claims of it.
    status : ndarray of str, shape (...)
        A word of `tmalib.status`: ``"filtered"``, or ``"not finite"`` for a run in which some estimate is not
        a finite number; the run stays in the track. Of batch estimates ``"converged"``, or why one has not.
    nis : ndarray, shape (..., N)
        Normalised innovation squared of each measurement, in the scenario's order: chi-square with one degree
        of freedom if the filter is right. NaN for a missing measurement and for those not later than the
        prior; `None` in a track that is not a filter's.
    used : ndarray of bool, shape (..., N)
        `False` for a measurement that is missing, outside the gate, or not later than the prior; or `None`.
    """

    times: FloatArray
    state: FloatArray
    covariance: FloatArray
    status: TextArray
    nis: FloatArray | None = None
    used: BoolArray | None = None

    @property
    def finite(self) -> BoolArray:
        """Which runs came to a good end, ``(...)``: filtered, or converged at all times."""
        return np.isin(self.status, [words.FILTERED, words.CONVERGED])


def ekf(
    scenario: Scenario,
    angles: ArrayLike,
    prior: Prior,
    record: ArrayLike | None = None,
    chart: ChartMaker | None = None,
    *,
    process_noise: ProcessNoise | None = None,
    gate: float | None = None,
) -> Track:
    """Extended Kalman filter for a target in constant velocity motion, or near to it.

    Parameters
    ----------
    scenario : Scenario
        What the filter assumes; its target is not read.
    angles : array_like, shape (..., N)
        Measurements, in the scenario's order. NaN is a missing one: that run does without it.
    prior : Prior
        With the components of the scenario, in its order.
    record : array_like, shape (T,), optional
        Times at which to keep the estimate, also before or after all data; measurements at a recorded time
        are used first. The default is the reference time alone.
    chart : callable, optional
        Coordinates in which an update is a straight step, about the platform at the time (see
        `tmalib.charts`); with `ModifiedPolar` this is the filter in modified polar coordinates. The default
        is Cartesian.
    process_noise : ProcessNoise, optional
        What disturbs the target, and which further unknowns wander. The default is nothing.
    gate : float, optional
        Probability with which a measurement passes if the filter is right; a less likely innovation is not
        used. By default all are.

    Returns
    -------
    Track
        A run whose inverse range becomes zero or negative has no state: it is NaN from there on, and
        ``finite`` says so.

    Raises
    ------
    ValueError
        For wrong shapes, a prior later than all data, a state whose motion is not uniform, or, with process
        noise, a recorded time before the prior's.

    Notes
    -----
    Sources: `emw-acoustic`, Section IV.B; in modified polar coordinates `robustness`, Section IV, and
    Aidala and Hammel (1983). Their rates are of the relative motion, those of `ModifiedPolar` the target's.

    Examples
    --------
    A target that wanders, and one wild bearing among 121:

    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> ear = tma.Sensor(tma.Bearing(), np.arange(0, 601, 5.0), sigma=0.01)
    >>> watch = tma.Scenario(ship, [ear], reference_time=600)
    >>> angles = watch.with_target(tma.Target((2e3, 4e3), 6, 1.5)).simulate(runs=1, seed=1)[0]
    >>> angles[60] += 0.5
    >>> prior = tma.prior_along_first_bearing(watch, angles, 5e3, 2e3, 10.0)
    >>> track = tma.ekf(watch, angles, prior, process_noise=tma.ProcessNoise(1e-4), gate=0.999)
    >>> np.flatnonzero(~track.used), bool(track.nis[60] > 1000)
    (array([ 0, 60]), True)
    """
    angles, names = checked_inputs(scenario, angles, prior, process_noise, chart)
    if names != scenario.coordinates:
        raise ValueError(f"prior must have the components {scenario.coordinates}, in this order, got {names}")
    limit, reference = gate_limit(gate), scenario.reference_time
    if prior.time > scenario.times.max():
        raise ValueError(f"prior is of {prior.time} s, and there is no measurement after it: use predict")
    record = check_record(record, reference, None if process_noise is None else prior)
    back = transition(reference - prior.time, names)
    mean, covariance = propagate(prior.mean, reference - prior.time, names), back @ prior.covariance @ back.T
    x, p, measured, shape = in_columns(mean, covariance, angles)

    nis, used = np.full(measured.shape, np.nan), np.zeros(measured.shape, dtype=bool)
    kept_x, kept_p, now = [], [], prior.time
    with np.errstate(all="ignore"):  # a diverging run shows in `finite`
        for time, group in _with_records(in_order_of_time(scenario, prior.time), record):
            if process_noise is not None:
                back = transition(reference - time, names)
                p = p + (back @ process_noise.covariance(time - now, names) @ back.T)[..., None]
                now = time
            if group is None:
                kept_x.append(x)
                kept_p.append(p)
                continue
            here = chart and chart_at(chart, scenario, group, time, names)
            seen = [(*where, measured[i]) for i, *where in group]
            x, p, squares, taken = update_state(x, p, seen, limit, here, time - reference)
            for (i, *_), square, took in zip(group, squares, taken, strict=True):
                nis[i], used[i] = square, took

    elapsed = record - reference
    phi = transition(elapsed, names)
    means, spreads = (np.reshape(kept, (len(record), *a.shape)) for kept, a in ((kept_x, x), (kept_p, p)))
    state = propagate(np.moveaxis(means, -1, 0), elapsed, names)
    claimed = phi @ np.moveaxis(spreads, -1, 0) @ phi.mT
    state, claimed = (part.reshape(shape + part.shape[1:]) for part in (state, claimed))
    nis, used = (part.T.reshape(*shape, len(part)) for part in (nis, used))
    return Track(record, state, claimed, words.status_of_filter(state, claimed), nis, used)


def predict(prior: Prior, time: float, process_noise: ProcessNoise | None = None) -> FilterState:
    """What is known at a later time, without further measurements: ``Phi X`` and ``Phi P Phi' + Q``.

    Parameters
    ----------
    prior : Prior
        Of one run or many.
    time : float
        Not before the prior's.
    process_noise : ProcessNoise, optional

    Returns
    -------
    FilterState
        At ``time``.

    Raises
    ------
    ValueError
        For a time before the prior's, or a prior without names of its components.
    """
    names, time = check_is("prior", prior, Prior).coordinates, check_scalar("time", time)
    check_noise(process_noise)
    elapsed = time - prior.time
    if names is None:
        raise ValueError("prior must have coordinates, the names of its components, got None")
    if elapsed < 0:
        raise ValueError(f"time must not be before the prior's, {prior.time}, got {time}")
    phi = transition(elapsed, names)
    added = (process_noise or ProcessNoise()).covariance(elapsed, names)
    with np.errstate(all="ignore"):  # a diverged run stays
        covariance = phi @ prior.covariance @ phi.T + added
        return FilterState(propagate(prior.mean, elapsed, names), covariance, time, names)


def update(
    prior: Prior,
    scenario: Scenario,
    measured: ArrayLike,
    *,
    process_noise: ProcessNoise | None = None,
    gate: float | None = None,
    chart: ChartMaker | None = None,
) -> FilterState:
    """What is known after one more measurement, or a few: `predict` to its time, and take it in.

    One call after the other gives what `ekf` gives for all at once, to rounding.

    Parameters
    ----------
    prior : Prior
        Of one run or many. It may have components that no sensor of the scenario sees.
    scenario : Scenario
        The sensors that have measured, with the times and the platform; its reference time is not read. For
        measurements taken at the same time to be linearised at the same state, it has them all.
    measured : array_like, shape (..., N)
        In the scenario's order; NaN is a missing one.
    process_noise, gate, chart : optional
        As in `ekf`.

    Returns
    -------
    FilterState
        At the last time of the scenario; it is the prior of the next call.

    Raises
    ------
    ValueError
        For wrong shapes, a measurement from before the prior's time, or a prior that lacks a component.

    Examples
    --------
    Bearings as they come in:

    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> def heard(time):
    ...     return tma.Scenario(ship, [tma.Sensor(tma.Bearing(), [time], 0.01)], reference_time=time)
    >>> known = tma.prior_along_first_bearing(heard(0.0), [0.46], 5e3, 2e3, 10.0)
    >>> wander = tma.ProcessNoise(1e-4)
    >>> for time, bearing in [(5.0, 0.47), (10.0, np.nan), (15.0, 0.48)]:
    ...     known = tma.update(known, heard(time), [bearing], process_noise=wander, gate=0.999)
    ...     print(known.time, known.used)
    5.0 [ True]
    10.0 [False]
    15.0 [ True]
    """
    measured, names = checked_inputs(scenario, measured, prior, process_noise, chart)
    limit, first = gate_limit(gate), scenario.times.min()
    if first < prior.time:
        raise ValueError(f"scenario must not measure before the prior's time {prior.time}, got {first}")
    found: Any = replace(prior, coordinates=names)
    *_, runs = in_columns(prior.mean, prior.covariance, measured)
    nis, used = np.empty((*runs, measured.shape[-1])), np.empty((*runs, measured.shape[-1]), dtype=bool)
    for time, group in in_order_of_time(scenario, -np.inf):
        found = predict(found, time, process_noise)
        x, p, values, shape = in_columns(found.mean, found.covariance, measured)
        here = chart and chart_at(chart, scenario, group, time, names)
        seen = [(in_state(block, names), site, 0.0, values[i]) for i, block, site, _ in group]
        with np.errstate(all="ignore"):
            x, p, squares, taken = update_state(x, p, seen, limit, here)
        for (i, *_), square, took in zip(group, squares, taken, strict=True):
            nis[..., i], used[..., i] = square.reshape(shape), took.reshape(shape)
        mean, covariance = x.T.reshape(*shape, len(x)), np.moveaxis(p, -1, 0).reshape(*shape, *p.shape[:2])
        found = FilterState(mean, covariance, time, names, nis, used)
    return found


def _with_records(steps, record):
    """Steps in order of time, and after those of its own time `None` for each recorded one."""
    return sorted([*steps, *((time, None) for time in record)], key=lambda item: item[0])
