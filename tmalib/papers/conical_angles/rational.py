"""Plane geometry in fractions: vectors are pairs of `fractions.Fraction`, and no result is rounded."""

from __future__ import annotations

from fractions import Fraction

ZERO = (Fraction(0), Fraction(0))


def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1]


def cross(a, b):
    """Third component of the vector product: 0 if and only if one of the vectors is along the other."""
    return a[0] * b[1] - a[1] * b[0]


def add(a, b, factor=1):
    """``a + factor b``."""
    return (a[0] + factor * b[0], a[1] + factor * b[1])


def scaled(factor, a):
    """``factor a``."""
    return (factor * a[0], factor * a[1])


def right(e):
    """``e`` turned by a right angle clockwise: the normal to the right of a heading."""
    return (e[1], -e[0])


def mirrored(e, a):
    """``a`` mirrored at the line along the unit vector ``e``."""
    return add(scaled(2 * dot(e, a), e), a, -1)


def sign(x):
    """-1, 0 or 1."""
    return (x > 0) - (x < 0)


def heading(k):
    """The unit vector at the angle ``2 arctan(k)`` from north, ``k`` a fraction."""
    return (2 * k / (1 + k**2), (1 - k**2) / (1 + k**2))
