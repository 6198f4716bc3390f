"""The measurement update of an extended Kalman filter, over many runs at once.

Each measurement is one scalar update of mean ``X`` and covariance ``P``, with the gradient ``h`` and the
innovation ``nu``, measured less predicted::

    s = h' P h + sigma^2,   K = P h / s,   X <- X + K nu,   P <- P - K (P h)',

which equals the Joseph form in exact arithmetic. Measurements taken at the same time are linearised
at the same predicted state, as a joint update is: the second one's innovation is reduced by
``h_2' (X_1 - X_0)``, the change that the first one made.

*Gate.* The normalised innovation squared ``nu^2 / s`` is chi-square with one degree of freedom if the filter
is right, whatever was measured before; at one time these sum to that of the joint innovation. A measurement
beyond the chosen quantile is not used.

*In modified polar coordinates* (Aidala and Hammel, 1983), or any other chart ``psi`` of `tmalib.charts`, the
step is straight in ``Y = psi(X)``, and the covariance follows it::

    Y^+ = psi(X^-) + D^- K nu,    X^+ = psi^{-1}(Y^+),    D = d psi / d X,
    P^+ = T (P - K (P h)') T',    T = (D^+)^{-1} D^-,

where gain, innovation and gradient are those above. The Cartesian chart has ``T = I``.

Arrays have the runs last here, so that a component is contiguous.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .charts import ChartMaker, check_chart
from .checks import LARGEST, as_numbers, check_broadcast, check_is, check_scalar
from .priors import Prior
from .process_noise import ProcessNoise
from .scenario import Scenario
from .sensors import SensorBlock, Taken
from .types import BoolArray, FloatArray
from .uniform import propagate, transition


def gate_limit(gate: float | None) -> float:
    """Largest normalised innovation squared that passes; infinite for `None`.

    Examples
    --------
    >>> round(gate_limit(0.99), 2)
    6.63
    """
    if gate is None:
        return np.inf
    if not 0 < check_scalar("gate", gate) < 1:
        raise ValueError(f"gate must be a probability above 0 and below 1, got {gate}")
    from scipy.special import chdtri  # half a second of the first call only

    return float(chdtri(1, 1 - gate))


def update_state(
    x: FloatArray,
    p: FloatArray,
    group: list[Any],
    limit: float = np.inf,
    chart: Any = None,
    elapsed: float = 0.0,
) -> tuple[FloatArray, FloatArray, list[FloatArray], list[BoolArray]]:
    """States and covariances after the measurements of one time.

    Parameters
    ----------
    x, p : ndarray, shapes (n, runs) and (n, n, runs)
        At the reference time.
    group : list of tuple
        ``(block, observer, elapsed, measured)`` for each measurement, as of `in_order_of_time`, with
        ``measured`` of shape ``(runs,)``. NaN is a missing one.
    limit : float
        Of the normalised innovation squared.
    chart : chart, optional
        In which the step is straight.
    elapsed : float
        From the reference time to that of the measurements.

    Returns
    -------
    x, p : ndarray
    nis : list of ndarray, shape (runs,)
        Normalised innovation squared, one array a measurement.
    used : list of ndarray of bool, shape (runs,)
        A run that uses no measurement is not changed.
    """
    moved, left, nis, used = _joint_update(x, p, group, limit)
    if chart is None:
        return moved, left, nis, used
    moved, left = _straight_in(chart, x, moved, left, elapsed)
    changed = np.any(used, axis=0)
    if not changed.all():
        moved, left = np.where(changed, moved, x), np.where(changed, left, p)
    return moved, left, nis, used


def _joint_update(x, p, group, limit):
    predicted, nis, used = x, [], []
    for block, observer, elapsed, measured in group:
        value, h = block.predict(predicted, observer, elapsed)
        sensor = block.sensor
        innovation = sensor.model.residual(measured, value)
        if x is not predicted:
            innovation = innovation - np.sum(h * (x - predicted), axis=0)
        ph = np.sum(p * h, axis=1)
        variance = np.sum(h * ph, axis=0) + sensor.sigma**2
        gain = ph / variance
        nis.append(innovation * innovation / variance)
        skipped = np.isnan(measured)
        if limit < np.inf:
            skipped |= nis[-1] > limit  # a prediction of NaN is no outlier: it ends the run
        used.append(~skipped)
        moved, left = x + gain * innovation, p - gain[:, None] * ph
        if np.count_nonzero(skipped):
            moved, left = np.where(skipped, x, moved), np.where(skipped, p, left)
        x, p = moved, left
    return x, p, nis, used


def _straight_in(chart, x, moved, p, elapsed):
    """The step from ``x`` to ``moved`` made straight in the chart's coordinates; the covariance follows."""
    names = chart.coordinates
    phi, back = transition(elapsed, names), transition(-elapsed, names)
    point = chart.from_state(propagate(x.T, elapsed, names))
    before = chart.inverse_jacobian(point)
    point = point + np.vecdot(before @ phi, np.ascontiguousarray((moved - x).T)[:, None, :])
    turn = back @ chart.jacobian(point) @ before @ phi
    p = turn @ np.ascontiguousarray(np.moveaxis(p, -1, 0)) @ turn.mT
    return propagate(chart.to_state(point), -elapsed, names).T, np.moveaxis(p, 0, -1)


