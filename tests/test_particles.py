from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

import tmalib as tma
from tmalib.particles import FEW_FAMILIES, systematic_resample


class Linear:
    """One component of the position relative to the platform: the filter's problem has an exact answer."""

    coordinates = ("x", "y", "vx", "vy")

    def __init__(self, component):
        self.row = np.eye(2)[component]

    def observer_state(self, platform, times):
        return platform.position_at(times).T

    def value_and_gradient(self, state, site, lag):
        x, y, vx, vy = state
        a, b = self.row
        value = a * (x + lag * vx - site[0]) + b * (y + lag * vy - site[1])
        return value, np.zeros((4, *value.shape))  # no filter of particles needs it

    def residual(self, measured, predicted):
        return measured - predicted

    def observe(self, target, platform, times):
        return (target.position_at(times) - platform.position_at(times)) @ self.row


MEAN, SPREAD, BETA = np.array([100.0, 200.0, 5.0, -3.0]), np.diag([40.0, 30.0, 4.0, 3.0]) ** 2, 0.8


@pytest.fixture
def linear():
    """Two sensors, one of them at every second time, uneven steps."""
    platform = tma.Course((0, 0), 8.0, 1.0, [tma.Straight(20)])
    target = tma.Target((130.0, 210.0), speed=6.0, heading=2.5)
    times = np.array([1.0, 2.0, 2.5, 4.0, 5.0, 7.0, 8.0])
    return tma.Scenario(
        platform, [tma.Sensor(Linear(0), times, 20.0), tma.Sensor(Linear(1), times[::2], 15.0)], 8.0, target
    )


def kalman(scenario, measured, unmeasured=()):
    """Mean, covariance and log-likelihood by the Kalman filter of another library.

    At the ``unmeasured`` times it takes a step and no measurement.
    """
    exact = KalmanFilter(dim_x=4, dim_z=2)
    exact.x, exact.P = MEAN.copy(), SPREAD.copy()
    now, log_likelihood = 0.0, 0.0
    for time in np.union1d(scenario.times, unmeasured):
        step = time - now
        g = np.array([[step**2 / 2, 0], [0, step**2 / 2], [step, 0], [0, step]])
        exact.predict(F=tma.transition(step), Q=BETA**2 * g @ g.T)
        now, columns = time, np.flatnonzero(scenario.times == time)
        if not len(columns):
            continue
        h = np.array([[*s.model.row, 0, 0] for s in scenario.sensors if time in s.times])
        z = measured[columns] + h[:, :2] @ scenario.platform.position_at(time)
        exact.dim_z = len(columns)
        exact.update(z, R=np.diag(scenario.sigma[columns] ** 2), H=h)
        log_likelihood += exact.log_likelihood
    return exact.x, exact.P, log_likelihood


def gaussian_cloud(particles, seed):
    return tma.Cloud(np.random.default_rng(seed).multivariate_normal(MEAN, SPREAD, particles), 0.0)


def test_agrees_with_the_kalman_filter_on_a_linear_problem(linear):
    """Over 60 repetitions mean, covariance and likelihood are right, and so is the scatter claimed."""
    measured, particles = linear.simulate(1, seed=3)[0], 4000
    mean, covariance, log_likelihood = kalman(linear, measured)
    runs = [tma.sir(linear, measured, gaussian_cloud(particles, k), BETA, seed=1000 + k) for k in range(60)]
    sigma = np.sqrt(np.diag(covariance))
    error = (np.array([run.state[-1] for run in runs]) - mean) / sigma
    standard_error = error.std(axis=0, ddof=1) / np.sqrt(len(runs))
    assert np.all(np.abs(error.mean(axis=0)) < 4 * standard_error), "the mean of the filter"
    spread = np.array([run.covariance[-1] for run in runs]) / np.outer(sigma, sigma)
    off = spread - covariance / np.outer(sigma, sigma)
    assert np.all(np.abs(off.mean(axis=0)) < 4 * off.std(axis=0, ddof=1) / np.sqrt(len(runs)))
    likelihood = np.exp([run.log_likelihood - log_likelihood for run in runs])
    assert abs(likelihood.mean() - 1) < 4 * likelihood.std(ddof=1) / np.sqrt(len(runs)), "unbiased"
    # A standard deviation of 60 is known to 9 per cent; systematic resampling scatters less than claimed.
    claimed = np.sqrt(np.mean([run.standard_error[-1] ** 2 for run in runs], axis=0)) / sigma
    ratio = error.std(axis=0, ddof=1) / claimed
    assert np.all((ratio > 0.5) & (ratio < 1.3)), ratio


