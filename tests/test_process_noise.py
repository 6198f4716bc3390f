"""Process noise in `ekf`: against matrix exponentials, Gaussian regression, another filter, and the truth."""

import numpy as np
import pytest
from filterpy.common import Q_continuous_white_noise
from filterpy.kalman import KalmanFilter
from linear_sensors import NAMES, LinearWithBias
from scipy.linalg import expm
from scipy.stats import chi2, kstest

import tmalib as tma

NOISE = tma.ProcessNoise(0.3, {"bias": 0.7})
MEAN, SPREAD = np.array([100.0, 200.0, 5.0, -3.0, 2.0]), np.diag([40.0, 30.0, 4.0, 3.0, 5.0]) ** 2 + 1.0


@pytest.fixture(scope="module")
def linear():
    """Two sensors, one of them at every second time, uneven steps; the reference time is in between."""
    platform = tma.Course((0, 0), 8.0, 1.0, [tma.Straight(20)])
    times = np.array([1.0, 2.0, 2.5, 4.0, 5.0, 7.0, 8.0])
    first = tma.Sensor(LinearWithBias(1.0, 0.3, 1.0), times, 5.0)
    second = tma.Sensor(LinearWithBias(-0.4, 1.0, 0.0), times[::2], 4.0)
    return tma.Scenario(platform, [first, second], 4.5)


def drawn(scenario, runs, seed):
    """Measurements of targets that the noise disturbs, and their states at each of the times."""
    rng = np.random.default_rng(seed)
    now, state = 0.0, rng.multivariate_normal(MEAN, SPREAD, runs)
    measured, at = np.empty((runs, len(scenario.times))), {}
    for time in np.unique(scenario.times):
        for _ in range(10):  # in small steps, which the filter does not make
            step = (time - now) / 10
            state = tma.propagate(state, step, NAMES)
            state = state + rng.multivariate_normal(np.zeros(5), exponential(step), runs)
        now, at[time] = time, state
        for block in scenario.blocks:
            for i in np.flatnonzero(block.sensor.times == time):
                site = np.append(scenario.platform.position_at(time), [0, 0, 0])
                noise = block.sensor.sigma * rng.standard_normal(runs)
                measured[:, block.columns.start + i] = (state - site) @ block.sensor.model.row() + noise
    return measured, at


def exponential(duration, q=0.3, walk=0.7):
    """The covariance that white noise adds, by Van Loan's matrix exponential."""
    drift, spread = np.zeros((5, 5)), np.diag([0.0, 0.0, q, q, walk])
    drift[0, 2] = drift[1, 3] = 1.0
    whole = expm(np.block([[-drift, spread], [np.zeros((5, 5)), drift.T]]) * duration)
    return whole[5:, 5:].T @ whole[:5, 5:]


@pytest.mark.parametrize("duration", [0.0, 0.3, 17.0])
def test_covariance(duration):
    np.testing.assert_allclose(NOISE.covariance(duration, NAMES), exponential(duration), rtol=1e-10)
    other = Q_continuous_white_noise(2, dt=duration, spectral_density=0.3, block_size=2, order_by_dim=False)
    np.testing.assert_allclose(NOISE.covariance(duration, NAMES)[:4, :4], other, rtol=1e-12)


def test_components_are_found_by_name():
    order = ("bias", "vy", "z", "x", "vx", "y")
    mixed = NOISE.covariance(3.0, order)
    places = [order.index(name) for name in NAMES]
    np.testing.assert_array_equal(mixed[np.ix_(places, places)], NOISE.covariance(3.0, NAMES))
    assert not mixed[order.index("z")].any(), "not named: it stays"
    assert tma.ProcessNoise(walks={"z": 2.0}).covariance(3.0, order)[2, 2] == 6.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((-1.0,), "acceleration must be at least 0"),
        ((np.nan,), "acceleration must be finite"),
        ((0.0, {"vx": 1.0}), "walks must name components other than"),
        ((0.0, {"bias": -1.0}), r"walks\['bias'\] must be at least 0"),
    ],
)
def test_bad_noise(arguments, message):
    with pytest.raises(ValueError, match=message):
        tma.ProcessNoise(*arguments)


