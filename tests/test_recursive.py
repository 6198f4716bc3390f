from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

import tmalib as tma
from tmalib.papers.emw_acoustic import scenarios as emw


class Linear:
    """A measurement that is linear in the state: a fixed mix of the position at the time."""

    coordinates = ("x", "y", "vx", "vy")

    def __init__(self, weights):
        self.weights = np.array(weights)

    def observer_state(self, platform, times):
        return platform.position_at(times).T

    def value_and_gradient(self, state, site, lag):
        x, y, vx, vy = state
        a, b = self.weights
        value = a * (x + lag * vx - site[0]) + b * (y + lag * vy - site[1])
        one = np.ones_like(value)
        return value, np.stack([a * one, b * one, a * lag * one, b * lag * one])

    def residual(self, measured, predicted):
        return measured - predicted

    def observe(self, target, platform, times):
        return (target.position_at(times) - platform.position_at(times)) @ self.weights


@pytest.fixture
def linear():
    platform = tma.Course((0, 0), 8.0, 1.0, [tma.Straight(100)])
    target = tma.Target((4e3, 5e3), speed=6.0, heading=2.5)
    first = tma.Sensor(Linear([1.0, 0.3]), np.arange(0, 101, 5.0), 20.0)
    second = tma.Sensor(Linear([-0.4, 1.0]), np.arange(0, 101, 10.0), 30.0)
    return tma.Scenario(platform, [first, second], reference_time=100.0, target=target)


PRIOR_COVARIANCE = np.diag([1e6, 2e6, 25.0, 30.0]) + 100.0


def kalman_filter(scenario, measured, mean, covariance):
    """A textbook Kalman filter from another library: prediction steps, joint updates, Joseph form."""
    kalman = KalmanFilter(dim_x=4, dim_z=2)
    kalman.x, kalman.P, kalman.Q = mean.copy(), covariance.copy(), np.zeros((4, 4))
    now = 0.0
    for time in np.unique(scenario.times):
        if time <= 0:
            continue
        kalman.predict(F=tma.transition(time - now))
        now = time
        here = scenario.platform.position_at(time)
        columns = np.flatnonzero(scenario.times == time)
        sensors = [s for s in scenario.sensors if time in s.times]
        h = np.array([[*s.model.weights, 0, 0] for s in sensors])
        z = measured[columns] + h[:, :2] @ here
        kalman.dim_z = len(columns)
        kalman.update(z, R=np.diag(scenario.sigma[columns] ** 2), H=h)
    return kalman.x, kalman.P


def test_equals_a_kalman_filter_on_a_linear_problem(linear):
    measured = linear.simulate(5, seed=1)
    start = replace(linear, reference_time=0.0).state + [300, -200, 1, 2]
    track = tma.ekf(linear, measured, tma.Prior(start, PRIOR_COVARIANCE, 0.0))
    for run in range(5):
        mean, covariance = kalman_filter(linear, measured[run], start, PRIOR_COVARIANCE)
        np.testing.assert_allclose(track.state[run, -1], mean, rtol=1e-8)
        np.testing.assert_allclose(track.covariance[run, -1], covariance, rtol=1e-7)


def test_equals_weighted_least_squares_on_a_linear_problem(linear):
    """Information of prior and measurements simply add."""
    measured = linear.simulate(1, seed=2)[0]
    now = linear.state + [100, 50, -1, 1]
    value, jacobian = linear.linearise(now)
    used = linear.times > 0
    prior = tma.Prior(now, PRIOR_COVARIANCE, 0.0)
    track = tma.ekf(linear, measured, tma.Prior(tma.propagate(now, -100.0), PRIOR_COVARIANCE, 0.0))
    phi = tma.transition(100.0)
    information = np.linalg.inv(phi @ prior.covariance @ phi.T)
    j, e = jacobian[used] / linear.sigma[used, None], (measured - value)[used] / linear.sigma[used]
    total = information + j.T @ j
    np.testing.assert_allclose(track.state[-1], now + np.linalg.solve(total, j.T @ e), rtol=1e-9)
    np.testing.assert_allclose(track.covariance[-1], np.linalg.inv(total), rtol=1e-6)


