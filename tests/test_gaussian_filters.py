"""The updates of a mean and a covariance, against filterpy, scipy, exact answers and draws."""

from itertools import pairwise

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter, JulierSigmaPoints, UnscentedKalmanFilter
from linear_sensors import NAMES, LinearWithBias
from scipy.optimize import minimize

import tmalib as tma
from tmalib.gaussian_updates import UPDATES, cholesky

ALL = tuple(UPDATES)


def prior_of(scenario, angles):
    return tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)


def in_sigmas(ours, theirs, covariance):
    scale = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    return np.max(np.abs(ours - theirs) / scale)


def of_filterpy(scenario, angles, prior, make):
    """A filter of filterpy for one run, of the state at the reference time: nothing moves between."""
    back = tma.transition(scenario.reference_time - prior.time)
    filter_ = make()
    filter_.x, filter_.P = back @ prior.mean, back @ prior.covariance @ back.T
    order = np.argsort(scenario.times, kind="stable")
    for i in order[scenario.times[order] > prior.time]:
        block = next(b for b in scenario.blocks if b.columns.start <= i < b.columns.stop)
        k = i - block.columns.start
        site, lag = block.observer[:, k], block.elapsed[k]
        filter_.R = np.array([[block.sensor.sigma**2]])
        measure(filter_, block, site, lag, angles[i])
    return filter_.x, filter_.P


def measure(filter_, block, site, lag, angle):
    def value(x):
        return np.atleast_1d(block.predict(x, site, lag)[0])

    def wrapped(a, b):
        return np.atleast_1d(tma.wrap(a - b))

    if isinstance(filter_, ExtendedKalmanFilter):
        filter_.update(
            np.array([angle]), lambda x: block.predict(x, site, lag)[1][None], value, residual=wrapped
        )
    else:
        filter_.predict(fx=lambda x, dt: x)
        filter_.hx, filter_.residual_z = value, wrapped
        filter_.update(np.array([angle]))


def unscented():
    points = JulierSigmaPoints(4, kappa=0.0)
    found = UnscentedKalmanFilter(4, 1, 1.0, lambda x: x, lambda x, dt: x, points)
    found.Q = np.zeros((4, 4))
    return found


@pytest.mark.parametrize(
    ("update", "make"), [("extended", lambda: ExtendedKalmanFilter(4, 1)), ("cubature", unscented)]
)
def test_filterpy_gives_the_same(scenario, update, make):
    """Two kinds of bearings; one run after the other, measurement by measurement."""
    angles = scenario.simulate(3, seed=8)
    prior = prior_of(scenario, angles)
    track = tma.gaussian_filter(scenario, angles, prior, update=update)
    for run in range(3):
        one = tma.Prior(prior.mean[run], prior.covariance[run], prior.time)
        x, p = of_filterpy(scenario, angles[run], one, make)
        scale = np.sqrt(np.diag(p))
        assert in_sigmas(track.state[run, 0], x, p) < 1e-9
        assert np.max(np.abs(track.covariance[run, 0] - p) / np.outer(scale, scale)) < 1e-9


def test_the_extended_update_is_that_of_ekf_for_measurements_of_different_times(scenario):
    angles = scenario.simulate(4, seed=3)
    angles[1, 20] = np.nan
    alone = scenario.keep(np.arange(len(scenario.times)) < len(scenario.sensors[0]))
    angles = angles[:, : len(alone.times)]
    prior = prior_of(alone, angles)
    ours = tma.gaussian_filter(alone, angles, prior, [300, 600], update="extended")
    theirs = tma.ekf(alone, angles, prior, [300, 600])
    assert in_sigmas(ours.state, theirs.state, theirs.covariance) < 1e-9
    np.testing.assert_allclose(ours.nis, theirs.nis, rtol=1e-6)


