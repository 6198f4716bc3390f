"""A confidence region of the position from the likelihood: for where no ellipse is honest.

With few bearings, or a range that is hardly known, the criterion is no parabola over the positions that it
allows, and the region is no ellipse: it is long, bent, open towards infinite range, or in several pieces.
It is the set of positions p with::

    D(p) = min { C(X) : position of X is p } - min C  <=  -2 log(1 - probability),

the quantile of chi-square with two degrees of freedom (likelihood ratio; see `tmalib.profile`). How it is
found, `tmalib.pieces` says.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .charts import ModifiedPolar, chart_of
from .checks import as_numbers, check_is, check_probability, check_scalar
from .estimate import Fit
from .losses import SQUARES
from .pieces import FARTHEST, STEP, PolarSearch, area_of
from .profile import criterion_at
from .scenario import Scenario
from .types import BoolArray, FloatArray
from .uniform import moving_pairs

NEAREST = 100.0  # metres
REPEATS, SAME = 5, 1e-3  # times that the pieces are found anew, from a criterion lower by more than this


@dataclass(frozen=True, eq=False)
class Region:
    """Output of `confidence_region`.

    Attributes
    ----------
    probability : float
    level : float
        ``-2 log(1 - probability)``: a position with a profile up to it is in the region.
    cost : float
        The lowest criterion that was found. It can be below that of the fit, which may have ended in
        another minimum or at none.
    boundary : tuple of ndarray, each shape (P, 2)
        A closed line in metres for each piece, the one that was found from the lowest criterion first. A
        piece that goes on to infinite range is cut at 1000 km. Pieces may touch or overlap. Holes are not
        drawn; `contains` knows of them.
    ranges : ndarray, shape (pieces, 2)
        Least and largest distance of each piece from the platform at the reference time, in metres.
    bounded : bool
        `False` if the criterion stays below the level out to 1000 km: the measurements then give no upper
        limit of the range, only the lower one in ``ranges``.
    area : float
        Of the union of the pieces, in square metres; infinite if not bounded.
    """

    probability: float
    level: float
    cost: float
    boundary: tuple[FloatArray, ...]
    ranges: FloatArray
    bounded: bool
    area: float
    scenario: Scenario
    measured: FloatArray
    states: FloatArray  # fitted states of the pieces, from which `profile` starts

    def __repr__(self) -> str:
        to = [f"{far:.0f} m" if far < FARTHEST else "infinity" for far in self.ranges[:, 1]]
        pieces = [f"{near:.0f} m to {end}" for near, end in zip(self.ranges[:, 0], to, strict=True)]
        return f"Region({self.probability:g}; {', '.join(pieces)} from the platform)"

    def profile(self, points: ArrayLike) -> FloatArray:
        """The profile ``D (...)`` at positions ``points (..., 2)``; infinite where nothing is predicted.

        It is counted from ``cost``. `ValueError` for points of another shape.
        """
        points = as_numbers("points", points)
        if points.ndim == 0 or points.shape[-1] != 2:
            raise ValueError(f"points must have shape (..., 2), got {points.shape}")
        flat, places = points.reshape(-1, 2), moving_pairs(self.scenario.coordinates)[0]
        away = np.hypot(*(flat[:, None, i] - self.states[:, places[i]] for i in (0, 1)))
        _, cost = criterion_at(self.scenario, self.measured, self.states[np.argmin(away, axis=1)], flat)
        return (cost - self.cost).reshape(points.shape[:-1])[()]

    def contains(self, points: ArrayLike) -> BoolArray:
        """Whether positions ``points (..., 2)`` are in the region, by their profile, ``(...)``."""
        return self.profile(points) <= self.level


def confidence_region(fit: Fit, probability: float = 0.9, nearest: float | None = None) -> Region:
    """Region of the positions at the reference time that the measurements of one run allow.

    Parameters
    ----------
    fit : Fit
        Of one run. It need not have converged.
    probability : float
        Between 0 and 1.
    nearest : float, optional
        Least distance in metres from the platform at which positions are looked for; by default 100 m, or a
        tenth of the distance of the fit if that is less. Within the distance that the platform covers between
        two measurements the criterion can have many narrow minima, islands of a few metres.

    Returns
    -------
    Region

    Raises
    ------
    ValueError
        For more than one run, a run that is not finite, fewer measurements than unknowns, a number that is
        out of bounds, a state without position and velocity in uniform motion, and a fit with a robust loss:
        fit by squares without the measurements of weight zero.

    Notes
    -----
    Derived at the top of this file. A part or a gap that is narrower than 12 per cent in range can be missed
    if no minimum of the criterion is in it. For a linear model the region is the ellipse and holds the truth
    as often as it says. Where the bound of the range is between a third and the whole of the range, in
    scenario 4 of `emw-acoustic`, the region of 0.9 held the truth in 0.89 to 0.91 of 2000 runs and that of
    0.5 in 0.45 to 0.50; the ellipses in 0.74 to 0.86 and 0.43 to 0.53.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 400, 5.0), sigma=0.01)
    >>> watch = tma.Scenario(ship, [ear], reference_time=400)
    >>> truth = tma.Target((2e3, 4e3), speed=6, heading=1.5)
    >>> found = tma.fit(watch, watch.with_target(truth).simulate(runs=1, seed=1)[0])
    >>> region = tma.confidence_region(found, probability=0.9)
    >>> region.bounded, len(region.boundary), bool(region.contains(truth.position_at(400)))
    (True, 1, True)
    >>> region
    Region(0.9; 4031 m to 5460 m from the platform)
    """
    probability = check_probability(probability)
    if check_is("fit", fit, Fit).robust:
        raise ValueError(
            f"a region is of a fit with loss {SQUARES!r}, and this one has {fit.loss!r}, whose profile has "
            "no known distribution; fit by squares what it trusts: "
            "np.where(fit.weights > 0, fit.measured, np.nan)"
        )
    if fit.state.ndim != 1:
        raise ValueError(f"a region is of one run, and these are {fit.state.shape[:-1]}; fit one")
    if not np.isfinite(fit.state).all():
        raise ValueError(f"the fit must have a finite state, got {fit.state} ({fit.status})")
    count = int(np.isfinite(fit.measured).sum())
    if count < len(fit.state):
        raise ValueError(f"a region needs {len(fit.state)} measurements, one an unknown, got {count}")
    there = ~np.isnan(fit.measured)
    fit = replace(fit, scenario=fit.scenario.keep(there), measured=fit.measured[there])
    search = _search(fit, nearest)
    seeds, cost = search.seeds(fit.state)
    level = -2 * np.log1p(-probability)
    for _ in range(REPEATS):
        lowest = cost.min()
        pieces = search.pieces(seeds, cost, lowest + level)
        best = min(pieces, key=lambda piece: piece.cost.min())
        if best.cost.min() >= lowest - SAME:
            break
        seeds = np.concatenate([seeds, best.state[[np.argmin(best.cost)]]])  # lower than any seed
        cost = np.append(cost, best.cost.min())
    bounded = bool(max(piece.range[-1] for piece in pieces) < FARTHEST)
    return Region(
        probability,
        float(level),
        float(lowest),
        tuple(piece.boundary(search.chart.origin) for piece in pieces),
        np.array([piece.range[[0, -1]] for piece in pieces]),
        bounded,
        area_of(pieces) if bounded else np.inf,
        fit.scenario,
        fit.measured,
        np.concatenate([piece.state for piece in pieces]),
    )


def _search(fit, nearest):
    """The search from a distance on, by default one that leaves the fit far outside."""
    chart = chart_of(fit.scenario, ModifiedPolar)
    distance = np.hypot(*(fit.state[chart.places[:2]] - chart.origin))
    nearest = min(NEAREST, distance / 10) if nearest is None else check_scalar("nearest", nearest, above=0.0)
    if not 0 < nearest <= FARTHEST / STEP:
        raise ValueError(f"nearest must be above 0 and at most {FARTHEST / STEP:g} m, got {nearest}")
    return PolarSearch(fit.scenario, fit.measured, chart, float(nearest))