def test_the_last_particles_are_equally_likely(linear):
    """Their mean is that of the weighted cloud, up to the noise of one systematic resampling."""
    measured = linear.simulate(1, seed=3)[0]
    track = tma.sir(linear, measured, gaussian_cloud(20_000, 1), BETA, seed=2)
    bound = 5 * np.sqrt(np.diag(track.covariance[-1]) / 20_000)
    assert np.all(np.abs(track.particles.mean(axis=0) - track.state[-1]) < bound)
    np.testing.assert_allclose(np.cov(track.particles.T), track.covariance[-1], rtol=0.1, atol=3.0)
    assert track.particles.shape == (20_000, 4)
    assert track.times.tolist() == np.unique(linear.times).tolist()
    assert not track.degenerate


def test_agrees_with_a_posterior_on_a_grid():
    """A target at rest on a known line, seen from a moving platform: its range by quadrature."""
    platform = tma.Course((0, 0), 10.0, np.pi / 2, [tma.Straight(100)])
    camera = tma.Sensor(tma.Bearing(), [20.0, 40.0, 60.0, 80.0], 0.1)
    scenario = tma.Scenario(platform, [camera], 80.0, tma.Target((0.0, 2e3), 0.0, 0.0))
    measured = scenario.simulate(1, seed=5)[0]
    grid = np.linspace(500.0, 6000.0, 200_001)
    states = np.stack([0 * grid, grid, 0 * grid, 0 * grid], axis=-1)
    residual = tma.wrap(measured - scenario.linearise(states)[0]) / 0.1
    density = np.exp(-0.5 * np.sum(residual**2, axis=-1))
    density /= density.sum()
    mean = density @ grid
    sigma = np.sqrt(density @ (grid - mean) ** 2)
    runs = []
    for k in range(40):
        start = np.zeros((5000, 4))
        start[:, 1] = np.random.default_rng(k).uniform(500.0, 6000.0, 5000)
        runs.append(tma.sir(scenario, measured, tma.Cloud(start, 0.0), 0.0, seed=k))
    error = np.array([run.state[-1, 1] - mean for run in runs])
    assert abs(error.mean()) < 4 * error.std(ddof=1) / np.sqrt(40)
    inside = np.array([np.mean(run.particles[:, 1] < mean) for run in runs])
    below = density[grid < mean].sum()
    assert abs(inside.mean() - below) < 4 * inside.std(ddof=1) / np.sqrt(40)
    assert np.sqrt(np.mean([run.covariance[-1, 1, 1] for run in runs])) == pytest.approx(sigma, rel=0.02)
    assert all(run.state[-1, 0] == 0 for run in runs), "without noise nothing leaves the line"


def resample_by_walking(weights, u):
    """The textbook: walk along the cumulated weights with a comb of N teeth."""
    n, taken, i, total = len(weights), [], 0, weights[0]
    for j in range(n):
        while (u + j) * sum(weights) / n >= total and i < n - 1:
            i += 1
            total += weights[i]
        taken.append(i)
    return taken


def test_systematic_resampling_equals_the_textbook_loop():
    rng = np.random.default_rng(1)
    for n in (1, 2, 7, 50):
        for _ in range(40):
            weights = rng.random(n) ** 8 * (rng.random(n) < 0.7)
            weights[rng.integers(n)] = 0.3
            u = rng.random()
            assert systematic_resample(weights, u).tolist() == resample_by_walking(weights.tolist(), u)


def test_systematic_resampling_is_unbiased():
    """Counts are the floor or the ceiling of N w, and N w on average over u."""
    weights = np.random.default_rng(2).random(30)
    expected = 30 * weights / weights.sum()
    combs = (np.arange(3000) + 0.5) / 3000
    counts = np.array([np.bincount(systematic_resample(weights, u), minlength=30) for u in combs])
    assert np.all((counts == np.floor(expected)) | (counts == np.ceil(expected)))
    np.testing.assert_allclose(counts.mean(axis=0), expected, atol=2 / 3000)  # an edge at either end


@pytest.mark.parametrize("weights", [[0.0, 0.0, 0.0], [np.nan, 1.0, 1.0], [np.inf, 1.0, 1.0]])
def test_weights_that_say_nothing_leave_the_cloud(weights):
    assert systematic_resample(np.array(weights), 0.3).tolist() == [0, 1, 2]


