"""`conical-angles`, Theorem 2: random geometries of two legs, and a search for their ghosts in fractions.

The array has speed 1 and is at the origin at the turn, ``t = 0``; it measures at five instants of the second
before (leg 1) and of the second after (leg 2). A target is ``(p, V_T, zeta)``: position at the turn and
velocity, pairs of fractions (see `rational`), and image depth. With ``d_i = p + t w_i``, ``w_i = V_T - e_i``
and the normal ``n_i`` to the right of ``e_i`` let ``s = e_i . d_i`` and ``c = n_i . d_i``.

The search takes one step from the proof of the corrected theorem: the two cosines at the turn determine
``p / R``. So a ghost has ``p' = beta p``, ``zeta'^2 = beta^2 zeta^2``, and relative velocities that are
written ``beta (w_i - h_i)``. It has one velocity, so::

    h_1 - h_2 + kappa (e_1 - e_2) = 0,     kappa = 1 - 1 / beta < 1.

With ``sigma = e_i . h_i``, ``gamma = n_i . h_i`` the squared cosines agree at the time t if and only if::

    s^2 ((c - gamma t)^2 + zeta^2) = (s - sigma t)^2 (c^2 + zeta^2),

which has degree four in t, so that five instants decide for the whole leg. All equations that are solved are
linear: no solution is missed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import product

from .rational import ZERO, add, cross, dot, heading, right, scaled, sign

INSTANTS = tuple(tuple(Fraction(side * k, 5) for k in range(1, 6)) for side in (-1, 1))  # of both legs


@dataclass(frozen=True)
class RationalGeometry:
    """A target seen from two legs.

    Attributes
    ----------
    p, velocity : tuple of Fraction
        Position at the turn, relative to the array, and velocity of the target.
    zeta : Fraction
        Depth of its image below the array.
    headings : tuple
        The two unit vectors ``e_1`` and ``e_2``, not parallel.
    leg : {0, 1}
        The leg that is meant where a class of geometries says "a leg".
    """

    p: tuple
    velocity: tuple
    zeta: Fraction
    headings: tuple
    leg: int = 0

    @property
    def target(self):
        """``(p, V_T, zeta)``."""
        return (self.p, self.velocity, self.zeta)

    @property
    def mine(self):
        """Heading of the leg that is meant."""
        return self.headings[self.leg]

    @property
    def other(self):
        """Heading of the other leg."""
        return self.headings[1 - self.leg]

    @property
    def chord(self):
        """Change of the array's velocity, ``V_2 - V_1``."""
        return add(self.headings[1], self.headings[0], -1)

    def components(self, i, t):
        """``(s, c)``: the target ahead and to the right of the array, at the time ``t`` on leg ``i``."""
        e = self.headings[i]
        d = add(self.p, add(self.velocity, e, -1), t)
        return dot(e, d), dot(right(e), d)


# -- random geometries ---------------------------------------------------------------------------------------


def fraction(rng, low=-12, high=12, largest=6):
    """A random fraction: numerator from ``low`` to ``high``, denominator from 1 to ``largest``."""
    return Fraction(int(rng.integers(low, high + 1)), int(rng.integers(1, largest + 1)))


def nonzero(rng, low=-12, high=12, largest=6):
    """The same, drawn until it is not zero."""
    while not (number := fraction(rng, low, high, largest)):
        pass
    return number


def _level(geometry, rng):
    return replace(geometry, zeta=Fraction(0))


def _over_the_array(geometry, rng):
    return replace(geometry, p=ZERO)


def _on_the_line(geometry, rng):
    return replace(geometry, p=scaled(nonzero(rng), geometry.mine))


def _broadside(geometry, rng):
    normal = right(geometry.mine)
    p = ZERO if geometry.p == ZERO else scaled(nonzero(rng), normal)
    return replace(geometry, p=p, velocity=add(geometry.mine, normal, fraction(rng)))


def _ahead_in_the_other(geometry, rng):
    return replace(geometry, p=scaled(nonzero(rng), geometry.other))


def _at_rest(geometry, rng):
    return replace(geometry, velocity=geometry.mine)


def _parallel(geometry, rng):
    return replace(geometry, velocity=scaled(fraction(rng), geometry.mine))


def _on_the_bisector(geometry, rng):
    return replace(geometry, velocity=scaled(nonzero(rng, -6, 6), add(*geometry.headings)))


