"""One straight leg of the array while it measures, and the target relative to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..cones import BOTTOM_BOUNCE, DIRECT, ConicalAngle, RayPath
from ..motion import Target
from ..scenario import Scenario
from ..types import FloatArray
from .family import ROUNDING, check_one_array

INSTANTS = 4


@dataclass(frozen=True)
class ArrayLeg:
    """The array during its measurements, and the target.

    ``tiny`` is the length below which all is rounding, ``slack`` the length by which the target may be moved
    to make it special, and ``tolerance`` what its cosines may change by that.
    """

    times: FloatArray  # both ends
    positions: FloatArray
    axes: FloatArray  # rows: unit vectors across (to the right) and ahead
    array_depth: float
    bottom_depth: float
    target: tuple[FloatArray, FloatArray, float]  # across and ahead at both ends, and depth
    share: FloatArray  # of the leg, at every measurement
    images: FloatArray  # its ray's slope and offset
    measured: FloatArray
    tiny: float
    slack: float
    tolerance: float

    def cosines(self, x: FloatArray, y: FloatArray, depth: float) -> FloatArray:
        """All measurements of a target with these relative coordinates; NaN on the array."""
        across, ahead = (start + self.share * (end - start) for start, end in (x, y))
        slope, offset = self.images
        zeta = slope * depth + (offset - self.array_depth)
        with np.errstate(invalid="ignore", divide="ignore"):
            return ahead / np.sqrt(across**2 + ahead**2 + zeta**2)

    def holds(self, x: FloatArray, y: FloatArray, depth: float) -> bool:
        """Whether the target is this one, for the numbers given: in every coordinate and every cosine."""
        pairs: Any = zip((x, y, depth), self.target, strict=True)
        moved = max(np.max(np.abs(new - old)) for new, old in pairs)
        if not moved <= self.slack:
            return False
        change = np.abs(self.cosines(x, y, depth) - self.measured)
        return bool(np.all(change <= self.tolerance))

    def member(self, x: ArrayLike, y: ArrayLike, depth: float, path: RayPath = DIRECT) -> Target:
        """The target with the relative positions ``(x, y)`` at both ends."""
        x, y = np.broadcast_to(x, 2), np.broadcast_to(y, 2)
        if self.passes(x, y) and abs(self.zeta(path, depth)) <= self.tiny:
            raise ValueError(f"this member would pass through the array: across {x}, ahead {y} m, no depth")
        start, end = self.positions + np.stack([x, y], axis=1) @ self.axes
        return Target.from_velocity(
            start, (end - start) / np.diff(self.times), depth=depth, time=self.times[0]
        )

    def passes(self, x: FloatArray, y: FloatArray) -> bool:
        """Whether a track leads right over or under the array."""
        beside = abs(x[0] * y[1] - x[1] * y[0]) <= self.tiny * np.hypot(x, y).max()
        return beside and x[0] * x[1] + y[0] * y[1] <= self.tiny**2

    def must_not_pass(self, path: RayPath) -> None:
        """`ValueError` for a target that goes through the array, where it has no cosine."""
        x, y, depth = self.target
        if self.passes(x, y) and abs(self.zeta(path, depth)) <= self.tiny:
            raise ValueError(f"the target passes through the array: across {x}, ahead {y} m, no depth")

    def zeta(self, path: RayPath, depth: float) -> float:
        slope, offset = path.image(self.bottom_depth)
        return slope * depth + (offset - self.array_depth)  # in the order of `ConicalAngle`


def straight_leg(scenario: Scenario, tolerance: float) -> tuple[ArrayLeg, RayPath | None]:
    """The leg, and the ray path (None for direct and bottom); `ValueError` for what is not covered."""
    check_one_array(scenario)
    target, models = scenario.target, [cast(Any, sensor.model) for sensor in scenario.sensors]
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

    instants: dict[tuple[float, float], Any] = {}  # a path by its image: (1, 0, 0) and (-1, 0, 0) are one
    paths = [model.path.image(bottom_depth) for model in models]
    for image, sensor in zip(paths, scenario.sensors, strict=True):
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
    positions, sites = scenario.platform.position_at(ends), target.position_at(ends)
    sin, cos = place[2:, 0]
    axes = np.array([[cos, -sin], [sin, cos]])
    x, y = axes @ (sites - positions).T
    images = np.repeat(np.transpose(paths), [len(sensor) for sensor in scenario.sensors], axis=1)
    zeta = images[0] * target.depth + (images[1] - array_depth)

    extent = [positions, sites, target.velocity * np.abs(ends - target.time).max()]
    tiny = ROUNDING * max(np.abs(part).max() for part in extent)
    slack = max(tiny, tolerance * max(np.abs(part).max() for part in (x, y, zeta)))
    share = (scenario.times - ends[0]) / (ends[1] - ends[0])
    leg = ArrayLeg(
        ends, positions, axes, array_depth, bottom_depth, (x, y, target.depth),
        share, images, scenario.measure(), tiny, slack, tolerance,
    )  # fmt: skip
    straight = positions[0] + share[:, None] * (positions[1] - positions[0])
    turned = np.abs(place[2:] - place[2:, :1]).max()
    if turned > tolerance or np.abs(place[:2].T - straight).max() > slack or not leg.holds(*leg.target):
        raise ValueError(
            "the platform must keep its velocity and heading while it measures: one straight leg"
        )
    return leg, models[0].path if len(instants) == 1 else None
