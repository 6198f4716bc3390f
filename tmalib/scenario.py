"""A scenario: a target, a platform, sensors, and the time at which the state is wanted.

A `Sensor` is a measurement model with times and a standard deviation. A `Scenario` stacks sensors:
its measurement vector has the N_1 values of the first sensor, then the N_2 of the second, and so on.
Bounds, estimators and Monte-Carlo know scenarios only through what is here.

Truth and assumption are two things. ``scenario.target`` is what `simulate` measures and may be any
motion; an estimator reads the platform, the sensors and the reference time and never the target. To
misspecify an estimator on purpose, simulate one scenario and fit another.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ._checks import check_array, check_count, check_scalar

TOUCHING = 1e-6  # metres: a target nearer than this is on the platform and has no bearing


@dataclass(frozen=True, eq=False, init=False)
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

    def __init__(self, model, times, sigma, name=""):
        put = object.__setattr__
        put(self, "model", model)
        put(self, "times", check_array("times", times, (None,)))
        if np.any(np.diff(self.times) <= 0):
            raise ValueError("times of a sensor must be strictly increasing")
        put(self, "sigma", check_scalar("sigma", sigma, above=0.0))
        put(self, "name", name or type(model).__name__)

    def __len__(self):
        return len(self.times)


@dataclass(frozen=True, eq=False, init=False)
class Scenario:
    """A target, a platform, sensors and a reference time.

    Parameters
    ----------
    target, platform : motion
        Anything with ``position(t)`` (and ``heading(t)`` where a model asks for it).
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

    def __init__(self, target, platform, sensors, reference_time):
        put = object.__setattr__
        put(self, "target", target)
        put(self, "platform", platform)
        put(self, "sensors", tuple(sensors))
        put(self, "reference_time", check_scalar("reference_time", reference_time))
        if not self.sensors:
            raise ValueError("sensors is empty; a scenario needs at least one Sensor")
        wanted = {sensor.model.coordinates for sensor in self.sensors}
        if len(wanted) > 1:
            raise ValueError(f"all sensors must want the same state, got {sorted(wanted)}")
        for sensor in self.sensors:
            gap = target.position(sensor.times) - platform.position(sensor.times)
            touching = ~(np.hypot(gap[..., 0], gap[..., 1]) > TOUCHING)
            if touching.any():
                raise ValueError(f"the target is on the platform at t = {sensor.times[touching][0]} s")
        seen = [s.model.observe(target, platform, s.times) for s in self.sensors]
        put(self, "_noise_free", np.concatenate(seen))
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
    def pieces(self):
        """One ``(sensor, columns, site, lag)`` a sensor: what the numeric kernels loop over."""
        pieces, first = [], 0
        for sensor in self.sensors:
            columns = slice(first, first + len(sensor))
            site = sensor.model.site(self.platform, sensor.times)
            pieces.append((sensor, columns, site, sensor.times - self.reference_time))
            first = columns.stop
        return tuple(pieces)

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
        for sensor, _, site, lag in self.pieces:
            value, gradient = sensor.model.kernel(rows, site, lag)
            values.append(value)
            gradients.append(np.moveaxis(gradient, 0, -1))
        return np.concatenate(values, axis=-1), np.concatenate(gradients, axis=-2)

    def residual(self, measured, predicted):
        """Measured minus predicted, ``(..., N)``, wrapped where the measurement is an angle."""
        parts = [
            sensor.model.residual(measured[..., columns], predicted[..., columns])
            for sensor, columns, _, _ in self.pieces
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

    def with_(self, **changes):
        """A copy with other ``target``, ``platform``, ``sensors`` or ``reference_time``."""
        fields = dict(target=self.target, platform=self.platform, sensors=self.sensors)
        fields |= dict(reference_time=self.reference_time) | changes
        return Scenario(**fields)

    def until(self, time):
        """The scenario as it stands at ``time``: measurements up to it, state wanted at it."""
        sensors = [Sensor(s.model, s.times[s.times <= time], s.sigma, s.name) for s in self.sensors]
        sensors = [sensor for sensor in sensors if len(sensor)]
        if not sensors:
            raise ValueError(f"no measurement up to time {time}; the first is at {self.times.min()}")
        return self.with_(sensors=sensors, reference_time=time)

    def columns_until(self, time):
        """Columns of the measurement vector that `until` keeps, shape ``(N',)``."""
        return np.flatnonzero(self.times <= time)
