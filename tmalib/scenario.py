"""A scenario: a target, a platform, sensors, and the time at which the state is wanted.

A `Sensor` is a measurement model with times and a standard deviation. A `Scenario` stacks sensors:
its measurement vector has the N_1 values of the first sensor, then the N_2 of the second, and so on.
Bounds, estimators and Monte-Carlo know scenarios only through what is here.

Truth and assumption are two things. ``scenario.target`` is what `simulate` measures and may be any
motion; an estimator reads the platform, the sensors and the reference time and never the target. To
misspecify an estimator on purpose, simulate one scenario and fit another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .checks import check_array, check_count, check_scalar, set_fields

TOUCHING = 1e-6  # metres: a target nearer than this is on the platform and has no bearing


@dataclass(frozen=True, eq=False)
class Sensor:
    """Measurements of one model.

    Parameters
    ----------
    model : measurement model
        `Bearing`, `DelayedBearing` or any object with the same methods (see `tmalib.bearings`).
    times : array_like, shape (N,)
        Strictly increasing, in seconds.
    sigma : float
        Standard deviation of the measurement noise, positive, in the model's unit (radians).
    name : str, optional
    """

    model: object
    times: np.ndarray
    sigma: float
    name: str = ""

    def __post_init__(self):
        times = check_array("times", self.times, (None,))
        if np.any(np.diff(times) <= 0):
            raise ValueError("times of a sensor must be strictly increasing")
        sigma = check_scalar("sigma", self.sigma, above=0.0)
        set_fields(self, times=times, sigma=sigma, name=self.name or type(self.model).__name__)

    def __len__(self):
        return len(self.times)


class SensorBlock(NamedTuple):
    """A sensor's part of the measurement vector, with what its model needs of the platform.

    ``columns`` is the slice of the measurement vector, ``observer`` what the model's ``observer_state``
    gives, ``(k, N)``, and ``elapsed`` the times less the reference time, ``(N,)``.
    """

    sensor: Sensor
    columns: slice
    observer: np.ndarray
    elapsed: np.ndarray


@dataclass(frozen=True, eq=False)
class Scenario:
    """A target, a platform, sensors and a reference time.

    Parameters
    ----------
    target, platform : motion
        Anything with ``position_at(t)`` (and ``heading_at(t)`` where a model asks for it).
    sensors : sequence of Sensor
    reference_time : float
        Time of the state that is estimated, in seconds.

    Raises
    ------
    ValueError
        For no sensors, sensors that want different states, or a target on the platform.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> platform = tma.Course((0, 0), 7, 0.0, [tma.Straight(60), tma.Turn(60, 0.02), tma.Straight(60)])
    >>> target = tma.Target((3000, 4000), speed=5, heading=1.0)
    >>> radar = tma.Sensor(tma.Bearing(), times=np.arange(181.0), sigma=np.radians(1))
    >>> scenario = tma.Scenario(target, platform, [radar], reference_time=180)
    >>> scenario.simulate(runs=3, seed=1).shape
    (3, 181)
    """

    target: object
    platform: object
    sensors: tuple
    reference_time: float

    def __post_init__(self):
        set_fields(
            self,
            sensors=tuple(self.sensors),
            reference_time=check_scalar("reference_time", self.reference_time),
        )
        if not self.sensors:
            raise ValueError("sensors is empty; a scenario needs at least one Sensor")
        wanted = {sensor.model.coordinates for sensor in self.sensors}
        if len(wanted) > 1:
            raise ValueError(f"all sensors must want the same state, got {sorted(wanted)}")
        for sensor in self.sensors:
            gap = self.target.position_at(sensor.times) - self.platform.position_at(sensor.times)
            touching = ~(np.hypot(gap[..., 0], gap[..., 1]) > TOUCHING)
            if touching.any():
                raise ValueError(f"the target is on the platform at t = {sensor.times[touching][0]} s")
        if not np.all(np.isfinite(self._noise_free)):
            raise ValueError("the measurement of the target is not finite; is it slower than sound?")

    # -- what is measured -----------------------------------------------------------------------

    @property
    def coordinates(self):
        """Names of the state's components, for instance ``("x", "y", "vx", "vy")``."""
        return self.sensors[0].model.coordinates

    @cached_property
    def times(self):
        """Times of all measurements, sensor after sensor, shape ``(N,)``, in seconds."""
        return np.concatenate([sensor.times for sensor in self.sensors])

    @cached_property
    def sigma(self):
        """Standard deviation of every measurement, shape ``(N,)``."""
        return np.concatenate([np.full(len(sensor), sensor.sigma) for sensor in self.sensors])

    @cached_property
    def _noise_free(self):
        return np.concatenate([s.model.observe(self.target, self.platform, s.times) for s in self.sensors])

    @cached_property
    def blocks(self):
        """One `SensorBlock` a sensor: what estimators and bounds loop over."""
        blocks, first = [], 0
        for sensor in self.sensors:
            columns = slice(first, first + len(sensor))
            observer = sensor.model.observer_state(self.platform, sensor.times)
            blocks.append(SensorBlock(sensor, columns, observer, sensor.times - self.reference_time))
            first = columns.stop
        return tuple(blocks)

    @property
    def state(self):
        """True state at the reference time, shape ``(n,)``; the target must be a `Target`."""
        return self.target.state(self.reference_time, self.coordinates)

    def measure(self):
        """Noise-free measurements of the target, shape ``(N,)``."""
        return self._noise_free.copy()

    def simulate(self, runs, seed):
        """Noisy measurements, shape ``(runs, N)``.

        ``seed`` is anything that `numpy.random.default_rng` takes: an integer, a `SeedSequence`
        (see `tmalib.montecarlo.stream`) or a generator.
        """
        runs = check_count("runs", runs)
        noise = np.random.default_rng(seed).standard_normal((runs, len(self.times)))
        noise *= self.sigma
        noise += self._noise_free
        return noise

    # -- what is assumed ------------------------------------------------------------------------

    def linearise(self, state):
        """Predicted measurements and their gradient with respect to the state.

        Parameters
        ----------
        state : array_like, shape (..., n)
            State(s) at the reference time.

        Returns
        -------
        value : ndarray, shape (..., N)
        gradient : ndarray, shape (..., N, n)
        """
        state = self.check_state(state)
        rows = [component[..., None] for component in np.moveaxis(state, -1, 0)]
        values, gradients = [], []
        for sensor, _, observer, elapsed in self.blocks:
            value, gradient = sensor.model.value_and_gradient(rows, observer, elapsed)
            values.append(value)
            gradients.append(np.moveaxis(gradient, 0, -1))
        return np.concatenate(values, axis=-1), np.concatenate(gradients, axis=-2)

    def residual(self, measured, predicted):
        """Measured minus predicted, ``(..., N)``, wrapped where the measurement is an angle."""
        parts = [
            sensor.model.residual(measured[..., columns], predicted[..., columns])
            for sensor, columns, _, _ in self.blocks
        ]
        return np.concatenate(parts, axis=-1)

    def check_state(self, state):
        """``state`` as a float array ``(..., n)``; `ValueError` when its last axis does not fit."""
        state = np.asarray(state, dtype=float)
        n = len(self.coordinates)
        if state.ndim == 0 or state.shape[-1] != n:
            raise ValueError(f"state must have shape (..., {n}) for {self.coordinates}, got {state.shape}")
        return state

    def check_measurements(self, angles):
        """``angles`` as a float array ``(..., N)``; `ValueError` when its last axis does not fit."""
        angles = np.asarray(angles, dtype=float)
        if angles.ndim == 0 or angles.shape[-1] != len(self.times):
            raise ValueError(f"measurements must have shape (..., {len(self.times)}), got {angles.shape}")
        return angles

    # -- scenarios from scenarios ---------------------------------------------------------------

    def until(self, time):
        """The scenario as it stands at ``time``: measurements up to it, state wanted at it."""
        sensors = [Sensor(s.model, s.times[s.times <= time], s.sigma, s.name) for s in self.sensors]
        sensors = [sensor for sensor in sensors if len(sensor)]
        if not sensors:
            raise ValueError(f"no measurement up to time {time}; the first is at {self.times.min()}")
        return replace(self, sensors=sensors, reference_time=time)

    def columns_until(self, time):
        """Columns of the measurement vector that `until` keeps, shape ``(N',)``."""
        return np.flatnonzero(self.times <= time)


def in_order_of_time(scenario, after):
    """Measurements later than ``after``, time by time: what a filter loops over.

    Returns
    -------
    list of (float, list)
        The times in order, each with one ``(column, sensor, observer, elapsed)`` a measurement: its column of
        the measurement vector, its sensor, and its part of the `SensorBlock`.
    """
    groups = {}
    for sensor, columns, observer, elapsed in scenario.blocks:
        for i in np.flatnonzero(sensor.times > after):
            group = groups.setdefault(sensor.times[i], [])
            group.append((columns.start + i, sensor, observer[:, i], elapsed[i]))
    return sorted(groups.items())
