"""Fewer values that tell nearly as much as all the bearings.

*Lines.* Successive bearings of a sensor are replaced by two values of the straight line through them, at the
mean of their times plus and minus the standard deviation s of these: ``mean +- s slope``. For m bearings of
standard deviation sigma both have ``sigma sqrt(2 / m)`` and are not correlated, and a bearing that changes as
a parabola in time has the mean of its two values as its own mean.

*Means* of successive values at the mean of their times are fewer still.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from .bearings import wrap
from .scenario import Scenario
from .sensors import Sensor
from .types import FloatArray

GROUPS = range(30, 45)  # numbers of groups of a sensor's bearings, two values each
LEAST = 10  # bearings in a group
COARSE = 30  # means of a sensor, or up to twice as many


class Lines:
    """Two values of the line through each of some groups of successive bearings, and their ``sensor``."""

    def __init__(self, sensor: Sensor, groups: int) -> None:
        count = len(sensor)
        self.first = np.arange(groups) * count // groups
        self.size = np.diff(self.first, append=count)
        mean = np.add.reduceat(sensor.times, self.first) / self.size
        self.away = sensor.times - np.repeat(mean, self.size)
        spread = np.sqrt(np.add.reduceat(self.away**2, self.first) / self.size)
        self.spread = np.where(spread > 0, spread, 1.0)  # bearings of one time have no slope
        times = np.stack([mean - self.spread, mean + self.spread], axis=-1).ravel()
        self.sensor = replace(sensor, times=times, sigma=sensor.sigma * np.sqrt(2 * groups / count))

    def of(self, angles: FloatArray) -> FloatArray:
        """Values ``(runs, 2 groups)`` of bearings ``(runs, N)``."""
        start = angles[:, self.first]  # the first of each group, so that no difference wraps
        offset = _offset(angles, np.repeat(start, self.size, axis=1))
        middle = start + np.add.reduceat(offset, self.first, axis=1) / self.size
        offset *= self.away
        tilt = np.add.reduceat(offset, self.first, axis=1) / (self.size * self.spread)
        return np.stack([middle - tilt, middle + tilt], axis=-1).reshape(len(angles), -1)


class Means:
    """Means of some successive bearings, and their ``sensor``; a rest that makes no mean is left out."""

    def __init__(self, sensor: Sensor, together: int) -> None:
        self.shape = len(sensor) // together, together
        times = self._grouped(sensor.times).mean(axis=1)
        self.sensor = replace(sensor, times=times, sigma=self._sigma(sensor))

    def _grouped(self, values):
        return values[: np.prod(self.shape)].reshape(self.shape)

    def _sigma(self, sensor):
        """That of a mean."""
        if np.ndim(sensor.sigma):
            return np.linalg.norm(self._grouped(sensor.sigma), axis=1) / self.shape[1]
        return sensor.sigma / np.sqrt(self.shape[1])

    def of(self, angles: FloatArray) -> FloatArray:
        """Means ``(runs, N')`` of bearings ``(runs, N)``."""
        parts = angles[:, : np.prod(self.shape)].reshape(len(angles), *self.shape)
        start = parts[..., 0]
        offset = _offset(parts, parts[..., :1])
        return start + sum(offset[..., i] for i in range(1, self.shape[1])) / self.shape[1]


def _offset(angles, start):
    """Angles from others, between -pi and pi; seldom is there anything to wrap."""
    offset = angles - start
    return offset if offset.max(initial=0) <= np.pi and offset.min(initial=0) >= -np.pi else wrap(offset)


def lines(sensor: Sensor) -> Lines | Means:
    """`Lines` of a sensor, or the sensor as it is if it has few bearings, or a sigma for each.

    All values share one standard deviation, so the number of groups is the one of `GROUPS` that divides the
    bearings best; groups differ by one bearing at most.
    """
    groups = min(GROUPS, key=lambda groups: len(sensor) % groups)
    sigma: Any = sensor.sigma
    many = len(sensor) >= LEAST * groups and not np.ndim(sigma)
    return Lines(sensor, groups) if many else unchanged(sensor)


def means(sensor: Sensor) -> Means:
    """`Means` of a sensor, at least `COARSE` if it has so many."""
    return Means(sensor, max(1, len(sensor) // COARSE))


def unchanged(sensor: Sensor) -> Means:
    """The sensor as it is."""
    return Means(sensor, 1)


class Condensed:
    """The sensors of bearings of a scenario, each made into fewer values, as a ``scenario`` without a target.

    ``make`` is `lines`, `means` or `unchanged`. ``same`` tells whether these are all the measurements of
    the scenario, as they are. `ValueError` for a scenario without bearings.
    """

    def __init__(self, scenario: Scenario, make: Callable[..., Any], reference_time: float) -> None:
        blocks = [block for block in scenario.blocks if getattr(block.sensor.model, "is_bearing", False)]
        if not blocks:
            names = [sensor.name for sensor in scenario.sensors]
            raise ValueError(
                f"a fit without a start needs a sensor that measures bearings, got {names}; give one"
            )
        self.parts = [(block.columns, make(block.sensor)) for block in blocks]
        sensors = [made.sensor for _, made in self.parts]
        self.scenario = Scenario(scenario.platform, sensors, reference_time)
        self.same = len(self.scenario.times) == len(scenario.times)

    def of(self, angles: FloatArray) -> FloatArray:
        """Values ``(runs, N')`` of measurements ``(runs, N)``."""
        if self.same:
            return angles
        return np.concatenate([made.of(angles[:, columns]) for columns, made in self.parts], axis=1)
