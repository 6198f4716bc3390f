"""A scenario: platforms, sensors, the time at which the state is wanted; and, apart from these, a target.

A `Sensor` is a measurement model with times and a standard deviation. A `Scenario` stacks sensors: its
measurement vector has the N_1 values of the first sensor, then the N_2 of the second, and so on. The
*state* is the union of what the sensors want, found by name: position, depth and velocity first, then
further unknowns in the order in which sensors ask for them.

Knowledge and truth are two things. Platform, sensors and reference time are what an observer knows, and all
that an estimator reads. A *target* is truth: `simulate`, `measure` and `state` need it, and refuse without
it. It may be any motion. To misspecify an estimator on purpose, simulate one scenario and fit another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from .checks import (
    as_numbers,
    check_count,
    check_has,
    check_scalar,
    check_seed,
    check_sequence,
    set_fields,
    short,
)
from .sensors import Sensor, SensorBlock
from .types import FloatArray, IntArray, Motion, Seed
from .uniform import KINEMATIC


@dataclass(frozen=True, eq=False)
class Scenario:
    """A platform, sensors and a reference time; a target, where the truth is to be known.

    Parameters
    ----------
    platform : motion
        Anything with ``position_at(t)`` (and ``heading_at(t)`` where a model asks for it).
    sensors : sequence of Sensor
    reference_time : float
        Time of the state that is estimated, in seconds.
    target : motion, optional
        See `with_target`.

    Raises
    ------
    ValueError
        For no sensors, a model whose arrays have a wrong shape, or a target that cannot be measured.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> platform = tma.Course((0, 0), 7, 0.0, [tma.Straight(60), tma.Turn(60, 0.02), tma.Straight(60)])
    >>> radar = tma.Sensor(tma.Bearing(), times=np.arange(181.0), sigma=np.radians(1))
    >>> watch = tma.Scenario(platform, [radar], reference_time=180)
    >>> watch.coordinates
    ('x', 'y', 'vx', 'vy')
    >>> scenario = watch.with_target(tma.Target((3000, 4000), speed=5, heading=1.0))
    >>> scenario.simulate(runs=3, seed=1).shape
    (3, 181)
    """

    platform: Motion
    sensors: Sequence[Sensor]
    reference_time: float
    target: Motion | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            platform=check_has("platform", self.platform, "position_at"),
            sensors=check_sequence("sensors", self.sensors, Sensor),
            reference_time=check_scalar("reference_time", self.reference_time),
        )
        if not self.sensors:
            raise ValueError("sensors is empty; a scenario needs at least one Sensor")
        for block in self.blocks:
            block.check_shapes()
        if self.target is not None:
            check_has("target", self.target, "position_at")
            self._noise_free  # noqa: B018  a target that cannot be measured is refused here

    # -- knowledge ------------------------------------------------------------------------------

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the state's components, for instance ``("x", "y", "vx", "vy")``."""
        wanted = dict.fromkeys(name for sensor in self.sensors for name in sensor.model.coordinates)
        return (*(name for name in KINEMATIC if name in wanted), *(n for n in wanted if n not in KINEMATIC))

    @cached_property
    def times(self) -> FloatArray:
        """Times of all measurements, sensor after sensor, shape ``(N,)``, in seconds."""
        return np.concatenate([sensor.times for sensor in self.sensors])

    @cached_property
    def sigma(self) -> FloatArray:
        """Standard deviation of every measurement, shape ``(N,)``; `ValueError` where one is not known."""
        if unknown := self.unknown_sigmas:
            raise ValueError(f"the sigma of {unknown} is not known; give it, or fit one run to estimate it")
        return np.concatenate(
            [np.broadcast_to(np.asarray(sensor.sigma), len(sensor)) for sensor in self.sensors]
        )

    @property
    def unknown_sigmas(self) -> list[str]:
        """Names of the sensors whose standard deviation is not known."""
        return [sensor.name for sensor in self.sensors if sensor.sigma is None]

    @cached_property
    def blocks(self) -> tuple[SensorBlock, ...]:
        """One `SensorBlock` a sensor: what estimators and bounds loop over."""
        blocks, first, names = [], 0, self.coordinates
        for sensor in self.sensors:
            columns = slice(first, first + len(sensor))
            observer = sensor.model.observer_state(self.platform_of(sensor), sensor.times)
            wanted = tuple(sensor.model.coordinates)
            places = None if wanted == names else np.array([names.index(name) for name in wanted])
            elapsed = sensor.times - self.reference_time
            blocks.append(SensorBlock(sensor, columns, observer, elapsed, places, len(names)))
            first = columns.stop
        return tuple(blocks)

    def platform_of(self, sensor: Sensor) -> Motion:
        """What carries a sensor."""
        return self.platform if sensor.platform is None else sensor.platform

    def linearise(self, state: ArrayLike) -> tuple[FloatArray, FloatArray]:
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
        for block in self.blocks:
            value, gradient = block.predict(rows, block.observer, block.elapsed)
            values.append(value)
            gradients.append(np.moveaxis(gradient, 0, -1))
        return np.concatenate(values, axis=-1), np.concatenate(gradients, axis=-2)

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        """Measured minus predicted, ``(..., N)``, wrapped where the measurement is an angle."""
        parts = [
            block.sensor.model.residual(measured[..., block.columns], predicted[..., block.columns])
            for block in self.blocks
        ]
        return np.concatenate(parts, axis=-1)

    def check_state(self, state: ArrayLike) -> FloatArray:
        """``state`` as a float array ``(..., n)``; `ValueError` when its last axis does not fit."""
        state = as_numbers("state", state)
        n = len(self.coordinates)
        if state.ndim == 0 or state.shape[-1] != n:
            raise ValueError(f"state must have shape (..., {n}) for {self.coordinates}, got {state.shape}")
        return state

    def check_measurements(self, angles: ArrayLike) -> FloatArray:
        """``angles`` as a float array ``(..., N)``; `ValueError` when its last axis does not fit.

        What a masked array masks is missing: NaN. Bearings of a sensor that are all beyond a whole turn, in
        all runs, are refused: they are degrees.
        """
        angles = as_numbers("measurements", angles)
        if angles.ndim == 0 or angles.shape[-1] != len(self.times):
            raise ValueError(f"measurements must have shape (..., {len(self.times)}), got {angles.shape}")
        for block in self.blocks:
            part = angles[..., block.columns]
            if not getattr(block.sensor.model, "is_bearing", False) or _some_are_within(part, 2 * np.pi):
                continue
            least = np.min(np.abs(part), initial=np.inf, where=~np.isnan(part))
            if least < np.inf:
                raise ValueError(
                    f"measurements of {block.sensor.name} must be bearings in radians, but all are beyond "
                    f"2 pi, from {least:g} on: this looks like degrees"
                )
        return angles

    # -- truth ----------------------------------------------------------------------------------

    def with_target(self, target: Motion | None) -> Scenario:
        """The scenario with a target: to be simulated, and to have bounds at its true state."""
        return replace(self, target=target)

    def _needs_target(self, what):
        if self.target is None:
            raise ValueError(f"{what} needs a target, and the scenario has none; see Scenario.with_target")
        return self.target

    @property
    def state(self) -> FloatArray:
        """True state at the reference time, shape ``(n,)``; the target must be a `Target`.

        What is no property of a target, a bias for instance, is what the sensors' models say is true of them.
        """
        target, known = self._needs_target("state"), self.offered("truth")
        own = [name for name in self.coordinates if name not in known]
        known |= dict(zip(own, target.state(self.reference_time, own), strict=True))
        return np.array([known[name] for name in self.coordinates])

    def offered(self, what: str) -> dict[str, float]:
        """What the sensors' models offer as ``guess`` or ``truth`` of further unknowns, a dict by name."""
        found: dict[str, float] = {}
        for sensor in self.sensors:
            found |= getattr(sensor.model, what, {})
        return found

    @cached_property
    def _noise_free(self):
        target = self._needs_target("measure")
        for sensor in self.sensors:
            check_has(f"the model of {sensor.name}", sensor.model, "observe")
        seen = [s.model.observe(target, self.platform_of(s), s.times) for s in self.sensors]
        for sensor, values in zip(self.sensors, seen, strict=True):
            lost = ~np.isfinite(values)
            if lost.any():
                raise ValueError(
                    f"{sensor.name} cannot measure the target at t = {sensor.times[lost][0]} s: "
                    "is it on the platform, or faster than sound?"
                )
        return np.concatenate(seen)

    def measure(self) -> FloatArray:
        """Noise-free measurements of the target, shape ``(N,)``."""
        return self._noise_free.copy()

    def simulate(self, runs: int, seed: Seed) -> FloatArray:
        """Noisy measurements, shape ``(runs, N)``.

        ``seed`` is anything that `numpy.random.default_rng` takes: an integer, a `SeedSequence`
        (see `tmalib.montecarlo.Stream`) or a generator.
        """
        runs, exact = check_count("runs", runs, least=0), self._noise_free
        noise = check_seed(seed).standard_normal((runs, len(self.times)))
        noise *= self.sigma
        noise += exact
        return noise

    # -- parts ----------------------------------------------------------------------------------

    def between(self, first: float, last: float) -> Scenario:
        """The scenario with the measurements from time ``first`` to ``last`` only, both included."""
        ends = as_numbers("first", first), as_numbers("last", last)
        if ends[0].ndim or ends[1].ndim:
            raise ValueError(f"first and last must be two numbers, got {short(ends[0])} and {short(ends[1])}")
        wanted = (self.times >= ends[0]) & (self.times <= ends[1])
        if not wanted.any():
            raise ValueError(
                f"no measurement between {first} and {last}; there are some from {self.times.min()} "
                f"to {self.times.max()}"
            )
        return self.keep(wanted)

    def keep(self, wanted: ArrayLike) -> Scenario:
        """The scenario with some of its measurements only, ``wanted`` being a mask ``(N,)``.

        A sensor of which nothing is left is gone, and with it any unknown that it alone asked for.
        """
        wanted = np.asarray(wanted)
        if wanted.dtype != bool or wanted.shape != self.times.shape or not wanted.any():
            raise ValueError(f"wanted must be a mask of {len(self.times)}, not all false, got {wanted}")
        parts = [(block.sensor, wanted[block.columns]) for block in self.blocks]
        return replace(self, sensors=[sensor.keep(part) for sensor, part in parts if part.any()])

    def columns_between(self, first: float, last: float) -> IntArray:
        """Columns of the measurement vector that `between` keeps, shape ``(N',)``."""
        return np.flatnonzero((self.times >= first) & (self.times <= last))

    def until(self, time: float) -> Scenario:
        """The scenario as it stands at ``time``: measurements up to it, state wanted at it."""
        return replace(self.between(-np.inf, time), reference_time=time)

    def columns_until(self, time: float) -> IntArray:
        """Columns of the measurement vector that `until` keeps, shape ``(N',)``."""
        return self.columns_between(-np.inf, time)


def _some_are_within(angles, limit):
    """Whether some angle is not larger than a limit; most often the first of each run tells."""
    return any(np.any((part <= limit) & (part >= -limit)) for part in (angles[..., :1], angles))
