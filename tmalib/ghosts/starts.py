"""Where the search for near ghosts starts.

The cosines of the first and the last instant leave three numbers of the state free: range at both ends and
depth, and a side at either end. A grid of them has the target's own values in it, and their mirror images.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..cosine_starts import longest_sensor, motions_through
from ..scenario import Scenario
from ..types import FloatArray
from ..uniform import propagate

RANGES = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 16.0)  # times the target's own, at either end
DEPTHS = (-0.3, -0.03, 0.03, 0.3)  # below the array, times the range or the depth of the water
IN_WATER = (0.5, 0.9)  # of the depth of the water


def grid_of_starts(scenario: Scenario) -> FloatArray:
    """States with the cosines of the first and the last instant: ranges, sides and depths, ``(S, 5)``."""
    sensor = longest_sensor(scenario).sensor
    ends, platform = sensor.times[[0, -1]], scenario.platform_of(sensor)
    model: Any = sensor.model
    target: Any = scenario.target
    slope, offset = model.path.image(model.bottom_depth)
    own = slope * target.depth + offset - model.array_depth
    gap = target.position_at(ends) - platform.position_at(ends)
    distance = np.sqrt(np.sum(gap**2, axis=1) + own**2)
    cosines = model.observe(target, platform, sensor.times)[[0, -1]]
    ranges = np.multiply.outer(RANGES, distance)
    states = motions_through(sensor, platform, cosines, ranges, _depths(scenario, distance.mean()))
    return propagate(states, scenario.reference_time - ends[0], ("x", "y", "z", "vx", "vy"))


def _depths(scenario, distance):
    """The target's depth, its mirror images on every ray, and others around the array and in the water."""
    depth, depths = scenario.target.depth, {scenario.target.depth}
    for model in (sensor.model for sensor in scenario.sensors):
        array, bottom = model.array_depth, model.bottom_depth
        slope, offset = model.path.image(bottom)
        depths.add((2 * (array - offset) - slope * depth) / slope)  # -zeta
        if bottom > depth:
            depths.add(bottom - (bottom - array) ** 2 / (bottom - depth))  # Theorem 3
        depths.update(array + share * min(distance, bottom) for share in DEPTHS)
        depths.update(share * bottom for share in IN_WATER)
    return sorted(depths)
