"""Curved rays: sound in water whose speed changes with depth, by Snell's law in closed form.

Between two depths of a profile the speed is linear, ``c(z) = c1 + g (z - z1)``. A ray keeps its *horizontal
slowness* ``p = cos(e) / c``, with e its angle below the horizontal, and turns where ``c = 1 / p``. A layer of
thickness ``h`` that it crosses takes it along a circular arc, by the horizontal distance and the time::

    x = p (c1 + c2) h / (s1 + s2),                          s = sin(e) = sqrt(1 - p^2 c^2),
    t = artanh(q) / g,    q = g h (c1 + c2) (1 + s1 s2) / ((s1 + s2) (c1^2 + c2^2 - p^2 c1^2 c2^2)),

and one in which it turns, up to that depth, by ``x = s1 / (p |g|)``, ``t = artanh(s1) / |g|``. Neither loses
digits where g is small.

A line array that is steered with the sound speed at its own depth, ``c0``, measures ``p c0`` times the cosine
of the relative bearing. Straight rays (`tmalib.cones`) put the cosine of a straight line in the place of
``p c0``. To first order in the variation of the speed the two differ by a factor (`effective_speed`).

Depths are positive downwards, metres; angles in radians, positive downwards, of the direction in which the
sound travels; speeds in m/s, slownesses in s/m, times in seconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_scalar
from .cones import RayPath
from .layered_water import LayeredWater, brackets, families
from .sound_profile import SoundSpeedProfile
from .types import FloatArray


def effective_speed(
    profile: SoundSpeedProfile, path: RayPath, target_depth: float, array_depth: float, bottom_depth: float
) -> float:
    """Sound speed with which an array has to be steered for straight rays to fit: its mean along a path.

    An array at the depth ``z0`` that is steered with ``c(z0)`` measures ``p c(z0)``, times the cosine of the
    relative bearing. Steered with c*, or multiplied by ``c* / c(z0)``, it measures ``p c*``. With
    ``c = c* (1 + u(z))`` the horizontal distance of the ray is to first order in u::

        x = integral of p c / sqrt(1 - p^2 c^2) dz
          = Z cos(e) / sin(e) + cos(e) / sin(e)^3 times the integral of u dz,      cos(e) = p c*,

    where Z is the depth that the path crosses, all bounces unfolded, ``|image_depth|``. The mean over these
    depths makes the integral vanish, at every distance: the ray is then where the straight one is.

    Parameters
    ----------
    profile : SoundSpeedProfile
    path : RayPath
    target_depth, array_depth, bottom_depth : float
        In metres, in the profile.

    Returns
    -------
    float
        In m/s.

    Notes
    -----
    Derived here. The remainder grows as ``u^2 / sin(e)^4``: nothing is gained where rays are flat, as direct
    ones are.

    Examples
    --------
    >>> from tmalib.cones import BOTTOM_BOUNCE
    >>> profile = SoundSpeedProfile([0, 4000], [1500, 1540])
    >>> round(effective_speed(profile, BOTTOM_BOUNCE, 100, 200, 4000), 3)
    1520.747
    """
    water = LayeredWater(profile, target_depth, array_depth, bottom_depth)
    (family,) = families(path, 0, water.target_above)
    lengths = np.diff(water.ends) * family.crossings
    if not lengths.any():
        return float(profile.speed_at(array_depth))
    return float(lengths @ [profile.mean(*ends) for ends in pairwise(water.ends)] / lengths.sum())


@dataclass(frozen=True, eq=False)
class EigenRays:
    """Rays between two points, ordered by their time; the last axis counts them, NaN where there are fewer.

    Parameters
    ----------
    slowness : ndarray, shape (..., k)
        Horizontal slowness ``p = cos(e) / c``.
    time : ndarray, shape (..., k)
    departure, arrival : ndarray, shape (..., k)
        Angles at the target and at the array, positive downwards.
    """

    slowness: FloatArray
    time: FloatArray
    departure: FloatArray
    arrival: FloatArray


def eigenrays(
    profile: SoundSpeedProfile,
    path: RayPath,
    target_depth: float,
    array_depth: float,
    bottom_depth: float,
    distance: ArrayLike,
    turns: int = 0,
) -> EigenRays:
    """All rays from a target to an array that bounce as a path says, and turn so many times between.

    Parameters
    ----------
    profile : SoundSpeedProfile
        At least as deep as the bottom.
    path : RayPath
        Its numbers of bounces. Without turns its first direction too (of a direct ray the depths decide);
        with turns a ray may leave upwards or downwards.
    target_depth, array_depth, bottom_depth : float
        In metres, target and array between surface and bottom.
    distance : array_like, shape (...)
        Horizontal, in metres, not negative.
    turns : int
        How often the ray is bent back before it meets surface or bottom.

    Returns
    -------
    EigenRays
        The last axis is empty where no distance has such a ray.

    Raises
    ------
    ValueError
        For depths outside the water or the profile, and for a negative distance.

    Notes
    -----
    Derived at the top of this file. Without turns the distance grows with the slowness, and the one ray, or
    that there is none, is found for certain. With turns it need not, and rays are found that differ by more
    than the spacing of a grid: two that are about to merge, at a caustic, may be missed.

    Examples
    --------
    Speed grows with depth: the rays bend upwards, and from 100 m to 100 m one dips below the straight line.

    >>> from tmalib.cones import BOTTOM_BOUNCE, DIRECT
    >>> profile = SoundSpeedProfile([0, 4000], [1480, 1560])
    >>> found = eigenrays(profile, DIRECT, 100, 100, 4000, 5000.0, turns=1)
    >>> np.degrees(found.departure).round(3), np.degrees(found.arrival).round(3)
    (array([1.932]), array([-1.932]))
    >>> eigenrays(profile, BOTTOM_BOUNCE, 100, 200, 4000, [5e3, 9e3]).slowness.shape
    (2, 1)
    """
    distance = as_numbers("distance", distance)
    if not np.all((distance >= 0) & (distance < np.inf)):
        raise ValueError(f"distance must be finite and not negative, got {distance}")
    water = LayeredWater(profile, target_depth, array_depth, bottom_depth)
    found = []
    for family, slowness in water.parts(path, turns):
        reached = water.advance(slowness, family)[0]
        for inside, low, high in brackets(slowness, reached, distance):
            found.append(np.full((4, *distance.shape), np.nan))
            found[-1][:, inside] = water.halve(low, high, family, distance[inside])
    rays = np.array(found).reshape((-1, 4, *distance.shape))
    rays = np.take_along_axis(rays, np.argsort(rays[:, 1:2], axis=0), axis=0)  # NaN comes last
    many = int(np.isfinite(rays[:, 1]).sum(axis=0).max(initial=0))
    return EigenRays(*np.moveaxis(rays[:many], (0, 1), (-1, 0)))


def farthest(
    profile: SoundSpeedProfile,
    path: RayPath,
    target_depth: float,
    array_depth: float,
    bottom_depth: float,
    turns: int = 0,
) -> float:
    """Distance beyond which `eigenrays` with these arguments finds no ray, in metres; 0 if there is none.

    Notes
    -----
    The largest distance on a grid of slownesses: that of the limiting ray, which grazes where a family ends,
    or near a caustic the largest of the grid.

    Examples
    --------
    Speed falls with depth: the limiting ray grazes the surface, and beyond is shadow.

    >>> from tmalib.cones import DIRECT
    >>> profile = SoundSpeedProfile([0, 1000], [1530, 1500])
    >>> [round(farthest(profile, DIRECT, 100, 200, 1000, turns)) for turns in (0, 1)]
    [3189, 7704]
    """
    water = LayeredWater(profile, target_depth, array_depth, bottom_depth)
    parts = water.parts(path, turns)
    return max((float(water.advance(p, family)[0].max()) for family, p in parts), default=0.0)


def trace_ray(
    profile: SoundSpeedProfile, depth: float, angle: float, distance: float, bottom_depth: float
) -> FloatArray:
    """The course of a ray that leaves a depth, for a drawing, ``(n, 2)``: distances and depths in metres.

    Parameters
    ----------
    profile : SoundSpeedProfile
    depth : float
        Where it leaves.
    angle : float
        At which it leaves, in radians below the horizontal, not zero and not vertical.
    distance : float
        Horizontal, to which it is followed.
    bottom_depth : float

    Returns
    -------
    ndarray
        Its points at the depths of the profile, where it turns and where it bounces; the last is at the
        distance or beyond. Between them it is an arc: give a finer profile for a smooth line.

    Raises
    ------
    ValueError
        For an angle that is zero or vertical, and for depths outside the water.

    Examples
    --------
    >>> profile = SoundSpeedProfile([0, 1000, 2000], [1500, 1500, 1500])
    >>> trace_ray(profile, 0, np.radians(45), 3000, 2000).round(6)
    array([[   0.,    0.],
           [1000., 1000.],
           [2000., 2000.],
           [3000., 1000.]])
    """
    if not 0 < abs(check_scalar("angle", angle)) < np.pi / 2:
        raise ValueError(f"angle must be between 0 and pi / 2 in size, got {angle}")
    water = LayeredWater(profile, depth, depth, bottom_depth)
    slowness = np.cos(angle) / water.array
    sine, (across, _) = water.sines(slowness), water.layers(slowness)
    at, down, points = int(water.first), angle > 0, [(0.0, water.z[water.first])]
    while points[-1][0] < check_scalar("distance", distance):
        x, beyond = points[-1][0], at + 1 if down else at - 1
        if not 0 <= beyond < len(sine):
            down = not down  # off the bottom or the surface
        elif sine[beyond] > 0:
            points.append((x + across[min(at, beyond)], water.z[beyond]))
            at = beyond
        else:  # turns in the layer, and comes back to where it entered
            half = across[min(at, beyond)]
            share = (1 / slowness - water.c[at]) / (water.c[beyond] - water.c[at])
            turn = water.z[at] + share * (water.z[beyond] - water.z[at])
            points += [(x + half, turn), (x + 2 * half, water.z[at])]
            down = not down
    return np.array(points)
