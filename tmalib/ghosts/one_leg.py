"""Ghosts seen from one straight leg, with one ray or with a direct and a bottom-bounced one.

With the array's axis for y, the relative position ``(x, y)``, linear in time, and the image depth ``zeta``,
a ghost (primes) has the same cosine ``m = y / sqrt(x^2 + y^2 + zeta^2)`` at all times if and only if::

    y^2 (x'^2 + zeta'^2) = y'^2 (x^2 + zeta^2)    as polynomials in time, and the signs of m agree.

*One ray.* If y vanishes, so does y': broadside. If ``y' = beta y`` (``beta > 0`` for the sign), then
``x'^2 + zeta'^2 = beta^2 (x^2 + zeta^2)``: with x constant (parallel) x' is any constant and beta follows;
otherwise ``x' = +- beta x`` and ``zeta' = +- beta zeta`` (homothetic). If y' is not a multiple of y, then
``y^2`` divides ``x^2 + zeta^2``, or y is constant, and m is constant: relative rest, or a radial motion at
``zeta = 0``. Then every target with the same constant m is a ghost.

*Two rays.* With ``d = D - z`` the two conditions differ by ``4 dO (dT y'^2 - d' y^2) = 0``, so
``beta^2 = d' / dT`` always. With x constant ``x'^2 = beta^2 (x^2 + (dO - dT)^2) - (dO - d')^2``, where this
is not negative; otherwise ``d' = dT`` (mirror) or ``d' dT = dO^2``.

The proofs are in the book, chapters on Theorems 1 and 3. Four instants a ray suffice, three do not.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ..cones import DIRECT
from ..scenario import Scenario
from .family import TOLERANCE, Family, check_tolerance, verified
from .leg import straight_leg

ANY, POSITIVE = (-np.inf, np.inf), (0.0, np.inf)


def ghosts_of_one_leg(scenario: Scenario, *, tolerance: float = TOLERANCE) -> list[Family]:
    """All targets with the same noise-free cosines of conical angles, seen from one straight leg.

    Parameters
    ----------
    scenario : Scenario
        A `Target` with a depth in the water; a platform on one straight leg of constant velocity and
        heading while it measures; `ConicalAngle` sensors along one ray path, or along the direct path and
        the bottom bounce, each with four instants or more. An assumed depth plays no part.
    tolerance : float
        What is special for the numbers given (see `find_ghosts`).

    Returns
    -------
    list of Family
        Complete for ``0 <= z <= D``; isolated ghosts outside the water are listed as well (see
        `admissible`). A family with parameters may contain the target itself. The parameters are

        ``depth``
            Depth of the ghost, in metres.
        ``beta``
            Ratio of the ghost's relative position to the target's.
        ``across``, ``across_start``, ``across_end``
            Relative position to the right of the axis, throughout or at the first and last measurement.
        ``range_start``, ``range_end``
            Distance along the axis at the first and last measurement, on the target's side.

        A value that puts the ghost on the array raises `ValueError`.

    Raises
    ------
    ValueError
        For anything else; the message says what.

    Notes
    -----
    Source: `conical-angles`, Theorems 1 and 3, as corrected in the book.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> from tmalib.ghosts import ghosts_of_one_leg
    >>> array = tma.Course((0, 0), speed=5, heading=0.0, legs=[tma.Straight(np.inf)])
    >>> target = tma.Target((5000, 7000), speed=4, heading=np.radians(45), depth=100)
    >>> rays = [tma.ConicalAngle(path, 200.0, 4000.0) for path in (tma.DIRECT, tma.BOTTOM_BOUNCE)]
    >>> sensors = [tma.Sensor(ray, np.arange(0, 301, 4), 0.017) for ray in rays]
    >>> scenario = tma.Scenario(array, sensors, reference_time=0, target=target)
    >>> for family in ghosts_of_one_leg(scenario):
    ...     print(f"{family.case}: {family.target().depth:.2f} m")
    mirror: 100.00 m
    homothetic: 297.44 m
    mirror-homothetic: 297.44 m
    """
    leg, path = straight_leg(scenario, check_tolerance(tolerance))
    found = _one_ray(leg, path) if path else _two_rays(leg)
    return verified(scenario, found, leg.tolerance)


def _one_ray(leg, path, theorem=1):
    """Theorem 1, corrected: the most special case that holds for the numbers given."""

    def family(case, number, make, **parameters):
        return Family(case, f"conical-angles, Theorem {theorem}, {number}", make, parameters)

    water = (0.0, leg.bottom_depth)
    x, y, depth = leg.target

    if leg.holds(x, 0 * y, depth):
        broadside = partial(_broadside, leg, path)
        return [family("broadside", "case 1", broadside, across_start=ANY, across_end=ANY, depth=water)]

    leg.must_not_pass(path)
    side = np.sign(y[0])
    slope, offset = path.image(leg.bottom_depth)
    same_depth = min(max((leg.array_depth - offset) / slope, 0.0), leg.bottom_depth)  # where zeta = 0 ...
    reachable = abs(leg.zeta(path, same_depth)) <= leg.tiny  # ... if that is in the water

    def radial(ratio):
        return partial(_radial, leg, path, same_depth, side, ratio)

    ranges = dict(range_start=POSITIVE, range_end=POSITIVE)
    level = reachable and leg.holds(x, y, same_depth)
    if level and y[0] * y[1] > 0 and leg.holds(0 * x, y, same_depth):
        return [family("endfire", "case 2", radial(0.0), **ranges)]

    beside, line = np.full(2, x.mean()), _on_one_line(x, y)
    at_rest = leg.holds(beside, np.full(2, y.mean()), depth)
    straight_at = level and np.vecdot(*line.T) > 0 and leg.holds(*line, same_depth)
    parallel = leg.holds(beside, y, depth)
    if at_rest:
        x, y = beside, np.full(2, y.mean())
    elif straight_at:
        (x, y), depth = line, same_depth
    elif parallel:
        x = beside
    elif level:
        depth = same_depth
    zeta = leg.zeta(path, depth)
    across_length = np.hypot(x[0], zeta)  # not zero here unless x changes

    def parallel_members(ahead):
        return partial(_parallel, leg, path, ahead, across_length)

    if at_rest or straight_at:
        rest = parallel_members(np.full(2, y[0]))
        found = [family("relative rest", "constant cosine", rest, across=ANY, depth=water)]
        if reachable:
            ratio = across_length / abs(y[0])
            found.append(family("radial, right", "constant cosine", radial(side * ratio), **ranges))
            found.append(family("radial, left", "constant cosine", radial(-side * ratio), **ranges))
        return found

    if parallel:
        return [family("parallel", "case 3", parallel_members(y), across=ANY, depth=water)]

    def homothetic(mirror):
        if level:
            return partial(_enlarged, leg, path, mirror, x, y, depth=depth)
        return partial(_homothetic, leg, path, mirror, x, y, zeta)

    free = dict(beta=POSITIVE) if level else dict(depth=water)
    return [
        family("homothetic", "case 4", homothetic(1), **free),
        family("mirror-homothetic", "case 4", homothetic(-1), **free),
    ]


def _two_rays(leg):
    """Theorem 3, corrected."""
    x, y, depth = leg.target
    below_array, below = leg.bottom_depth - leg.array_depth, leg.bottom_depth - depth  # dO, dT
    if below_array <= leg.slack or leg.holds(x, 0 * y, depth):
        return _one_ray(leg, DIRECT, theorem=3)  # both rays are one, or tell nothing
    leg.must_not_pass(DIRECT)

    def family(case, number, make, **parameters):
        return Family(case, f"conical-angles, Theorem 3, {number}", make, parameters)

    def isolated(case, mirror, beta, depth):
        return family(case, "case 4", partial(leg.member, mirror * beta * x, beta * y, depth))

    on_the_bottom, level = leg.holds(x, y, leg.bottom_depth), leg.holds(x, y, leg.array_depth)
    beside = np.full(2, x.mean())
    if leg.holds(beside, y, leg.bottom_depth):
        on_bottom = partial(_on_bottom, leg, beside[0], y, below_array)
        return [family("parallel on the bottom", "target on the bottom", on_bottom, across=ANY)]

    if leg.holds(0 * x, y, leg.array_depth):
        return []  # endfire: the second ray gives the range

    if leg.holds(beside, y, depth):
        square = beside[0] ** 2 + (below_array - below) ** 2

        def abreast(mirror):
            return partial(_abreast, leg, mirror, y, below, below_array, square)

        # The radicand is not negative between two roots d- and d+ whose product is dO^2.
        half = below_array + square / (2 * below)
        largest = half + np.sqrt(half**2 - below_array**2)
        depths = (max(0.0, leg.bottom_depth - largest), leg.bottom_depth - below_array**2 / largest)
        return [
            family("parallel, right", "case 3", abreast(1), depth=depths),
            family("parallel, left", "case 3", abreast(-1), depth=depths),
        ]

    found = [isolated("mirror", -1, 1.0, depth)]
    if not level and not on_the_bottom:
        beta = below_array / below
        other = leg.bottom_depth - below_array * beta
        found.append(isolated("homothetic", 1, beta, other))
        found.append(isolated("mirror-homothetic", -1, beta, other))
    return found


# -- members by their parameters: functions of this module, so that families can be pickled ---------


def _broadside(leg, path, across_start, across_end, depth):
    return leg.member((across_start, across_end), 0.0, depth, path)


def _radial(leg, path, depth, side, ratio, range_start, range_end):
    ahead = side * np.array([range_start, range_end])
    if not np.all(ahead):
        raise ValueError("range_start and range_end must be positive, got 0")
    return leg.member(ratio * ahead, ahead, depth, path)


def _parallel(leg, path, ahead, across_length, across, depth):
    beta = np.hypot(across, leg.zeta(path, depth)) / across_length
    if beta * across_length <= leg.tiny:
        raise ValueError(f"across = {across} and depth = {depth} put the ghost on the array's line")
    return leg.member(across, beta * ahead, depth, path)


def _enlarged(leg, path, mirror, x, y, beta, depth):
    return leg.member(mirror * _positive(beta) * x, beta * y, depth, path)


def _homothetic(leg, path, mirror, x, y, zeta, depth):
    beta = abs(leg.zeta(path, depth) / zeta)
    return _enlarged(leg, path, mirror, x, y, beta, depth)


def _on_bottom(leg, beside, y, below_array, across):
    beta = np.hypot(across, below_array) / np.hypot(beside, below_array)
    return leg.member(across, beta * y, leg.bottom_depth)


def _abreast(leg, mirror, y, below, below_array, square, depth):
    d = leg.bottom_depth - depth
    radicand = d / below * square - (below_array - d) ** 2
    return leg.member(mirror * np.sqrt(max(radicand, 0.0)), np.sqrt(d / below) * y, depth)


def _on_one_line(x, y):
    """The nearest ``(x, y)`` whose two positions are on one line through the array."""
    positions = np.stack([x, y], axis=1)
    direction = np.linalg.svd(positions)[2][0]
    return np.outer(direction, positions @ direction)


def _positive(beta):
    if not 0 < beta < np.inf:
        raise ValueError(f"the ghost would be on the array or nowhere: beta = {beta}, must be positive")
    return beta