def _broadside_in_both(geometry, rng):
    one, two = geometry.headings
    return replace(geometry, velocity=scaled(1 / (1 + dot(one, two)), add(one, two)))


def _radial(geometry, rng):
    return replace(geometry, velocity=add(geometry.mine, geometry.p, fraction(rng, -3, 3, 24)))


def _along_the_chord(geometry, rng):
    p, share = scaled(nonzero(rng), geometry.chord), fraction(rng, -3, 3)
    return replace(geometry, p=p, velocity=add(geometry.headings[0], geometry.chord, share))


# Name of a class to what is changed in a geometry without special features, in order.
CLASSES = {
    "anywhere": (),
    "broadside in a leg": (_broadside,),
    "broadside in a leg, right angle": (_broadside, _ahead_in_the_other),
    "relative rest in a leg": (_at_rest,),
    "parallel to a leg": (_parallel,),
    "on a leg's line at the turn": (_on_the_line,),
    "on a leg's line, parallel": (_on_the_line, _parallel),
    "along the chord": (_along_the_chord,),
    "bisector": (_on_the_bisector,),
    "over the array": (_over_the_array,),
    "over the array, parallel to a leg": (_over_the_array, _parallel),
    "over the array, relative rest in a leg": (_over_the_array, _at_rest),
    "over the array, bisector": (_over_the_array, _on_the_bisector),
    "over the array, broadside in a leg": (_over_the_array, _broadside),
    "over the array, broadside in both legs": (_over_the_array, _broadside_in_both),
    "equal depths": (_level,),
    "equal depths, broadside in a leg": (_level, _broadside),
    "equal depths, broadside in a leg, right angle": (_level, _broadside, _ahead_in_the_other),
    "equal depths, endfire in a leg": (_level, _on_the_line, _parallel),
    "equal depths, relative rest in a leg": (_level, _at_rest),
    "equal depths, radial in a leg": (_level, _radial),
    "equal depths, along the chord": (_level, _along_the_chord),
}


def draw_geometry(name, rng):
    """A random `RationalGeometry` of a class.

    Parameters
    ----------
    name : str
        A key of `CLASSES`. In a class with a right angle, the turn is one, and the target is on the line of
        the other leg.
    rng : numpy.random.Generator
    """
    geometry = _anywhere(rng, right_angle="right angle" in name)
    for change in CLASSES[name]:
        geometry = change(geometry, rng)
    return geometry


def _anywhere(rng, right_angle):
    while True:
        one, two = heading(fraction(rng, -9, 9)), heading(fraction(rng, -9, 9))
        if right_angle:
            two = scaled(int(rng.choice([-1, 1])), right(one))
        elif cross(one, two) == 0:
            continue
        leg = int(rng.integers(2))
        p, velocity = [(fraction(rng, -n, n), fraction(rng, -n, n)) for n in (12, 6)]
        geometry = RationalGeometry(p, velocity, nonzero(rng, 1, 12), (one, two), leg)
        if p != ZERO:
            return geometry


# -- the search ----------------------------------------------------------------------------------------------


def ghosts(geometry):
    """All ghosts besides the depth mirror.

    Returns
    -------
    list or None
        Ghosts ``(p', V_T', zeta')``, exact, with ``zeta'`` of the sign of ``zeta``. None if infinitely many
        solve the equations.
    """
    solutions = _on_level(geometry) if geometry.zeta == 0 else _off_level(geometry)
    if solutions is None:
        return None
    return [_ghost(geometry, kappa, h) for kappa, h in solutions if kappa < 1 and _keeps_signs(geometry, h)]


def _ghost(geometry, kappa, h):
    beta, e = 1 / (1 - kappa), geometry.headings[0]
    w = add(add(geometry.velocity, e, -1), h[0], -1)
    return (scaled(beta, geometry.p), add(e, w, beta), beta * geometry.zeta)


def _keeps_signs(geometry, h):
    """Whether the cosines of target and ghost have the same sign at all instants."""
    for i in (0, 1):
        sigma = dot(geometry.headings[i], h[i])
        for t in INSTANTS[i]:
            s, _ = geometry.components(i, t)
            if sign(s) != sign(s - sigma * t):
                return False
    return True


