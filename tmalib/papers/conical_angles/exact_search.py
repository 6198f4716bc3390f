"""`conical-angles`, Theorem 2: a search for the ghosts of a geometry of two legs, in fractions.

Geometries, times and symbols are those of `exact_classes`.

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

from fractions import Fraction
from itertools import product

from .exact_classes import INSTANTS
from .rational import add, dot, right, scaled, sign


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
