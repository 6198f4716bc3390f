"""Sound speed at depths: a profile, as a cast or an atlas gives it.

Depths are positive downwards, metres; speeds in m/s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_array, set_fields
from .types import Array, FloatArray


@dataclass(frozen=True, eq=False)
class SoundSpeedProfile:
    """Sound speed at depths, linear between them.

    Parameters
    ----------
    depths : array_like, shape (n,)
        In metres, increasing from 0; at least two.
    speeds : array_like, shape (n,)
        In m/s, positive.

    Raises
    ------
    ValueError
        For depths that do not increase from 0, or speeds that are not positive.

    Examples
    --------
    >>> profile = SoundSpeedProfile([0, 100, 1000], [1530, 1510, 1480])
    >>> float(profile.speed_at(50))
    1520.0
    >>> float(profile.mean(0, 1000))
    1497.5
    """

    depths: Array
    speeds: Array

    def __post_init__(self) -> None:
        depths = check_array("depths", self.depths, (None,))
        speeds = check_array("speeds", self.speeds, (len(depths),))
        if len(depths) < 2 or depths[0] != 0 or np.any(np.diff(depths) <= 0):
            raise ValueError(f"depths must be at least two that increase from 0, got {depths}")
        if np.any(speeds <= 0):
            raise ValueError(f"speeds must be positive, got {speeds}")
        set_fields(self, depths=depths, speeds=speeds)

    def speed_at(self, depth: ArrayLike) -> FloatArray:
        """Sound speed at depths of any shape; `ValueError` outside the profile."""
        depth = as_numbers("depth", depth)
        if np.any(~((depth >= 0) & (depth <= self.depths[-1]))):
            raise ValueError(f"depth must be between 0 and {self.depths[-1]:g}, got {depth}")
        return np.interp(depth, self.depths, self.speeds)

    def mean(self, upper: float, lower: float) -> FloatArray:
        """Mean speed over the depths between two; the speed itself where they are equal."""
        ends = self.speed_at([upper, lower])
        if upper == lower:
            return ends[0]
        inside = (self.depths > min(upper, lower)) & (self.depths < max(upper, lower))
        z = np.union1d(self.depths[inside], [upper, lower])
        c = self.speed_at(z)
        return np.sum(np.diff(z) * (c[1:] + c[:-1]) / 2) / (z[-1] - z[0])
