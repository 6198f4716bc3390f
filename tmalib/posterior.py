"""States drawn from the posterior of a fit by importance sampling, with a prior that is flat or stated.

The posterior density of a state X is ``p(X) exp(-C(X) / 2)`` up to a constant, with the prior density ``p`` and
the criterion ``C`` of `tmalib.batch`. Draws ``X_i`` from another density ``q``, the *proposal*, represent it with
the weights::

    w_i ~ p(X_i) exp(-C(X_i) / 2) / q(X_i),      sum_i w_i = 1,

and are worth about ``1 / sum_i w_i^2`` draws from the posterior itself, the *effective sample size*.

*Coordinates.* A state with position and velocity is drawn in bearing, logarithm of the range, and velocity over
range (`tmalib.charts`), in which the posterior of a target of badly known range is not bent. The weights have
the volume ``|dX / dq|``, which is the fourth power of the range. Other states are drawn as they are.

*Proposal.* A mixture of Student's t distributions with four degrees of freedom, whose tails are heavier than
those of a Gaussian. Three stand along the direction that the information at the fit tells least, one at the
fit and two beside it, each as wide as the information says. Five rounds of draws move them: each gets the mean
and the covariance of the weighted draws for which it is responsible (population Monte Carlo, Cappé et al.
2008). The draws of all rounds count, with the mean of all five mixtures as their ``q`` (the deterministic mixture
of Veach and Guibas 1995), so that no draw far from a late, narrow mixture gets a large weight.

*Region.* The density of the position is estimated with Gaussian kernels from one half of the draws, shrunk
towards their mean such that the kernels do not widen it (West 1993). The other half tells the level above
which the wanted share of the probability lies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .charts import ModifiedPolar, chart_of
from .checks import as_numbers, check_count, check_is, check_probability, check_scalar, check_seed
from .estimate import Fit
from .profile import Held, lowest_of
from .scenario import Scenario
from .types import BoolArray, FloatArray, Seed
from .uniform import POSITION, is_uniform

ROUNDS, FREEDOM = 5, 4.0  # of draws; of the t distributions
BESIDE = 1.5  # standard deviations along the direction that is told least
AWAY = 2.0 ** np.arange(-3, 4)  # of the fitted range: where the first proposal stands
WIDEST = (1.0, 0.5)  # of its parts: radians of the bearing, natural logarithm of the range
FASTEST = 30.0  # m/s: by which their rates are limited
CLIPPED = 3  # weights for each unknown; a mixture that few draws move collapses
LEAST_EIGENVALUE = 1e-8  # of the scaled information, where nothing else limits a direction
LogDensity = Callable[[FloatArray], Any]


@dataclass(frozen=True, eq=False)
class Posterior:
    """Weighted draws from a posterior: output of `sample_posterior`.

    Attributes
    ----------
    state : ndarray, shape (M, n)
        At the reference time of the scenario.
    weight : ndarray, shape (M,)
        Not negative, of sum one; all NaN if no draw has a finite density.
    effective : float
        The effective sample size, ``1 / sum w^2``; 0 if no draw has a finite density. It cannot see a part of
        the posterior that no draw has reached.
    least : float
        Below this effective size the draws are not trusted: what is computed from them raises `ValueError`.
    scenario : Scenario
    """

    state: FloatArray
    weight: FloatArray
    effective: float
    least: float
    scenario: Scenario

    def __repr__(self) -> str:
        trusted = "" if self.trusted else f", fewer than {self.least:g}: not trusted"
        return f"Posterior({len(self.state)} draws worth {self.effective:.0f}{trusted})"

    @property
    def trusted(self) -> bool:
        """Whether the effective sample size reaches ``least``."""
        return self.effective >= self.least

    def _check(self):
        if not self.trusted:
            raise ValueError(
                f"the draws are worth {self.effective:.3g}, fewer than least = {self.least:g}: no answer. "
                "More draws help if the posterior is only far from the fit; a flat prior over a range that "
                "the measurements do not limit has no posterior, and needs a prior"
            )

    @cached_property
    def mean(self) -> FloatArray:
        """Posterior mean, ``(n,)``; `ValueError` if not trusted."""
        self._check()
        return self.weight @ self.state

    @cached_property
    def covariance(self) -> FloatArray:
        """Posterior covariance, ``(n, n)``; `ValueError` if not trusted."""
        off = self.state - self.mean
        return (self.weight[:, None] * off).T @ off

    def quantile(self, values: ArrayLike, probability: ArrayLike) -> FloatArray:
        """Quantiles of anything that was computed for each draw.

        Parameters
        ----------
        values : array_like, shape (M,)
            For instance ``np.hypot(*posterior.state[:, :2].T)``, distances from the origin.
        probability : array_like, shape (...)
            Each between 0 and 1.

        Returns
        -------
        ndarray, shape (...)

        Raises
        ------
        ValueError
            For another number of values, or draws that are not trusted.
        """
        self._check()
        values, wanted = as_numbers("values", values), as_numbers("probability", probability)
        if values.shape != self.weight.shape:
            raise ValueError(f"values must have shape {self.weight.shape}, one a draw, got {values.shape}")
        if not np.all((wanted > 0) & (wanted < 1)):
            raise ValueError(f"probability must be between 0 and 1, got {probability}")
        order = np.argsort(values)
        return values[order][_quantile_index(self.weight[order], wanted)]

    def region(self, probability: float = 0.9) -> CredibleRegion:
        """The smallest region of positions that has this probability; `ValueError` if not trusted."""
        self._check()
        return _region(self, check_probability(probability))


@dataclass(frozen=True, eq=False)
class CredibleRegion:
    """The smallest region of positions with a given posterior probability: output of `Posterior.region`.

    Attributes
    ----------
    probability : float
    level : float
        A position is in the region if its ``density`` is at least this, in 1/m^2.
    area : float
        In square metres, from the draws.
    """

    probability: float
    level: float
    area: float
    origin: FloatArray | None  # of polar coordinates
    centres: FloatArray  # of the kernels, in whitened coordinates, (K, 2)
    weight: FloatArray
    middle: FloatArray
    whiten: FloatArray
    width: float

    def density(self, points: ArrayLike) -> FloatArray:
        """Posterior density of positions ``points (..., 2)``, in 1/m^2."""
        points = as_numbers("points", points)
        if points.ndim == 0 or points.shape[-1] != 2:
            raise ValueError(f"points must have shape (..., 2), got {points.shape}")
        flat, log_volume = _polar(points.reshape(-1, 2), self.origin, self.middle[0])
        white = (flat - self.middle) @ self.whiten.T / self.width
        total = np.empty(len(white))
        for i in range(0, len(white), 256):
            apart = white[i : i + 256, None] - self.centres / self.width
            total[i : i + 256] = np.exp(-np.vecdot(apart, apart) / 2) @ self.weight
        scale = np.abs(np.linalg.det(self.whiten)) / (2 * np.pi * self.width**2)
        return (total * scale * np.exp(-log_volume)).reshape(points.shape[:-1])[()]

    def contains(self, points: ArrayLike) -> BoolArray:
        """Whether positions ``points (..., 2)`` are in the region, ``(...)``."""
        return self.density(points) >= self.level


def sample_posterior(
    found: Fit,
    seed: Seed,
    *,
    log_prior: LogDensity | None = None,
    draws: int = 5000,
    least: float = 500.0,
    also: ArrayLike | None = None,
) -> Posterior:
    """Draws from the posterior of one run, with their effective number.

    Parameters
    ----------
    found : Fit
        Of one run, by squares. It need not have converged, but its state must be finite: the search starts
        there.
    seed : int, SeedSequence or Generator
    log_prior : callable, optional
        ``log_prior(states)``, the logarithm of the prior density of states ``(M, n)`` per unit of their
        components, ``(M,)``, up to a constant; ``-inf`` for what cannot be. Flat by default.
    draws : int
        In five rounds of equal size.
    least : float
        Effective sample size below which the answer is refused.
    also : array_like, shape (k, n), optional
        Other states to look around, such as those of `tmalib.alternatives`: a ghost that no start leads to is
        not found, and no effective size tells.

    Returns
    -------
    Posterior

    Raises
    ------
    ValueError
        For more than one run, a robust loss, a state that is not finite, and a prior that returns another
        shape or NaN.

    Notes
    -----
    Derived at the top of this file. A bearing without a manoeuvre gives no upper limit of the range: with a flat
    prior there is no posterior. State one then; a largest speed is enough.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> watch = tma.Scenario(ship, [tma.Sensor(tma.Bearing(), np.arange(0, 400, 5.0), 0.01)], 400)
    >>> truth = tma.Target((2e3, 4e3), speed=6, heading=1.5)
    >>> found = tma.fit(watch, watch.with_target(truth).simulate(runs=1, seed=1)[0])
    >>> def slower_than_15(states):
    ...     return np.where(np.hypot(states[:, 2], states[:, 3]) < 15, 0.0, -np.inf)
    >>> posterior = tma.sample_posterior(found, seed=1, log_prior=slower_than_15)
    >>> posterior.trusted, bool(posterior.region(0.9).contains(truth.position_at(400)))
    (True, True)
    >>> away = np.hypot(*(posterior.state[:, :2] - ship.position_at(400)).T)
    >>> bool(np.diff(posterior.quantile(away, [0.05, 0.95])) > 1000)  # metres
    True
    """
    if check_is("found", found, Fit).robust:
        raise ValueError(f"a posterior needs the likelihood of a fit by squares, and the loss is {found.loss!r}")
    if found.state.ndim != 1:
        raise ValueError(f"a posterior is of one run, and these are {found.state.shape[:-1]}; fit one")
    if not np.isfinite(found.state).all():
        raise ValueError(f"the fit must have a finite state, got {found.state} ({found.status})")
    rng, count = check_seed(seed), check_count("draws", draws, ROUNDS)
    least = check_scalar("least", least, above=0.0)
    there = ~np.isnan(found.measured)
    scenario, measured = found.scenario.keep(there), found.measured[there]
    space = _Space(scenario, measured, log_prior)
    others = np.empty((0, len(found.state))) if also is None else np.atleast_2d(scenario.check_state(also))
    mixture = _first_mixture(space, np.concatenate([found.state[None], others]))
    points, values, mixtures = np.empty((0, len(found.state))), np.empty(0), []
    for round_ in range(ROUNDS):
        size = count // ROUNDS + (round_ < count % ROUNDS)
        new = mixture.draw(size, rng)
        points, values = np.concatenate([points, new]), np.append(values, space.log_density(new))
        mixtures.append((size / count, mixture))
        weight = _normalised(values - _log_mean(mixtures, points))
        if np.isfinite(weight).all():
            mixture = mixture.moved(points, _clipped(weight, CLIPPED * points.shape[1]))
    effective = 1 / np.sum(weight**2) if np.isfinite(weight).all() else 0.0
    return Posterior(space.state(points), weight, float(effective), least, scenario)


def _quantile_index(weight, probability):
    """Index at which the cumulated weights reach the probabilities."""
    return np.minimum(np.searchsorted(np.cumsum(weight), probability), len(weight) - 1)


def _normalised(log_weight):
    """Weights of sum one; NaN if none is finite."""
    largest = log_weight.max()
    if not np.isfinite(largest):
        return np.full(log_weight.shape, np.nan)
    weight = np.exp(log_weight - largest)
    return weight / weight.sum()


def _clipped(weight, count):
    """Weights of which so many of the largest are made equal, of sum one: what to move a mixture by."""
    positive = np.sort(weight[weight > 0])
    clipped = np.minimum(weight, positive[-min(count, len(positive))])
    return clipped / clipped.sum()


def _log_mean(mixtures, points):
    """Logarithm of the mean density of mixtures, each with its share of the draws."""
    parts = np.array([np.log(share) + mixture.log_density(points) for share, mixture in mixtures])
    return np.logaddexp.reduce(parts, axis=0)


@dataclass(frozen=True, eq=False)
class _Space:
    """The coordinates of the draws, and the posterior density in them."""

    scenario: Scenario
    measured: FloatArray
    log_prior: LogDensity | None

    @cached_property
    def polar(self) -> ModifiedPolar | None:
        uniform = is_uniform(self.scenario.coordinates)
        return chart_of(self.scenario, ModifiedPolar) if uniform else None

    def point(self, state):
        """Coordinates ``(..., n)`` of states."""
        if self.polar is None:
            return np.array(state)
        point = self.polar.from_state(state)
        point[..., self.polar.places[1]] = -np.log(point[..., self.polar.places[1]])
        return point

    def _modified_polar(self, point):
        inverse = np.array(point)
        inverse[..., self.polar.places[1]] = np.exp(-point[..., self.polar.places[1]])
        return inverse

    def state(self, point):
        return np.array(point) if self.polar is None else self.polar.to_state(self._modified_polar(point))

    def along_the_range(self, states):
        """States at several ranges, all else fitted; and the states themselves."""
        range_place = self.polar.places[1]
        inverse = self.polar.from_state(states)[:, None].repeat(len(AWAY), axis=1)
        inverse[..., range_place] /= AWAY
        starts = self.polar.to_state(inverse).reshape(1, -1, states.shape[1])
        many = np.broadcast_to(self.measured, (starts.shape[1], len(self.measured)))
        found, cost = lowest_of(self.scenario, many, starts, Held(self.polar, (range_place,)))
        return np.concatenate([states, found[np.isfinite(cost)]])

    def information(self, state):
        """Fisher information in the coordinates of the draws, ``(n, n)``."""
        jacobian = self.scenario.linearise(state)[1] / self.scenario.sigma[:, None]
        if self.polar is not None:
            chart = self._modified_polar(self.point(state))
            slope = self.polar.jacobian(chart)
            slope[:, self.polar.places[1]] *= -chart[self.polar.places[1]]
            jacobian = jacobian @ slope
        return jacobian.T @ jacobian

    def limits(self, state):
        """Largest standard deviations of a first proposal, ``(n,)``; infinite where nothing limits."""
        limits = np.full(len(state), np.inf)
        if self.polar is not None:
            rate = FASTEST * np.exp(-self.point(state)[self.polar.places[1]])
            limits[self.polar.places] = [*WIDEST, rate, rate]
        return limits

    def log_density(self, point):
        """Logarithm of the posterior density of the coordinates, ``(M,)``; ``-inf`` where there is none."""
        with np.errstate(all="ignore"):
            state = self.state(point)
            predicted = self.scenario.linearise(state)[0]
            standard = self.scenario.residual(self.measured, predicted) / self.scenario.sigma
            value = -np.sum(standard**2, axis=-1) / 2
            if self.polar is not None:
                value = value + 4 * point[:, self.polar.places[1]]
        value = np.where(np.isfinite(value) & np.isfinite(state).all(axis=1), value, -np.inf)
        good = np.isfinite(value)
        if self.log_prior is not None and good.any():
            prior = as_numbers("log_prior", self.log_prior(state[good]))
            if prior.shape != (good.sum(),) or np.isnan(prior).any() or np.any(prior == np.inf):
                raise ValueError(
                    f"log_prior must give a number or -inf for each of {good.sum()} states, got {prior}"
                )
            value[good] += prior
        return value


@dataclass(frozen=True, eq=False)
class _Mixture:
    """Student's t distributions: shares ``(K,)``, centres ``(K, n)``, roots of their scales ``(K, n, n)``."""

    share: FloatArray
    centre: FloatArray
    root: FloatArray

    def draw(self, count, rng):
        which = rng.choice(len(self.share), size=count, p=self.share)
        normal = rng.standard_normal((count, self.centre.shape[1]))
        normal /= np.sqrt(rng.chisquare(FREEDOM, count) / FREEDOM)[:, None]
        return self.centre[which] + np.einsum("ijk,ik->ij", self.root[which], normal)

    def log_parts(self, points):
        """Logarithms of share times density of each, up to one constant, ``(K, M)``."""
        n, parts = points.shape[1], []
        for share, centre, root in zip(self.share, self.centre, self.root, strict=True):
            white = np.linalg.solve(root, (points - centre).T)
            volume = np.sum(np.log(np.abs(np.diagonal(root))))
            tail = (FREEDOM + n) / 2 * np.log1p(np.sum(white**2, axis=0) / FREEDOM)
            parts.append(np.log(share) - volume - tail)
        return np.array(parts)

    def log_density(self, points):
        return np.logaddexp.reduce(self.log_parts(points), axis=0)

    def moved(self, points, weight):
        """The mixture with means and covariances of the draws for which each part is responsible."""
        parts = self.log_parts(points)
        blame = np.exp(parts - np.logaddexp.reduce(parts, axis=0)) * weight
        share, centre, root = self.share.copy(), self.centre.copy(), self.root.copy()
        n = points.shape[1]
        for k, own in enumerate(blame):
            total = own.sum()
            if total <= 0 or total**2 / np.sum(own**2) < 5 * n:
                continue  # too few to move it
            own = own / total
            mean = own @ points
            off = points - mean
            size = np.sqrt(own @ off**2)
            correlation = (own[:, None] * off / size).T @ (off / size)
            share[k], centre[k] = total, mean
            root[k] = size[:, None] * np.linalg.cholesky(correlation + 1e-9 * np.eye(n))
        share = np.maximum(share, 0.02)
        return _Mixture(share / share.sum(), centre, root)


