"""Draws from a posterior: against exact linear algebra, grids, truths from the prior; refusals."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import binom

import tmalib as tma
from tmalib.mixtures import Mixture

LEVEL = -2 * np.log(0.1)


@dataclass(frozen=True)
class Displacement:
    """East and north of the target by turns: linear in the state."""

    coordinates = ("x", "y", "vx", "vy")

    def observer_state(self, platform, times):
        return (np.arange(len(times)) % 2)[None].astype(float)

    def value_and_gradient(self, state, observer, elapsed):
        x, y, vx, vy = state
        north, east = observer[0], 1 - observer[0]
        value = east * (x + elapsed * vx) + north * (y + elapsed * vy)
        one = np.ones_like(value)
        return value, np.stack([east * one, north * one, east * elapsed * one, north * elapsed * one])

    def residual(self, measured, predicted):
        return measured - predicted

    def observe(self, target, platform, times):
        return np.where(self.observer_state(platform, times)[0] == 1, *target.position_at(times).T[::-1])


@dataclass(frozen=True)
class StillBearing:
    """Bearing of a target at rest, whose state is its position."""

    coordinates = ("x", "y")

    def observer_state(self, platform, times):
        return platform.position_at(times).T

    def value_and_gradient(self, state, observer, elapsed):
        dx, dy = state[0] - observer[0], state[1] - observer[1]
        square = dx**2 + dy**2
        return np.arctan2(dx, dy), np.stack([dy / square, -dx / square])

    def residual(self, measured, predicted):
        return tma.wrap(measured - predicted)

    def observe(self, target, platform, times):
        return tma.bearing(target.position_at(times) - platform.position_at(times))


def slow(states):
    """Gaussian velocity, 4 m/s a component."""
    return -np.sum(states[:, -2:] ** 2, axis=1) / 32


@pytest.fixture(scope="module")
def short():
    """Eight bearings on two legs: the range is hardly known."""
    ship = tma.Course((0, 0), 6, 0.0, [tma.Straight(200), tma.Straight(200, heading=np.pi / 2)])
    ear = tma.Sensor(tma.Bearing(), np.linspace(0, 400, 8), 0.02)
    return tma.Scenario(ship, [ear], 400.0, tma.Target((2e3, 3e3), 4.0, 1.0))


def test_of_a_linear_model_it_is_the_gaussian():
    platform = tma.Course((0, 0), 0.0, 0.0, [tma.Straight(600)])
    sensor = tma.Sensor(Displacement(), np.arange(0, 600, 20.0), 150.0)
    now = tma.Scenario(platform, [sensor], 300.0, tma.Target((2e3, 3e3), 5.0, 1.0))
    found = tma.fit(now, now.simulate(1, seed=1)[0], now.state)
    posterior = tma.sample_posterior(found, 1, draws=40_000)
    jacobian = now.linearise(now.state)[1] / now.sigma[:, None]
    exact = np.linalg.inv(jacobian.T @ jacobian)
    sigma = np.sqrt(np.diagonal(exact))
    assert posterior.effective > 10_000
    np.testing.assert_allclose(
        (posterior.mean - found.state) / sigma, 0, atol=5 / np.sqrt(posterior.effective)
    )
    np.testing.assert_allclose((posterior.covariance - exact) / np.outer(sigma, sigma), 0, atol=0.06)
    region, ellipse = posterior.region(0.9), tma.confidence_ellipse(found.state, exact, 0.9)
    assert region.area == pytest.approx(ellipse.area, rel=0.08)
    around = ellipse.boundary(60) - ellipse.centre
    assert region.contains(ellipse.centre + 0.85 * around).all()
    assert not region.contains(ellipse.centre + 1.15 * around).any()


def test_of_a_target_at_rest_it_is_that_of_a_grid():
    """Two unknowns, drawn as they are: the range of a target four baselines off is skew."""
    ship = tma.Course((0, 0), 5, np.pi / 2, [tma.Straight(200)])
    ear = tma.Sensor(StillBearing(), np.linspace(0, 200, 9), 0.03)
    now = tma.Scenario(ship, [ear], 0.0)
    truth = tma.Target((500, 4000), 0.0, 0.0)
    measured = _bearings(now, truth, 4)

    def near(states):
        return np.where(np.hypot(*states.T) < 15e3, 0.0, -np.inf)

    found = tma.fit(now, measured, np.array([500.0, 4000.0]))
    posterior = tma.sample_posterior(found, 2, log_prior=near, draws=40_000)
    x, y = np.meshgrid(np.linspace(-6e3, 15e3, 1401), np.linspace(15, 15e3, 1000))
    states = np.stack([x, y], axis=-1).reshape(-1, 2)
    off = now.residual(measured, now.linearise(states)[0]) / now.sigma
    density = np.where(np.hypot(*states.T) < 15e3, np.exp(-np.sum(off**2, axis=1) / 2), 0.0)
    density /= density.sum()
    distance = np.hypot(*states.T)
    order = np.argsort(distance)
    wanted = np.interp([0.1, 0.5, 0.9], np.cumsum(density[order]), distance[order])
    got = posterior.quantile(np.hypot(*posterior.state.T), [0.1, 0.5, 0.9])
    np.testing.assert_allclose(got, wanted, rtol=0.04)
    level = np.sort(density)[::-1]
    area = np.searchsorted(np.cumsum(level), 0.9) * 15.0 * 15.0
    assert posterior.region(0.9).area == pytest.approx(area, rel=0.12)


def _bearings(now, target, seed):
    times, noise = now.times, np.random.default_rng(seed).standard_normal(len(now.times))
    return tma.bearing(target.position_at(times) - now.platform.position_at(times)) + 0.03 * noise


def test_of_a_moving_target_it_is_that_of_a_grid(short):
    """Four unknowns, drawn in bearing, log range and rates, against a sum over x, y and velocities."""
    measured = short.simulate(1, seed=6)[0]
    found = tma.fit(short, measured)
    posterior = tma.sample_posterior(found, 3, log_prior=slow, draws=40_000)
    here = short.platform.position_at(400)
    away = np.hypot(*(posterior.state[:, :2] - here).T)
    got = posterior.quantile(away, [0.1, 0.5, 0.9])
    theta = np.arctan2(*(found.state[:2] - here)) + np.linspace(-0.12, 0.12, 33)
    log = np.log(np.linspace(0.5, 15, 59) * 1e3)
    velocity = np.linspace(-15, 15, 41)
    weight = np.zeros(len(log))
    for k, distance in enumerate(np.exp(log)):
        grid = np.meshgrid(theta, velocity, velocity, indexing="ij")
        t, vx, vy = (part.ravel() for part in grid)
        states = np.stack([here[0] + distance * np.sin(t), here[1] + distance * np.cos(t), vx, vy], axis=1)
        off = short.residual(measured, short.linearise(states)[0]) / short.sigma
        weight[k] = distance * np.exp(-np.sum(off**2, axis=1) / 2 + slow(states)).sum()
    share = np.cumsum(weight) / weight.sum()  # of steps of equal length
    wanted = np.interp([0.1, 0.5, 0.9], share, np.exp(log) + 125.0)
    np.testing.assert_allclose(got, wanted, rtol=0.05)


@pytest.mark.slow
def test_over_truths_from_the_prior_it_holds_what_it_says(short):
    """Whatever the prior and however bad the geometry: the one guarantee that a posterior gives."""
    rng, runs, held, refused = np.random.default_rng(8), 300, [], 0
    here = short.platform.position_at(400)
    for seed in range(runs):
        distance, theta = 10e3 * np.sqrt(rng.uniform(0.01, 1)), rng.uniform(0, 2 * np.pi)
        place = here + distance * np.array([np.sin(theta), np.cos(theta)])
        truth = np.concatenate([place, 4 * rng.standard_normal(2)])
        measured = short.linearise(truth)[0] + short.sigma * rng.standard_normal(len(short.times))
        found = tma.fit(short, measured)

        def log_prior(states):
            away = np.hypot(*(states[:, :2] - here).T)
            return np.where((away > 1e3) & (away < 10e3), slow(states), -np.inf)

        posterior = tma.sample_posterior(found, seed, log_prior=log_prior, draws=5000, least=100)
        refused += not posterior.trusted
        if posterior.trusted:
            held.append(bool(posterior.region(0.8).contains(place)))
    assert refused < 0.15 * runs
    low, high = binom.ppf([0.0005, 0.9995], len(held), 0.8)
    assert low <= sum(held) <= high


def test_another_prior_from_the_same_draws(short):
    found = tma.fit(short, short.simulate(1, seed=6)[0])
    first = tma.sample_posterior(found, 3, log_prior=slow, draws=40_000)
    factor = -np.sum((first.state[:, -2:] - [2, 0]) ** 2, axis=1) / 8 - slow(first.state)
    again = first.reweighted(factor)
    direct = tma.sample_posterior(
        found, 4, log_prior=lambda s: -np.sum((s[:, -2:] - [2, 0]) ** 2, axis=1) / 8, draws=40_000
    )
    assert 200 < again.effective < first.effective
    sigma = np.sqrt(np.diagonal(direct.covariance))
    np.testing.assert_allclose((again.mean - direct.mean) / sigma, 0, atol=5 / np.sqrt(again.effective))


def test_a_ghost_that_is_told_gets_its_share():
    """An array on a straight course: the mirror image is as likely. Untold it is not found."""
    array = tma.Course((0, 0), 5, 0.0, [tma.Straight(600)])
    rays = [tma.ConicalAngle(path, 200.0, 2000.0, 100.0) for path in (tma.DIRECT, tma.BOTTOM_BOUNCE)]
    sensors = [tma.Sensor(ray, np.arange(0, 601, 20.0), 0.003) for ray in rays]
    now = tma.Scenario(array, sensors, 0.0, tma.Target((3000, 4000), 4.0, 0.8, depth=100))
    found = tma.fit(now, now.simulate(1, seed=1)[0], now.state)
    mirror = found.state * [-1, 1, -1, 1]
    both = tma.sample_posterior(found, 1, also=mirror, draws=10_000)
    east = both.weight @ (both.state[:, 0] > 0)
    assert east == pytest.approx(0.5, abs=0.05)
    region = both.region(0.9)
    assert region.contains([found.state[:2], mirror[:2]]).all()


def test_a_range_without_limit_is_refused(short):
    """A straight course and a flat prior: there is no posterior, and no number is given."""
    ship = tma.Course((0, 0), 6, 0.0, [tma.Straight(400)])
    now = replace(short, platform=ship)
    found = tma.fit(now, now.simulate(1, seed=1)[0], now.state)
    posterior = tma.sample_posterior(found, 1)
    assert not posterior.trusted
    assert "not trusted" in repr(posterior)
    for ask in (
        lambda: posterior.mean,
        lambda: posterior.region(),
        lambda: posterior.quantile(np.ones(5000), 0.5),
    ):
        with pytest.raises(ValueError, match="fewer than least = 500: no answer"):
            ask()
    stated = tma.sample_posterior(found, 1, log_prior=slow, draws=20_000)
    assert stated.trusted


def test_a_prior_that_excludes_everything_has_no_weight(short):
    found = tma.fit(short, short.simulate(1, seed=6)[0])
    nothing = tma.sample_posterior(found, 1, log_prior=lambda s: np.full(len(s), -np.inf), draws=100)
    assert nothing.effective == 0
    assert np.isnan(nothing.weight).all()


def test_draws_depend_on_the_seed_alone_and_gaps_are_left_out(short):
    measured = short.simulate(1, seed=6)[0]
    gap = measured.copy()
    gap[3] = np.nan
    kept = np.arange(8) != 3
    whole, less = tma.fit(short, gap), tma.fit(short.keep(kept), measured[kept])
    one, two = (tma.sample_posterior(f, 5, log_prior=slow, draws=500) for f in (whole, less))
    np.testing.assert_allclose(one.state, two.state, rtol=1e-6)
    again = tma.sample_posterior(whole, 5, log_prior=slow, draws=500)
    np.testing.assert_array_equal(one.weight, again.weight)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (dict(log_prior=lambda s: 0.0), "log_prior must give a number or -inf for each"),
        (dict(log_prior=lambda s: np.full(len(s), np.nan)), "log_prior must give a number"),
        (dict(draws=3), "draws must be"),
        (dict(least=0), "least must be"),
        (dict(also=[1.0, 2.0]), r"state must have shape \(..., 4\)"),
    ],
)
def test_what_makes_no_sense_is_refused(short, options, message):
    found = tma.fit(short, short.simulate(1, seed=6)[0])
    with pytest.raises(ValueError, match=message):
        tma.sample_posterior(found, 1, **options)


def test_many_runs_and_robust_fits_are_refused(short):
    angles = short.simulate(2, seed=6)
    with pytest.raises(ValueError, match="a posterior is of one run"):
        tma.sample_posterior(tma.fit(short, angles), 1)
    with pytest.raises(ValueError, match="the loss is 'bisquare'"):
        tma.sample_posterior(tma.fit(short, angles[0], loss="bisquare"), 1)
    posterior = tma.sample_posterior(tma.fit(short, angles[0]), 1, log_prior=slow)
    with pytest.raises(ValueError, match="values must have shape"):
        posterior.quantile([1.0, 2.0], 0.5)
    with pytest.raises(ValueError, match="probability must be between 0 and 1"):
        posterior.quantile(posterior.state[:, 0], [0.0, 0.5])
    with pytest.raises(ValueError, match="log_factor must be 5000 numbers"):
        posterior.reweighted([1.0])
    with pytest.raises(ValueError, match=r"points must have shape"):
        posterior.region().contains([1.0, 2.0, 3.0])


def test_a_mixture_has_the_density_that_it_draws():
    """The share of draws in a box against the integral of the density over it."""
    rng = np.random.default_rng(1)
    roots = np.array([[[1.0, 0], [0.5, 0.5]], [[2.0, 0], [0, 0.3]]])
    mixture = Mixture(np.array([0.3, 0.7]), np.array([[0.0, 0.0], [3.0, 1.0]]), roots)
    draws = mixture.draw(100_000, rng)
    axis = np.arange(-80, 80, 0.05) + 0.025
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    density = np.exp(mixture.log_density(grid))
    density /= density.sum()
    for low, high in ((-1, 1), (1, 4)):
        inside = [np.all((points > low) & (points < high), axis=1) for points in (draws, grid)]
        assert inside[0].mean() == pytest.approx(density[inside[1]].sum(), abs=0.01)
