"""Priors and first clouds with further unknowns, and the particle filter of any state."""

from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from linear_sensors import NAMES, LinearWithBias

import tmalib as tma

MEAN, SPREAD = np.array([100.0, 200.0, 5.0, -3.0, 2.0]), np.diag([40.0, 30.0, 4.0, 3.0, 6.0]) ** 2
BETA, WALK = 0.8, 3.0


@pytest.fixture(scope="module")
def linear():
    platform = tma.Course((0, 0), 8.0, 1.0, [tma.Straight(20)])
    times = np.array([1.0, 2.0, 2.5, 4.0, 5.0, 7.0, 8.0])
    first = tma.Sensor(LinearWithBias(1.0, 0.0, 1.0), times, 20.0)
    second = tma.Sensor(LinearWithBias(0.0, 1.0, 0.5), times[::2], 15.0)
    return tma.Scenario(platform, [first, second], 8.0)


def kalman(scenario, measured):
    """Mean, covariance and log-likelihood by the Kalman filter of another library."""
    exact = KalmanFilter(dim_x=5, dim_z=2)
    exact.x, exact.P, now, log_likelihood = MEAN.copy(), SPREAD.copy(), 0.0, 0.0
    for time in np.unique(scenario.times):
        step = time - now
        g = np.array([[step**2 / 2, 0], [0, step**2 / 2], [step, 0], [0, step], [0, 0]])
        q = BETA**2 * g @ g.T + np.diag([0, 0, 0, 0, WALK * step])
        exact.predict(F=tma.transition(step, NAMES), Q=q)
        now, columns = time, np.flatnonzero(scenario.times == time)
        h = np.array([s.model.row() for s in scenario.sensors if time in s.times])
        z = measured[columns] + h[:, :2] @ scenario.platform.position_at(time)
        exact.dim_z = len(columns)
        exact.update(z, R=np.diag(scenario.sigma[columns] ** 2), H=h)
        log_likelihood += exact.log_likelihood
    return exact.x, exact.P, log_likelihood


def test_particles_agree_with_a_kalman_filter_that_has_a_wandering_bias(linear):
    """Over 60 repetitions mean, covariance and likelihood are right."""
    measured = np.array([90, 85, 95, 88, 100, 95, 103, 190, 185, 180, 170.0])
    mean, covariance, log_likelihood = kalman(linear, measured)
    runs = []
    for k in range(60):
        cloud = tma.Cloud(np.random.default_rng(k).multivariate_normal(MEAN, SPREAD, 4000), 0.0)
        runs.append(tma.sir(linear, measured, cloud, BETA, seed=1000 + k, walks={"bias": WALK}))
    sigma = np.sqrt(np.diag(covariance))
    error = (np.array([run.state[-1] for run in runs]) - mean) / sigma
    assert np.all(np.abs(error.mean(axis=0)) < 4 * error.std(axis=0, ddof=1) / np.sqrt(60))
    off = np.array([run.covariance[-1] - covariance for run in runs]) / np.outer(sigma, sigma)
    assert np.all(np.abs(off.mean(axis=0)) < 4 * off.std(axis=0, ddof=1) / np.sqrt(60))
    assert np.abs(off.mean(axis=0)).max() < 0.05, "and not for want of precision"
    likelihood = np.exp([run.log_likelihood - log_likelihood for run in runs])
    assert abs(likelihood.mean() - 1) < 4 * likelihood.std(ddof=1) / np.sqrt(60), "unbiased"
    stiff = tma.sir(linear, measured, cloud, BETA, seed=1)
    assert set(stiff.particles[:, 4]) <= set(cloud.states[:, 4]), "without a walk it stays"


def test_a_depth_stays_and_positions_move():
    """Components by name: (x, y, z, vx, vy), and measurements that say next to nothing."""
    ship = tma.Course((0, 0), 5.0, 0.0, [tma.Straight(60)])
    ray = tma.ConicalAngle(tma.DIRECT, array_depth=200, bottom_depth=4000)
    watch = tma.Scenario(ship, [tma.Sensor(ray, [30.0], 1e6)], 30.0)
    assert watch.coordinates == ("x", "y", "z", "vx", "vy")
    states = np.random.default_rng(1).normal([4e3, 3e3, 100, 5, -5], 10.0, (50, 5))
    track = tma.sir(watch, [1.0], tma.Cloud(states, 10.0), 0.0, seed=1)
    np.testing.assert_allclose(
        track.particles, tma.propagate(states, 20.0, watch.coordinates)[track.ancestor]
    )
    np.testing.assert_array_equal(track.ancestor, np.arange(50))


