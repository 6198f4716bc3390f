"""One measurement at a time, gates and missing measurements."""

from dataclasses import replace

import numpy as np
import pytest
from linear_sensors import NAMES, LinearWithBias
from scipy.stats import binomtest, chi2

import tmalib as tma

CHARTS = [None, tma.ModifiedPolar]


def one_after_the_other(scenario, angles, prior, **options):
    """`update` at one time after the other; what it says of each measurement."""
    found = prior
    nis, used = np.full(angles.shape, np.nan), np.zeros(angles.shape, dtype=bool)
    for time in np.unique(scenario.times[scenario.times > prior.time]):
        columns = scenario.columns_between(time, time)
        found = tma.update(found, scenario.between(time, time), angles[..., columns], **options)
        nis[..., columns], used[..., columns] = found.nis, found.used
    return found, nis, used


def assert_same(found, track, rtol=1e-7):
    """In standard deviations: a filter of many steps amplifies rounding."""
    scale = np.sqrt(np.diagonal(track.covariance[..., -1, :, :], axis1=-2, axis2=-1))
    np.testing.assert_allclose(found.mean / scale, track.state[..., -1, :] / scale, rtol=rtol, atol=rtol)
    product = scale[..., :, None] * scale[..., None, :]
    np.testing.assert_allclose(
        found.covariance / product, track.covariance[..., -1, :, :] / product, atol=rtol
    )


@pytest.mark.parametrize("noise", [None, tma.ProcessNoise(1e-3)])
@pytest.mark.parametrize("chart", CHARTS)
@pytest.mark.parametrize("batch", [(), (3,), (2, 2)])
def test_one_after_the_other_is_all_at_once(scenario, chart, noise, batch):
    """Two kinds of bearings, some at the same time, some missing, some far off."""
    angles = scenario.simulate(4, seed=8)
    angles[0, 5] = angles[1, 64] = np.nan
    angles[0, 17] += 0.3
    angles = angles[: int(np.prod(batch))].reshape(*batch, -1)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    options = dict(process_noise=noise, gate=0.999, chart=chart)
    track = tma.ekf(scenario, angles, prior, **options)
    found, nis, used = one_after_the_other(scenario, angles, prior, **options)
    assert_same(found, track)
    assert found.mean.shape == (*batch, 4)
    assert found.time == 600.0
    np.testing.assert_array_equal(used, track.used)
    np.testing.assert_allclose(nis, track.nis, rtol=1e-5, atol=1e-7)
    assert not used.reshape(-1, 77)[0, [5, 17]].any()


def test_a_scenario_of_many_times_is_taken_in_order(scenario):
    angles = scenario.simulate(3, seed=8)
    later = scenario.between(1.0, np.inf)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    found = tma.update(prior, later, angles[:, scenario.columns_between(1.0, np.inf)])
    assert_same(found, tma.ekf(scenario, angles, prior))
    assert found.nis.shape == found.used.shape == (3, 75)


def test_a_sensor_that_sees_a_part_of_the_state(scenario):
    """A biased compass and an ear that has no bias, at other times: the state is of both."""
    compass = tma.Sensor(tma.Biased(tma.Bearing(), "compass"), np.arange(0, 600, 20.0), 0.01)
    ear = tma.Sensor(tma.DelayedBearing(1500.0), np.arange(5, 601, 35.0), 0.01)
    both = replace(scenario, sensors=[compass, ear])
    angles = both.simulate(3, seed=4)
    prior = tma.prior_along_first_bearing(both, angles, 6e3, 2e3, 5.0, others={"compass": (0.0, 0.02)})
    options = dict(process_noise=tma.ProcessNoise(1e-3, {"compass": 1e-7}), chart=tma.ModifiedPolar)
    found, _, used = one_after_the_other(both, angles, prior, **options)
    assert both.between(5.0, 5.0).coordinates == ("x", "y", "vx", "vy")
    assert found.coordinates == ("x", "y", "vx", "vy", "compass")
    assert used[:, 1:].all()
    assert_same(found, tma.ekf(both, angles, prior, record=[found.time], **options))


def test_two_updates_at_one_time_are_a_joint_one_where_all_is_linear():
    platform = tma.Course((0, 0), 8.0, 1.0, [tma.Straight(20)])
    sensors = [tma.Sensor(LinearWithBias(*w), [3.0], 5.0) for w in ((1, 0.3, 1), (-0.4, 1, 0))]
    both, *each = (tma.Scenario(platform, s, 0.0) for s in (sensors, sensors[:1], sensors[1:]))
    prior = tma.Prior(np.arange(5.0), np.diag([40.0, 30.0, 4.0, 3.0, 5.0]), 0.0, NAMES)
    joint = tma.update(prior, both, [3.0, 4.0])
    one = tma.update(tma.update(prior, each[0], [3.0]), each[1], [4.0])
    np.testing.assert_allclose(one.mean, joint.mean, rtol=1e-12)
    np.testing.assert_allclose(one.covariance, joint.covariance, rtol=1e-10, atol=1e-12)


