"""`robustness`, Figures 5 to 8: two filters for targets that leave the model, and what the text says of them.

The paper names the filters, a Kalman filter in modified polar coordinates and the SIR particle filter of
equation (4), and states none of their settings. Those below are ours. `filtered` runs both beside the least
squares estimate (BLS); the functions after it measure what the text says of them. The limits within which a
phrase holds are those of the module `phrases`.

*Fewer, sharper bearings.* A particle filter that resamples 500 times loses nearly all its families. The
mean of m successive bearings, with the standard deviation ``sigma / sqrt(m)``, tells as much of a target
that hardly turns meanwhile, and the cloud is resampled m times less often (`tmalib.average_measurements`).
The disturbance ``beta / sqrt(m)``, held m times as long, makes the velocity wander as far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...averaging import average_measurements
from ...batch import along_first_bearing, fit
from ...bearings import bearing, wrap
from ...charts import ModifiedPolar
from ...clouds import cloud_along_first_bearing
from ...ellipse import confidence_ellipse
from ...particles import ParticleTrack, sir
from ...priors import prior_along_first_bearing
from ...recursive import Track, ekf
from ...scenario import Scenario
from ...sensitivity import displaced_measurements
from ...uniform import propagate
from . import scenarios as paper

# Assumed, not printed.
START_RANGE, START_RANGE_SHARE, START_VELOCITY_SIGMA = 10e3, 0.5, 250.0  # m, of it, m/s: Kalman filter, BLS
CLOUD_RANGE, CLOUD_SPEED = (500.0, 25e3), 400.0  # m, m/s: particle filter
BETA = 30.0  # m/s^2
PARTICLES = 50_000
TOGETHER = 10  # bearings averaged for the judgement: 0.4 s


@dataclass(frozen=True, eq=False)
class Filtered:
    """What the three estimators make of one run of noisy bearings.

    Attributes
    ----------
    scenario : Scenario
        With the target as it is.
    measured : ndarray, shape (N,)
    bls : ndarray, shape (4,)
        Estimate of the uniform motion, at the reference time.
    kalman : Track
        At the times of all measurements but the first, which is the filter's prior.
    particles : ParticleTrack
        At the same times, or, where bearings were averaged, in the middle of each group but the first.
    """

    scenario: Scenario
    measured: np.ndarray
    bls: np.ndarray
    kalman: Track
    particles: ParticleTrack

    @property
    def end(self):
        """True position at the end, shape ``(2,)``."""
        return self.scenario.target.position_at(paper.DURATION)

    @property
    def cloud(self):
        """States of the particles at the end, shape ``(N, 4)``."""
        return propagate(self.particles.particles, paper.DURATION - self.particles.times[-1])

    @property
    def range(self):
        """Distance of target and platform at the end, in metres."""
        return float(np.hypot(*(self.end - self.scenario.platform.position_at(paper.DURATION))))

    def bls_at(self, t):
        """State of the estimated uniform motion at the times ``t``, shape ``(..., 4)``."""
        return propagate(self.bls, np.asarray(t) - self.scenario.reference_time)

    def along(self, positions):
        """Positions ``(..., 2)`` at the end on the axis through the BLS estimate, 0, and the truth, 1."""
        zero = self.bls_at(paper.DURATION)[:2]
        axis = self.end - zero
        return (positions - zero) @ axis / (axis @ axis)


def filtered(
    geometry, scenario, seed, *, particles=PARTICLES, beta=BETA, together=1, draw=0, prior_range=START_RANGE
):
    """Simulate one run of a scenario, and estimate.

    Parameters
    ----------
    geometry : scenarios.Geometry
        Its ``straight`` is what the estimators assume.
    scenario : Scenario
        With the target as it is.
    seed : SeedSequence
        Of the bearings, and of the particle filter.
    particles : int
    beta : float
        In m/s^2, for the time between two bearings.
    together : int
        How many bearings the particle filter gets as one.
    draw : int
        Another number gives the particle filter other random numbers, for the same bearings.
    prior_range : float
        Of the Kalman filter, in metres; its standard deviation is a half of it.

    Returns
    -------
    Filtered
    """
    options = dict(particles=particles, beta=beta, together=together, draw=draw, prior_range=prior_range)
    return filtered_cases(geometry, {"": (scenario, seed)}, **options)[""]


def filtered_cases(geometry, cases, *, particles, beta, together, draw, prior_range):
    """`filtered` for several targets, all Kalman filters at once: a dict from name to `Filtered`.

    ``cases`` maps names to pairs of scenario and seed.
    """
    assumed = geometry.straight
    measured = np.stack([scenario.simulate(1, seed)[0] for scenario, seed in cases.values()])
    prior = prior_along_first_bearing(
        assumed, measured, prior_range, START_RANGE_SHARE * prior_range, START_VELOCITY_SIGMA
    )
    tracks = ekf(assumed, measured, prior, record=assumed.times[1:], chart=ModifiedPolar)
    found = fit(assumed, measured, along_first_bearing(assumed, measured, START_RANGE))
    bls = np.where(found.converged[:, None], found.state, np.nan)
    runs = {}
    for i, (name, (scenario, seed)) in enumerate(cases.items()):
        key = (*seed.spawn_key, 1, draw)
        rng = np.random.default_rng(np.random.SeedSequence(seed.entropy, spawn_key=key))
        fewer, means = average_measurements(assumed, measured[i], together)
        cloud = cloud_along_first_bearing(fewer, means, CLOUD_RANGE, CLOUD_SPEED, particles, rng)
        kalman = Track(tracks.times, tracks.state[i], tracks.covariance[i], tracks.status[i])
        particle = sir(fewer, means, cloud, beta / np.sqrt(together), rng)
        runs[name] = Filtered(scenario, measured[i], bls[i], kalman, particle)
    return runs


def path_length(positions):
    """Length of a track through positions ``(N, 2)``, in metres."""
    return float(np.hypot(*np.diff(positions, axis=0).T).sum())


def early_wandering(found):
    """How many times as long as its second half the first half of the Kalman filter's track is.

    A track that follows a target of constant speed has 1, whatever its range; one that jumps about has
    more. The first second, in which the prior is corrected, is left out.
    """
    times, track = found.kalman.times, found.kalman.state[:, :2]
    first = (times >= 1.0) & (times <= paper.DURATION / 2)
    return path_length(track[first]) / path_length(track[times >= paper.DURATION / 2])


def kalman_departure(found):
    """Distance of the Kalman filter from the BLS estimate at the end, over that of BLS and truth."""
    bls = found.bls_at(paper.DURATION)[:2]
    return float(np.hypot(*(found.kalman.state[-1, :2] - bls)) / np.hypot(*(found.end - bls)))


def cloud_size(found):
    """Major semi-axis of the 90 % ellipse of the last cloud's positions, over the range."""
    where = found.cloud[:, :2]
    return float(confidence_ellipse(where.mean(axis=0), np.cov(where.T)).semi_axes[0] / found.range)