def _first_mixture(space, states):
    """The t distributions of the first round: along the range, or along what the information tells least."""
    centres, roots = [], []
    for state in states if space.polar is None else space.along_the_range(states):
        limit = space.limits(state) ** -2.0
        information, centre = space.information(state) + np.diag(limit), space.point(state)
        length = np.sqrt(np.diagonal(information))
        length = np.where(length > 0, length, 1.0)
        values, vectors = np.linalg.eigh(information / length / length[:, None])
        spread = 1 / np.sqrt(np.maximum(values, LEAST_EIGENVALUE * values[-1]))
        scaled = vectors * spread / length[:, None]
        root = np.linalg.cholesky(scaled @ scaled.T)
        if space.polar is None:
            steps: tuple[float, ...] = (-BESIDE, 0.0, BESIDE)
        else:  # rates that nothing tells go towards zero
            steps, rates = (0.0,), space.polar.places[2:]
            centre = centre - scaled @ scaled.T[:, rates] @ (limit[rates] * centre[rates])
        centres += [centre + step * scaled[:, 0] for step in steps]
        roots += [root] * len(steps)
    return _Mixture(np.full(len(centres), 1 / len(centres)), np.array(centres), np.array(roots))


def _polar(points, origin, near):
    """Bearing within a half turn of ``near`` and log range, and the log of the volume of these in m^2."""
    if origin is None:
        return points, np.zeros(len(points))
    dx, dy = (points - origin).T
    with np.errstate(divide="ignore"):
        log = np.log(np.hypot(dx, dy))
    theta = near + np.remainder(np.arctan2(dx, dy) - near + np.pi, 2 * np.pi) - np.pi
    return np.stack([theta, log], axis=1), 2 * log