@pytest.fixture(scope="module")
def biased():
    ship = tma.Course((500, -300), 5.0, 0.0, [tma.Straight(60)])
    compass = tma.Sensor(tma.Biased(tma.Bearing(), "compass"), [0.0, 30.0, 60.0], 0.004)
    return tma.Scenario(ship, [compass], 60.0)


def test_a_cloud_knows_that_a_bias_turns_its_bearing(biased):
    """Bearing and bias err together: their sum is what was measured, to within sigma."""
    cloud = tma.cloud_along_first_bearing(
        biased, [0.5, 0, 0], (2e3, 8e3), 12.0, 20_000, 1, {"compass": (0.1, 0.03)}
    )
    gap, bias = cloud.states[:, :2] - [500, -300], cloud.states[:, 4]
    theta, root = np.arctan2(*gap.T), np.sqrt(20_000)
    assert bias.mean() == pytest.approx(0.1, abs=5 * 0.03 / root)
    assert bias.std() == pytest.approx(0.03, rel=5 / (root * np.sqrt(2)))
    assert (theta + bias).mean() == pytest.approx(0.5, abs=5 * 0.004 / root)
    assert (theta + bias).std() == pytest.approx(0.004, rel=5 / (root * np.sqrt(2)))
    assert abs(np.corrcoef(theta + bias, bias)[0, 1]) < 5 / root
    r = np.hypot(*gap.T)
    assert (r.min() > 2e3 - 1e-6) & (r.max() < 8e3 + 1e-6)


def test_a_prior_knows_that_a_bias_turns_its_bearing(biased):
    """Truths drawn as the prior says, measured with their own bias: its errors are chi-square.

    Angles are small enough for a range that varies to matter little: 1 per cent of the range's spread.
    """
    runs, rng = 4000, np.random.default_rng(2)
    r, bias = 5e3 + 50 * rng.standard_normal(runs), 0.1 + 0.003 * rng.standard_normal(runs)
    theta, speed = rng.uniform(-np.pi, np.pi, runs), 4.0 * rng.standard_normal((runs, 2))
    truth = np.column_stack([500 + r * np.sin(theta), -300 + r * np.cos(theta), speed, bias])
    angles = np.zeros((runs, 3))
    angles[:, 0] = theta + bias + 0.004 * rng.standard_normal(runs)
    prior = tma.prior_along_first_bearing(biased, angles, 5e3, 50.0, 4.0, {"compass": (0.1, 0.003)})
    low, high = tma.nees_limits(5, runs, 0.999)
    assert low < tma.nees(prior.mean, truth, prior.covariance).mean() < high
    error = prior.mean - truth
    claimed = prior.covariance.mean(axis=0)
    found = error.T @ error / runs
    scale = np.sqrt(np.diag(claimed))
    assert np.abs((found - claimed) / np.outer(scale, scale)).max() < 5 * np.sqrt(2 / runs)


def test_others_are_wanted_by_name(biased):
    for start in (
        lambda others: tma.prior_along_first_bearing(biased, [0.5, 0, 0], 5e3, 50.0, 4.0, others),
        lambda others: tma.cloud_along_first_bearing(biased, [0.5, 0, 0], (1, 2), 4.0, 9, 1, others),
    ):
        for others in (None, {"bias": (0, 1)}, {"compass": (0, 1), "c": (0, 1)}):
            with pytest.raises(ValueError, match=r"others must have the unknowns \['compass'\]"):
                start(others)
        with pytest.raises(ValueError, match="compass"):
            start({"compass": (0, -1.0)})


def test_filters_find_a_bias_that_two_sensors_disagree_about(scenario):
    """A biased compass beside bearings without bias: both filters find it."""
    rng = np.random.default_rng(1)
    times = scenario.sensors[0].times
    compass = tma.Sensor(tma.Biased(tma.Bearing(), "compass", true_bias=0.05), times, 0.01)
    both = replace(scenario, sensors=[tma.Sensor(tma.Bearing(), times, 0.01), compass])
    angles = both.simulate(1, seed=rng)[0]
    others = {"compass": (0.0, 0.1)}
    prior = tma.prior_along_first_bearing(both, angles, 6e3, 2e3, 5.0, others)
    track = tma.ekf(both, angles, prior)
    cloud = tma.cloud_along_first_bearing(both, angles, (2e3, 12e3), 12.0, 20_000, 1, others)
    found = tma.sir(both, angles, cloud, 0.02, seed=1, walks={"compass": 1e-9})
    sigma = np.sqrt(track.covariance[0, 4, 4])
    assert sigma < 0.003
    assert abs(track.state[0, 4] - 0.05) < 4 * sigma
    assert abs(found.state[-1, 4] - 0.05) < 4 * np.sqrt(found.covariance[-1, 4, 4])
    assert found.covariance[-1, 4, 4] < 0.01**2