def test_predict_is_a_track_without_measurements(scenario):
    angles, noise = scenario.simulate(3, seed=8), tma.ProcessNoise(0.01)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    track = tma.ekf(scenario, angles, prior, record=[9.0], process_noise=noise)
    ahead = tma.predict(tma.predict(prior, 4.0, noise), 9.0, noise)
    assert_same(ahead, track, 1e-10)
    assert (ahead.nis, ahead.used) == (None, None)
    assert ahead.finite.all()
    np.testing.assert_array_equal(tma.predict(prior, 0.0).mean, prior.mean)


@pytest.mark.parametrize("chart", CHARTS)
@pytest.mark.parametrize("column", [4, 61 + 1, 5])  # two of one time, and one alone
def test_a_missing_measurement_is_missing_for_its_run_only(scenario, chart, column):
    angles = scenario.simulate(3, seed=8)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    whole = tma.ekf(scenario, angles, prior, chart=chart)
    stay = np.arange(77) != column
    fewer = replace(scenario, sensors=[
        replace(b.sensor, times=b.sensor.times[stay[b.columns]]) for b in scenario.blocks
    ])  # fmt: skip
    own = replace(prior, mean=prior.mean[1], covariance=prior.covariance[1])
    told = tma.ekf(fewer, angles[1:2, stay], own, chart=chart)
    angles[1, column] = np.nan
    track = tma.ekf(scenario, angles, prior, chart=chart)
    scale = np.sqrt(np.diagonal(told.covariance[0, 0]))
    np.testing.assert_allclose(track.state[1] / scale, told.state[0] / scale, rtol=1e-9)
    np.testing.assert_allclose(track.covariance[1], told.covariance[0], rtol=1e-6)
    np.testing.assert_array_equal(track.state[[0, 2]], whole.state[[0, 2]])
    assert track.finite.all()
    assert np.isnan(track.nis[1, column])
    np.testing.assert_array_equal(np.argwhere(~track.used & (scenario.times > 0)), [[1, column]])


def test_missing_from_all_runs_is_as_if_never_taken(scenario):
    """A row of NaN, in the chart whose round trip is not exact."""
    angles = scenario.simulate(2, seed=8)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    angles[:, scenario.times > 300] = np.nan
    for chart in CHARTS:
        track = tma.ekf(scenario, angles, prior, chart=chart, record=[300.0, 600.0])
        phi = tma.transition(300.0)
        np.testing.assert_allclose(track.state[:, 1], tma.propagate(track.state[:, 0], 300.0), rtol=1e-12)
        np.testing.assert_allclose(track.covariance[:, 1], phi @ track.covariance[:, 0] @ phi.T, rtol=1e-8)


def gated(scenario, runs, gate, seed):
    """Share of clean first measurements that the gate stops."""
    truth = replace(scenario, reference_time=0.0).state
    covariance = np.diag([5.0, 5.0, 0.1, 0.1]) ** 2
    mean = np.random.default_rng(seed).multivariate_normal(truth, covariance, runs)
    now = scenario.between(10.0, 10.0)
    angles = scenario.simulate(runs, seed + 1)[:, scenario.columns_between(10.0, 10.0)]
    return tma.update(tma.Prior(mean, covariance, 0.0), now, angles, gate=gate)


@pytest.mark.parametrize("gate", [0.5, 0.9, 0.99])
def test_a_gate_stops_its_share_of_clean_measurements(scenario, gate):
    """And those that it stops change nothing."""
    found = gated(scenario, 5000, gate, seed=1)
    stopped = int(np.sum(~found.used))
    assert binomtest(stopped, 5000, 1 - gate).pvalue > 1e-3
    np.testing.assert_array_equal(found.used, found.nis <= chi2.ppf(gate, 1))
    free = gated(scenario, 5000, None, seed=1)
    assert free.used.all()
    np.testing.assert_array_equal(free.nis, found.nis)
    inside = found.used[:, 0]
    np.testing.assert_array_equal(found.mean[inside], free.mean[inside])
    assert np.all(found.covariance[~inside, 0, 0] > free.covariance[~inside, 0, 0])