def dense_ekf(scenario, angles, mean, covariance, record):
    """The recursion of emw-acoustic, Section IV.B, as printed: one run, matrices, joint updates."""
    x, p, now, kept = mean.copy(), covariance.copy(), 0.0, {}
    for time in np.unique(scenario.times):
        if time <= 0:
            continue
        phi = tma.transition(time - now)
        x, p, now = phi @ x, phi @ p @ phi.T, time
        columns = np.flatnonzero(scenario.times == time)
        value, gradient = replace(scenario, reference_time=time).linearise(x)
        h, r = gradient[columns], np.diag(scenario.sigma[columns] ** 2)
        k = p @ h.T @ np.linalg.inv(h @ p @ h.T + r)
        x = x + k @ tma.wrap(angles[columns] - value[columns])
        left = np.eye(4) - k @ h
        p = left @ p @ left.T + k @ r @ k.T
        kept[time] = (x, p)
    return [kept[time] for time in record]


def test_equals_the_printed_recursion(scenario):
    angles = scenario.simulate(4, seed=8)
    start = tma.along_first_bearing(scenario, angles, 6e3)
    covariance = np.diag([3e3**2, 3e3**2, 25.0, 25.0])
    record = [40.0, 300.0, 600.0]
    track = tma.ekf(scenario, angles, tma.Prior(start, covariance, 0.0), record=record)
    for run in range(4):
        for k, (x, p) in enumerate(dense_ekf(scenario, angles[run], start[run], covariance, record)):
            np.testing.assert_allclose(track.state[run, k], x, rtol=1e-7, atol=1e-6)
            np.testing.assert_allclose(track.covariance[run, k], p, rtol=1e-5, atol=1e-6 * np.abs(p).max())


def test_batch_equals_loop(scenario):
    angles = scenario.simulate(6, seed=8)
    prior = tma.Prior(replace(scenario, reference_time=0.0).state, np.diag([1e6, 1e6, 4.0, 4.0]), 0.0)
    whole = tma.ekf(scenario, angles, prior)
    np.testing.assert_allclose(tma.ekf(scenario, angles[4], prior).state, whole.state[4], rtol=1e-12)


def test_only_measurements_after_the_prior_are_used(scenario):
    angles = scenario.simulate(1, seed=8)
    changed = angles.copy()
    changed[:, scenario.times <= 100.0] += 0.5
    prior = tma.Prior(replace(scenario, reference_time=100.0).state, np.diag([1e6, 1e6, 4.0, 4.0]), 100.0)
    np.testing.assert_array_equal(
        tma.ekf(scenario, angles, prior).state, tma.ekf(scenario, changed, prior).state
    )


def test_consistent_with_a_good_prior(scenario):
    rng = np.random.default_rng(3)
    covariance = np.diag([50.0**2, 50.0**2, 0.3**2, 0.3**2])
    truth = replace(scenario, reference_time=0.0).state
    runs = 2000
    start = truth + rng.normal(size=(runs, 4)) * np.sqrt(np.diag(covariance))
    track = tma.ekf(scenario, scenario.simulate(runs, seed=4), tma.Prior(start, covariance, 0.0))
    nees = tma.nees(track.state[:, -1], scenario.state, track.covariance[:, -1])
    assert nees.mean() == pytest.approx(4, rel=0.1)


def test_a_diverged_run_is_flagged_and_stays(scenario):
    angles = scenario.simulate(3, seed=8)
    angles[1, 5] = np.inf
    prior = tma.Prior(replace(scenario, reference_time=0.0).state, np.diag([1e6, 1e6, 4.0, 4.0]), 0.0)
    track = tma.ekf(scenario, angles, prior)
    np.testing.assert_array_equal(track.finite, [True, False, True])
    assert track.state.shape == (3, 1, 4)


# -- modified polar coordinates ---------------------------------------------------------------------


def polar_move(y, step, before, after):
    """Modified polar coordinates a time ``step`` later, about another origin, in the chart's own terms.

    The direction to the target from the new origin is that of u + step (a u + b u') - rho m.
    """
    theta, rho, a, b = y
    u, across = np.array([np.sin(theta), np.cos(theta)]), np.array([np.cos(theta), -np.sin(theta)])
    velocity = a * u + b * across  # over range, as are all lengths here
    d = u + step * velocity - rho * (after - before)
    length2 = d @ d
    radial, transverse = velocity @ d, velocity[0] * d[1] - velocity[1] * d[0]
    return np.array([np.arctan2(*d), rho / np.sqrt(length2), radial / length2, transverse / length2])


