"""Which region of positions is honest: the ellipse, the likelihood region, or that of a posterior.

Scenario 4 of `emw-acoustic` at early times, where the range is hardly known, and the single ray of
`conical-angles`, Section 3.2, of which it is not known at all.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..batch import fit
from ..bearings import DelayedBearing
from ..bounds import crlb, nees
from ..checks import check_seed
from ..montecarlo import Stream
from ..motion import Target
from ..papers.conical_angles import scenarios as conical
from ..papers.emw_acoustic import scenarios as emw
from ..posterior import sample_posterior
from ..profile import profile_criterion
from ..region import confidence_region
from ..status import NOT_FINITE

STREAM = Stream("beyond/regions")
LEVEL = -2 * np.log(0.1)  # of 90 per cent
FASTEST, SPREAD = 15.0, 4.0  # m/s: of the flat prior, the largest speed; of the other, a component's sigma
FARTHEST, NEAREST = 60e3, 500.0  # metres: of the flat prior; of the drawn targets the nearest
DRAWN = 20e3  # metres: the farthest of the drawn targets
LEAST = 150.0  # effective draws


def early(time):
    """Scenario 4 with the measurements up to a time, the state wanted then."""
    return emw.scenario(4).until(time)


def one_ray():
    """The single bottom-bounced ray of Section 3.2, at the true depth."""
    return conical.section_3_2()


def range_known(scenario, covariance, state):
    """Standard deviation of the range over the range, ``(...)``, for states and covariances of a fit."""
    gap = state[..., :2] - scenario.platform.position_at(scenario.reference_time)
    square = np.sum(gap**2, axis=-1)
    along = np.einsum("...i,...ij,...j->...", gap, covariance[..., :2, :2], gap)
    return np.sqrt(along) / square


def bound_over_range(scenario):
    """Bound on the range over the range."""
    return float(range_known(scenario, crlb(scenario), scenario.state))


def ellipse_area(covariance):
    """Area of the 90 % ellipse of covariances ``(..., n, n)``, in square metres."""
    (a, b), (_, d) = np.moveaxis(covariance[..., :2, :2], (-2, -1), (0, 1))
    return np.pi * LEVEL * np.sqrt(a * d - b * b)


@dataclass(frozen=True)
class CountedBearing(DelayedBearing):
    """A delayed bearing that writes down how many it has predicted."""

    count: list = field(default_factory=list, compare=False)

    def value_and_gradient(self, state, observer, elapsed):
        value, gradient = super().value_and_gradient(state, observer, elapsed)
        self.count.append(value.size)
        return value, gradient


def evaluations(time, measured, call):
    """How many states' bearings a call computes, given a scenario and its fit; without those of the fit.

    Returns this number for the fit alone and for ``call(fit)``.
    """
    now = early(time)
    optical, sonar = now.sensors
    model = CountedBearing(sonar.model.c)
    found = fit(replace(now, sensors=[optical, replace(sonar, model=model)], target=None), measured)
    alone = sum(model.count) / len(sonar)
    call(found)
    return alone, sum(model.count) / len(sonar) - alone


# -- priors -------------------------------------------------------------------------------------------


def flat(scenario, side=False):
    """Log density that is flat in position and velocity, up to 60 km and 15 m/s; on request, east only."""
    here = scenario.platform.position_at(scenario.reference_time)

    def log_prior(states):
        near = np.hypot(*(states[:, :2] - here).T) < FARTHEST
        slow = np.hypot(*states[:, 2:].T) < FASTEST
        return np.where(near & slow & ((states[:, 0] > here[0]) | (not side)), 0.0, -np.inf)

    return log_prior


def of_ships(states):
    """Log density of velocities: Gaussian, 4 m/s a component."""
    return -np.sum(states[:, 2:] ** 2, axis=1) / (2 * SPREAD**2)


# -- tasks --------------------------------------------------------------------------------------------


def squares(seed, runs, time=None):
    """Squares of the error of the position, each chi-square with two degrees of freedom, if it is honest.

    Parameters
    ----------
    time : float, optional
        Of scenario 4; without one, the single ray, fitted from the truth.

    Returns
    -------
    dict
        ``ellipse`` against the covariance of the fit, infinite without one; ``region``, the profile;
        ``known``, the fit's own standard deviation of the range over the range, infinite without one.
    """
    now = one_ray() if time is None else early(time)
    start = now.state if time is None else None
    angles = now.simulate(runs, seed)
    found = fit(now, angles, start)
    off = nees(found.state[:, :2], now.state[:2], found.covariance[:, :2, :2])
    good = found.converged & np.isfinite(off)
    known = range_known(now, found.covariance, found.state)
    return {
        "ellipse": np.where(good, off, np.inf),
        "region": profile_criterion(now, angles, now.state[:2], start),
        "known": np.where(good, known, np.inf),
    }


def posteriors(seed, runs, time, draws):
    """Posterior regions of scenario 4 with the flat prior and that of ships, from the same draws.

    Returns
    -------
    dict
        For each prior, ``flat`` and ``ships``, whether the region of 90 % holds the truth; ``..._area``
        over that of the fit's ellipse; ``..._size``, the effective number of draws. What is refused is NaN
        in the first two.
    """
    now = early(time)
    prior, rng = flat(now), check_seed(seed)
    rows = []
    for measured in now.simulate(runs, rng):
        found = fit(now, measured)
        first = sample_posterior(found, rng, log_prior=prior, draws=draws, least=LEAST)
        ships = first.reweighted(of_ships(first.state))
        area = ellipse_area(found.covariance)
        rows.append([*_held(first, now.state, area), *_held(ships, now.state, area)])
    names = ("flat", "flat_area", "flat_size", "ships", "ships_area", "ships_size")
    return dict(zip(names, np.reshape(rows, (runs, 6)).T, strict=True))


def _held(posterior, truth, area):
    """Whether the region holds the truth, its area over another, the effective size."""
    if not posterior.trusted:
        return np.nan, np.nan, posterior.effective
    region = posterior.region(0.9)
    return float(region.contains(truth[:2])), region.area / area, posterior.effective


def region_areas(seed, runs, time):
    """Area of the likelihood region over that of the ellipse, ``area (runs,)``; infinite without limit."""
    now = early(time)
    fits = [fit(now, measured) for measured in now.simulate(runs, seed)]
    return {"area": np.array([confidence_region(f).area / ellipse_area(f.covariance) for f in fits])}


def drawn_targets(seed, runs, time, draws):
    """Targets drawn from a prior, all around, and what holds them.

    Positions are uniform in a ring from 500 m to 20 km around the observer at the time of the state,
    velocities those of ships. The posterior has just this prior.

    Returns
    -------
    dict
        ``ellipse``, ``region`` and ``posterior``, whether it holds the target; a fit without an estimate has
        an ellipse that holds nothing, a posterior that is refused is NaN.
    """
    now, rng = early(time), check_seed(seed)
    here = now.platform.position_at(time)

    def log_prior(states):
        away = np.hypot(*(states[:, :2] - here).T)
        return np.where((away > NEAREST) & (away < DRAWN), of_ships(states), -np.inf)

    rows = []
    for _ in range(runs):
        distance = np.sqrt(rng.uniform(NEAREST**2, DRAWN**2))
        theta, velocity = rng.uniform(0, 2 * np.pi), SPREAD * rng.standard_normal(2)
        place = here + distance * np.array([np.sin(theta), np.cos(theta)])
        target = Target.from_velocity(place - time * velocity, velocity)
        measured = now.with_target(target).simulate(1, rng)[0]
        found = fit(now, measured)
        square = nees(found.state[:2], place, found.covariance[:2, :2])
        posterior = np.nan
        if found.status != NOT_FINITE and np.isfinite(found.state).all():
            drawn = sample_posterior(found, rng, log_prior=log_prior, draws=draws, least=LEAST)
            posterior = _held(drawn, place, 1.0)[0]
        profile = profile_criterion(now, measured, place)
        rows.append([bool(found.converged and square <= LEVEL), profile <= LEVEL, posterior])
    return dict(zip(("ellipse", "region", "posterior"), np.array(rows, dtype=float).T, strict=True))


def one_ray_posteriors(seed, runs, draws):
    """Posterior of the single ray with the priors of `posteriors` and the target known to be in the east.

    Returns ``flat`` and ``ships`` as there, and ``flat_median`` and ``ships_median``, medians of the range in
    metres; NaN where refused.
    """
    now, rng = one_ray(), check_seed(seed)
    prior, rows = flat(now, side=True), []
    for measured in now.simulate(runs, rng):
        found = fit(now, measured, now.state)
        first = sample_posterior(found, rng, log_prior=prior, draws=draws, least=LEAST)
        row = []
        for posterior in (first, first.reweighted(of_ships(first.state))):
            away = np.hypot(*posterior.state[:, :2].T)
            median = posterior.quantile(away, 0.5) if posterior.trusted else np.nan
            row += [_held(posterior, now.state, 1.0)[0], median]
        rows.append(row)
    names = ("flat", "flat_median", "ships", "ships_median")
    return dict(zip(names, np.reshape(rows, (runs, 4)).T, strict=True))