def checked_inputs(
    scenario: Scenario,
    measured: ArrayLike,
    prior: Prior,
    process_noise: ProcessNoise | None,
    chart: ChartMaker | None,
) -> tuple[FloatArray, tuple[str, ...]]:
    """Measurements as an array, and the names of the prior's components; `ValueError` for what is wrong."""
    if chart is not None:
        check_chart(chart)
    measured = check_is("scenario", scenario, Scenario).check_measurements(measured)
    check_noise(process_noise)
    return measured, check_is("prior", prior, Prior).names_for(scenario)


def check_record(record: ArrayLike | None, reference: float, prior: Prior | None) -> FloatArray:
    """Times ``(T,)`` at which a filter keeps its estimate, the reference time by default; `ValueError`.

    With a ``prior`` they must not be before it: process noise is not run backwards.
    """
    times = np.atleast_1d(as_numbers("record", reference if record is None else record))
    if times.ndim != 1 or np.any(np.diff(times) <= 0) or not np.all(np.abs(times) <= LARGEST):
        raise ValueError(f"record must be finite and strictly increasing, got {times}")
    if prior is not None and len(times) and times[0] < prior.time:
        raise ValueError(
            f"record must not be before the prior's time {prior.time} with process noise, got {times[0]}"
        )
    return times


def check_noise(process_noise: ProcessNoise | None) -> None:
    """`ValueError` for what is no `ProcessNoise`, and not left out."""
    if process_noise is not None:
        check_is("process_noise", process_noise, ProcessNoise)


def in_columns(
    mean: FloatArray, covariance: FloatArray, measured: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, tuple[int, ...]]:
    """States ``(n, runs)``, covariances ``(n, n, runs)``, measurements ``(N, runs)``; the batch's shape."""
    n = mean.shape[-1]
    shape = check_broadcast(
        measurements=measured[..., 0], mean=mean[..., 0], covariance=covariance[..., 0, 0]
    )
    x = np.broadcast_to(mean, (*shape, n)).reshape(-1, n).T.copy()  # a component is contiguous
    runs = x.shape[1]
    p = np.broadcast_to(covariance, (*shape, n, n)).reshape(runs, n, n).transpose(1, 2, 0).copy()
    values = np.broadcast_to(measured, (*shape, measured.shape[-1])).reshape(runs, measured.shape[-1]).T
    return x, p, np.ascontiguousarray(values), shape


def in_state(block: SensorBlock, names: tuple[str, ...]) -> SensorBlock:
    """The block for a state with these components, the model's and maybe more."""
    places = np.array([names.index(name) for name in block.sensor.model.coordinates])
    return block._replace(components=places, size=len(names))


def chart_at(
    chart: ChartMaker, scenario: Scenario, group: list[Taken], time: float, names: tuple[str, ...]
) -> Any:
    """The chart about the platform that carries the first sensor of a group, of `in_order_of_time`."""
    return chart(scenario.platform_of(group[0][1].sensor).position_at(time), names)
