"""A memory of bounded size against the batch estimate of all measurements."""

from dataclasses import replace

import numpy as np
import pytest
from random_scenarios import FAMILIES, random_scenario

import tmalib as tma
from tmalib.remembered import condense, line_at_gauss_nodes


def apart(track_or_fit, fit, bound):
    """Distance of two estimates in standard deviations of the bound, ``(runs,)``.

    Its mean square is what the one adds to the NEES of the other, which is 4: 0.4 is a tenth, and half of
    that in root mean square errors.
    """
    return np.sqrt(tma.nees(track_or_fit - fit.state, np.zeros(fit.state.shape[-1]), bound))


def heard_one_by_one(scenario, angles, **options):
    """`refit` at one time after the other."""
    known, most = None, 0
    for time in np.unique(scenario.times):
        columns = scenario.columns_between(time, time)
        known = tma.refit(known, scenario.between(time, time), angles[..., columns], **options)
        most = max(most, known.kept)
    return known, most


@pytest.mark.parametrize("seed", range(20))
def test_two_values_tell_of_a_line_what_all_tell(seed):
    """Weighted least squares of a line by the nodes, and by all: the same estimate and covariance."""
    rng = np.random.default_rng(seed)
    times, weights = np.sort(rng.uniform(0, 50, 9) ** 2), rng.uniform(0.2, 5, 9)
    values = rng.normal(size=9)
    nodes, sharper, line = line_at_gauss_nodes(times, weights)
    assert times[0] <= nodes[0] < nodes[1] <= times[-1]

    def least_squares(t, w, v):
        design = np.stack([np.ones_like(t), t], axis=-1) * np.sqrt(w)[:, None]
        return np.linalg.lstsq(design, v * np.sqrt(w))[0], np.linalg.inv(design.T @ design)

    for ours, theirs in zip(
        least_squares(nodes, sharper, line @ values), least_squares(times, weights, values), strict=True
    ):
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9)
    for power in range(4):
        np.testing.assert_allclose(sharper @ nodes**power, weights @ times**power, rtol=1e-9)
    covariance = line / weights @ line.T
    np.testing.assert_allclose(covariance, np.diag(1 / sharper), atol=1e-9)


def test_values_of_one_time_become_their_mean():
    nodes, weights, line = line_at_gauss_nodes(np.full(3, 7.0), np.array([1.0, 1.0, 2.0]))
    assert (nodes.tolist(), weights.tolist()) == ([7.0], [4.0])
    np.testing.assert_allclose(line @ [1.0, 2.0, 4.0], [2.75])


def test_condensing_perfect_measurements_with_the_truth_gives_perfect_measurements(scenario):
    """Curved ones: what is lost by a line is given back by the prediction. Without an estimate it is not."""
    exact = scenario.measure()[None]
    few, values = condense(scenario, exact, scenario.state[None], np.array([True]), 16)
    np.testing.assert_allclose(values[0], few.measure(), rtol=1e-12)
    assert [len(sensor) for sensor in few.sensors] == [8, 8]
    unaided = condense(scenario, exact, np.full((1, 4), np.nan), np.array([False]), 16)[1]
    assert np.abs(unaided[0] - few.measure()).max() > 1e-5


def test_all_at_once_is_the_batch_estimate(scenario):
    """More than ten times as many measurements as are kept."""
    radar, sonar = scenario.sensors
    many = replace(radar, times=np.arange(0, 600.5, 0.5))
    dense = replace(scenario, sensors=[many, replace(sonar, times=np.arange(0, 601, 4.0))])
    angles = dense.simulate(200, seed=4)
    times = np.array([300.0, 450.0, 600.0])
    track = tma.running_fit(dense, angles, times)
    for k, time in enumerate(times):
        then = dense.until(time)
        whole = tma.fit(then, angles[:, dense.columns_until(time)], then.state)
        assert (track.finite[:, k] & whole.converged).all()
        assert np.sqrt(np.mean(apart(track.state[:, k], whole, tma.crlb(then)) ** 2)) < 0.1
        ours = np.sqrt(np.diagonal(track.covariance[:, k], axis1=1, axis2=2))
        np.testing.assert_allclose(np.median(ours / whole.sigma, axis=0), 1, atol=0.02)


