"""One straight leg of the array while it measures, and the target relative to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..cones import BOTTOM_BOUNCE, DIRECT, ConicalAngle
from ..motion import Target

# What is zero up to rounding: lengths, relative to the largest coordinate in the scenario. It is some
# hundred times the rounding error of a position, and moves a cosine by less than 1e-12.
TOLERANCE = 1e-13
INSTANTS = 4


@dataclass(frozen=True)
class ArrayLeg:
    """The array during its measurements: times and positions at both ends, axes, depths, and a length
    below which all is rounding."""

    times: np.ndarray
    positions: np.ndarray
    axes: np.ndarray  # rows: unit vectors across (to the right) and ahead
    array_depth: float
    bottom_depth: float
    tiny: float

    def member(self, x, y, depth, path=DIRECT):
        """The target with the relative positions ``(x, y)`` at both ends."""
        x, y = np.broadcast_to(x, 2), np.broadcast_to(y, 2)
        passes = abs(x[0] * y[1] - x[1] * y[0]) <= self.tiny * np.hypot(x, y).max()
        passes &= x[0] * x[1] + y[0] * y[1] <= self.tiny**2
        if passes and abs(self.zeta(path, depth)) <= self.tiny:
            raise ValueError(f"this member would pass through the array: across {x}, ahead {y} m, no depth")
        start, end = self.positions + np.stack([x, y], axis=1) @ self.axes
        return Target.from_velocity(
            start, (end - start) / np.diff(self.times), depth=depth, time=self.times[0]
        )

    def zeta(self, path, depth):
        slope, offset = path.image(self.bottom_depth)
        return slope * depth + (offset - self.array_depth)  # in the order of `ConicalAngle`


def straight_leg(scenario):
    """The leg, the target's relative coordinates ``x`` and ``y`` at both ends, its depth, and the ray path
    (None for direct and bottom); `ValueError` for a scenario that is not covered."""
    target, models = scenario.target, [sensor.model for sensor in scenario.sensors]
    if not isinstance(target, Target) or target.depth is None:
        raise ValueError(f"the target must be a Target with a depth, got {target!r}")
    if not all(isinstance(model, ConicalAngle) for model in models):
        raise ValueError(
            f"all sensors must be ConicalAngle, got {sorted({type(m).__name__ for m in models})}"
        )
    depths = {(model.array_depth, model.bottom_depth) for model in models}
    if len(depths) > 1:
        raise ValueError(f"all sensors must have the same array_depth and bottom_depth, got {sorted(depths)}")
    array_depth, bottom_depth = depths.pop()
    if not 0 <= target.depth <= bottom_depth:
        raise ValueError(f"the target's depth must be between 0 and {bottom_depth}, got {target.depth}")

    instants = {}  # a path by its image: (1, 0, 0) and (-1, 0, 0) are one
    for sensor in scenario.sensors:
        image = sensor.model.path.image(bottom_depth)
        instants[image] = np.union1d(instants.get(image, []), sensor.times)
    pair = {path.image(bottom_depth) for path in (DIRECT, BOTTOM_BOUNCE)}
    if len(instants) > 1 and set(instants) != pair:
        raise ValueError("the rays must be one path, or the direct path and the bottom bounce")
    fewest = min(map(len, instants.values()))
    if fewest < INSTANTS:
        raise ValueError(f"each ray needs at least {INSTANTS} instants, got {fewest}")

    times = np.unique(scenario.times)
    ends = times[[0, -1]]
    place = np.concatenate([block.observer for block in scenario.blocks], axis=1)
    positions = scenario.platform.position_at(ends)
    extent = [positions, target.position_at(ends), target.velocity * np.abs(ends - target.time).max()]
    tiny = TOLERANCE * max(np.abs(part).max() for part in extent)
    share = (scenario.times - ends[0]) / (ends[1] - ends[0])
    straight = positions[0] + share[:, None] * (positions[1] - positions[0])
    turned = np.abs(place[2:] - place[2:, :1]).max()
    if turned > TOLERANCE or np.abs(place[:2].T - straight).max() > tiny:
        raise ValueError(
            "the platform must keep its velocity and heading while it measures: one straight leg"
        )

    sin, cos = place[2:, 0]
    axes = np.array([[cos, -sin], [sin, cos]])
    leg = ArrayLeg(ends, positions, axes, array_depth, bottom_depth, tiny)
    x, y = axes @ (target.position_at(ends) - positions).T
    return leg, x, y, target.depth, models[0].path if len(instants) == 1 else None