def polar_filter(scenario, angles, mean, covariance, time, q=0.0):
    """The textbook filter, one run: state in modified polar coordinates, Jacobian by finite differences.

    White acceleration of density ``q`` is added to the predicted state, in these coordinates.
    """
    place = scenario.platform.position_at
    chart = tma.ModifiedPolar(place(time))
    y = chart.from_state(mean)
    back = np.linalg.inv(chart.jacobian(y))
    p, now = back @ covariance @ back.T, time
    for k in np.flatnonzero(scenario.times > time):
        then = scenario.times[k]
        f = np.empty((4, 4))
        for i, h in enumerate(np.array([1e-5, 1e-5 * y[1], 1e-8, 1e-8])):
            e = h * np.eye(4)[i]
            ends = [polar_move(y + s * e, then - now, place(now), place(then)) for s in (1, -1)]
            f[:, i] = (ends[0] - ends[1]) / (2 * h)
        y, p, t, now = polar_move(y, then - now, place(now), place(then)), f @ p @ f.T, then - now, then
        back = np.linalg.inv(tma.ModifiedPolar(place(now)).jacobian(y))
        p = p + back @ np.kron(q * np.array([[t**3 / 3, t**2 / 2], [t**2 / 2, t]]), np.eye(2)) @ back.T
        gain = p[:, 0] / (p[0, 0] + scenario.sigma[k] ** 2)  # the bearing is the first coordinate
        y = y + gain * tma.wrap(angles[k] - y[0])
        p = p - np.outer(gain, p[0])
    chart = tma.ModifiedPolar(place(now))
    return chart.to_state(y), chart.jacobian(y) @ p @ chart.jacobian(y).T


@pytest.fixture
def bearings(scenario):
    """The shared scenario with its instantaneous bearings alone."""
    return replace(scenario, sensors=scenario.sensors[:1])


@pytest.mark.parametrize("q", [0.0, 1e-3])
def test_modified_polar_equals_the_textbook_filter(bearings, q):
    """Finite differences of second order leave 1e-9 of the Jacobian a step."""
    angles = bearings.simulate(3, seed=8)
    prior = tma.prior_along_first_bearing(bearings, angles, 5e3, 2e3, 10.0)
    noise = tma.ProcessNoise(q)
    track = tma.ekf(bearings, angles, prior, chart=tma.ModifiedPolar, process_noise=noise)
    cartesian = tma.ekf(bearings, angles, prior, process_noise=noise)
    for run in range(3):
        mean, covariance = polar_filter(
            bearings, angles[run], prior.mean[run], prior.covariance[run], prior.time, q
        )
        scale = np.sqrt(np.diag(covariance))
        np.testing.assert_allclose(track.state[run, -1] / scale, mean / scale, atol=1e-4)
        off = (track.covariance[run, -1] - covariance) / np.outer(scale, scale)
        assert np.abs(off).max() < 1e-4
        assert np.abs((cartesian.state[run, -1] - mean) / scale).max() > 0.1, "another filter"


def test_inverse_jacobian_of_the_chart():
    rng = np.random.default_rng(5)
    chart = tma.ModifiedPolar((100.0, -200.0))
    states = rng.normal(size=(50, 4)) * [1e4, 1e4, 10, 10]
    points = chart.from_state(states)
    product = chart.inverse_jacobian(points) @ chart.jacobian(points)
    scale = 1 / np.abs(points).max(axis=0)  # a coordinate in units of its size
    np.testing.assert_allclose(
        product * scale[:, None] / scale, np.broadcast_to(np.eye(4), (50, 4, 4)), atol=1e-10
    )
    assert np.isnan(chart.inverse_jacobian(np.array([0.1, -1e-4, 0.0, 0.0]))).any()