def test_it_does_not_matter_how_often_it_is_asked(scenario):
    angles = scenario.simulate(10, seed=8)
    angles[1, [5, 40, 70]] = np.nan
    known, most = heard_one_by_one(scenario, angles, most=16)
    at_once = tma.running_fit(scenario, angles, most=16)
    whole = tma.fit(scenario, angles)
    assert most <= 32
    assert known.converged.all()
    assert at_once.finite.all()
    bound = tma.crlb(scenario)
    assert np.mean(apart(known.state, whole, bound) ** 2) < 0.1
    assert np.mean(apart(at_once.state[:, 0], whole, bound) ** 2) < 0.1


def test_few_measurements_are_kept_as_they_are(scenario):
    """Then it is the batch estimate and nothing else."""
    angles = scenario.simulate(4, seed=8)
    angles[2, 13] = np.nan
    track = tma.running_fit(scenario, angles, [200, 400, 600])
    for k, time in enumerate(track.times):
        then = scenario.until(time)
        whole = tma.fit(then, angles[:, scenario.columns_until(time)])
        both = track.finite[:, k] & whole.converged
        assert both.sum() >= (0 if time < 400 else 4)
        assert np.all(
            apart(track.state[both, k], replace(whole, state=whole.state[both]), tma.crlb(then)) < 1e-2
        )


def test_runs_with_other_gaps_do_not_change_each_other(scenario):
    angles = scenario.simulate(4, seed=8)
    angles[1, 20:30] = angles[2, 60] = np.nan
    angles[3] = np.nan
    track = tma.running_fit(scenario, angles, [300, 600], most=16)
    assert not track.finite[3].any()
    for run in range(3):
        alone = tma.running_fit(scenario, angles[run], [300, 600], most=16)
        np.testing.assert_allclose(track.state[run], alone.state, rtol=1e-6)
        np.testing.assert_allclose(track.covariance[run], alone.covariance, rtol=1e-5)


@pytest.mark.parametrize("family", FAMILIES)
def test_random_scenarios(family):
    """No run is lost where the batch estimate finds its minimum, and the two agree.

    In the air, where a tenth of a degree meets a platform that turns at 500 km/h, least.
    """
    rng = np.random.default_rng(FAMILIES.index(family))
    distance = []
    for _ in range(4):
        scenario = random_scenario(rng, family)
        angles = scenario.simulate(5, seed=1)
        track, whole = tma.running_fit(scenario, angles), tma.fit(scenario, angles)
        assert track.finite[whole.converged].all()
        distance.extend(apart(track.state[:, 0], whole, tma.crlb(scenario))[whole.converged])
    assert np.mean(np.square(distance)) < 0.4


def test_a_target_that_cannot_be_ranged_has_no_estimate():
    """One leg and instantaneous bearings; the estimate comes with the manoeuvre."""
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    ear = tma.Sensor(tma.Bearing(), np.arange(0, 600, 2.0), 0.005)
    scenario = tma.Scenario(ship, [ear], 598.0, tma.Target((2e3, 4e3), 6, 1.5))
    track = tma.running_fit(scenario, scenario.simulate(20, seed=1), [-5.0, 200.0, 598.0])
    assert not track.finite[:, :2].any()
    assert np.isnan(track.state[:, :2]).all()
    assert track.finite[:, 2].all()


def test_another_unknown_is_estimated():
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    sensors = [
        tma.Sensor(tma.Biased(tma.Bearing(), "offset"), np.arange(0, 600, 2.0), 0.01, "ear"),
        tma.Sensor(tma.Bearing(), np.arange(1, 600, 2.0), 0.01, "eye"),
    ]
    watch = tma.Scenario(ship, sensors, 599.0)
    assert len(watch.coordinates) == 5
    truth = tma.Scenario(
        ship, [replace(s, model=tma.Bearing()) for s in sensors], 599.0, tma.Target((2e3, 4e3), 6, 1.5)
    )
    angles = truth.simulate(10, seed=2)
    angles[:, : len(sensors[0])] += 0.05
    track, whole = tma.running_fit(watch, angles), tma.fit(watch, angles)
    assert whole.converged.all()
    assert apart(track.state[:, 0], whole, whole.covariance).max() < 0.3