@pytest.mark.parametrize("update", ALL)
@pytest.mark.parametrize("noise", [None, tma.ProcessNoise(1e-3)])
def test_a_linear_sensor_has_the_kalman_filter_s_answer(update, noise):
    """All updates are the same then: the joint Gaussian, conditioned; with noise, that of `ekf`."""
    rng = np.random.default_rng(5)
    ship = tma.Course((0, 0), 5, 0.3, [tma.Straight(100)])
    sensors = [
        tma.Sensor(LinearWithBias(*rng.normal(size=3)), np.arange(5.0 + i, 100, 9), 2.0, f"{i}")
        for i in range(3)
    ]
    scenario = tma.Scenario(ship, sensors, 99.0)
    root = rng.normal(size=(5, 5))
    prior = tma.Prior(rng.normal(size=5), root @ root.T + np.eye(5), 0.0, NAMES)
    measured = rng.normal(size=(2, len(scenario.times)))
    track = tma.gaussian_filter(scenario, measured, prior, update=update, process_noise=noise)
    exact = tma.ekf(scenario, measured, prior, process_noise=noise)
    if noise is None:
        phi = tma.transition(99.0, NAMES)
        mean, p = phi @ prior.mean, phi @ prior.covariance @ phi.T
        value, h = scenario.linearise(mean)
        s = h @ p @ h.T + 4 * np.eye(len(h))
        gain = np.linalg.solve(s, h @ p).T
        np.testing.assert_allclose(
            track.state[:, 0], mean + (measured - value) @ gain.T, rtol=1e-6, atol=1e-6
        )
        np.testing.assert_allclose(track.covariance[0, 0], p - gain @ h @ p, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(track.state, exact.state, rtol=1e-5, atol=1e-5)


def bent(rows):
    """A scalar measurement of a scalar: ``x + x^2 / 2``."""
    return rows[0] + rows[0] ** 2 / 2, np.stack([1 + rows[0]])


def updated(update, x, variance, measured, sigma, predict=bent):
    def offset(value, of=None):
        return measured - value if of is None else value - of

    return UPDATES[update](np.array([[x]]), np.array([[[variance]]]), predict, offset, sigma)


def test_the_iterated_update_of_a_linear_scalar_uses_the_prior_once():
    """A mean 1 with variance 4, and 3 measured with variance 1: (1/4 + 3) / (1/4 + 1) in all passes."""
    found = updated("iterated", 1.0, 4.0, 3.0, 1.0, lambda rows: (rows[0], np.ones((1, *rows[0].shape))))
    np.testing.assert_allclose(found.mean, 2.6, rtol=1e-14)
    np.testing.assert_allclose(found.covariance, 0.8, rtol=1e-14)


@pytest.mark.parametrize("measured", [-0.3, 0.2, 2.0, 6.0])
def test_the_iterated_update_ends_at_the_most_probable_state(measured):
    def criterion(x):
        return (x[0] - 0.5) ** 2 / 0.3 + (measured - x[0] - x[0] ** 2 / 2) ** 2 / 0.04

    best = minimize(criterion, [0.5], method="Nelder-Mead", options=dict(xatol=1e-9, fatol=1e-12)).x
    np.testing.assert_allclose(updated("iterated", 0.5, 0.3, measured, 0.2).mean[0], best, atol=1e-6)


def test_second_order_and_cubature_have_the_moments_of_a_parabola():
    """For x ~ N(m, v): the mean of x + x^2/2 is m + m^2/2 + v/2, its variance (1 + m)^2 v + v^2/2."""
    m, v = 0.5, 0.3
    found = updated("second-order", m, v, 2.0, 0.2)
    np.testing.assert_allclose(found.innovation, 2.0 - (m + m**2 / 2 + v / 2), rtol=1e-9)
    np.testing.assert_allclose(found.variance, (1 + m) ** 2 * v + v**2 / 2 + 0.04, rtol=1e-7)
    points = updated("cubature", m, v, 2.0, 0.2)
    np.testing.assert_allclose(points.innovation, found.innovation, rtol=1e-9)
    np.testing.assert_allclose(points.variance, (1 + m) ** 2 * v + 0.04, rtol=1e-9)


def test_the_second_order_update_of_a_bearing_has_its_mean_and_variance():
    """Against a million draws of the predicted bearing; a range of 3 km known to 400 m, 5 km off the axes."""
    rng = np.random.default_rng(3)
    ear = tma.Bearing()
    mean, root = np.array([2e3, 3e3, 4.0, -2.0]), np.diag([500.0, 300.0, 1.0, 1.0]) + np.eye(4, k=-1) * 0.3
    p = root @ root.T

    def predict(rows):
        return ear.value_and_gradient(rows, np.zeros(2), 20.0)

    def offset(value, of=None):
        return 0.7 - value if of is None else value - of

    found = UPDATES["second-order"](mean[:, None], p[..., None], predict, offset, 0.0)
    draws = predict((mean + rng.normal(size=(1_000_000, 4)) @ root.T).T)[0]
    first = UPDATES["extended"](mean[:, None], p[..., None], predict, offset, 0.0)
    error = draws.std() / 1e3
    assert (
        abs(0.7 - found.innovation[0] - draws.mean())
        < 0.1 * abs(0.7 - first.innovation[0] - draws.mean()) + 4 * error
    )
    assert abs(found.variance[0] / draws.var() - 1) < abs(first.variance[0] / draws.var() - 1)


@pytest.mark.parametrize("update", ALL)
def test_a_run_does_not_depend_on_the_runs_beside_it(scenario, update):
    angles = scenario.simulate(5, seed=8)
    angles[2, 30] = np.nan
    prior = prior_of(scenario, angles)
    lost = tma.Prior(
        prior.mean, np.where(np.arange(5)[:, None, None] == 4, np.nan, prior.covariance), prior.time
    )
    track = tma.gaussian_filter(scenario, angles, lost, [200, 600], update=update)
    assert np.array_equal(track.finite, [True] * 4 + [False])
    assert not track.used[2, 30]
    few = tma.Prior(prior.mean[1:3], prior.covariance[1:3], prior.time)
    alone = tma.gaussian_filter(scenario, angles[1:3], few, [200, 600], update=update)
    np.testing.assert_array_equal(alone.state, track.state[1:3])
    np.testing.assert_array_equal(alone.covariance, track.covariance[1:3])


def test_cholesky_is_numpy_s_and_nan_where_there_is_none():
    rng = np.random.default_rng(2)
    roots = rng.normal(size=(6, 4, 4))
    p = roots @ roots.mT
    p[3, 2, 2] = -1.0
    found = np.moveaxis(cholesky(np.moveaxis(p, 0, -1)), -1, 0)
    good = [0, 1, 2, 4, 5]
    np.testing.assert_allclose(found[good], np.linalg.cholesky(p[good]), rtol=1e-9)
    assert np.isnan(found[3]).any()


def test_a_bank_of_one_is_its_filter(scenario):
    angles = scenario.simulate(3, seed=8)
    bank = tma.range_bank(scenario, angles, [4e3, 8e3], 5.0, [300, 600])
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 4e3 / np.sqrt(12), 5.0)
    alone = tma.gaussian_filter(scenario, angles, prior, [300, 600])
    np.testing.assert_allclose(bank.state, alone.state, rtol=1e-12)
    np.testing.assert_allclose(bank.covariance, alone.covariance, rtol=1e-12)


