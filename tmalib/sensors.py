"""Sensors: a measurement model with times and noise, and what estimators loop over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np

from .checks import check_array, check_has, check_scalar, set_fields, short
from .models import MeasurementModel
from .types import Array, BoolArray, FloatArray, IntArray, Motion, StateRows

METHODS = ("coordinates", "observer_state", "value_and_gradient", "residual")


@dataclass(frozen=True, eq=False)
class Sensor:
    """Measurements of one model.

    Parameters
    ----------
    model : measurement model
        `Bearing`, `DelayedBearing` or any object with the same methods (see `tmalib.models`).
    times : array_like, shape (N,)
        In seconds, not decreasing.
    sigma : float or array_like, shape (N,), optional
        Standard deviation of the measurement noise, of all or of each measurement, positive, in the model's
        unit (radians). `None` if it is not known: `fit` then estimates it from the residuals of one run.
    name : str, optional
    platform : motion, optional
        What carries the sensor, if not the scenario's platform.
    """

    model: MeasurementModel
    times: Array
    sigma: float | Array | None
    name: str = ""
    platform: Motion | None = None

    def __post_init__(self) -> None:
        check_has("model", self.model, *METHODS)
        if self.platform is not None:
            check_has("platform", self.platform, "position_at")
        if not isinstance(self.name, str):
            raise ValueError(f"name must be a text, got {short(self.name)}")
        times = check_array("times", self.times, (None,))
        if not len(times):
            raise ValueError("times is empty; a sensor needs at least one")
        if np.any(np.diff(times) < 0):
            raise ValueError("times of a sensor must not go back; sort them, and the measurements with them")
        sigma: Any = self.sigma
        if np.ndim(sigma):
            sigma = check_array("sigma", sigma, (len(times),))
            if not np.all(sigma > 0):
                raise ValueError(f"sigma must be positive, got {sigma.min()}")
        elif sigma is not None:
            sigma = check_scalar("sigma", sigma, above=0.0)
        if getattr(self.model, "is_bearing", False) and sigma is not None and np.min(sigma) > np.pi:
            raise ValueError(f"sigma of a bearing must be in radians, got {short(sigma)}: in degrees?")
        set_fields(self, times=times, sigma=sigma, name=self.name or type(self.model).__name__)

    def __len__(self) -> int:
        return len(self.times)

    def keep(self, which: BoolArray | IntArray) -> Sensor:
        """The sensor with some of its measurements, ``which`` being a mask ``(N,)`` or indices."""
        sigma: Any = self.sigma
        sigma = sigma[which] if np.ndim(sigma) else sigma
        return replace(self, times=self.times[which], sigma=sigma)


class SensorBlock(NamedTuple):
    """A sensor's part of the measurement vector, with what its model needs of the platform.

    ``columns`` is the slice of the measurement vector, ``observer`` what the model's ``observer_state``
    gives, ``(k, N)``, ``elapsed`` the times less the reference time, ``(N,)``, and ``components`` the places
    of the model's coordinates in the state, `None` if they are the state. ``size`` is that of the state.
    """

    sensor: Sensor
    columns: slice
    observer: FloatArray
    elapsed: FloatArray
    components: IntArray | None
    size: int

    def predict(self, state: StateRows, observer: FloatArray, elapsed: Any) -> tuple[FloatArray, FloatArray]:
        """Value and gradient of the sensor's model, for rows of the whole state.

        ``state`` is an array or sequence of ``size`` rows, ``observer`` and ``elapsed`` are as in the block
        or a part of them; ``elapsed`` may be a number. The gradient has a row for each component of the
        state.
        """
        model = self.sensor.model
        if self.components is None:
            return model.value_and_gradient(state, observer, elapsed)
        value, part = model.value_and_gradient([state[i] for i in self.components], observer, elapsed)
        gradient = np.zeros((self.size, *value.shape))
        gradient[self.components] = part
        return value, gradient

    def check_shapes(self) -> None:
        """`ValueError` for a model whose arrays do not have the shapes that the protocol wants."""
        model, count, n = (
            type(self.sensor.model).__name__,
            len(self.sensor),
            len(self.sensor.model.coordinates),
        )
        observer = np.asarray(self.observer)
        if observer.ndim != 2 or observer.shape[1] != count:
            raise ValueError(f"{model}.observer_state must have shape (k, {count}), got {observer.shape}")
        with np.errstate(all="ignore"):  # the shapes at some state, not the values
            value, gradient = self.sensor.model.value_and_gradient(
                np.ones((n, count)), observer, self.elapsed
            )
        wanted, got = ((count,), (n, count)), (np.shape(value), np.shape(gradient))
        if wanted != got:
            raise ValueError(f"{model}.value_and_gradient must give arrays of shapes {wanted}, got {got}")


Taken: TypeAlias = tuple[int, SensorBlock, FloatArray, float]  # column, block, and its part of the arrays


class HasBlocks(Protocol):
    """A scenario, which lies above."""

    @property
    def blocks(self) -> Sequence[SensorBlock]: ...


def in_order_of_time(scenario: HasBlocks, after: float) -> list[tuple[float, list[Taken]]]:
    """Measurements later than ``after``, time by time: what a filter loops over.

    Returns
    -------
    list of (float, list)
        The times in order, each with one ``(column, block, observer, elapsed)`` a measurement: its column of
        the measurement vector, its `SensorBlock`, and its part of the block's arrays.
    """
    groups: dict[float, list[Taken]] = {}
    for block in scenario.blocks:
        for i in np.flatnonzero(block.sensor.times > after):
            group = groups.setdefault(block.sensor.times[i], [])
            group.append((block.columns.start + i, block, block.observer[:, i], block.elapsed[i]))
    return sorted(groups.items(), key=lambda item: item[0])
