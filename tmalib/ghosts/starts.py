"""Where the search for near ghosts starts.

The cosines of the first and the last instant leave three numbers of the state free: range at both ends and
depth, and a side at either end. A grid of them has the target's own values in it, and their mirror images.
"""

from __future__ import annotations

import numpy as np

RANGES = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 16.0)  # times the target's own, at either end
DEPTHS = (-0.3, -0.03, 0.03, 0.3)  # below the array, times the range or the depth of the water
IN_WATER = (0.5, 0.9)  # of the depth of the water


def grid_of_starts(scenario):
    """States with the cosines of the first and the last instant: ranges, sides and depths, ``(S, 5)``."""
    sensor = max(scenario.sensors, key=lambda s: np.ptp(s.times))
    ends = sensor.times[[0, -1]]
    if not ends[1] > ends[0]:
        raise ValueError(f"a sensor needs two instants or more, got {[len(s) for s in scenario.sensors]}")
    model, target, platform = sensor.model, scenario.target, scenario.platform_of(sensor)
    x, y, sin, cos = model.observer_state(platform, sensor.times)[:, [0, -1]]
    slope, offset = model.path.image(model.bottom_depth)
    own = slope * target.depth + offset - model.array_depth
    gap = target.position_at(ends) - np.stack([x, y], axis=1)
    distance = np.sqrt(np.sum(gap**2, axis=1) + own**2)
    depths = _depths(scenario, distance.mean())

    z, *grid = np.meshgrid(depths, RANGES, RANGES, (-1, 1), (-1, 1), indexing="ij")
    z, ranges, sides = z.ravel(), np.reshape(grid[:2], (2, -1)).T * distance, np.reshape(grid[2:], (2, -1)).T
    zeta = slope * z + offset - model.array_depth
    cosine = model.observe(target, platform, sensor.times)[[0, -1]]
    ahead = ranges * cosine
    across = sides * np.sqrt(np.maximum(ranges**2 - ahead**2 - zeta[:, None] ** 2, (1e-3 * ranges) ** 2))
    places = np.stack([x + across * cos + ahead * sin, y - across * sin + ahead * cos])  # (2, S, ends)
    velocity = np.diff(places, axis=-1)[..., 0] / (ends[1] - ends[0])
    place = places[..., 0] + (scenario.reference_time - ends[0]) * velocity
    return np.stack([*place, z, *velocity], axis=-1)


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
