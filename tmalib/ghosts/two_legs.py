"""Ghosts seen along one ray from two straight legs of equal speed v, with a turn at once between them.

At the turn, let p be the target's horizontal position relative to the array and zeta its image depth, and
``R^2 = |p|^2 + zeta^2``. Leg i has the heading e_i, its normal n_i and the relative velocity
``w_i = V_T - v e_i``; primes denote a ghost.

*The turn itself.* The cosines just before and just after it are ``e_i . p / R``. Unless ``e_2 = +-e_1`` they
determine ``p / R``, so ``p' = beta p`` and ``zeta' = +-beta zeta`` with ``beta = R' / R``.

*A leg.* Write ``w'_i = beta (w_i - h_i)``. The cosines agree on the whole leg if and only if ``h_i = 0``; or
p is along e_i and ``h_i = 2 (n_i . w_i) n_i`` (mirror); or the target is broadside and ``e_i . h_i = 0``; or
zeta = 0, w_i is along p (the cosine is constant) and so is h_i, and neither passes through the array.

*Both legs.* A constant velocity demands ``h_1 - h_2 = -kappa v (e_1 - e_2)``, ``kappa = 1 - 1 / beta < 1``.

The few combinations that satisfy this are the cases of `ghosts_of_two_legs`; the proof is in the book. If
R = 0, the target meets the array at the turn and all cosines are constant: `_collision` enumerates. After a
U-turn, ``e_2 = -e_1``, both legs lie on one line, and what is symmetric about it looks the same.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ..scenario import Scenario
from .family import ROUNDING, TOLERANCE, Family, check_tolerance, verified
from .turn import cross, turn_of

ANY, POSITIVE = (-np.inf, np.inf), (0.0, np.inf)


def ghosts_of_two_legs(scenario: Scenario, *, tolerance: float = TOLERANCE) -> list[Family]:
    """All targets with the same noise-free cosines of conical angles, seen along one ray from two legs.

    Parameters
    ----------
    scenario : Scenario
        A `Target` with a depth; a `Course` of two `Straight` legs of the same speed and different headings;
        one `ConicalAngle` sensor without lag, with five instants or more on each leg. An assumed depth
        plays no part. On a `Course` of more legs the measurements must be on two that follow each other.
    tolerance : float
        What is special for the numbers given (see `find_ghosts`).

    Returns
    -------
    list of Family
        Complete for ghosts that stay off the array between the first and the last instant. Those outside the
        water are listed (see `admissible`), except that the range of the parameter ``depth`` ends there.
        Families may contain the target itself. Cases, for a turn that is not a U-turn:

        ``depth mirror``
            The same track at ``zeta' = -zeta``: always, unless zeta = 0.
        ``bisector``, ``broadside in leg 1``, ``broadside in leg 2``
            Target over or under the array at the turn; each also with ``zeta' < 0``.
        ``broadside in both legs``
            The same track at any ``depth``.
        ``constant cosine in both legs``
            zeta = 0 and p, w_1, w_2 are along ``V_2 - V_1``. The ghost is ``range`` metres away at the turn,
            in the same direction, and has the velocity ``V_1 + share (V_2 - V_1)``.
        ``collision at the turn``
            The target meets the array at the turn, zeta = 0. So do these ghosts.

        After a U-turn they are ``mirror``, ``depth mirror`` and ``mirror, depth mirror``; or ``parallel
        course``, by an ``angle`` about the array's line; or ``endfire``, with ``ahead`` metres and ``speed``
        along the first heading, or with ``speed`` alone.

        A member that would pass through the array raises `ValueError`.

    Raises
    ------
    ValueError
        For any other scenario; the message says what is wanted.

    Notes
    -----
    Source: `conical-angles`, Theorem 2 and Appendix A, as corrected in the book.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> from tmalib.ghosts import ghosts_of_two_legs
    >>> array = tma.Course((0, 0), 5, 0.0, [tma.Straight(100), tma.Straight(100, heading=np.pi / 2)])
    >>> target = tma.Target((5000, 7000), speed=4, heading=np.radians(45), depth=100)
    >>> direct = tma.Sensor(tma.ConicalAngle(tma.DIRECT, 200.0, 4000.0), np.arange(0, 201, 4), 0.017)
    >>> scenario = tma.Scenario(array, [direct], reference_time=0, target=target)
    >>> [(family.case, float(family.target().depth)) for family in ghosts_of_two_legs(scenario)]
    [('depth mirror', 300.0)]
    """
    turn = turn_of(scenario, check_tolerance(tolerance))
    return verified(scenario, _families(turn), turn.tolerance)


def _families(turn):
    """The most special case that holds for the numbers given."""
    if back := turn.if_holds(e=np.array([turn.e[0], -turn.e[0]])):
        return _u_turn(back)
    over, flat = np.zeros(2), turn.depth_at(0.0)
    bisector = turn.e[0] + turn.e[1]
    both = 2 * turn.speed * bisector / (bisector @ bisector)  # its components along e_1 and e_2 are v
    if special := turn.if_holds(p=over, V_T=both):
        make, water = partial(special.member, over, both), (0.0, turn.model.bottom_depth)
        return [turn.family("broadside in both legs", make, depth=water)]
    if special := turn.if_holds(p=over, depth=flat):
        return _collision(special)
    if special := turn.if_holds(p=over):
        return _overhead(special)
    if not turn.if_holds(depth=flat):
        return [turn.isolated("depth mirror", 1.0, turn.V_T, -1)]
    along = turn.chord / np.hypot(*turn.chord)
    along = along if along @ turn.p > 0 else -along
    special = turn.if_holds(depth=flat, p=(along @ turn.p) * along, V_T=_along_from_first(turn, along))
    if special and min(along @ end for end in special.ends(special.p, special.V_T)) > 0:
        return [_constant_cosine(special, along)]
    return []


def _along_from_first(turn, along):
    """The nearest velocity whose relative velocity on the first leg is along a direction."""
    return turn.V[0] + (along @ turn.w[0]) * along


def _overhead(turn):
    """p = 0, zeta not 0: the same track at -zeta, and one horizontal ghost if a velocity fits."""
    families = [turn.isolated("depth mirror", 1.0, turn.V_T, -1)]
    both = turn.e[0] + turn.e[1]
    for i, j in ((0, 1), (1, 0)):  # the ghost is the mirror image in leg j
        if special := turn.if_holds(V_T=turn.V_T - (turn.e[i] @ turn.w[i]) * turn.e[i]):
            case = f"broadside in leg {i + 1}"
            kappa = 2 * (special.n[j] @ special.w[j]) * (turn.n[j] @ turn.e[i])
            kappa /= turn.speed * (1 - turn.e[0] @ turn.e[1])
            break
    else:
        case, j = "bisector", 0
        special = turn.if_holds(V_T=(turn.V_T @ both) * both / (both @ both))
        if not special:
            return families
        kappa = special.V_T @ both / turn.speed
    if abs(kappa) > turn.tolerance and 1 - kappa > ROUNDING:  # kappa = 0: the target itself
        beta = 1 / (1 - kappa)
        velocity = turn.V[j] + beta * turn.mirrored(j, special.w[j])
        families += [special.isolated(case, beta, velocity, sign) for sign in (1, -1)]
    return families


def _constant_cosine(turn, along):
    """zeta = 0: all targets on the line through the array along ``V_2 - V_1``, and in motion along it."""
    make = partial(_along_chord, turn, along)
    return turn.family("constant cosine in both legs", make, range=POSITIVE, share=ANY)


def _along_chord(turn, along, range, share):
    p, velocity = range * along, turn.V[0] + share * turn.chord
    ahead = [along @ end for end in turn.ends(p, velocity)]
    if min(ahead) <= 0 or (range == 0 and not turn.overhead):
        raise ValueError(f"range = {range} and share = {share} let the ghost pass through the array")
    return turn.member(p, velocity, turn.depth)


def _collision(turn):
    """p = 0 and zeta = 0: on leg i the ghost moves along w_i or its mirror image, to or from the array."""
    case, families = "collision at the turn", []
    along = turn.chord / np.hypot(*turn.chord)
    turn = turn.if_holds(V_T=_along_from_first(turn, along)) or turn
    for first in (turn.w[0], turn.mirrored(0, turn.w[0])):
        for second in (turn.w[1], turn.mirrored(1, turn.w[1])):
            sizes = np.hypot(*first), np.hypot(*second)
            if abs(cross(first, second)) > ROUNDING * sizes[0] * sizes[1]:
                # V_1 + a first = V_2 + b second
                a, b = np.linalg.solve(np.stack([first, -second], axis=1), turn.chord)
                velocity = turn.V[0] + a * first
                known = [turn.V_T] + [family.target().velocity for family in families if family.is_isolated]
                if min(a, b) > ROUNDING and not any(turn.still(velocity - other) for other in known):
                    families.append(turn.isolated(case, 1.0, velocity))
            elif abs(cross(first, along)) <= ROUNDING * sizes[0]:
                before, after = np.sign(first @ along), np.sign(second @ along)
                if before != after:
                    families.append(_constant_cosine(turn, after * along))
                else:
                    limits = (1.0, np.inf) if after > 0 else (-np.inf, 0.0)
                    families.append(turn.family(case, partial(_on_chord, turn, limits), share=limits))
    return families


def _on_chord(turn, limits, share):
    if share in limits:
        raise ValueError(f"share = {share} keeps the ghost on the array during a leg")
    return turn.member(turn.p, turn.V[0] + share * turn.chord, turn.depth)


def _u_turn(turn):
    """e_2 = -e_1: one line, so what is symmetric about it looks the same."""
    axis, beside, flat = turn.e[0], turn.n[0], turn.depth_at(0.0)
    parallel = turn.if_holds(V_T=(axis @ turn.V_T) * axis)
    if not parallel:
        bend = [turn.mirrored(0, vector) for vector in (turn.p, turn.V_T)]
        found = [("mirror", bend, turn.depth)]
        if not turn.if_holds(depth=flat):
            other = turn.depth_at(-turn.zeta)
            found += [("depth mirror", (turn.p, turn.V_T), other), ("mirror, depth mirror", bend, other)]
        return [turn.family(case, partial(turn.member, *motion, depth)) for case, motion, depth in found]

    turn = parallel
    for p in (np.zeros(2), (axis @ turn.p) * axis):
        ahead = turn.if_holds(p=p, depth=flat)
        if ahead and min(p @ end for end in ahead.ends(p, ahead.V_T)) >= 0:
            return _endfire(ahead)
    radius = np.hypot(beside @ turn.p, turn.zeta)
    return [turn.family("parallel course", partial(_rotated, turn, radius), angle=(-np.pi, np.pi))]


def _rotated(turn, radius, angle):
    axis, beside = turn.e[0], turn.n[0]
    p = (axis @ turn.p) * axis + radius * np.cos(angle) * beside
    return turn.member(p, turn.V_T, turn.depth_at(radius * np.sin(angle)))


def _endfire(turn):
    """After a U-turn, on the array's line: all that are ahead, or astern, on the same legs."""
    axis = turn.e[0]
    own = [axis @ (turn.p + end) for end in turn.ends(turn.p, turn.V_T)]  # its sign: ahead or astern
    make = partial(_on_the_line, turn, own)
    if own[0] * own[1] < 0:  # from ahead to astern, or back, at the turn
        return [turn.family("endfire", partial(make, 0.0), speed=ANY)]
    return [turn.family("endfire", make, ahead=ANY, speed=ANY)]


def _on_the_line(turn, own, ahead, speed):
    axis = turn.e[0]
    new = [axis @ end for end in turn.ends(ahead * axis, speed * axis)]
    same = all(side * ahead >= 0 < side * end for side, end in zip(own, new, strict=True))
    if not same or (ahead == 0 and not turn.overhead):
        raise ValueError(f"ahead = {ahead} and speed = {speed} let the ghost pass through the array")
    return turn.member(ahead * axis, speed * axis, turn.depth)
