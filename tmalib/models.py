"""What a measurement model is, and a check of one's own.

A *measurement model* is an object with

``coordinates``
    names of the components of the state that it wants, in the order in which it takes them: of ``x, y, z,
    vx, vy`` at the reference time, and of any further unknown (``"f0"``, ``"bias"``). Two models that name
    the same component mean the same;
``observer_state(platform, times)``
    what the model has to know of the platform, an array ``(k, N)`` for N times;
``value_and_gradient(state, observer, elapsed)``
    the prediction and its gradient, elementwise. ``state`` is a sequence of n arrays, one a coordinate, that
    broadcast against the rows of ``observer`` and against ``elapsed``, the seconds since the reference time.
    Returns the value and the gradient, an array whose first axis has n components;
``residual(measured, predicted)``
    measured minus predicted, wrapped where the measurement is an angle;
``observe(target, platform, times)``
    the noise-free measurement ``(N,)`` of any motion, one that leaves the model included; NaN where there is
    none. Only simulation needs it;
``is_bearing``, optional
    `True` if the measurement is the bearing of the target, from which a first guess can start.
``truth``, optional
    a dict from further unknowns to what is true of them in simulation, for `Scenario.state`;
``guess``, optional
    a dict, name to a plausible first value, of the model's unknowns besides position, depth and velocity:
    ``{"bias": 0.0}``, ``{"c": 1500.0}``. It is what a start without further knowledge uses.

`Scenario` checks the shapes; `check_model` compares the gradient with differences.

Examples
--------
The elevation of an aircraft of unknown height h, seen from the ground:

>>> import numpy as np, tmalib as tma
>>> class Elevation:
...     coordinates = ("x", "y", "vx", "vy", "h")
...     def observer_state(self, platform, times):
...         return platform.position_at(times).T
...     def value_and_gradient(self, state, observer, elapsed):
...         x, y, vx, vy, h = state
...         dx, dy = x + elapsed * vx - observer[0], y + elapsed * vy - observer[1]
...         r = np.hypot(dx, dy)
...         slope = -h / (r * (r**2 + h**2))
...         gx, gy = slope * dx, slope * dy
...         return np.arctan2(h, r), np.stack([gx, gy, elapsed * gx, elapsed * gy, r / (r**2 + h**2)])
...     def residual(self, measured, predicted):
...         return measured - predicted
>>> walk = tma.Course((0, 0), speed=1.5, heading=0.0, legs=[tma.Straight(60)])
>>> tma.check_model(Elevation(), walk, np.arange(0, 60, 5.0), state=[3e3, 4e3, -50, 20, 2e3]) < 1e-6
True
>>> watch = tma.Scenario(walk, [
...     tma.Sensor(tma.Bearing(), np.arange(0, 60, 5.0), 0.01),
...     tma.Sensor(Elevation(), np.arange(0, 60, 5.0), 0.01)], reference_time=0)
>>> watch.coordinates
('x', 'y', 'vx', 'vy', 'h')
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from .checks import check_array, check_has, check_scalar
from .types import FloatArray, Motion


@runtime_checkable
class MeasurementModel(Protocol):
    """What every measurement model has; what is optional besides, the top of this page says."""

    @property
    def coordinates(self) -> tuple[str, ...]: ...

    def observer_state(self, platform: Motion, times: FloatArray, /) -> FloatArray: ...

    def value_and_gradient(
        self, state: Any, observer: FloatArray, elapsed: FloatArray, /
    ) -> tuple[FloatArray, FloatArray]: ...

    def residual(self, measured: FloatArray, predicted: FloatArray, /) -> FloatArray: ...


def check_model(
    model: MeasurementModel,
    platform: Motion,
    times: ArrayLike,
    state: ArrayLike,
    reference_time: float = 0.0,
    step: float = 1e-6,
) -> float:
    """Largest relative difference of a model's gradient and central differences of its value.

    Parameters
    ----------
    model : measurement model
    platform : motion
    times : array_like, shape (N,)
    state : array_like, shape (n,)
        In the order of the model's coordinates, at the reference time.
    reference_time : float
    step : float
        Of the differences, relative to each component, absolute for one below 1.

    Returns
    -------
    float
        Relative to the largest gradient of the component over the times; about 1e-8 for a right one.

    Raises
    ------
    ValueError
        For arrays of wrong shapes, or values that are not finite.
    """
    check_has("model", model, "coordinates", "observer_state", "value_and_gradient", "residual")
    check_has("platform", platform, "position_at")
    step = check_scalar("step", step, above=0.0)
    times, state = (
        check_array("times", times, (None,)),
        check_array("state", state, (len(model.coordinates),)),
    )
    elapsed = times - check_scalar("reference_time", reference_time)
    observer = np.asarray(model.observer_state(platform, times), dtype=float)
    if observer.ndim != 2 or observer.shape[1] != len(times):
        raise ValueError(f"observer_state must have shape (k, {len(times)}), got {observer.shape}")

    def at(changed):
        rows = [np.full(len(times), part) for part in changed]
        with np.errstate(all="ignore"):  # what is not finite is refused below
            parts = model.value_and_gradient(rows, observer, elapsed)
        value, gradient = map(np.asarray, parts)
        wanted = (len(times),), (len(state), len(times))
        if (value.shape, gradient.shape) != wanted:
            raise ValueError(
                f"value and gradient must have shapes {wanted}, got {value.shape, gradient.shape}"
            )
        if not (np.isfinite(value).all() and np.isfinite(gradient).all()):
            raise ValueError(f"value and gradient must be finite at {changed}")
        return value, gradient

    worst, (_, gradient) = 0.0, at(state)
    for i, own in enumerate(gradient):
        change = np.zeros(len(state))
        change[i] = step * max(abs(state[i]), 1.0)
        difference = model.residual(at(state + change)[0], at(state - change)[0]) / (2 * change[i])
        scale = max(np.abs(own).max(), np.abs(difference).max())
        worst = max(worst, float(np.abs(own - difference).max() / scale) if scale > 0 else 0.0)
    return worst