def test_modified_polar_reaches_the_batch_estimate(bearings):
    """Sharp bearings and a prior 30 times as wide as the bound: the maximum of the likelihood.

    The prior is off by 30 standard deviations times a Gaussian number, below 4 here, and has 1 / 900 of
    the weight: it pulls by less than 4 / 30. The rest is second order in sigma.
    """
    sharp = replace(bearings, sensors=[tma.Sensor(tma.Bearing(), bearings.times, 1e-5)])
    angles, bound = sharp.simulate(20, seed=8), tma.crlb(sharp)
    wrong = np.random.default_rng(2).standard_normal((20, 4)).clip(-4, 4)
    start = tma.propagate(sharp.state + 30 * wrong @ np.linalg.cholesky(bound).T, -601.0)
    back = tma.transition(-601.0)
    prior = tma.Prior(start, 900 * back @ bound @ back.T, -1.0)
    track = tma.ekf(sharp, angles, prior, chart=tma.ModifiedPolar)
    difference = track.state[:, -1] - tma.fit(sharp, angles, sharp.state).state
    assert np.sqrt(tma.nees(difference, 0.0, bound)).max() < 2 * 4 / 30, "over four coordinates"
    scale = np.sqrt(np.diag(bound))
    off = (track.covariance[:, -1] - bound) / np.outer(scale, scale)
    assert np.abs(off).max() < 0.01


def test_modified_polar_is_cartesian_for_small_steps(bearings):
    """With a prior s times as wide the two part by s^2: to first order the change of chart is linear."""
    truth = replace(bearings, reference_time=0.0).state
    spread = np.array([500.0, 500.0, 1.0, 1.0])
    apart = []
    for scale in (1e-2, 1e-3):
        start = truth + scale * spread
        prior = tma.Prior(start, np.diag((scale * spread) ** 2), 0.0)
        tracks = [tma.ekf(bearings, bearings.measure(), prior, chart=c) for c in (None, tma.ModifiedPolar)]
        apart.append(np.abs((tracks[0].state[-1] - tracks[1].state[-1]) / spread).max())
    assert apart[0] < 1e-4
    assert apart[1] < apart[0] / 50


def test_cartesian_chart_is_no_chart(scenario):
    """Both kinds of bearings, two at a time."""
    angles = scenario.simulate(3, seed=8)
    prior = tma.Prior(replace(scenario, reference_time=0.0).state, np.diag([1e6, 1e6, 4.0, 4.0]), 0.0)

    with_, without = (tma.ekf(scenario, angles, prior, chart=chart) for chart in (tma.Cartesian, None))
    np.testing.assert_allclose(with_.state, without.state, rtol=1e-9)
    np.testing.assert_allclose(with_.covariance, without.covariance, rtol=1e-6, atol=1e-6)
    both = tma.ekf(scenario, angles, prior, chart=tma.ModifiedPolar)
    assert tma.nees(both.state[:, -1], scenario.state, both.covariance[:, -1]).max() < 30


def test_a_run_without_range_is_reported_and_stays_alone(bearings):
    """Inverse range leaves the chart where one bearing, a radian off, carries it below zero.

    Runs of one batch differ from single ones by rounding, here of a calm filter: a unit in the last place of
    its prior grows 2000-fold, to 1e-12.
    """
    angles, k = bearings.simulate(40, seed=8), 30
    wild = np.arange(40) % 3 == 0
    angles[wild, k] -= 1.0
    prior = tma.prior_along_first_bearing(bearings, angles, 6e3, 1e3, 3.0)
    record = bearings.times[1:]
    whole = tma.ekf(bearings, angles, prior, record=record, chart=tma.ModifiedPolar)
    np.testing.assert_array_equal(whole.finite, ~wild)
    for run in range(40):
        own = tma.Prior(prior.mean[run], prior.covariance[run], prior.time)
        alone = tma.ekf(bearings, angles[run], own, record=record, chart=tma.ModifiedPolar)
        np.testing.assert_allclose(alone.state, whole.state[run], rtol=1e-9)
        bad = np.isnan(whole.state[run]).any(axis=-1)
        np.testing.assert_array_equal(bad, wild[run] & (record >= bearings.times[k]), "NaN from there on")
    for run in (0, 1):  # the textbook filter loses the same run, at the same bearing
        for last in (k - 1, k):
            mean, _ = polar_filter(
                bearings.until(bearings.times[last]), angles[run, : last + 1], prior.mean[run],
                prior.covariance[run], prior.time,
            )  # fmt: skip
            assert np.isnan(mean).any() == (wild[run] and last == k)