@pytest.mark.parametrize("chart", CHARTS)
def test_a_measurement_outside_the_gate_is_a_missing_one(scenario, chart):
    angles = scenario.simulate(4, seed=8)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    angles[:2, 30] += 0.4
    track = tma.ekf(scenario, angles, prior, chart=chart, gate=1 - 1e-9)
    np.testing.assert_array_equal(np.argwhere(~track.used[:, 1:61]), [[0, 29], [1, 29]])
    assert np.all(track.nis[:2, 30] > 100)
    angles[:2, 30] = np.nan
    missing = tma.ekf(scenario, angles, prior, chart=chart, gate=1 - 1e-9)
    np.testing.assert_array_equal(track.state, missing.state)
    np.testing.assert_array_equal(track.covariance, missing.covariance)


def test_a_gate_keeps_one_wild_bearing_from_ruining_a_track(scenario):
    """What a user gets of it, over 200 runs: errors as the filter says. The prior suits an EKF."""
    angles = scenario.simulate(200, seed=8)
    covariance = np.diag([50.0, 50.0, 0.3, 0.3]) ** 2
    truth = replace(scenario, reference_time=0.0).state
    mean = np.random.default_rng(1).multivariate_normal(truth, covariance, 200)
    prior = tma.Prior(mean, covariance, 0.0)
    angles[:, 30] += 0.5
    low, high = tma.nees_limits(4, 200, 0.9999)
    for gate, right in ((None, False), (0.9999, True)):
        track = tma.ekf(scenario, angles, prior, gate=gate)
        value = tma.nees(track.state[:, 0], scenario.state, track.covariance[:, 0]).mean()
        assert (low < value < high) == right


def test_a_lost_run_stays_alone(scenario):
    """Without a number in its prior, or with an infinite bearing; no call raises."""
    angles = scenario.simulate(4, seed=8)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    whole, _, _ = one_after_the_other(scenario, angles, prior)
    mean, covariance, far = prior.mean.copy(), prior.covariance.copy(), angles.copy()
    mean[0], covariance[1], far[2, 20] = np.nan, np.nan, np.inf
    lost = tma.Prior(mean, covariance, 0.0)
    for chart in CHARTS:
        found, _, _ = one_after_the_other(scenario, far, lost, chart=chart)
        np.testing.assert_array_equal(found.finite, [False, False, False, True])
        np.testing.assert_array_equal(tma.ekf(scenario, far, lost, chart=chart).finite, found.finite)
    found, _, _ = one_after_the_other(scenario, far, lost)
    np.testing.assert_array_equal(found.mean[3], whole.mean[3])


def test_bad_calls(scenario):
    prior, now = tma.Prior(np.ones(4), np.eye(4), 20.0), scenario.between(10.0, 10.0)
    for call, message in (
        (lambda: tma.update(prior, now, [0.1]), "must not measure before the prior's time"),
        (lambda: tma.update(prior, scenario.between(40, 40), [0.1]), "measurements must have shape"),
        (lambda: tma.update(prior, scenario.between(40, 40), [0.1, 0.1], gate=0.0), "gate must be a probab"),
        (lambda: tma.predict(prior, 10.0), "time must not be before"),
        (lambda: tma.predict(prior, np.nan), "time must be finite"),
        (lambda: tma.predict(tma.Prior(np.ones(5), np.eye(5), 0.0), 1.0), "prior must have coordinates"),
    ):
        with pytest.raises(ValueError, match=message):
            call()


@pytest.mark.parametrize("chart", CHARTS)
def test_a_missing_measurement_needs_no_bearing(scenario, chart):
    """An estimate right on the platform has no modified polar coordinates; nothing is asked of them."""
    now = scenario.between(40.0, 40.0)
    mean = np.array([[*scenario.platform.position_at(40.0), 0.0, 0.0], [3e3, 4e3, 1.0, 2.0]])
    prior = tma.Prior(mean, np.eye(4), 40.0)
    found = tma.update(prior, now, [[np.nan, np.nan], [0.64, 0.64]], chart=chart)
    np.testing.assert_array_equal(found.mean[0], mean[0])
    np.testing.assert_array_equal(found.covariance[0], np.eye(4))
    assert found.used.tolist() == [[False, False], [True, True]]
    assert found.finite.all()


@pytest.mark.parametrize("chart", CHARTS)
def test_no_run_and_no_time(scenario, chart):
    angles = scenario.simulate(2, seed=8)
    prior = tma.prior_along_first_bearing(scenario, angles[:0], 6e3, 2e3, 5.0)
    track = tma.ekf(scenario, angles[:0], prior, chart=chart, gate=0.99)
    assert (track.state.shape, track.used.shape, track.finite.shape) == ((0, 1, 4), (0, 77), (0,))
    found, nis, _ = one_after_the_other(scenario, angles[:0], prior, chart=chart)
    assert (found.mean.shape, nis.shape) == ((0, 4), (0, 77))
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    track = tma.ekf(scenario, angles, prior, record=[], chart=chart)
    assert (track.state.shape, track.covariance.shape, track.used.shape) == ((2, 0, 4), (2, 0, 4, 4), (2, 77))