def _off_level(geometry):
    """Pairs ``(kappa, (h_1, h_2))`` with ``kappa != 0`` for ``zeta != 0``; None if every kappa is a solution.

    The first derivatives of the cosines at the turn agree if ``e_i . M h_i = 0`` with
    ``M h = R^2 h - (p . h) p``. Since ``h_1 + kappa e_1 = h_2 + kappa e_2``, both are
    ``h_i = kappa (g - e_i)`` with one vector g. Then an instant says ``kappa (A + kappa B) = 0``.
    """
    square = dot(geometry.p, geometry.p) + geometry.zeta**2
    rows = [add(scaled(square, e), geometry.p, -dot(e, geometry.p)) for e in geometry.headings]  # M e_i
    system = [(*row, dot(row, e)) for row, e in zip(rows, geometry.headings, strict=True)]
    _, g = solve_linear(system)
    directions = [add(g, e, -1) for e in geometry.headings]
    equations = [
        _equation_in_kappa(geometry, i, direction, t)
        for i, direction in enumerate(directions)
        for t in INSTANTS[i]
    ]
    if not any(A or B for A, B in equations):
        return None
    candidates = {-A / B for A, B in equations if B} - {0}
    kappas = [kappa for kappa in candidates if all(A + kappa * B == 0 for A, B in equations)]
    return [(kappa, [scaled(kappa, direction) for direction in directions]) for kappa in kappas]


def _equation_in_kappa(geometry, i, direction, t):
    """``(A, B)`` of one instant, for ``h_i = kappa direction``."""
    s, c = geometry.components(i, t)
    sigma, gamma = (dot(axis, direction) for axis in (geometry.headings[i], right(geometry.headings[i])))
    away = c**2 + geometry.zeta**2
    return (
        -2 * t * gamma * c * s**2 + 2 * t * sigma * s * away,
        (t * gamma * s) ** 2 - (t * sigma) ** 2 * away,
    )


def _on_level(geometry):
    """Pairs ``(kappa, (h_1, h_2))``, not all zero, for ``zeta = 0``; None if infinitely many.

    On each leg ``s (c - gamma t) = (s - sigma t) c`` at all instants, or the same with the other sign: four
    linear systems in ``h_1`` and kappa.
    """
    found = {}
    for signs in product((1, -1), repeat=2):
        solved = solve_linear(
            [
                _equation_on_level(geometry, i, sign_i, t)
                for i, sign_i in enumerate(signs)
                for t in INSTANTS[i]
            ]
        )
        if solved is None:
            continue
        dimension, unknown = solved
        if dimension:
            return None
        if any(unknown):
            *h_1, kappa = unknown
            found[unknown] = (kappa, [h_1, add(h_1, geometry.chord, -kappa)])
    return list(found.values())


def _equation_on_level(geometry, i, same_sign, t):
    """Row ``[a, b, c | d]``: ``s (c - gamma t) - same_sign (s - sigma t) c = 0`` for ``h_1`` and kappa."""
    s, c = geometry.components(i, t)
    e = geometry.headings[i]
    row = add(scaled(-t * s, right(e)), e, same_sign * t * c)  # times h_i
    of_kappa = -dot(row, geometry.chord) if i == 1 else Fraction(0)  # h_2 = h_1 - kappa (e_2 - e_1)
    return (*row, of_kappa, (same_sign - 1) * s * c)


def solve_linear(rows):
    """Solve linear equations by elimination, exactly.

    Parameters
    ----------
    rows : sequence
        Each the coefficients of an equation and then its right side, all fractions.

    Returns
    -------
    tuple or None
        Dimension of the set of solutions, and the solution whose free unknowns are 0; None without one.
    """
    rows, unknowns, pivots = [list(row) for row in rows], len(rows[0]) - 1, []
    for column in range(unknowns):
        top = len(pivots)
        pivot = next((j for j in range(top, len(rows)) if rows[j][column] != 0), None)
        if pivot is None:
            continue
        rows[top], rows[pivot] = rows[pivot], rows[top]
        rows[top] = [x / rows[top][column] for x in rows[top]]
        for j, row in enumerate(rows):
            if j != top and row[column] != 0:
                rows[j] = [x - row[column] * y for x, y in zip(row, rows[top], strict=True)]
        pivots.append(column)
    if any(row[-1] != 0 for row in rows[len(pivots) :]):
        return None
    value = {column: row[-1] for column, row in zip(pivots, rows, strict=False)}
    return unknowns - len(pivots), tuple(value.get(column, Fraction(0)) for column in range(unknowns))