def test_a_wide_start_near_the_platform_loses_range(bearings):
    """Of its own, without an outlier; not compared in digits: a run within a metre amplifies 1e10-fold."""
    angles = bearings.simulate(40, seed=8)
    prior = tma.prior_along_first_bearing(bearings, angles, 600.0, 600.0, 30.0)
    track = tma.ekf(bearings, angles, prior, record=bearings.times[1:], chart=tma.ModifiedPolar)
    bad = np.isnan(track.state).any(axis=-1)
    assert 0 < bad[:, -1].sum() < 40
    np.testing.assert_array_equal(track.finite, ~bad[:, -1])
    assert np.all(bad[:, 1:] >= bad[:, :-1]), "NaN from there on"


def test_prior_along_first_bearing(scenario):
    angles = scenario.simulate(3, seed=8)
    prior = tma.prior_along_first_bearing(scenario, angles, 5e3, 2e3, 10.0)
    chart = tma.ModifiedPolar(scenario.platform.position_at(0.0))
    points = chart.from_state(prior.mean)
    back = chart.inverse_jacobian(points)
    polar = back @ prior.covariance @ back.mT
    wanted = np.array([scenario.sigma[0], 2e3 / 5e3**2, 10 / 5e3, 10 / 5e3])
    np.testing.assert_allclose(points, [[theta, 1 / 5e3, 0, 0] for theta in angles[:, 0]], atol=1e-15)
    np.testing.assert_allclose(
        polar / np.outer(wanted, wanted), np.broadcast_to(np.eye(4), (3, 4, 4)), atol=1e-9
    )
    assert prior.time == 0.0
    for bad in ((0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, -1.0)):
        with pytest.raises(ValueError, match="must be greater than 0"):
            tma.prior_along_first_bearing(scenario, angles, *bad)


def test_filter_of_the_tables_differs_only_at_radar_only_instants():
    scenario = emw.scenario(1)
    value, gradient = scenario.linearise(scenario.state)
    other_value, other_gradient = emw.filter_scenario(scenario, "tables").linearise(scenario.state)
    np.testing.assert_array_equal(other_value, value)
    radar = slice(0, 1200)
    with_sonar = np.isin(scenario.times[radar], scenario.sensors[1].times)
    changed = np.any(other_gradient[radar] != gradient[radar], axis=1)
    np.testing.assert_array_equal(changed, ~with_sonar)
    late = replace(scenario, sensors=[tma.Sensor(tma.DelayedBearing(), scenario.sensors[0].times, 1.0)])
    delayed = late.linearise(scenario.state)[1]
    np.testing.assert_allclose(other_gradient[radar][~with_sonar], delayed[~with_sonar])


@pytest.mark.parametrize(
    ("prior", "options", "message"),
    [
        ((np.zeros(4), np.eye(3), 0.0), {}, "symmetric"),
        ((np.zeros(4), np.diag([1.0, 1, 1, -1]), 0.0), {}, "positive definite"),
        ((np.zeros(4), np.eye(4) + np.eye(4, k=1), 0.0), {}, "symmetric"),
        ((0.0, 1.0, 0.0), {}, "symmetric"),
        ((np.zeros(3), np.eye(3), 0.0), {}, "prior must have the components"),
        ((np.zeros(4), np.eye(4), np.nan), {}, "prior time must be finite"),
        ((np.zeros(4), np.eye(4), 0.0, ("x", "y")), {}, "coordinates must name the 4"),
        ((np.zeros(4), np.eye(4), 0.0, ("x", "y", "vx", "z")), {}, "prior must have the components"),
        ((np.zeros(4), np.eye(4), 0.0, ("vx", "vy", "x", "y")), {}, "in this order"),
        ((np.zeros(5), np.eye(5), 0.0, ("x", "y", "vx", "vy", "bias")), {}, "in this order"),
        ((np.zeros(4), np.eye(4), 0.0), {"record": [3.0, 2.0]}, "strictly increasing"),
        ((np.zeros(4), np.eye(4), 0.0), {"gate": 1.0}, "gate must be a probability"),
        ((np.zeros(4), np.eye(4), 9.0), {"record": [3.0], "process_noise": tma.ProcessNoise(1.0)}, "record"),
        ((np.zeros(4), np.eye(4), 0.0), {"process_noise": tma.ProcessNoise(0, {"bias": 1.0})}, "walks must"),
    ],
)
def test_bad_input(scenario, prior, options, message):
    with pytest.raises(ValueError, match=message):
        tma.ekf(scenario, scenario.measure(), tma.Prior(*prior), **options)