def test_a_sensor_that_comes_later_with_an_unknown_of_its_own():
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    eye = tma.Sensor(tma.Bearing(), np.arange(0, 400, 2.0), 0.01, "eye")
    ear = tma.Sensor(tma.Biased(tma.Bearing(), "offset"), np.arange(401, 600, 2.0), 0.01, "ear")
    target = tma.Target((2e3, 4e3), 6, 1.5)
    first = tma.Scenario(ship, [eye], 398.0, target)
    second = tma.Scenario(ship, [replace(ear, model=tma.Bearing())], 599.0, target)
    early, late = first.simulate(5, seed=1), second.simulate(5, seed=2) + 0.05
    known = tma.refit(tma.refit(None, first, early), tma.Scenario(ship, [ear], 599.0), late)
    both = tma.Scenario(ship, [eye, ear], 599.0)
    whole = tma.fit(both, np.concatenate([early, late], axis=1))
    assert known.coordinates == both.coordinates
    assert known.converged.all()
    assert apart(known.state, whole, whole.covariance).max() < 0.3


def test_a_range_alone_needs_a_start():
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    sonar = tma.Sensor(tma.Range(), np.arange(0, 600, 2.0), 20.0)
    scenario = tma.Scenario(ship, [sonar], 598.0, tma.Target((2e3, 4e3), 6, 1.5))
    measured = scenario.simulate(5, seed=1)
    with pytest.raises(ValueError, match="start"):
        tma.running_fit(scenario, measured)
    start = scenario.state + [300.0, -200.0, 0.5, 0.5]
    track = tma.running_fit(scenario, measured, [400, 598], start=start)
    whole = tma.fit(scenario, measured, start)
    assert apart(track.state[:, -1], whole, tma.crlb(scenario)).max() < 0.3


def test_an_estimate_is_carried_to_another_time(scenario):
    known = tma.refit(None, scenario, scenario.simulate(2, seed=1))
    later = known.at(900.0)
    np.testing.assert_allclose(later.state[:, :2], known.state[:, :2] + 300 * known.state[:, 2:])
    phi = tma.transition(300.0)
    np.testing.assert_allclose(later.covariance, phi @ known.covariance @ phi.T)
    assert known.time == 600.0


def refused(scenario, change):
    angles = scenario.measure()
    known = tma.refit(None, scenario.between(0, 300), angles[scenario.columns_between(0, 300)])
    later = scenario.between(300.5, 600)
    values = angles[scenario.columns_between(300.5, 600)]
    if change == "runs":
        return tma.refit(known, later, np.stack([values, values]))
    if change == "before":
        return tma.refit(known, scenario.between(200, 600), angles[scenario.columns_between(200, 600)])
    if change == "kind":
        sensors = [replace(s, model=tma.DelayedBearing(1500.0)) for s in later.sensors]
        return tma.refit(known, replace(later, sensors=sensors, target=None), values)
    if change == "names":
        return tma.refit(None, replace(later, sensors=[replace(s, name="a") for s in later.sensors]), values)
    if change == "sigma":
        return tma.refit(
            None, replace(later, sensors=[replace(s, sigma=None) for s in later.sensors]), values
        )
    return tma.refit(None, later, values, most=4)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ("runs", "measurements must be of runs"),
        ("before", "must not measure before"),
        ("kind", "one kind of model"),
        ("names", "different names"),
        ("sigma", "sigma of"),
        ("most", "most must be"),
    ],
)
def test_what_is_refused(scenario, change, match):
    with pytest.raises(ValueError, match=match):
        refused(scenario, change)
