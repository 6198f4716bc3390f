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

from .turn import TOLERANCE, cross, turn_of

ANY, POSITIVE = (-np.inf, np.inf), (0.0, np.inf)


def ghosts_of_two_legs(scenario):
    """All targets with the same noise-free cosines of conical angles, seen along one ray from two legs.

    Parameters
    ----------
    scenario : Scenario
        A `Target` with a depth; a `Course` of two `Straight` legs of the same speed and different headings;
        one `ConicalAngle` sensor without lag, with five instants or more on each leg. An assumed depth
        plays no part.

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
    turn = turn_of(scenario)
    if abs(cross(*turn.e)) <= TOLERANCE:
        return _u_turn(turn)
    if turn.overhead and turn.broadside(0) and turn.broadside(1):
        make, water = partial(turn.member, turn.p, turn.V_T), (0.0, turn.model.bottom_depth)
        return [turn.family("broadside in both legs", lambda depth: make(depth), depth=water)]
    if turn.overhead:
        return _collision(turn) if turn.level else _overhead(turn)
    if not turn.level:
        return [turn.isolated("depth mirror", 1.0, turn.V_T, -1)]
    along = turn.p / np.hypot(*turn.p)
    if turn.still(cross(along, turn.chord)) and turn.still(cross(along, turn.w[0])):
        return [_constant_cosine(turn, along)]
    return []


def _overhead(turn):
    """p = 0, zeta not 0: the same track at -zeta, and one horizontal ghost if a velocity fits."""
    families = [turn.isolated("depth mirror", 1.0, turn.V_T, -1)]
    sides = [i for i in (0, 1) if turn.broadside(i)]
    if sides:
        i, j = sides[0], 1 - sides[0]  # the ghost is the mirror image in leg j
        case = f"broadside in leg {i + 1}"
        kappa = 2 * (turn.n[j] @ turn.w[j]) * (turn.n[j] @ turn.e[i])
        kappa /= turn.speed * (1 - turn.e[0] @ turn.e[1])
    else:
        case, j, both = "bisector", 0, turn.e[0] + turn.e[1]
        if not turn.still(cross(turn.V_T, both)):
            return families
        kappa = turn.V_T @ both / turn.speed
    if abs(kappa) > TOLERANCE and 1 - kappa > TOLERANCE:
        beta = 1 / (1 - kappa)
        velocity = turn.V[j] + beta * turn.mirrored(j, turn.w[j])
        families += [turn.isolated(case, beta, velocity, sign) for sign in (1, -1)]
    return families


def _constant_cosine(turn, along):
    """zeta = 0: all targets on the line through the array along ``V_2 - V_1``, and in motion along it."""

    def make(range, share):
        p, velocity = range * along, turn.V[0] + share * turn.chord
        ahead = [along @ end for end in turn.ends(p, velocity)]
        if min(ahead) <= 0 or (range == 0 and not turn.overhead):
            raise ValueError(f"range = {range} and share = {share} let the ghost pass through the array")
        return turn.member(p, velocity, turn.depth)

    return turn.family("constant cosine in both legs", make, range=POSITIVE, share=ANY)


def _collision(turn):
    """p = 0 and zeta = 0: on leg i the ghost moves along w_i or its mirror image, to or from the array."""
    case, families = "collision at the turn", []
    along = turn.chord / np.hypot(*turn.chord)
    for first in (turn.w[0], turn.mirrored(0, turn.w[0])):
        for second in (turn.w[1], turn.mirrored(1, turn.w[1])):
            sizes = np.hypot(*first), np.hypot(*second)
            if abs(cross(first, second)) > TOLERANCE * sizes[0] * sizes[1]:
                # V_1 + a first = V_2 + b second
                a, b = np.linalg.solve(np.stack([first, -second], axis=1), turn.chord)
                velocity = turn.V[0] + a * first
                known = [turn.V_T] + [family.target().velocity for family in families if family.is_isolated]
                if min(a, b) > TOLERANCE and not any(turn.still(velocity - other) for other in known):
                    families.append(turn.isolated(case, 1.0, velocity))
            elif abs(cross(first, along)) <= TOLERANCE * sizes[0]:
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
    axis, beside = turn.e[0], turn.n[0]
    if not turn.still(beside @ turn.V_T):
        bend = [turn.mirrored(0, vector) for vector in (turn.p, turn.V_T)]
        found = [("mirror", bend, turn.depth)]
        if not turn.level:
            other = turn.depth_at(-turn.zeta)
            found += [("depth mirror", (turn.p, turn.V_T), other), ("mirror, depth mirror", bend, other)]
        return [turn.family(case, partial(turn.member, *motion, depth)) for case, motion, depth in found]

    if not (turn.zero(beside @ turn.p) and turn.level):
        radius = np.hypot(beside @ turn.p, turn.zeta)

        def rotated(angle):
            p = (axis @ turn.p) * axis + radius * np.cos(angle) * beside
            return turn.member(p, turn.V_T, turn.depth_at(radius * np.sin(angle)))

        return [turn.family("parallel course", rotated, angle=(-np.pi, np.pi))]

    own = [axis @ (turn.p + end) for end in turn.ends(turn.p, turn.V_T)]  # its sign: ahead or astern

    def make(ahead, speed):
        new = [axis @ end for end in turn.ends(ahead * axis, speed * axis)]
        same = all(side * ahead >= 0 < side * end for side, end in zip(own, new, strict=True))
        if not same or (ahead == 0 and not turn.overhead):
            raise ValueError(f"ahead = {ahead} and speed = {speed} let the ghost pass through the array")
        return turn.member(ahead * axis, speed * axis, turn.depth)

    if own[0] * own[1] < 0:  # from ahead to astern, or back, at the turn
        return [turn.family("endfire", partial(make, 0.0), speed=ANY)]
    return [turn.family("endfire", make, ahead=ANY, speed=ANY)]
