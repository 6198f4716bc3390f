"""Position and depth from the cosines of three rays, or more, at one instant: no motion, and no start.

Mirror the array at surface and bottom instead of the target: a ray that arrives with any number of bounces
comes straight to an *image of the array* at the depth ``-b``. If the target's image is ``s z + c`` below the
array (`tmalib.cones`), then ``b = s c``. All images stand on one vertical line. With the displacements
``along`` the array's axis and ``across`` it, the cosine of a ray is::

    m = along / sqrt(along^2 + across^2 + (z + b)^2),

so that the inverse square of the cosine is a quadratic function of b, the same for all rays::

    1 / m^2 = A + B b + C b^2,    C = 1 / along^2,    B / C = 2 z,    A / C = along^2 + across^2 + z^2.

Three rays with different b give the parabola, and it gives the depth, the displacement along the axis, whose
sign is that of the cosines, and the one across it but for its side. More rays fit it by least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_scalar, check_sequence
from .cones import RayPath
from .types import FloatArray

APART = 1e-6  # of the bottom's depth: images of the array that are nearer to one another are one


class RayPosition(NamedTuple):
    """A target in the frame of the array, in metres: output of `position_from_rays`.

    ``across`` is not negative: the side is not known. ``depth`` is below the surface.
    """

    along: FloatArray
    across: FloatArray
    depth: FloatArray


def array_image(path: RayPath, array_depth: float, bottom_depth: float) -> float:
    """The ``b`` of a path: the array's image stands at the depth ``-b``, in metres.

    Examples
    --------
    >>> from tmalib.cones import DIRECT, BOTTOM_BOUNCE
    >>> array_image(DIRECT, 200, 4000), array_image(BOTTOM_BOUNCE, 200, 4000)
    (-200.0, -7800.0)
    """
    slope, offset = path.image(check_scalar("bottom_depth", bottom_depth, above=0.0))
    return slope * (offset - check_scalar("array_depth", array_depth))


def position_from_rays(
    paths: Sequence[RayPath], cosines: ArrayLike, array_depth: float, bottom_depth: float
) -> RayPosition:
    """Position and depth of a target from the cosines of its rays at one instant.

    Parameters
    ----------
    paths : sequence of RayPath
        Three or more, K of them.
    cosines : array_like, shape (..., K)
        Of the conical angles, in the order of the paths.
    array_depth, bottom_depth : float
        In metres.

    Returns
    -------
    RayPosition
        Arrays ``(...)``. NaN for ``along`` and ``depth`` where the noise leaves no parabola that opens
        upwards, and for ``across`` where it leaves no such position. A depth out of the water is given as
        it comes.

    Raises
    ------
    ValueError
        For fewer than three rays, another number of cosines, and rays of which fewer than three are
        different: with an array at the surface a direct ray and one with a bounce off the surface are the
        same.

    Notes
    -----
    Derived at the top of this file. With more than three rays each is weighted by ``|m|^3``, as noise of
    equal size on the cosines asks for. Of a target broadside to the array all cosines are zero: NaN.

    Examples
    --------
    >>> import tmalib as tma
    >>> rays = [tma.DIRECT, tma.BOTTOM_BOUNCE, tma.RayPath(-1, 1, 1)]
    >>> array = tma.Course((0, 0), 5, 0.0, [tma.Straight(60)])
    >>> target = tma.Target((3000, 4000), speed=4, heading=1.0, depth=100)
    >>> cosines = [tma.ConicalAngle(ray, 200, 2000).observe(target, array, [0.0])[0] for ray in rays]
    >>> along, across, depth = position_from_rays(rays, cosines, 200, 2000)
    >>> round(float(along), 6), round(float(across), 6), round(float(depth), 6)
    (4000.0, 3000.0, 100.0)
    """
    paths = check_sequence("paths", paths, RayPath)
    b = np.array([array_image(path, array_depth, bottom_depth) for path in paths])
    distinct = 1 + int(np.sum(np.diff(np.sort(b)) > APART * bottom_depth))
    if distinct < 3:
        raise ValueError(f"a depth needs three different rays, and these have {distinct} images of the array")
    cosines = as_numbers("cosines", cosines)
    if cosines.ndim == 0 or cosines.shape[-1] != len(b):
        raise ValueError(f"cosines must have shape (..., {len(b)}), one a path, got {cosines.shape}")
    unit = np.abs(b).max()
    columns = np.stack([np.ones_like(b), b / unit, (b / unit) ** 2], axis=-1)
    with np.errstate(all="ignore"):
        weight = np.abs(cosines) ** 3
        rows = columns * weight[..., None]
        sums = np.einsum("...ki,...kj->...ij", rows, rows)
        found = np.isfinite(cosines).all(axis=-1) & (cosines != 0).all(axis=-1)
        sums = np.where(found[..., None, None], sums, np.eye(3))
        right = np.einsum("...ki,...k->...i", rows, np.where(found[..., None], weight / cosines**2, 0.0))
        a, slope, curve = np.moveaxis(np.linalg.solve(sums, right[..., None])[..., 0], -1, 0)
        curve = np.where(found & (curve > 0), curve, np.nan)
        along = np.sign(cosines.sum(axis=-1)) * unit / np.sqrt(curve)
        depth = unit * slope / (2 * curve)
        across = np.sqrt(unit**2 * a / curve - depth**2 - along**2)
    return RayPosition(along, across, depth)
