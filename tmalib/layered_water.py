"""What rays do in the layers of a profile: the machinery of `tmalib.ray_tracing`, where the formulas stand.

A ray is known by its horizontal slowness and its *family*: in which direction it leaves and arrives, and how
often it crosses the water above the two depths, between them and below them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .checks import check_count, check_is, check_scalar
from .cones import RayPath
from .sound_profile import SoundSpeedProfile
from .types import BoolArray, FloatArray, IntArray

GRID = 33  # slownesses in each part of a family of rays, between which its rays are looked for
HALVINGS = 60  # of a part that has a ray: to the last digit
NEAR = 1e-12  # how near, of the width of a part, its ends are approached


class RayFamily(NamedTuple):
    """Rays that leave, reverse and arrive in one way."""

    leaves_down: bool
    arrives_down: bool
    turns: int
    crossings: IntArray  # of the water above, between and below the two depths


def families(path: RayPath, turns: int, target_above: bool) -> list[RayFamily]:
    """Those with the bounces of a path and a number of turns."""
    path, turns = check_is("path", path, RayPath), check_count("turns", turns, least=0)
    reversals = path.bottom + path.surface + turns
    ways = [path.delta == 1] if reversals else [target_above]
    found = []
    for leaves in [True, False] if turns else ways:
        arrives = leaves == (reversals % 2 == 0)
        early, late = (reversals + 1) // 2, reversals // 2
        above, below = (late, early) if leaves else (early, late)
        between = reversals + 1 - (leaves != target_above) - (arrives != target_above)
        found.append(RayFamily(leaves, arrives, turns, np.array([2 * above, between, 2 * below])))
    return found


def brackets(
    slowness: FloatArray, reached: FloatArray, distance: FloatArray
) -> Iterator[tuple[BoolArray, float, float]]:
    """Pairs of slownesses between which a family comes to some of the distances, and which these are."""
    for (low, high), far in zip(pairwise(slowness), pairwise(reached), strict=True):
        inside = (min(far) <= distance) & (distance < max(far))
        if inside.any():
            yield inside, low, high


class LayeredWater:
    """A profile down to the bottom, with the two depths among its own: layers, and what rays do in them."""

    def __init__(
        self, profile: SoundSpeedProfile, target_depth: float, array_depth: float, bottom_depth: float
    ) -> None:
        check_is("profile", profile, SoundSpeedProfile)
        bottom = check_scalar("bottom_depth", bottom_depth, above=0.0)
        if bottom > profile.depths[-1]:
            raise ValueError(f"bottom_depth must be at most {profile.depths[-1]:g}, got {bottom:g}")
        for name, depth in (("target_depth", target_depth), ("array_depth", array_depth)):
            if check_scalar(name, depth, minimum=0.0) > bottom:
                raise ValueError(f"{name} must be at most bottom_depth = {bottom:g}, got {depth:g}")
        both = sorted([float(target_depth), float(array_depth)])
        self.z = np.unique([*profile.depths[profile.depths < bottom], *both, bottom])
        self.c = profile.speed_at(self.z)
        self.ends = np.array([0.0, *both, bottom])
        self.first, self.last = np.searchsorted(self.z, both)
        self.section = np.repeat([0, 1, 2], np.diff([0, self.first, self.last, len(self.z) - 1]))
        self.target, self.array = profile.speed_at([target_depth, array_depth])
        self.target_above = target_depth <= array_depth

    def sines(self, slowness: ArrayLike) -> FloatArray:
        """Of the angles at the depths, ``(..., m)``; 0 where a ray does not come."""
        return np.sqrt(np.maximum(0.0, 1 - (np.asarray(slowness)[..., None] * self.c) ** 2))

    def layers(self, slowness: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Distance and time in each layer, ``(..., m - 1)``: through it, or into it until the ray turns."""
        p, sine = np.asarray(slowness)[..., None], self.sines(slowness)
        c1, c2, s1, s2 = self.c[:-1], self.c[1:], sine[..., :-1], sine[..., 1:]
        thick = np.diff(self.z)
        g = np.abs(c2 - c1) / thick
        enters = np.maximum(s1, s2)
        with np.errstate(divide="ignore", invalid="ignore"):
            whole = thick * (c1 + c2)
            far = p * whole / (s1 + s2)
            pace = whole * (1 + s1 * s2) / ((s1 + s2) * (c1**2 + c2**2 - (p * c1 * c2) ** 2))
            late = pace * _artanh_over(g * pace)
            turned = (p * np.maximum(c1, c2) > 1) & (g > 0)
            far = np.where(turned, enters / (p * g), far)
            late = np.where(turned, enters * _artanh_over(enters) / g, late)
        return far, late

    def advance(self, slowness: ArrayLike, family: RayFamily) -> tuple[FloatArray, FloatArray]:
        """Distance and time from the target to the array, of the shape of the slowness."""
        crossings = family.crossings[self.section]
        if family.turns:
            crossings = crossings * self._reached(self.sines(slowness) > 0)
        far, late = (np.where(crossings > 0, each, 0.0) * crossings for each in self.layers(slowness))
        return far.sum(axis=-1), late.sum(axis=-1)

    def _reached(self, passes):
        """Whether a ray comes into a layer from the two depths; the depths that it passes are marked."""
        up = np.logical_and.accumulate(passes[..., self.first : 0 : -1], axis=-1)[..., ::-1]
        down = np.logical_and.accumulate(passes[..., self.last : -1], axis=-1)
        between = np.ones((*passes.shape[:-1], self.last - self.first), bool)
        return np.concatenate([up, between, down], axis=-1)

    def parts(self, path: RayPath, turns: int) -> Iterator[tuple[RayFamily, FloatArray]]:
        """Families of rays, each with slownesses over which it changes smoothly."""
        for family in families(path, turns, self.target_above):
            if not family.turns:
                crossed = np.flatnonzero(family.crossings[self.section])
                fastest = self.c[np.union1d(crossed, crossed + 1)].max(initial=self.target)
                yield family, np.array([0.0, 1 / fastest])
                continue
            most = 1 / self.c[self.first : self.last + 1].max()
            ends = np.unique([0.0, *1 / self.c[1 / self.c < most], most])
            for low, high in pairwise(ends):
                passes = self.sines((low + high) / 2) > 0
                above = family.crossings[0] / 2 if passes[: self.first + 1].all() else 0
                below = family.crossings[2] / 2 if passes[self.last :].all() else 0
                if (above, below) == (path.surface, path.bottom) and high - low > NEAR * high:
                    share = np.clip((1 - np.cos(np.linspace(0, np.pi, GRID))) / 2, NEAR, 1 - NEAR)
                    yield family, low + share * (high - low)

    def halve(self, low: float, high: float, family: RayFamily, distance: FloatArray) -> FloatArray:
        """Slowness, time, departure and arrival of the rays between two slownesses, ``(4, N)``."""
        lower, upper = np.full(distance.shape, low), np.full(distance.shape, high)
        short = self.advance(low, family)[0] <= distance
        for _ in range(HALVINGS):
            middle = (lower + upper) / 2
            alike = (self.advance(middle, family)[0] <= distance) == short
            lower, upper = np.where(alike, middle, lower), np.where(alike, upper, middle)
        angles = [
            np.where(down, 1, -1) * np.arccos(np.minimum(1.0, lower * speed))
            for down, speed in ((family.leaves_down, self.target), (family.arrives_down, self.array))
        ]
        return np.stack([lower, self.advance(lower, family)[1], *angles])


def _artanh_over(q):
    """``artanh(q) / q``, also at 0."""
    small = np.abs(q) < 1e-3
    return np.where(small, 1 + q**2 / 3 + q**4 / 5, np.arctanh(q) / np.where(small, 1.0, q))
