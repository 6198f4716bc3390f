"""Displacements of a given size that displace the batch estimate most, to first order.

``C A v`` is the shift of the criterion for displacements ``v_k`` along ``U_k`` (see `response`). Which v is
the worst depends on how its size is measured, and four answers are here:

- *energy*: ``sum v_k^2`` is bounded. The worst is the strongest mode; it is smooth. The paper's figures show
  it, scaled to a given largest value;
- *sup norm*: ``|H_k| <= b`` at every measurement. Then ``max |C A v|`` over a box is reached at a corner,
  ``v_k = ±b``: the target jumps. For a direction w of the criterion the best signs are those of ``w' C A``;
  the largest over w is a vertex of a zonotope;
- *sup norm and acceleration*: ``|H_k| <= b`` and ``|H''| <= a``: what a target can fly. A linear programme
  for every direction w, with the discs cut to regular polygons inside them;
- *stealth*: ``|H_k| <= b``, and the displaced target gives exactly the measurements of another motion of
  the model. No residual is left: no estimator and no test can tell.

Every displacement is returned for each measurement, shape ``(N, 2)``, in metres. Its negative is as bad to
first order; which of the two is worse in truth a fit has to say. The sign is chosen so that the largest
component of the criterion's shift is positive.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import check_count, check_scalar
from ..scenario import Scenario
from ..types import FloatArray
from .response import check_criterion, check_one_state, displaced, modes_of, position_places, response

ASCENTS = 100
NEWTON_STEPS = 20


def worst_energy(
    scenario: Scenario, bound: float, state: ArrayLike | None = None, criterion: ArrayLike | None = None
) -> FloatArray:
    """The strongest mode, scaled so that its largest displacement is ``bound``.

    Parameters
    ----------
    scenario : Scenario
    bound : float
        In metres, positive.
    state : array_like, shape (n,), optional
        Motion that is displaced; the scenario's target by default.
    criterion : array_like, shape (m, n), optional
        What of the estimate is to be displaced; the parameter norm by default, see `modes`.

    Returns
    -------
    ndarray, shape (N, 2)

    Notes
    -----
    Source: `robustness`, Theorem 1 and Figures 3 and 4. It maximises ``|C A v| / |v|`` in the Euclidean norm
    of v, and is not the worst for a given sup norm.
    """
    bound = check_scalar("bound", bound, above=0.0)
    map_ = response(scenario, state)
    found = modes_of(check_criterion(scenario, criterion) @ map_.gain)
    along = bound * _signed(found.f[0], found.d[0]) / np.abs(found.f[0]).max()
    return map_.displacement(along)


def worst_sup(
    scenario: Scenario, bound: float, state: ArrayLike | None = None, criterion: ArrayLike | None = None
) -> FloatArray:
    """The worst displacement with ``|H_k| <= bound``: plus or minus ``bound`` along every ``U_k``.

    For a criterion of one or two rows it is the global maximum; for more rows the best of the local maxima
    that an ascent reaches from every column of ``C A`` and every singular direction.

    Parameters and returned shape as in `worst_energy`.
    """
    bound = check_scalar("bound", bound, above=0.0)
    map_ = response(scenario, state)
    gain = check_criterion(scenario, criterion) @ map_.gain
    corner = _ascent(gain, _directions(gain))
    return map_.displacement(bound * _signed(corner, gain @ corner))


def _signed(along, shift):
    return along * np.sign(shift[np.argmax(np.abs(shift))])


def _directions(gain):
    """Directions ``(S, m)`` from which the ascent over corners starts."""
    if len(gain) == 2:  # one direction between each two neighbouring sign changes: all the vertices
        change = np.sort(np.arctan2(*gain[::-1]) % np.pi)
        between = (change + np.roll(change, -1) + np.pi * (np.arange(len(change)) == len(change) - 1)) / 2
        return np.column_stack([-np.sin(between), np.cos(between)])
    return np.concatenate([np.linalg.svd(gain, full_matrices=False)[0].T, gain.T])


def _ascent(gain, directions):
    """The corner v of the unit box with the largest ``|gain v|`` that alternation reaches."""
    best = np.zeros(len(directions))
    for _ in range(ASCENTS):
        corners = np.where(directions @ gain >= 0, 1.0, -1.0)
        directions = corners @ gain.T
        length = np.linalg.norm(directions, axis=-1)
        if np.all(length <= best * (1 + 1e-12)):
            break
        best = length
    return corners[np.argmax(length)]


def worst_flyable(
    scenario: Scenario,
    bound: float,
    acceleration: float,
    state: ArrayLike | None = None,
    criterion: ArrayLike | None = None,
    *,
    directions: int = 4,
    sides: int = 12,
) -> FloatArray:
    """The worst displacement with ``|H| <= bound`` and ``|H''| <= acceleration``.

    Parameters
    ----------
    scenario : Scenario
    bound : float
        In metres, positive.
    acceleration : float
        In m/s^2, positive: bound of the second differences of H over the times of measurement.
    state, criterion
        As in `worst_energy`.
    directions : int
        Directions of the criterion from which the search starts. From each, linear programmes are solved for
        the direction of the last one's shift until the shift grows no more: a local maximum.
    sides : int
        Sides of the polygons inside the two discs, even. The result is feasible, and at least
        ``cos(pi / sides)`` of the best that the discs allow in its direction.

    Returns
    -------
    ndarray, shape (N, 2)

    Raises
    ------
    ValueError
        For bounds that are not positive, fewer than three times, or a programme that the solver gives up.
    """
    bound = check_scalar("bound", bound, above=0.0)
    acceleration = check_scalar("acceleration", acceleration, above=0.0)
    directions, sides = check_count("directions", directions), check_count("sides", sides)
    if sides < 4 or sides % 2:
        raise ValueError(f"sides must be even and at least 4, got {sides}")
    map_ = response(scenario, state)
    gain = check_criterion(scenario, criterion) @ map_.gain
    solve = _flyable_programme(scenario.times, bound, acceleration, sides)
    left = np.linalg.svd(gain, full_matrices=False)[0][:, :2]
    angle = np.pi * np.arange(directions) / directions
    starts = left @ np.stack([np.cos(angle), np.sin(angle)])[: left.shape[1]]
    best, longest = np.zeros_like(map_.direction), -1.0
    for w in starts.T:
        length = -1.0
        while True:
            found = solve((w @ gain)[:, None] * map_.direction)
            shift = gain @ map_.along(found)
            if np.linalg.norm(shift) <= length * (1 + 1e-6):
                break
            length, w = float(np.linalg.norm(shift)), shift / np.linalg.norm(shift)
        if length > longest:
            best, longest = found * np.sign(shift[np.argmax(np.abs(shift))]), length
    return best


def _flyable_programme(times, bound, acceleration, sides):
    """A function that maximises ``sum_k <c_k, H_k>`` over the flyable H, for weights c ``(N, 2)``."""
    from scipy import sparse  # imported here: they cost half a second
    from scipy.optimize import linprog

    instants, place = np.unique(times, return_inverse=True)
    count = len(instants)
    if count < 3:
        raise ValueError(f"an acceleration needs at least three times of measurement, got {count}")
    step = np.diff(instants)
    ahead, behind = 2 / (step[1:] * (step[1:] + step[:-1])), 2 / (step[:-1] * (step[1:] + step[:-1]))
    second = sparse.diags_array([behind, -ahead - behind, ahead], offsets=[0, 1, 2], shape=(count - 2, count))
    angle = 2 * np.pi * np.arange(sides // 2) / sides
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    inside = np.cos(np.pi / sides)
    rows = sparse.vstack([
        sparse.kron(normals, sparse.eye_array(count)),
        sparse.kron(normals, second / acceleration * bound),
    ]).tocsr()  # fmt: skip
    limit = inside * np.ones(rows.shape[0])
    constraints = sparse.vstack([rows, -rows]), np.concatenate([limit, limit])

    def solve(weights):
        total = np.zeros((2, count))
        np.add.at(total, (slice(None), place), weights.T)
        cost = -total.ravel() / np.abs(total).max()
        found = linprog(cost, *constraints, bounds=(-1, 1), method="highs-ipm")
        if not found.success:
            raise ValueError(f"the linear programme was not solved: {found.message}")
        return bound * found.x.reshape(2, count).T[place]

    return solve


def stealth(scenario: Scenario, other: ArrayLike, state: ArrayLike | None = None) -> FloatArray:
    """The displacement that gives the target the measurements of another motion of the model.

    Parameters
    ----------
    scenario : Scenario
    other : array_like, shape (n,)
        State of the other motion at the reference time.
    state : array_like, shape (n,), optional
        Motion that is displaced; the scenario's target by default.

    Returns
    -------
    ndarray, shape (N, 2)
        For a bearing: from the target to the other target's line of sight.

    Raises
    ------
    ValueError
        When no such displacement is found; the other motion is too far away.
    """
    state, other = check_one_state(scenario, state), check_one_state(scenario, other)
    wanted, _ = scenario.linearise(other)
    found = np.zeros((len(scenario.times), 2))
    with np.errstate(all="ignore"):
        for _ in range(NEWTON_STEPS):
            value, gradient = displaced(scenario, found, state)
            missing = scenario.residual(wanted, value)
            if np.all(np.abs(missing) <= 1e-14):
                break
            found = found + gradient * (missing / np.vecdot(gradient, gradient))[:, None]
    if not np.max(np.abs(missing)) <= 1e-9:
        raise ValueError(f"no displacement gives the measurements of {other}: is it on the other side?")
    return found


def worst_stealth(
    scenario: Scenario,
    bound: float,
    state: ArrayLike | None = None,
    criterion: ArrayLike | None = None,
    *,
    directions: int = 32,
) -> tuple[FloatArray, FloatArray]:
    """The other motion that shifts the criterion most among those a displacement of ``bound`` can imitate.

    To first order the displacement for ``theta + s`` is ``v_k = <g_k, s> / |p_k|``; for each direction of the
    criterion, ``|v_k| <= bound`` makes a linear programme for s. The best is then scaled until the exact
    displacement, that of `stealth`, has ``bound`` as its largest length.

    Parameters and criterion as in `worst_energy`; ``directions`` of the criterion's two strongest singular
    directions are tried.

    Returns
    -------
    displacement : ndarray, shape (N, 2)
    other : ndarray, shape (n,)
        The motion whose measurements the displaced target gives: what every estimator will report.
    """
    from scipy.optimize import brentq, linprog  # imported here: it costs half a second

    bound = check_scalar("bound", bound, above=0.0)
    directions = check_count("directions", directions)
    state = check_one_state(scenario, state)
    criterion = check_criterion(scenario, criterion)
    _, gradient = scenario.linearise(state)
    length = np.hypot(*gradient[:, position_places(scenario)].T)
    rows = gradient / length[:, None]
    scale = 1 / np.linalg.norm(rows, axis=0)
    rows = rows * scale
    left = np.linalg.svd(criterion * scale, full_matrices=False)[0][:, :2]
    angle = np.pi * np.arange(directions) / directions
    best, longest = np.zeros_like(state), -1.0
    for w in (left @ np.stack([np.cos(angle), np.sin(angle)])[: left.shape[1]]).T:
        cost = -(w @ criterion) * scale
        found = linprog(
            cost / np.abs(cost).max(), np.vstack([rows, -rows]), np.ones(2 * len(rows)), bounds=(None, None)
        )
        if not found.success:
            raise ValueError(f"the linear programme was not solved: {found.message}")
        shift = found.x * scale * bound
        if np.linalg.norm(criterion @ shift) > longest:
            best, longest = _signed(shift, criterion @ shift), float(np.linalg.norm(criterion @ shift))

    def excess(factor):
        return np.hypot(*stealth(scenario, state + factor * best, state).T).max() - bound

    high = 1.0
    while excess(high) < 0:
        high *= 1.1
    factor = brentq(excess, 0.5 * high, high, xtol=1e-10) if excess(0.5 * high) < 0 else 0.5 * high
    other = state + factor * best
    return stealth(scenario, other, state), other
