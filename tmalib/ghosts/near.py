"""Near ghosts: other targets that the noise hides, although no theorem makes them exact.

A target X' is told from X by N measurements with the chi-square

    C(X') = sum_k ((m_k(X') - m_k(X)) / sigma_k)^2,

the criterion that `tmalib.fit` minimises for the noise-free measurements of X. Its minimum at X is zero. Any
other local minimum below a level q is a near ghost: noise alone decides which of the two an estimator takes.
Exact ghosts are those with C = 0. The state is always ``(x, y, z, vx, vy)``: the depth is not known.

*Valleys.* Where measurements leave a direction open, the minimum is a curve or a surface. A pull towards the
target, ``(pull / L)^2 |X' - X|^2`` in units of its distance L and of L over the time of observation, makes
its nearest point the only minimum. It is weak from the start, or strong first where fits are slow. An end is
a minimum if no step of its own size would lower chi-square by more than ``UNSEEN``, to first order; without
a valley the fit is repeated without a pull.

*One or two.* Two ends are one ghost if a way without a barrier leads from one to the other
(`tmalib.ghosts.ways`). Then no measurement tells them apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..batch import fit
from ..checks import check_is, check_scalar, check_sequence
from ..cones import ConicalAngle
from ..motion import Target
from ..scenario import Scenario, Sensor
from ..types import FloatArray
from .family import Family, admissible
from .starts import grid_of_starts
from .ways import UNSEEN, distinct, in_blocks, thinned

NAMES = ("x", "y", "z", "vx", "vy")
WEAK, PULLS, ON_THE_WAY = 1e-3, (0.3, 0.03, 1e-3), 0.03
ITERATIONS, MORE_ITERATIONS = 100, 2000


@dataclass(frozen=True, kw_only=True)
class NearGhost(Family):
    """A local minimum of chi-square away from the target; ``target()`` is the target there.

    Attributes
    ----------
    chi_square : float
        Sum of the squared differences of measurements, in standard deviations.
    rank : int
        Of five directions of the state, those along which chi-square would rise by ``UNSEEN`` or more, to
        first order, if the ghost moved by its own distance (changed its velocity by this over the time of
        observation). Below five, ``target()`` is the point of a valley that is nearest to the true target.
    in_water : bool
        Whether its depth is between surface and bottom. Reported, not demanded.
    """

    chi_square: float
    rank: int
    in_water: bool

    @property
    def is_isolated(self) -> bool:
        """Whether chi-square rises in all directions; otherwise the ghost is a point of a valley."""
        return self.rank == len(NAMES)


def near_ghosts(
    scenario: Scenario, within: float, *, starts: ArrayLike | None = None, known: Sequence[Target] = ()
) -> list[NearGhost]:
    """Other targets whose measurements differ from the target's by a chi-square below ``within``.

    Parameters
    ----------
    scenario : Scenario
        A `Target` with a depth, `ConicalAngle` sensors along any paths, any platform. The noise is that of
        the sensors. An assumed depth plays no part.
    within : float
        Level q of chi-square, positive. For instance 11.07, which noise alone exceeds in one of twenty
        estimates of five components.
    starts : array_like, shape (S, 5), optional
        States ``(x, y, z, vx, vy)`` at the reference time from which to search, besides the grid.
    known : sequence of Target
        Targets that are not to be reported again, nor what cannot be told from them.

    Returns
    -------
    list of NearGhost
        By chi-square. A search: a minimum to which no start leads is missing, and a valley in which fits
        get stuck may be listed by several of its points. The target's own surroundings are not listed,
        however far they reach; that is what `crlb` tells. Nor are far targets to which chi-square only
        levels off without a minimum.

    Raises
    ------
    ValueError
        For other sensors or targets, a level that is not positive, and fewer than two instants.

    Notes
    -----
    Source: none of the papers. Where a theorem says what the minima are, the tests compare.

    Examples
    --------
    Nothing is exactly special here, but a turn of one degree hardly tells right from left.

    >>> import numpy as np, tmalib as tma
    >>> legs = [tma.Straight(300), tma.Straight(300, heading=np.radians(1))]
    >>> array = tma.Course((0, 0), speed=5, heading=0.0, legs=legs)
    >>> target = tma.Target((5000, 7000), speed=4, heading=np.radians(45), depth=100)
    >>> rays = [tma.ConicalAngle(path, 200.0, 4000.0) for path in (tma.DIRECT, tma.BOTTOM_BOUNCE)]
    >>> sensors = [tma.Sensor(ray, np.arange(0, 601, 20), 0.017) for ray in rays]
    >>> for ghost in tma.near_ghosts(tma.Scenario(array, sensors, 0, target), within=11.07):
    ...     (x, y), z = ghost.target().position, ghost.target().depth
    ...     print(f"{ghost.chi_square:.2f}: {x:.0f} m, {y:.0f} m, {z:.0f} m deep, in water: {ghost.in_water}")
    3.86: -3566 m, 12301 m, -8125 m deep, in water: False
    3.90: -1145 m, 3862 m, 2805 m deep, in water: True
    """
    level = check_scalar("within", within, above=0.0)
    known = check_sequence("known", known, Target)
    check_is("scenario", scenario, Scenario)
    scenario = _depth_in_state(scenario)
    grid = grid_of_starts(scenario)
    if starts is not None:
        grid = np.concatenate([grid, scenario.check_state(starts).reshape(-1, len(NAMES))])
    own = [scenario.state] + [other.state(scenario.reference_time, NAMES) for other in known]
    states = np.concatenate([own, _settled(scenario, _minima(scenario, grid, level), level)])
    valley = _rank(scenario, states) < len(NAMES)
    kept = distinct(partial(chi_square, scenario), partial(_relax, scenario), states, valley, len(own))
    ghosts = [_ghost(scenario, states[k]) for k in kept[len(own) :]]
    return sorted(ghosts, key=lambda ghost: ghost.chi_square)


def chi_square(scenario: Scenario, states: FloatArray) -> FloatArray:
    """Chi-square of states ``(..., 5)`` against the noise-free measurements, shape ``(...)``."""
    with np.errstate(all="ignore"):
        predicted, _ = scenario.linearise(states)
        return np.sum(((predicted - scenario.measure()) / scenario.sigma) ** 2, axis=-1)


def _depth_in_state(scenario):
    target, models = scenario.target, [sensor.model for sensor in scenario.sensors]
    if not isinstance(target, Target) or target.depth is None:
        raise ValueError(f"the target must be a Target with a depth, got {target!r}")
    if not all(isinstance(model, ConicalAngle) for model in models):
        kinds = sorted({type(model).__name__ for model in models})
        raise ValueError(f"all sensors must be ConicalAngle, got {kinds}")
    free = [replace(s, model=replace(s.model, assumed_depth=None)) for s in scenario.sensors]
    return replace(scenario, sensors=free)


def _unit(scenario, states):
    """A state's own size in every coordinate, ``(..., 5)``: its mean distance, and this over the time."""
    distances = []
    for block in scenario.blocks:
        sensor, elapsed, (x, y, *_) = block.sensor, block.elapsed, block.observer
        px, py, z, vx, vy = (component[..., None] for component in np.moveaxis(states, -1, 0))
        slope, offset = sensor.model.path.image(sensor.model.bottom_depth)
        zeta = slope * z + offset - sensor.model.array_depth
        distances.append(np.sqrt((px + elapsed * vx - x) ** 2 + (py + elapsed * vy - y) ** 2 + zeta**2))
    distance = np.concatenate(distances, axis=-1).mean(axis=-1)
    return distance[..., None] / [1, 1, 1, np.ptp(scenario.times), np.ptp(scenario.times)]


