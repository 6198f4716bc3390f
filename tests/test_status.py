"""What a fit says of a run: each word of the vocabulary, where it is known to be true."""

import numpy as np
import pytest
from scipy.optimize import least_squares

import tmalib as tma
from tmalib import status

TIMES = np.arange(0, 600, 10.0)


def ship(turning):
    return tma.Course(
        (0, 0), 6.0, 0.3, [tma.Straight(300), tma.Straight(300, heading=1.5 if turning else 0.3)]
    )


def random_target(rng):
    place = rng.uniform(2e3, 20e3) * np.array([np.sin(a := rng.uniform(0, 6.28)), np.cos(a)])
    return tma.Target(place, rng.uniform(1, 10), rng.uniform(0, 6.28))


def test_bearings_from_a_straight_ship_are_never_converged():
    """Rank three of four, whatever the target, the noise and the start: the classical theorem."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        scenario = tma.Scenario(
            ship(turning=False), [tma.Sensor(tma.Bearing(), TIMES, 0.01)], 600.0, random_target(rng)
        )
        angles = scenario.simulate(10, rng)
        for start in (None, scenario.state, [5e3, 5e3, 0, 0]):
            found = tma.fit(scenario, angles, start)
            assert np.all(found.status == status.NOT_OBSERVABLE)
            assert np.isnan(found.covariance).all()
        assert "rank 3 of 4" in found.explain()
        assert "along (x, y, vx, vy) = (" in found.explain()
        (weakest,) = found.weakest[:1]
        away = found.state[0, :2] - scenario.platform.position_at(600.0)
        off = found.state[0, 2:] - 6.0 * np.array([np.sin(0.3), np.cos(0.3)])
        family = np.array([*away, *off])  # the family of targets: all distances scaled
        assert abs(weakest @ family) == pytest.approx(
            np.linalg.norm(weakest) * np.linalg.norm(family), rel=1e-5
        )


def test_no_minimum_is_said_only_where_the_criterion_is_lowest_at_infinity():
    """The profile of the criterion over the range decides, by scipy's own least squares."""
    rng, seen, ranges = np.random.default_rng(2), 0, np.geomspace(100, 1e8, 13)
    for _ in range(4):
        target = tma.Target((30e3, 40e3), 2.0, rng.uniform(0, 6.28))
        scenario = tma.Scenario(ship(turning=True), [tma.Sensor(tma.Bearing(), TIMES, 0.1)], 600.0, target)
        for run in scenario.simulate(4, rng):
            if tma.fit(scenario, run).status == status.NO_MINIMUM:
                profile = profile_of_range(scenario, run, ranges)
                assert profile.min() > profile[-1] - 1e-2
                seen += 1
    assert seen > 1


def profile_of_range(scenario, run, ranges):
    """The criterion, minimised over direction and velocity at each range from the platform, ``(k,)``."""
    here = scenario.platform.position_at(scenario.reference_time)

    def held(rest, r):
        theta, vx, vy = rest
        state = [here[0] + r * np.sin(theta), here[1] + r * np.cos(theta), vx * r, vy * r]
        return scenario.residual(run, scenario.linearise(state)[0]) / scenario.sigma

    lowest, order = np.full(len(ranges), np.inf), np.arange(len(ranges))
    for velocity in [(0, 0), (3e-3, 0), (-3e-3, 0), (0, 3e-3), (0, -3e-3)]:
        guess = [np.median(run), *velocity]
        for k in [*order, *order[::-1]]:  # from each minimum to that of the next range, there and back
            found = least_squares(held, guess, args=(ranges[k],), x_scale=[0.1, 1e-3, 1e-3])
            guess, lowest[k] = found.x, min(lowest[k], 2 * found.cost)
    return lowest