def test_bad_duration():
    with pytest.raises(ValueError, match="duration must be at least 0"):
        NOISE.covariance(-1.0, NAMES)


def kalman(scenario, measured, record):
    """Another library's filter, with prediction steps and joint updates; innovations squared of each time."""
    exact = KalmanFilter(dim_x=5, dim_z=2)
    exact.x, exact.P, now, kept, squares = MEAN.copy(), SPREAD.copy(), 0.0, [], {}
    for time in np.union1d(scenario.times, record):
        exact.predict(F=tma.transition(time - now, NAMES), Q=exponential(time - now))
        now, columns = time, np.flatnonzero(scenario.times == time)
        if len(columns):
            h = np.array([s.model.row() for s in scenario.sensors if time in s.times])
            z = measured[columns] + h[:, :2] @ scenario.platform.position_at(time)
            exact.dim_z = len(columns)
            exact.update(z, R=np.diag(scenario.sigma[columns] ** 2), H=h)
            squares[time] = exact.mahalanobis**2
        if time in record:
            kept.append((exact.x.copy(), exact.P.copy()))
    return *map(np.array, zip(*kept, strict=True)), squares


def test_equals_a_kalman_filter(linear):
    """At, between and after the measurements, two of them at one time, and the reference time in between."""
    measured, _ = drawn(linear, 4, seed=1)
    record = [0.0, 0.5, 4.0, 4.3, 8.0, 11.0]
    track = tma.ekf(linear, measured, tma.Prior(MEAN, SPREAD, 0.0), record=record, process_noise=NOISE)
    for run in range(4):
        mean, covariance, squares = kalman(linear, measured[run], record)
        np.testing.assert_allclose(track.state[run], mean, rtol=1e-9)
        np.testing.assert_allclose(track.covariance[run], covariance, rtol=1e-8)
        for time, square in squares.items():
            assert track.nis[run, linear.times == time].sum() == pytest.approx(square, rel=1e-8)
    assert track.used.all()
    assert track.finite.all()


def test_equals_gaussian_regression(linear):
    """No recursion: the joint Gaussian of all measurements and the last state, from integrated white noise.

    For s <= t an integral of a random walk of density q has the covariance ``q s^2 (3 t - s) / 6`` with
    itself, the walk ``q s`` with itself, and walk at s and integral at t ``q s (2 t - s) / 2``.
    """
    measured, _ = drawn(linear, 1, seed=2)
    end, times = 8.0, linear.times

    def disturbance(s, t):  # of the state at s and at t, s <= t
        place, cross, early = s**2 * (3 * t - s) / 6, s * (2 * t - s) / 2, s**2 / 2
        block = 0.3 * np.array([[place, early], [cross, s]])  # rows: at s, columns: at t
        whole = np.zeros((5, 5))
        whole[:4, :4], whole[4, 4] = np.kron(block, np.eye(2)), 0.7 * s
        return whole

    def between(s, t):
        if s > t:
            return between(t, s).T
        phi_s, phi_t = tma.transition(s, NAMES), tma.transition(t, NAMES)
        return phi_s @ SPREAD @ phi_t.T + disturbance(s, t)

    rows = np.concatenate([np.tile(s.model.row(), (len(s), 1)) for s in linear.sensors])
    own = np.array([[a @ between(s, t) @ b for t, b in zip(times, rows, strict=True)]
                    for s, a in zip(times, rows, strict=True)])  # fmt: skip
    cross = np.array([between(end, t) @ b for t, b in zip(times, rows, strict=True)]).T
    expected = [tma.propagate(MEAN, t, NAMES) @ b - linear.platform.position_at(t) @ b[:2]
                for t, b in zip(times, rows, strict=True)]  # fmt: skip
    gain = cross @ np.linalg.inv(own + np.diag(linear.sigma**2))
    mean = tma.propagate(MEAN, end, NAMES) + gain @ (measured[0] - expected)
    track = tma.ekf(linear, measured[0], tma.Prior(MEAN, SPREAD, 0.0), record=[end], process_noise=NOISE)
    np.testing.assert_allclose(track.state[0], mean, rtol=1e-8)
    np.testing.assert_allclose(track.covariance[0], between(end, end) - gain @ cross.T, rtol=1e-7, atol=1e-7)