@dataclass(frozen=True)
class _Component:
    """A component of the state as a measurement model: what pulls an estimate to the target."""

    which: int
    coordinates = NAMES

    def observer_state(self, platform, times):
        return np.zeros((1, len(times)))

    def value_and_gradient(self, state, observer, elapsed):
        value = state[self.which] + 0 * elapsed
        gradient = np.zeros((len(state), *value.shape))
        gradient[self.which] = 1.0
        return value, gradient

    def residual(self, measured, predicted):
        return measured - predicted

    def observe(self, target, platform, times):
        return np.zeros(len(times))


def _pulled_fit(scenario, aims, starts, pull, most=ITERATIONS):
    """Estimates from noise-free measurements, each pulled towards a state, ``(1 or S, 5)``."""
    time, sigma = scenario.times[:1], _unit(scenario, scenario.state) / pull
    pulls = [Sensor(_Component(i), time, sigma[i]) for i in range(len(NAMES))]
    pulled = Scenario(scenario.platform, [*scenario.sensors, *pulls], scenario.reference_time)
    measured = np.broadcast_to(scenario.measure(), (len(aims), len(scenario.times)))
    aims = np.concatenate([measured, aims], axis=-1)
    return fit(pulled, aims, starts, tolerance=1e-5, max_iterations=most)