def test_a_measurement_that_no_particle_explains_is_reported(linear):
    """Weights of 1e-200000 underflow; their logarithms do not."""
    measured = linear.measure()
    measured[3] += 20.0 * 1000
    track = tma.sir(linear, measured, gaussian_cloud(500, 1), BETA, seed=2)
    assert track.finite
    assert track.log_likelihood < -1e5
    assert track.effective.min() < 3
    assert track.degenerate


def without(scenario, column):
    """The scenario without one measurement, and the columns that stay."""
    stay = np.arange(len(scenario.times)) != column
    sensors = [
        tma.Sensor(block.sensor.model, block.sensor.times[stay[block.columns]], block.sensor.sigma)
        for block in scenario.blocks
    ]
    return replace(scenario, sensors=sensors), stay


@pytest.mark.parametrize("column", [0, 8])  # the first and the second of two at the same time
def test_of_two_measurements_only_the_missing_one_is_skipped(linear, column):
    measured = linear.simulate(1, seed=3)[0]
    fewer, stay = without(linear, column)
    told = tma.sir(fewer, measured[stay], gaussian_cloud(300, 1), BETA, seed=5)
    measured[column] = np.nan
    track = tma.sir(linear, measured, gaussian_cloud(300, 1), BETA, seed=5)
    for name in ("state", "covariance", "standard_error", "effective", "families", "particles"):
        np.testing.assert_array_equal(getattr(track, name), getattr(told, name))
    assert track.log_likelihood == told.log_likelihood
    assert track.finite


def test_where_nothing_is_measured_the_cloud_moves_on(linear):
    """The row of a missing measurement is a prediction; without noise two steps are one."""
    measured, row = linear.simulate(1, seed=3)[0], 3
    fewer, stay = without(linear, row)
    rng = np.random.default_rng(5)
    before = tma.sir(fewer.until(2.5), measured[stay & (linear.times < 4)], gaussian_cloud(300, 1), 0, rng)
    rng.random()  # the comb of the step with NaN
    after = tma.sir(fewer, measured[stay], tma.Cloud(before.particles, 2.5), 0, rng)
    measured[row] = np.nan
    track = tma.sir(linear, measured, gaussian_cloud(300, 1), 0, np.random.default_rng(5))
    np.testing.assert_array_equal(track.state[:row], before.state)
    predicted = tma.propagate(before.particles, 1.5)
    np.testing.assert_allclose(track.state[row], predicted.mean(axis=0), rtol=1e-9)
    np.testing.assert_allclose(track.covariance[row], np.cov(predicted.T, bias=True), rtol=1e-9)
    assert track.effective[row] == pytest.approx(300)
    assert track.families[row] == track.families[row - 1], "nothing is resampled"
    np.testing.assert_allclose(track.state[row + 1 :], after.state, rtol=1e-9)
    np.testing.assert_allclose(track.particles, after.particles, rtol=1e-9)
    assert track.log_likelihood == pytest.approx(before.log_likelihood + after.log_likelihood)
    assert track.finite


def test_a_time_at_which_no_particle_has_a_weight_says_so(linear):
    measured = linear.measure()
    measured[3] = np.inf
    track = tma.sir(linear, measured, gaussian_cloud(500, 1), BETA, seed=2)
    assert not track.finite
    assert track.effective[3] == 0
    assert track.log_likelihood == -np.inf
    assert np.isnan(track.state[3]).all()
    assert np.isnan(track.standard_error[3]).all()
    others = np.delete(np.arange(len(track.times)), 3)
    assert np.isfinite(track.covariance[others]).all(), "only its own row"
    assert track.families[3] == track.families[2], "nothing is resampled"


def test_a_particle_that_predicts_nothing_harms_no_other():
    """Faster than sound, it is not heard and has no weight; the others are as without it."""
    ship = tma.Course((0, 0), 0.0, 0.0, [tma.Straight(60)])
    watch = tma.Scenario(ship, [tma.Sensor(tma.DopplerFrequency(1500.0), [10.0, 20.0], 1.0)], 20.0)
    states = np.random.default_rng(1).normal([4e3, 3e3, 5, 5, 300], [200, 200, 1, 1, 2], (200, 5))
    wild = states.copy()
    wild[7, 2:4] = 2000.0
    track = tma.sir(watch, [298.0, 299.0], tma.Cloud(wild, 0.0), 0.0, seed=1)
    assert track.finite
    assert not np.any(track.ancestor == 7)
    tame = tma.sir(watch, [298.0, 299.0], tma.Cloud(np.delete(states, 7, axis=0), 0.0), 0.0, seed=1)
    np.testing.assert_allclose(track.state[0], tame.state[0], rtol=1e-12)
    np.testing.assert_allclose(track.effective[0], tame.effective[0], rtol=1e-12)