def test_the_moments_of_a_bank_are_those_of_its_mixture(scenario):
    """Weights from the innovations that `ekf`-like tracks report, drawn from as a mixture."""
    angles = scenario.simulate(2, seed=8)[1]
    edges = np.array([3e3, 5e3, 8e3])
    bank = tma.range_bank(scenario, angles, edges, 5.0, [120.0], update="extended")
    tracks, fits = [], []
    for low, high in pairwise(edges):
        prior = tma.prior_along_first_bearing(
            scenario, angles, (low + high) / 2, (high - low) / np.sqrt(12), 5.0
        )
        tracks.append(tma.gaussian_filter(scenario, angles, prior, [120.0], update="extended"))
        until = scenario.until(120.0)
        order = np.argsort(until.times, kind="stable")
        order = order[until.times[order] > prior.time]
        fits.append(log_likelihood(until, angles[scenario.columns_until(120.0)], prior, order))
    weights = np.exp(np.array(fits) - max(fits))
    weights /= weights.sum()
    assert weights.min() > 0.02  # else nothing is mixed
    rng = np.random.default_rng(0)
    which = rng.choice(2, size=400_000, p=weights)
    parts = [rng.multivariate_normal(t.state[0], t.covariance[0], size=len(which)) for t in tracks]
    draws = np.where((which == 0)[:, None], *parts)
    error = in_sigmas(draws.mean(axis=0), bank.state[0], bank.covariance[0])
    assert error < 5 / np.sqrt(len(which))
    np.testing.assert_allclose(
        np.sqrt(np.diag(np.cov(draws.T))), np.sqrt(np.diag(bank.covariance[0])), rtol=0.01
    )


def log_likelihood(scenario, angles, prior, order):
    """Of the measurements, one by one, by textbook matrices at the time itself."""
    x, p, now, total = prior.mean, prior.covariance, prior.time, 0.0
    for i in order:
        one = scenario.keep(np.arange(len(angles)) == i)
        time = scenario.times[i]
        phi = tma.transition(time - now)
        x, p, now = phi @ x, phi @ p @ phi.T, time
        value, h = tma.Scenario(one.platform, one.sensors, time).linearise(x)
        s = (h @ p @ h.T)[0, 0] + one.sigma[0] ** 2
        nu = tma.wrap(angles[i] - value[0])
        gain = p @ h[0] / s
        x, p = x + gain * nu, p - np.outer(gain, gain) * s
        total -= (nu**2 / s + np.log(2 * np.pi * s)) / 2
    return total


@pytest.mark.parametrize("edges", [[1e3], [2e3, 1e3], [0.0, 1e3], [1e3, 1e3]])
def test_edges_that_are_none(scenario, edges):
    with pytest.raises(ValueError, match="edges"):
        tma.range_bank(scenario, scenario.measure(), edges, 5.0)


def test_another_update_is_refused(scenario):
    angles = scenario.measure()
    with pytest.raises(ValueError, match="update must be one of"):
        tma.gaussian_filter(scenario, angles, prior_of(scenario, angles), update="particle")