def _relax(scenario, states):
    """The minima nearest to states, ``(S, 5)``, some of which are on no minimum."""
    return _pulled_fit(scenario, states, states, ON_THE_WAY).state


def _below(scenario, states, level):
    """Those of the states that are finite, and below the level."""
    states = states[np.isfinite(states).all(axis=-1)]
    return states[in_blocks(partial(chi_square, scenario), states) < level]


def _minima(scenario, starts, level):
    """Minima below the level, and points of valleys; several of one minimum."""
    aim = scenario.state[None]
    first = _pulled_fit(scenario, aim, starts, WEAK)
    fixed = _below(scenario, first.state[first.converged], level)
    slow = more = _below(scenario, first.state[~first.converged], level)
    for pull in PULLS:
        if len(more):
            more = _below(scenario, _pulled_fit(scenario, aim, more, pull).state, level)
    ends = np.concatenate([fixed, slow, more])
    alike = np.unique(np.round(ends / _unit(scenario, ends), 4), axis=0, return_index=True)[1]
    converged, ends = alike < len(fixed), ends[alike]
    minimal = in_blocks(partial(_is_minimum, scenario), ends)
    isolated = in_blocks(partial(_rank, scenario), ends) == len(NAMES)
    ends, fixed = ends[minimal], (converged & isolated)[minimal]
    return ends[thinned(partial(chi_square, scenario), partial(_unit, scenario), ends, fixed)]


def _settled(scenario, states, level):
    """Isolated minima without a pull, valleys at their nearest point; of those alike the nearest first."""
    if not len(states):
        return states
    full, aim = _rank(scenario, states) == len(NAMES), scenario.state[None]
    free, valleys = states[full], states[~full]
    if len(free):
        found = fit(scenario, scenario.measure(), free, tolerance=1e-5, max_iterations=MORE_ITERATIONS)
        free = found.state[found.converged]
    for pull in PULLS:
        if len(valleys):
            valleys = _pulled_fit(scenario, aim, valleys, pull, MORE_ITERATIONS).state
            valleys = valleys[np.isfinite(valleys).all(axis=-1)]
    ends = _below(scenario, np.concatenate([free, valleys]), level)
    ends = ends[in_blocks(partial(_is_minimum, scenario), ends)]
    away = np.max(np.abs(ends - scenario.state) / _unit(scenario, scenario.state), axis=-1)
    return ends[np.lexsort([away, np.round(chi_square(scenario, ends) / UNSEEN)])]


def _scaled(scenario, states):
    """Whitened gradient for steps of a state's own size, ``(..., N, 5)``, and whitened residuals."""
    predicted, gradient = scenario.linearise(states)
    scaled = gradient / scenario.sigma[:, None] * _unit(scenario, states)[..., None, :]
    return scaled, (scenario.measure() - predicted) / scenario.sigma


def _is_minimum(scenario, states):
    """Whether no step of a state's own size lowers chi-square by more than ``UNSEEN``, ``(S,)``."""
    gradient, residual = _scaled(scenario, states)
    values, vectors = np.linalg.eigh(gradient.mT @ gradient)
    slope = np.vecdot(vectors.mT, np.vecdot(gradient.mT, residual[:, None])[:, None])
    return np.sum(slope**2 / (np.maximum(values, 0) + UNSEEN), axis=-1) < UNSEEN


def _rank(scenario, states):
    singular = np.linalg.svd(_scaled(scenario, states)[0], compute_uv=False)
    return np.sum(singular**2 > UNSEEN, axis=-1)


def _ghost(scenario, state):
    target = Target.from_velocity(
        state[[0, 1]], state[[3, 4]], depth=float(state[2]), time=scenario.reference_time
    )
    return NearGhost(
        case="near",
        source="a minimum of chi-square",
        make=partial(_the_same, target),
        chi_square=float(chi_square(scenario, state)),
        rank=int(_rank(scenario, state)),
        in_water=admissible(target, min(sensor.model.bottom_depth for sensor in scenario.sensors)),
    )


def _the_same(target):
    """What makes an isolated ghost: a function that can be pickled."""
    return target