def test_a_start_from_which_the_steps_run_away():
    """There is a minimum, and a fit without a start finds it: the start is to blame."""
    legs = [tma.Straight(600), tma.Turn(60, -np.pi / 2 / 60), tma.Straight(1140)]
    platform = tma.Course((0, 0), 6.0, np.radians(60), legs)
    ear = tma.Sensor(tma.Bearing(), np.arange(0, 1800, 10.0), np.radians(1))
    scenario = tma.Scenario(platform, [ear], 1800.0, tma.Target((0.0, 9100.0), 4.0, 2.0))
    angles = scenario.simulate(400, seed=1)
    found = tma.fit(scenario, angles, tma.along_first_bearing(scenario, angles, 10e3))
    assert np.sum(found.status == status.RAN_AWAY) > 3
    assert not np.any(found.status == status.NO_MINIMUM), "all have a minimum"
    assert tma.fit(scenario, angles).converged.all()
    assert "Give another start" in found.explain()


def test_every_word_has_advice_or_needs_none():
    for word, advice in status.ADVICE.items():
        assert bool(advice) != (word in (status.CONVERGED, status.FILTERED))
        assert "\n" not in advice


def test_rank_condition_and_weakest_direction_of_a_good_fit(scenario):
    """The condition is that of numpy; along the weakest direction the measurements change least."""
    found = tma.fit(scenario, scenario.simulate(1, seed=3)[0])
    gradient = scenario.linearise(found.state)[1] / scenario.sigma[:, None]
    scaled = gradient / np.linalg.norm(gradient, axis=0)
    assert found.rank == 4
    assert found.condition == pytest.approx(np.linalg.cond(scaled), rel=1e-9)
    unit = found.weakest * np.linalg.norm(gradient, axis=0)
    least = np.linalg.norm(scaled @ unit) / np.linalg.norm(unit)
    assert least == pytest.approx(np.linalg.svd(scaled, compute_uv=False)[-1], rel=1e-9)


def test_filters_speak_the_same_words(scenario):
    """A run that is lost says so in a track, a filter's state, a track of batch estimates; others do not."""
    angles = scenario.simulate(4, seed=5)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    wild = angles.copy()
    wild[2, 30] = np.inf
    words = [status.FILTERED, status.FILTERED, status.NOT_FINITE, status.FILTERED]
    assert list(tma.ekf(scenario, wild, prior).status) == words
    assert list(tma.update(prior, scenario, wild).status) == words
    start = np.tile(scenario.state, (4, 1))
    start[1] = np.inf
    track = tma.fit_over_time(scenario, angles, [400.0, 600.0], start)
    assert list(track.status) == [status.CONVERGED, status.NOT_FINITE, status.CONVERGED, status.CONVERGED]
    np.testing.assert_array_equal(track.finite, [True, False, True, True])


def test_a_particle_filter_speaks_them_too(scenario):
    radar = tma.Scenario(scenario.platform, scenario.sensors[:1], 600.0)
    (run,) = radar.with_target(scenario.target).simulate(1, seed=6)
    cloud = tma.cloud_along_first_bearing(radar, run, (1e3, 20e3), 15.0, 2000, seed=1)
    assert tma.sir(radar, run, cloud, 0.01, seed=2).status == status.FILTERED
    far = run.copy()
    far[20] = np.inf
    assert tma.sir(radar, far, cloud, 0.01, seed=2).status == status.NO_WEIGHT


def test_a_run_without_a_covariance_has_no_ellipse_and_says_why():
    scenario = tma.Scenario(ship(turning=False), [tma.Sensor(tma.Bearing(), TIMES, 0.01)], 600.0)
    angles = scenario.with_target(tma.Target((3e3, 6e3), 4.0, 1.0)).simulate(1, 1)[0]
    with pytest.raises(ValueError, match=r"no ellipse: the run has no covariance; Fit\.explain\(\) says why"):
        tma.fit(scenario, angles).at(900.0).ellipse()


def test_a_target_at_infinity_is_not_observable_from_a_straight_ship():
    """Far out the information is rounding in all directions, and its scaled determinant says nothing."""
    rng, seen = np.random.default_rng(36), 0
    for _ in range(150):
        scenario = tma.Scenario(
            ship(turning=False), [tma.Sensor(tma.Bearing(), TIMES, 0.01)], 600.0, random_target(rng)
        )
        found = tma.fit(scenario, scenario.simulate(20, rng))
        assert np.all(found.status == status.NOT_OBSERVABLE)
        seen += np.sum(np.hypot(*found.state[:, :2].T) > 1e6)
    assert seen > 0
