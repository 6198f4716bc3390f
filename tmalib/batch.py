"""Batch estimation: the state that minimises the weighted sum of squared residuals, many runs at once.

For Gaussian noise the maximum likelihood estimate minimises (`emw-acoustic`, Section IV.A)::

    C(X) = sum_k (residual_k(X) / sigma_k)^2.

`fit` takes Gauss-Newton steps in a chart of the state, with a safeguard (see
`tmalib.levenberg_marquardt`). Runs go through the iteration together, in blocks that fit into the
processor's cache; results do not depend on the size of a block.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from . import status as words
from .bounds import brought_near, information_rank
from .charts import Cartesian, ChartMaker, chart_of
from .checks import check_broadcast, check_count, check_flag, check_is, check_scalar
from .cosine_starts import has_cosines, lowest_of_grid
from .estimate import Fit
from .levenberg_marquardt import Settings, minimise_in_blocks
from .losses import SQUARES, check_loss, value_and_weight
from .robust import CLOSER, fit_robustly
from .scenario import Scenario
from .starts import fit_without_start, starts_at_ranges
from .types import BoolArray, FloatArray, IntArray, Motion
from .uniform import PLANE, is_uniform, moving_pairs, propagate
from .unknown_sigma import with_estimated_sigmas

BLOCK = 500  # runs at once: what is needed besides measurements and results is then bounded
FLAT = 1e-9  # a scaled determinant below which the rank is looked at; rounding leaves 1e-11 of none


def first_bearing(scenario: Scenario) -> tuple[int, Motion]:
    """Column of the earliest measurement that is a bearing, and the platform of its sensor.

    Of two at the same time the first sensor's. `ValueError` if no sensor measures bearings.
    """
    found = [block for block in scenario.blocks if getattr(block.sensor.model, "is_bearing", False)]
    if not found:
        names = [sensor.name for sensor in scenario.sensors]
        raise ValueError(f"a start along a bearing needs a sensor that measures bearings, got {names}")
    block = min(found, key=lambda block: block.sensor.times[0])
    return block.columns.start, scenario.platform_of(block.sensor)


def along_first_bearing(
    scenario: Scenario, angles: ArrayLike, range: float, others: Mapping[str, float] | None = None
) -> FloatArray:
    """Start at rest at a chosen range along the first bearing of each run.

    ``X_init = r_init [sin theta(t_1), cos theta(t_1), 0, 0]`` from the platform's position at t_1, the
    earliest time at which a bearing was taken.

    Parameters
    ----------
    scenario : Scenario
    angles : array_like, shape (..., N)
    range : float
        In metres, positive.
    others : dict, optional
        Name of an unknown besides position and velocity to its value; by default what the models guess.

    Returns
    -------
    ndarray, shape (..., n)

    Notes
    -----
    Source: `emw-acoustic`, Section V. Of two bearings at t_1 the first sensor's is used.
    """
    angles = check_is("scenario", scenario, Scenario).check_measurements(angles)
    others = scenario.offered("guess") | check_is("others", {} if others is None else others, dict)
    range = check_scalar("range", range, above=0.0)
    missing = set(scenario.coordinates) - set(PLANE)
    if missing != others.keys():
        raise ValueError(f"others must have the unknowns {sorted(missing)}, got {sorted(others)}")
    (first, platform), (places, _) = first_bearing(scenario), moving_pairs(scenario.coordinates)
    theta = angles[..., first]
    start = np.zeros((*theta.shape, len(scenario.coordinates)))
    here = platform.position_at(scenario.times[first])
    start[..., places] = here + range * np.stack([np.sin(theta), np.cos(theta)], axis=-1)
    for name, value in others.items():
        start[..., scenario.coordinates.index(name)] = check_scalar(name, value)
    return start


def fit(
    scenario: Scenario,
    angles: ArrayLike,
    start: ArrayLike | None = None,
    *,
    chart: ChartMaker | None = None,
    safeguard: bool = True,
    tolerance: float = 1e-2,
    max_iterations: int = 100,
    loss: str = SQUARES,
) -> Fit:
    """Maximum likelihood (least squares) estimate of the state for every run, or a robust one.

    Parameters
    ----------
    scenario : Scenario
        What the estimator assumes: platform, sensors, reference time. Its target is not read.
    angles : array_like, shape (..., N)
        Measurements, in the scenario's order; NaN, or masked, where there is none.
    start : array_like, shape (..., n), optional
        First guess(es) of the state at the reference time; broadcasts against the runs. Without one a start
        is found, from bearings (see `tmalib.starts`) or from conical angles alone (`tmalib.cosine_starts`).
    chart : callable, optional
        Coordinates in which the steps are taken, about the platform at the reference time: `ModifiedPolar` or
        `Cartesian` (see `tmalib.charts`). The default is the former, and the latter for a state with a depth
        or without position and velocity.
    safeguard : bool
        `False` gives plain Gauss-Newton: every step is taken, whatever it does to the criterion.
    tolerance : float
        Newton decrement, in standard deviations of the estimate, below which a step is the last.
        What remains after that step is second order: about 1e-4 standard deviations by default.
    max_iterations : int
        Most evaluations of the model for a run.
    loss : {"squares", "bisquare"}
        ``"bisquare"`` is for data with wild measurements, a few in a hundred: these get the weight zero, see
        `Fit.weights`. It needs every sigma.

    Returns
    -------
    Fit

    Raises
    ------
    ValueError
        For wrong shapes, an unknown loss, or a sensor whose sigma is not known with more than one run or a
        robust loss. What becomes of a run is told by its ``status``; none raises.

    Notes
    -----
    A measurement that is NaN is missing: its run is fitted as a scenario without it. Sigmas that are not
    known are estimated together with the state, see `tmalib.unknown_sigma`.

    Source: `emw-acoustic`, Section IV.A, which prints plain Gauss-Newton in Cartesian coordinates:
    ``fit(..., chart=Cartesian, safeguard=False)``.

    Examples
    --------
    Three bearings of 120 are wild:

    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> watch = tma.Scenario(ship, [tma.Sensor(tma.Bearing(), np.arange(0, 600, 5.0), 0.01)], 595)
    >>> angles = watch.with_target(tma.Target((2e3, 4e3), speed=6, heading=1.5)).simulate(1, seed=1)[0]
    >>> angles[[20, 50, 90]] = 3.0, -1.0, 0.0
    >>> found = tma.fit(watch, angles, loss="bisquare")
    >>> np.flatnonzero(found.weights == 0), found.loss
    (array([20, 50, 90]), 'bisquare')
    """
    angles = check_is("scenario", scenario, Scenario).check_measurements(angles)
    start = None if start is None else scenario.check_state(start)
    tolerance = check_scalar("tolerance", tolerance, above=0.0)
    max_iterations = check_count("max_iterations", max_iterations)
    settings = Settings(chart, check_flag("safeguard", safeguard), tolerance, max_iterations)
    estimated = tuple(scenario.unknown_sigmas)
    if check_loss(loss) != SQUARES:
        scenario.sigma  # noqa: B018  a robust loss needs it: refused here
        settings = settings._replace(tolerance=tolerance / CLOSER, loss=value_and_weight)
    if estimated:
        again = partial(fit, angles=angles, start=start, chart=chart)
        scenario = with_estimated_sigmas(scenario, angles, again)
    elapsed = _beyond(scenario)
    if elapsed:
        scenario = replace(scenario, reference_time=scenario.reference_time - elapsed, target=None)
        start = None if start is None else propagate(start, -elapsed, scenario.coordinates)
    shape = angles.shape[:-1]
    if start is not None:
        shape = check_broadcast(measurements=angles[..., 0], start=start[..., 0])
        start = np.broadcast_to(start, (*shape, start.shape[-1])).reshape(-1, start.shape[-1])
    angles = np.broadcast_to(angles, (*shape, angles.shape[-1]))
    rows = angles.reshape(-1, angles.shape[-1])
    fields = _fit_what_is_there(scenario, rows, start, settings)
    state, status, iterations, cost = (part.reshape(shape + part.shape[1:]) for part in fields)
    if elapsed:
        scenario = replace(scenario, reference_time=scenario.reference_time + elapsed)
        state = propagate(state, elapsed, scenario.coordinates)
    return Fit(state, status, iterations, cost, scenario, angles, estimated, loss)


def _beyond(scenario):
    """Seconds by which the reference time is too far from the measurements: a fit is made nearer to them."""
    first, last = scenario.times.min(), scenario.times.max()
    span = last - first
    nearest = np.clip(scenario.reference_time, first - span, last + span)
    return scenario.reference_time - nearest if is_uniform(scenario.coordinates) else 0.0


def _can_start(scenario, start=None):
    """Whether a fit can begin: a start is given, or there are bearings, or conical angles alone."""
    bearings = (getattr(sensor.model, "is_bearing", False) for sensor in scenario.sensors)
    return start is not None or any(bearings) or has_cosines(scenario)


def without_gaps(scenario: Scenario, angles: FloatArray) -> Iterator[tuple[Scenario, BoolArray, IntArray]]:
    """Runs ``(runs, N)`` with the same measurements missing, as scenarios without these.

    Yields the scenario, the mask of what is there ``(N,)`` and the indices of the runs. A run without any
    measurement is left out.
    """
    patterns, of = np.unique(~np.isnan(angles), axis=0, return_inverse=True)
    for k, there in enumerate(patterns):
        if there.any():
            yield scenario.keep(there), there, np.flatnonzero(of.ravel() == k)


def _fit_what_is_there(scenario, angles, start, settings):
    """State, status, iterations and criterion of runs ``(runs, N)``: those with the same gaps go together."""
    complete = _fit_robustly if settings.loss else _fit_complete
    if not np.isnan(angles.min(initial=np.inf)):  # without an array of truth values
        parts = [slice(i, i + BLOCK) for i in range(0, max(1, len(angles)), BLOCK)]
        first = [None if start is None else start[part] for part in parts]
        found = [complete(scenario, angles[p], f, settings) for p, f in zip(parts, first, strict=True)]
        return [np.concatenate(column) for column in zip(*found, strict=True)]
    runs, n = len(angles), len(scenario.coordinates)
    state, status = np.full((runs, n), np.nan), np.full(runs, words.NOT_OBSERVABLE, dtype=f"<U{words.WIDTH}")
    fields = (state, status, np.zeros(runs, dtype=int), np.full(runs, np.nan))
    for rest, there, which in without_gaps(scenario, angles):
        if rest.coordinates != scenario.coordinates or not _can_start(rest, start):
            continue  # nothing is left that tells an unknown
        first = None if start is None else start[which]
        found = complete(rest, angles[which][:, there], first, settings)
        for whole, part in zip(fields, found, strict=True):
            whole[which] = part
    return fields


def _look_from_all_ranges(scenario, measured, settings, before, tame=None):
    """Put a lower minimum into the outcome of a run that ran away, if a start at some range leads to one.

    The starts are those of measurements without wild ones, if ``tame`` is given.
    """
    starts = starts_at_ranges(scenario, measured if tame is None else tame)
    angles = np.broadcast_to(measured, (len(starts), len(measured)))
    for chart in (None, Cartesian):
        found = minimise_in_blocks(scenario, angles, starts, chart_of(scenario, chart), *settings)
        cost = np.where(found.converged, found.cost, np.inf)
        if cost.min() < before.cost:
            before.put([0], found.of([np.argmin(cost)]))


def _fit_complete(scenario, angles, start, settings):
    """`_fit_what_is_there` for runs without a gap."""
    without, (chart, *others) = start is None, settings
    chart = chart_of(scenario, chart)
    if without and not has_cosines(scenario):
        ends = angles.min(initial=0), angles.max(initial=0)
        finite = angles if np.isfinite(ends).all() else np.where(np.isfinite(angles), angles, np.nan)
        found = fit_without_start(scenario, finite, chart, *others)
        start = found.state
    else:
        start = lowest_of_grid(scenario, angles, chart) if without else start
        found = minimise_in_blocks(scenario, angles, start, chart, *others)
    state, status, iterations, cost, volume = found
    if angles.shape[1] < len(scenario.coordinates):
        status[np.isfinite(angles).all(axis=1)] = words.NOT_OBSERVABLE
    converged = status == words.CONVERGED
    far = np.any(brought_near(scenario, state) != state, axis=-1)  # out there a volume is one of rounding
    doubtful = np.flatnonzero(~(converged & (volume > FLAT) & ~far) & (status != words.NOT_FINITE))
    if len(doubtful):
        end = np.where(converged[doubtful, None], state[doubtful], start[doubtful])
        rank = information_rank(scenario, brought_near(scenario, end))
        status[doubtful[(rank >= 0) & (rank < end.shape[-1])]] = words.NOT_OBSERVABLE
    away = np.flatnonzero(status == words.RAN_AWAY)
    if len(away) and without:
        status[away] = words.NO_MINIMUM
        for run in away if not has_cosines(scenario) else ():
            _look_from_all_ranges(scenario, angles[run], others, found.of(slice(run, run + 1)))
    elif len(away) and _can_start(scenario):
        nearer = _fit_complete(scenario, angles[away], None, settings._replace(chart=None, safeguard=True))
        lowest = (nearer[1] != words.CONVERGED) | (nearer[3] > cost[away])
        status[away[lowest]] = words.NO_MINIMUM
    return state, status, iterations, cost


def _fit_robustly(scenario, angles, start, settings):
    """`_fit_complete` for a robust loss."""

    def by_squares(tame):
        return _fit_complete(scenario, tame, start, settings._replace(loss=None))

    def look(run, found, tame):
        if _can_start(scenario) and not has_cosines(scenario):
            before = found.of(slice(run, run + 1))
            _look_from_all_ranges(scenario, angles[run], settings[1:], before, tame[run])

    return fit_robustly(scenario, angles, settings, by_squares, look)
