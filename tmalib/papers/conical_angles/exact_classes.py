"""`conical-angles`, Theorem 2: random geometries of two legs in fractions, one class a special position.

The array has speed 1 and is at the origin at the turn, ``t = 0``; it measures at five instants of the second
before (leg 1) and of the second after (leg 2). A target is ``(p, V_T, zeta)``: position at the turn and
velocity, pairs of fractions (see `rational`), and image depth. With ``d_i = p + t w_i``, ``w_i = V_T - e_i``
and the normal ``n_i`` to the right of ``e_i`` let ``s = e_i . d_i`` and ``c = n_i . d_i``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

from .rational import ZERO, add, cross, dot, heading, right, scaled

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
