"""What an estimate means as seen from the platform: range, bearing, speed and course, with their sigmas.

Range and bearing are length and direction of the vector ``d`` from the platform to the target, speed and
course those of its velocity. Their standard deviations follow from the covariance P of the vector to first
order (delta method)::

    sigma_f^2 = grad f' P grad f,     grad length = d / |d|,     grad direction = (d_y, -d_x) / |d|^2.

This holds while an error is small against the length. A range that is known to a third only has no honest
ellipse (`tmalib.region` says how often such ellipses hold the truth).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .estimate import Estimate
from .scenario import Scenario
from .types import FloatArray, Motion
from .uniform import POSITION, VELOCITY

HONEST = 1 / 3  # share of the range up to which its sigma makes an ellipse that holds what it says


def length_and_direction(vector: ArrayLike, covariance: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Length and direction of plane vectors with their standard deviations, to first order.

    Parameters
    ----------
    vector : array_like, shape (..., 2)
        East and north.
    covariance : array_like, shape (..., 2, 2)

    Returns
    -------
    value, sigma : ndarray, shape (..., 2)
        Length, in the vector's unit, and direction in radians, clockwise from north. NaN for a vector of
        length zero.

    Notes
    -----
    Derived at the top of this file.

    Examples
    --------
    A place 1000 m to the north, with 10 m to the east and 20 m to the north:

    >>> value, sigma = length_and_direction([0.0, 1000.0], [[100.0, 0.0], [0.0, 400.0]])
    >>> value.tolist(), sigma.tolist()
    ([1000.0, 0.0], [20.0, 0.01])
    """
    vector, covariance = np.asarray(vector, dtype=float), np.asarray(covariance, dtype=float)
    x, y = np.moveaxis(vector, -1, 0)
    length = np.where(np.hypot(x, y) > 0, np.hypot(x, y), np.nan)
    of_length, of_direction = np.stack([x, y] / length, -1), np.stack([y, -x] / length**2, -1)
    slope = np.stack([of_length, of_direction], axis=-2)
    value = np.stack([length, np.where(length > 0, np.arctan2(x, y), np.nan)], axis=-1)
    return value, np.sqrt(np.vecdot(slope @ covariance, slope))


def seen_from(estimate: Estimate, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Range, bearing, speed and course of an estimate from a place ``(2,)``, and sigmas, each ``(..., 4)``.

    In metres, radians and m/s. NaN where a run has no covariance, and for a state without velocity.
    """
    parts: list[Any] = []
    for names, origin in ((POSITION, place), (VELOCITY, 0.0)):
        if set(names) <= set(estimate.coordinates):
            i = [estimate.coordinates.index(name) for name in names]
            covariance = estimate.covariance[..., i, :][..., :, i]
            parts.append(length_and_direction(estimate.state[..., i] - origin, covariance))
        else:
            parts.append(np.full((2, *estimate.state.shape[:-1], 2), np.nan))
    value, sigma = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
    return value, sigma


def place_at(platform: Motion, time: float) -> FloatArray:
    """Where a platform is at a time, NaN where its record does not say."""
    try:
        return platform.position_at(float(time))
    except ValueError:
        return np.full(2, np.nan)


def is_hardly_known(estimate: Estimate, scenario: Scenario) -> bool:
    """Whether the range of one run has a sigma of more than a third of it: its ellipse is not honest.

    Counted from the platform's place at the reference time, or at the measurement nearest to it.
    """
    time = np.clip(estimate.time, scenario.times.min(), scenario.times.max())
    value, sigma = seen_from(estimate, scenario.platform.position_at(time))
    return bool(sigma[0] > HONEST * value[0])
