"""Fewer, sharper measurements: means of successive ones.

The mean of m successive measurements of a sensor, taken as one at the mean of their times with the standard
deviation ``sigma / sqrt(m)``, tells as much as they do where the measurement changes linearly meanwhile.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from .checks import check_count, check_is
from .scenario import Scenario
from .types import FloatArray


def average_measurements(scenario: Scenario, angles: ArrayLike, together: int) -> tuple[Scenario, FloatArray]:
    """The scenario with means of successive measurements, and these means.

    Parameters
    ----------
    scenario : Scenario
    angles : array_like, shape (..., N)
        Measurements, in the scenario's order; angles may wrap.
    together : int
        How many measurements make a mean. The number of measurements of every sensor must be a multiple.

    Returns
    -------
    scenario : Scenario
    means : ndarray, shape (..., N / together)

    Raises
    ------
    ValueError
        For wrong shapes, and for a sensor whose measurements cannot be divided so.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> north = tma.Course((0, 0), speed=5, heading=0.0, legs=[tma.Straight(60)])
    >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(60.0), sigma=0.02)
    >>> scenario = tma.Scenario(north, [ear], 59.0, tma.Target((3e3, 4e3), speed=4, heading=1.0))
    >>> fewer, means = average_measurements(scenario, scenario.simulate(runs=3, seed=1), together=4)
    >>> means.shape, fewer.sensors[0].sigma
    ((3, 15), 0.01)
    """
    angles = check_is("scenario", scenario, Scenario).check_measurements(angles)
    together = check_count("together", together)
    sensors, means = [], []
    for block in scenario.blocks:
        sensor, columns = block.sensor, block.columns
        if len(sensor) % together:
            raise ValueError(
                f"the {len(sensor)} measurements of {sensor.name} cannot be divided into means of {together}"
            )
        times = sensor.times.reshape(-1, together).mean(axis=1)
        sensors.append(replace(sensor, times=times, sigma=_of_means(sensor, together)))
        first = angles[..., columns.start, None]
        offsets = sensor.model.residual(angles[..., columns], first)  # from the first, so that none wraps
        means.append(first + offsets.reshape(*angles.shape[:-1], len(times), together).mean(axis=-1))
    return replace(scenario, sensors=sensors), np.concatenate(means, axis=-1)


def _of_means(sensor, together):
    """The sigma of means; `None` where it is not known."""
    if np.ndim(sensor.sigma):
        return np.linalg.norm(sensor.sigma.reshape(-1, together), axis=1) / together
    return None if sensor.sigma is None else sensor.sigma / np.sqrt(together)