def test_after_nan_the_filter_still_agrees_with_the_kalman_filter(linear):
    """Which skips the update but not the prediction."""
    measured = linear.simulate(1, seed=3)[0]
    fewer, stay = without(linear, 3)
    mean, covariance, _ = kalman(fewer, measured[stay], [4.0])
    measured[3] = np.nan
    runs = [tma.sir(linear, measured, gaussian_cloud(4000, k), BETA, seed=1000 + k) for k in range(40)]
    error = np.array([run.state[-1] for run in runs]) - mean
    assert np.all(np.abs(error.mean(axis=0)) < 4 * error.std(axis=0, ddof=1) / np.sqrt(40))
    spread = np.array([run.covariance[-1] for run in runs]) - covariance
    assert np.all(np.abs(spread.mean(axis=0)) < 4 * spread.std(axis=0, ddof=1) / np.sqrt(40))


def test_degenerate_speaks_of_the_last_cloud(linear):
    track = tma.sir(linear, linear.measure(), gaussian_cloud(500, 1), BETA, seed=2)
    counted = np.array([90.0, FEW_FAMILIES - 1.0, FEW_FAMILIES + 1.0])
    assert not replace(track, families=counted).degenerate
    assert replace(track, families=counted[:2]).degenerate


def test_few_families_do_no_harm_where_the_state_forgets(linear):
    """All particles descend from a few of the first, and the filter is right all the same."""
    times = np.arange(1.0, 301.0)
    platform = tma.Course((0, 0), 8.0, 1.0, [tma.Straight(300)])
    sensors = [tma.Sensor(Linear(0), times, 20.0), tma.Sensor(Linear(1), times[::2], 15.0)]
    long = replace(linear, platform=platform, sensors=sensors, reference_time=300.0)
    measured = long.simulate(1, seed=3)[0]
    mean, covariance, _ = kalman(long, measured)
    runs = [tma.sir(long, measured, gaussian_cloud(1000, k), BETA, seed=k) for k in range(12)]
    assert all(run.degenerate for run in runs)
    sigma = np.sqrt(np.diag(covariance))
    error = (np.array([run.state[-1] for run in runs]) - mean) / sigma
    draws = max(run.families[-1] for run in runs)
    assert np.all(3 * error.std(axis=0, ddof=1) < 1 / np.sqrt(draws)), "far less than so many draws scatter"
    assert np.all(np.abs(error.mean(axis=0)) < 4 * error.std(axis=0, ddof=1) / np.sqrt(len(runs)))


def test_a_filter_with_too_few_particles_says_so(linear):
    """Sharp measurements and hardly any noise: a few families remain, and fewer with every step."""
    sharp = replace(linear, sensors=[tma.Sensor(s.model, s.times, s.sigma / 4) for s in linear.sensors])
    track = tma.sir(sharp, sharp.measure(), gaussian_cloud(1000, 1), 1e-3, seed=2)
    assert track.degenerate
    assert track.families[-1] < FEW_FAMILIES
    assert track.families[0] > FEW_FAMILIES, "it began with more"
    sizes = np.bincount(track.ancestor, minlength=1000)
    assert track.families[-1] == pytest.approx(1000**2 / np.sum(sizes**2)), "counted another way"


def test_the_cloud_handed_in_is_not_touched(linear):
    cloud = gaussian_cloud(100, 1)
    before = cloud.states.copy()
    first = tma.sir(linear, linear.measure(), cloud, BETA, seed=2)
    again = tma.sir(linear, linear.measure(), cloud, BETA, seed=2)
    np.testing.assert_array_equal(cloud.states, before)
    np.testing.assert_array_equal(first.particles, again.particles)
    on = tma.sir(linear, linear.measure(), tma.Cloud(first.particles, 7.0), BETA, seed=2)
    assert on.times.tolist() == [8.0], "a cloud holds what was measured up to its time"


def test_filtering_in_two_parts_equals_filtering_at_once(linear):
    measured, rng = linear.measure(), np.random.default_rng(2)
    whole = tma.sir(linear, measured, gaussian_cloud(100, 1), BETA, np.random.default_rng(2))
    early = linear.until(4.0)
    half = tma.sir(early, measured[linear.columns_until(4.0)], gaussian_cloud(100, 1), BETA, rng)
    rest = tma.sir(linear, measured, tma.Cloud(half.particles, 4.0), BETA, rng)
    np.testing.assert_array_equal(rest.particles, whole.particles)
    assert half.log_likelihood + rest.log_likelihood == pytest.approx(whole.log_likelihood)