def test_is_consistent_where_targets_are_disturbed(linear):
    """Errors and innovations have the size that the filter says, and without noise they have not."""
    runs = 1000
    measured, at = drawn(linear, runs, seed=3)
    prior, record = tma.Prior(MEAN, SPREAD, 0.0), np.unique(linear.times)
    track = tma.ekf(linear, measured, prior, record=record, process_noise=NOISE)
    stiff = tma.ekf(linear, measured, prior, record=record)
    low, high = tma.nees_limits(5, runs, 0.9999)
    for k, time in enumerate(record):
        assert low < tma.nees(track.state[:, k], at[time], track.covariance[:, k]).mean() < high
    assert tma.nees(stiff.state[:, -1], at[8.0], stiff.covariance[:, -1]).mean() > 1.3 * high
    assert kstest(track.nis.ravel(), chi2(1).cdf).pvalue > 1e-3, "independent of one another, chi-square"


@pytest.mark.parametrize("chart", [None, tma.ModifiedPolar])
def test_is_consistent_with_bearings_and_ranges(chart):
    """A disturbed target, well seen; its course is wrong for a filter without process noise."""
    runs, q, sigma = 600, 0.05, np.array([0.002, 10.0])
    rng = np.random.default_rng(5)
    times = np.arange(0.0, 301.0, 10.0)
    ship = tma.Course((0, 0), 8.0, 1.0, [tma.Straight(301)])
    truth = np.array([3e3, 4e3, 5.0, -4.0])
    spread = np.diag([50.0, 50.0, 2.0, 2.0]) ** 2
    state, seen = rng.multivariate_normal(truth, spread, runs), []
    fine = np.linalg.cholesky(exponential(1.0, q)[:4, :4])
    for time in times[1:]:
        for _ in range(10):
            state = tma.propagate(state, 1.0) + rng.standard_normal((runs, 4)) @ fine.T
        gap = state[:, :2] - ship.position_at(time)
        seen.append(
            np.stack([np.arctan2(*gap.T), np.hypot(*gap.T)]) + sigma[:, None] * rng.standard_normal((2, runs))
        )
    measured = np.moveaxis(seen, -1, 0)  # (runs, times, 2)
    measured = np.concatenate([measured[..., 0], measured[..., 1]], axis=1)
    sensors = [tma.Sensor(tma.Bearing(), times[1:], sigma[0]), tma.Sensor(tma.Range(), times[1:], sigma[1])]
    watch = tma.Scenario(ship, sensors, 300.0)
    prior = tma.Prior(truth, spread, 0.0)
    track = tma.ekf(watch, measured, prior, chart=chart, process_noise=tma.ProcessNoise(q))
    stiff = tma.ekf(watch, measured, prior, chart=chart)
    low, high = tma.nees_limits(4, runs, 0.9999)
    assert low < tma.nees(track.state[:, -1], state, track.covariance[:, -1]).mean() < high
    assert tma.nees(stiff.state[:, -1], state, stiff.covariance[:, -1]).mean() > 10 * high
    assert track.nis.mean() == pytest.approx(1.0, abs=4 * np.sqrt(2 / track.nis.size))
    assert stiff.nis.mean() > 2


@pytest.mark.parametrize("chart", [None, tma.ModifiedPolar])
def test_little_noise_is_nearly_none(scenario, chart):
    """The difference goes with q, and no noise is none."""
    angles = scenario.simulate(5, seed=8)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    plain = tma.ekf(scenario, angles, prior, chart=chart)
    scale = np.sqrt(np.diagonal(plain.covariance, axis1=-2, axis2=-1))

    def apart(q):
        track = tma.ekf(scenario, angles, prior, chart=chart, process_noise=tma.ProcessNoise(q))
        return np.abs((track.state - plain.state) / scale).max()

    assert apart(0.0) < 1e-9
    assert 1e-4 < apart(1e-6) < 0.1
    assert apart(1e-7) == pytest.approx(apart(1e-6) / 10, rel=0.05)