def _region(posterior, probability):
    """Kernels from the even draws, the level from the odd ones."""
    names = posterior.scenario.coordinates
    places = posterior.state[:, [names.index(name) for name in POSITION]]
    polar = is_uniform(names)
    origin = chart_of(posterior.scenario, ModifiedPolar).origin if polar else None
    heaviest = places[np.argmax(posterior.weight)]
    near = _polar(heaviest[None], origin, 0.0)[0][0, 0]
    flat, _ = _polar(places, origin, near)
    middle = posterior.weight @ flat
    off = flat - middle
    covariance = (posterior.weight[:, None] * off).T @ off
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))
    width = (posterior.effective / 2) ** (-1 / 6)
    even = posterior.weight[::2] / posterior.weight[::2].sum()
    centres = np.sqrt(1 - width**2) * off[::2] @ whiten.T
    region = CredibleRegion(
        probability, 0.0, np.nan, origin, centres, even, middle, whiten, float(width)
    )  # fmt: skip
    odd = posterior.weight[1::2] / posterior.weight[1::2].sum()
    density = region.density(places[1::2])
    order = np.argsort(-density)
    level = density[order][_quantile_index(odd[order], probability)]
    inside = density >= level
    area = float(np.sum(odd[inside] / density[inside]))
    return CredibleRegion(
        probability, float(level), area, origin, centres, even, middle, whiten, float(width)
    )