def test_cloud_along_first_bearing(scenario):
    angles = scenario.simulate(1, seed=8)[0]
    cloud = tma.cloud_along_first_bearing(scenario, angles, (2e3, 8e3), 12.0, 20_000, seed=1)
    gap = cloud.states[:, :2] - scenario.platform.position_at(0.0)
    r, theta = np.hypot(*gap.T), tma.bearing(gap)
    speed = np.hypot(*cloud.states[:, 2:].T)
    assert cloud.time == 0.0
    for value in ((r - 2e3) / 6e3, (speed / 12.0) ** 2, np.arctan2(*cloud.states[:, 2:].T) / (2 * np.pi) % 1):
        share = np.histogram(value, 10, (0, 1))[0] / 20_000  # each uniform: 0.1, standard error 0.0021
        assert np.all(np.abs(share - 0.1) < 5 * np.sqrt(0.09 / 20_000))
    assert theta.mean() == pytest.approx(angles[0], abs=5 * scenario.sigma[0] / np.sqrt(20_000))
    assert theta.std() == pytest.approx(scenario.sigma[0], rel=5 / np.sqrt(40_000))


def test_bad_input(scenario):
    angles, along = scenario.measure(), tma.cloud_along_first_bearing
    cloud = tma.Cloud(np.ones((3, 4)), 0.0)
    for call, message in (
        (lambda: tma.Cloud(np.ones(4), 0.0), "states must have shape"),
        (lambda: tma.sir(scenario, angles, tma.Cloud(np.ones((3, 5)), 0.0), 1.0, 1), "state must have shape"),
        (lambda: tma.sir(scenario, angles, cloud, 1.0, 1, walks={"vx": 1.0}), "walks must name"),
        (lambda: tma.sir(scenario, angles, cloud, 1.0, 1, walks={"bias": 1.0}), "walks must name"),
        (lambda: along(scenario, angles * np.nan, (1.0, 2.0), 1, 9, 1), "first bearing"),
        (lambda: along(scenario, angles, (1.0, 2.0), 1, 9, 1, {"bias": (0, 1)}), "others must have"),
        (lambda: tma.Cloud(np.ones((0, 4)), 0.0), "at least one particle"),
        (lambda: tma.Cloud(np.full((3, 4), np.nan), 0.0), "states must be finite"),
        (lambda: tma.sir(scenario, angles[None], cloud, 1.0, 1), "takes one run"),
        (lambda: tma.sir(scenario, angles[:-1], cloud, 1.0, 1), "measurements must have shape"),
        (lambda: tma.sir(scenario, angles, cloud, -1.0, 1), "beta must be at least 0"),
        (
            lambda: tma.sir(scenario, angles, tma.Cloud(np.ones((3, 4)), 700.0), 1.0, 1),
            "no measurement",
        ),
        (lambda: along(scenario, angles, (3.0, 2.0), 1, 9, 1), "range must be"),
        (
            lambda: along(scenario, angles, (0.0, 2.0), 1, 9, 1),
            "range must be greater",
        ),
        (lambda: along(scenario, angles, (1.0, 2.0), 1, 0, 1), "positive integer"),
    ):
        with pytest.raises(ValueError, match=message):
            call()


def test_a_cloud_starts_from_the_platform_that_takes_the_first_bearing():
    own = tma.Course((0, 0), 5, 0.0, [tma.Straight(300)])
    other = tma.Course((40e3, -7e3), 5, 1.0, [tma.Straight(300)])
    early = tma.Sensor(tma.Bearing(), np.arange(0, 300, 10.0), 0.01, platform=other)
    late = tma.Sensor(tma.Bearing(), np.arange(5, 300, 10.0), 0.01)
    target = tma.Target((45e3, 2e3), 4, 0.0)
    for sensors in ([early, late], [late, early]):
        scenario = tma.Scenario(own, sensors, 290.0, target)
        cloud = tma.cloud_along_first_bearing(scenario, scenario.measure(), (1e3, 2e3), 5.0, 200, 1)
        away = cloud.states[:, :2] - [40e3, -7e3]
        assert np.all(np.abs(np.hypot(*away.T) - 1.5e3) <= 500 + 1e-6)
        assert np.all(np.abs(np.arctan2(*away.T) - np.arctan2(5e3, 9e3)) < 0.06)
