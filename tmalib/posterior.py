"""States drawn from the posterior of a fit by importance sampling, with a prior that is flat or stated.

The posterior density of a state X is ``p(X) exp(-C(X) / 2)`` up to a constant, with the prior density ``p``
and the criterion ``C`` of `tmalib.batch`. Draws ``X_i`` from another density ``q``, the *proposal*,
represent it with the weights::

    w_i ~ p(X_i) exp(-C(X_i) / 2) / q(X_i),      sum_i w_i = 1,

and are worth about ``1 / sum_i w_i^2`` draws from the posterior itself, the *effective sample size*.

*Proposal.* A mixture of Student's t distributions (`tmalib.mixtures`) in bearing, logarithm of the range
and velocity over range (`tmalib.posterior_space`), in which the posterior of a target of badly known range
is not bent. Before the first round its parts stand at an eighth to eight times the fitted range (of a fit
that has not converged, at a quarter to 128 km), all else fitted: along the direction that is known least.
Of a state without a range three stand along what the information tells least. Each is as wide as the
information there says, within limits. Five rounds of draws move them. The draws of all rounds count, with
the mean of the five mixtures as their ``q`` (Veach and Guibas 1995), so that no draw far from a late,
narrow mixture gets a large weight.

*Region.* See `tmalib.credible`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from .charts import ModifiedPolar, chart_of
from .checks import as_numbers, check_count, check_is, check_probability, check_scalar, check_seed, short
from .credible import CredibleRegion, credible_region, weighted_quantile
from .estimate import Fit
from .mixtures import clipped, log_mean_density
from .posterior_space import LogDensity, PosteriorSpace, first_mixture
from .scenario import Scenario
from .types import FloatArray, Seed
from .uniform import POSITION, is_uniform

ROUNDS = 5  # of draws


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
            raise ValueError(f"probability must be between 0 and 1, got {short(probability)}")
        return weighted_quantile(values, self.weight, wanted)[()]

    def reweighted(self, log_factor: ArrayLike) -> Posterior:
        """The posterior with another prior, from the same draws.

        Parameters
        ----------
        log_factor : array_like, shape (M,)
            For each draw the logarithm of the new prior density over the old one, up to a constant; ``-inf``
            for what cannot be.

        Returns
        -------
        Posterior
            Its effective size tells how far the priors are apart for these draws.
        """
        factor = as_numbers("log_factor", log_factor)
        if factor.shape != self.weight.shape or np.isnan(factor).any() or np.any(factor == np.inf):
            raise ValueError(
                f"log_factor must be {len(self.weight)} numbers or -inf, got {short(log_factor)}"
            )
        with np.errstate(divide="ignore"):
            return _of_weights(self.state, np.log(self.weight) + factor, self.least, self.scenario)

    def region(self, probability: float = 0.9) -> CredibleRegion:
        """The smallest region of positions that has this probability; `ValueError` if not trusted."""
        self._check()
        names = self.scenario.coordinates
        places = self.state[:, [names.index(name) for name in POSITION]]
        origin = chart_of(self.scenario, ModifiedPolar).origin if is_uniform(names) else None
        return credible_region(places, self.weight, check_probability(probability), origin, self.effective)


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
    Derived at the top of this file. Bearings without a manoeuvre give no upper limit of the range: with a
    flat prior there is no posterior. State one then; a largest speed is enough.

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
        raise ValueError(
            f"a posterior needs the likelihood of a fit by squares, and the loss is {found.loss!r}"
        )
    if found.state.ndim != 1:
        raise ValueError(f"a posterior is of one run, and these are {found.state.shape[:-1]}; fit one")
    if not np.isfinite(found.state).all():
        raise ValueError(f"the fit must have a finite state, got {found.state} ({found.status})")
    rng, count = check_seed(seed), check_count("draws", draws, ROUNDS)
    least = check_scalar("least", least, above=0.0)
    there = ~np.isnan(found.measured)
    scenario, measured = found.scenario.keep(there), found.measured[there]
    space = PosteriorSpace(scenario, measured, log_prior)
    others = np.empty((0, len(found.state))) if also is None else np.atleast_2d(scenario.check_state(also))
    mixture = first_mixture(space, np.concatenate([found.state[None], others]), not found.converged)
    points, values, mixtures = np.empty((0, len(found.state))), np.empty(0), []
    for round_ in range(ROUNDS):
        size = count // ROUNDS + (round_ < count % ROUNDS)
        new = mixture.draw(size, rng)
        points, values = np.concatenate([points, new]), np.append(values, space.log_density(new))
        mixtures.append((size / count, mixture))
        weight = _normalised(values - log_mean_density(mixtures, points))
        if np.isfinite(weight).all():
            mixture = mixture.moved(points, clipped(weight, points.shape[1]))
    return _of_weights(space.state(points), values - log_mean_density(mixtures, points), least, scenario)


def _of_weights(state, log_weight, least, scenario):
    """The posterior of draws with logarithms of weights."""
    weight = _normalised(log_weight)
    effective = 1 / np.sum(weight**2) if np.isfinite(weight).all() else 0.0
    return Posterior(state, weight, float(effective), least, scenario)


def _normalised(log_weight):
    """Weights of sum one; NaN if none is finite."""
    largest = log_weight.max()
    if not np.isfinite(largest):
        return np.full(log_weight.shape, np.nan)
    weight = np.exp(log_weight - largest)
    return weight / weight.sum()