def bearings_apart(found):
    """Root mean square difference of the noise-free bearings of the BLS track and of the target, in sigma."""
    times = found.scenario.times
    seen = bearing(found.bls_at(times)[:, :2] - found.scenario.platform.position_at(times))
    return float(np.sqrt(np.mean((wrap(seen - found.scenario.measure()) / found.scenario.sigma) ** 2)))


def density(values, places):
    """Density of a cloud's ``values`` ``(N,)`` at the ``places``: Gaussian kernels of Silverman's width.

    The values are counted in cells of an eighth of the width first, which makes it fast.
    """
    width = np.std(values) * (0.75 * len(values)) ** -0.2
    cell = width / 8
    edges = np.arange(values.min() - 6 * width, values.max() + 6 * width, cell)
    kernel = np.exp(-0.5 * (np.arange(-40, 41) / 8) ** 2) / (np.sqrt(2 * np.pi) * width)
    smooth = np.convolve(np.histogram(values, edges)[0] / len(values), kernel, mode="same")
    return np.interp(places, edges[:-1] + cell / 2, smooth, left=0.0, right=0.0)


def cloud_maximum(found):
    """Where between the BLS estimate, 0, and the truth, 1, the marginal density of the cloud is largest."""
    along = found.along(found.cloud[:, :2])
    if not np.isfinite(along).all():
        return np.nan
    places = np.linspace(*np.quantile(along, [0.005, 0.995]), 201)
    return float(places[np.argmax(density(along, places))])


def truth_tail(found):
    """Twice the share of the cloud beyond the truth on the axis from the BLS estimate to it."""
    along = found.along(found.cloud[:, :2])
    beyond = np.mean(along > 1)
    return float(2 * min(beyond, 1 - beyond)) if np.isfinite(along).all() else np.nan


def density_between(found):
    """Density of the cloud halfway from the BLS estimate to the truth, over its largest."""
    along = found.along(found.cloud[:, :2])
    if not np.isfinite(along).all():
        return np.nan
    places = np.append(np.linspace(*np.quantile(along, [0.005, 0.995]), 201), 0.5)
    values = density(along, places)
    return float(values[-1] / values.max())


def error_over_bls(found, positions):
    """Error of a filter at the end over that of the BLS; 0 where the BLS has no estimate at a finite range.

    ``positions`` ``(..., 2)`` of the filter at the end are taken by their median; one that is not finite is
    infinitely wrong.
    """
    error = np.hypot(*(np.median(positions.reshape(-1, 2), axis=0) - found.end))
    bls = np.hypot(*(found.bls_at(paper.DURATION)[:2] - found.end))
    return np.inf if not np.isfinite(error) else 0.0 if not np.isfinite(bls) else float(error / bls)


def worse_perturbation(geometry):
    """The paper's worst perturbation, ``(N, 2)``, of the sign that displaces the noise-free estimate more."""
    both = np.stack([geometry.worst_displacement, -geometry.worst_displacement])
    found = fit(geometry.straight, displaced_measurements(geometry.straight, both), geometry.theta_star)
    gap = propagate(found.state, paper.DURATION)[:, :2] - geometry.straight.target.position_at(paper.DURATION)
    error = np.where(found.converged, np.hypot(*(gap - both[:, -1]).T), np.inf)
    return both[np.argmax(error)]
