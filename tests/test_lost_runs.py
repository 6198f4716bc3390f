"""One lost run beside others: nothing raises, nothing hides, nothing else moves, not by a bit."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.bounds import whitened_jacobian

BATCHED = [whitened_jacobian, tma.fisher_information, tma.information_rank, tma.crlb, tma.crlb_sigma]
SEEDS = range(6)


def random_scenario(rng):
    """One turn, one or two sensors; the target is a few kilometres away."""
    legs = [tma.Straight(200), tma.Turn(200, rng.uniform(0.003, 0.02)), tma.Straight(200)]
    platform = tma.Course((0, 0), rng.uniform(3, 12), rng.uniform(0, 6), legs)
    target = tma.Target(rng.uniform(4e3, 8e3, 2), rng.uniform(0, 8), rng.uniform(0, 6))
    sensors = [
        tma.Sensor(tma.DelayedBearing(1500.0), np.arange(0, 601, float(rng.integers(5, 40))), 0.01),
        tma.Sensor(tma.Bearing(), np.arange(0, 601, float(rng.integers(5, 40))), 0.02),
    ]
    return tma.Scenario(platform, sensors[: rng.integers(1, 3)], 600.0, target)


def lost_states(scenario):
    """States without a bound: not numbers, overflow, no observable distance, at rest on the platform."""
    lost = np.tile(scenario.state, (7, 1))
    lost[0, 2], lost[1, 0], lost[2, :2], lost[3, 1], lost[4, :2], lost[5] = (
        np.nan, np.inf, 1e200, -1e160, 1e25, [*scenario.platform.position_at(scenario.times[-1]), 0, 0],
    )  # fmt: skip
    lost[6, :2], lost[6, 2:] = 1e30, np.nan
    return lost


@pytest.mark.parametrize("seed", SEEDS)
def test_the_bound_of_a_batch_with_lost_states(seed):
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng)
    good = scenario.state + rng.normal(size=(5, 4)) * [200, 200, 0.5, 0.5]
    good[4, :2] *= 1e5  # far away and still observable
    lost = lost_states(scenario)
    order = rng.permutation(12)
    states = np.concatenate([good, lost])[order]
    kept = order < 5
    rank = tma.information_rank(scenario, states)
    assert np.all(rank[kept] == 4)
    assert np.all(rank[~kept] < 4)
    assert np.all(rank[np.isin(order, [5, 6, 10, 11])] == -1), "no gradient"
    for function in BATCHED:
        found, alone = function(scenario, states), function(scenario, good)
        np.testing.assert_array_equal(found[kept], alone[order[kept]])
        one = np.stack([function(scenario, state) for state in good])
        np.testing.assert_array_equal(alone, one, err_msg="each on its own")
        square = function(scenario, states.reshape(3, 4, 4))
        np.testing.assert_array_equal(square.reshape(found.shape), found)
    assert np.isnan(tma.crlb(scenario, states)[~kept]).all()
    assert np.isnan(tma.crlb_sigma(scenario, states)[~kept]).all()
    assert np.isnan(tma.fisher_information(scenario, states)[rank == -1]).all()
    assert not np.isnan(tma.fisher_information(scenario, states)[rank >= 0]).any()
    assert tma.crlb(scenario, lost).shape == (7, 4, 4), "all of them lost"
    assert tma.crlb(scenario, states[:0]).shape == (0, 4, 4)


def test_with_too_few_measurements_every_member_is_nan(scenario):
    few = tma.Scenario(scenario.platform, [tma.Sensor(tma.Bearing(), [0.0, 9.0], 0.1)], 9.0, scenario.target)
    assert np.isnan(tma.crlb(few, np.tile(few.state, (3, 1)))).all()
    np.testing.assert_array_equal(tma.information_rank(few, [few.state, np.full(4, np.nan)]), [2, -1])


@pytest.mark.parametrize("function", BATCHED)
def test_a_single_lost_state_raises(scenario, function):
    here = scenario.platform.position_at(scenario.reference_time)
    with pytest.raises(ValueError, match="state must be finite, got"):
        function(scenario, [1.0, np.nan, 0.0, 0.0])
    with pytest.raises(ValueError, match="no finite gradient at the state"):
        function(scenario, [*here, 1.0, 1.0])


@pytest.mark.parametrize("seed", SEEDS)
def test_the_message_names_the_direction_that_is_not_observable(seed):
    """Seen from a straight course: along the relative state, which only scales the distance."""
    rng = np.random.default_rng(seed)
    course = tma.Course((0, 0), 8.0, rng.uniform(0, 6), [tma.Straight(600)])
    target = tma.Target(rng.uniform(4e3, 8e3, 2), rng.uniform(1, 8), rng.uniform(0, 6))
    sensor = tma.Sensor(tma.Bearing(), np.arange(0, 601, 10.0), 0.01)
    scenario = tma.Scenario(course, [sensor], float(rng.uniform(0, 600)), target)
    with pytest.raises(ValueError, match=r"rank 3 of 4; .* along \(x, y, vx, vy\) = \(") as caught:
        tma.crlb(scenario)
    found = np.array(str(caught.value).rstrip(")").rsplit("(", 1)[1].split(","), dtype=float)
    gap = target.position_at([0.0, 1.0]) - course.position_at([0.0, 1.0])
    velocity = gap[1] - gap[0]
    relative = np.concatenate([gap[0] + scenario.reference_time * velocity, velocity])
    np.testing.assert_allclose(found, relative / relative[np.argmax(np.abs(relative))], rtol=5e-3, atol=1e-9)


def random_covariances(rng, runs, n):
    root = rng.normal(size=(runs, n, n)) * np.array([1e3, 1e2, 1e-2, 1e-3, 30.0])[:n]
    return root.mT @ root


@pytest.mark.parametrize("n", [1, 2, 4, 5])
def test_nees_of_lost_runs_is_nan(n):
    rng = np.random.default_rng(n)
    covariance, state = random_covariances(rng, 16, n), rng.normal(size=(16, n))
    plain = tma.nees(state, np.zeros(n), covariance)
    expected = [x @ np.linalg.inv(p) @ x for x, p in zip(state, covariance, strict=True)]
    np.testing.assert_allclose(plain, expected, rtol=1e-6)
    lost, bad = covariance.copy(), state.copy()
    lost[1, 0, -1], lost[2, 0, 0], lost[3] = np.nan, np.inf, 0.0
    lost[4] *= -1  # negative definite
    lost[5] = np.outer(state[5], state[5])  # of rank one
    lost[6, 0, 0] = -lost[6, 0, 0]
    bad[7, 0], bad[8, -1], bad[9] = np.nan, np.inf, 1e200
    gone = np.arange(16) < 10
    gone[0] = False
    gone[5] = n > 1
    found = tma.nees(bad, np.zeros(n), lost)
    assert np.isnan(found[gone]).all()
    kept = ~gone & (np.arange(16) != 5)
    np.testing.assert_array_equal(found[kept], plain[kept])
    one = [tma.nees(*run) for run in zip(bad, np.zeros((16, n)), lost, strict=True)]
    np.testing.assert_array_equal(found, one)


@pytest.mark.parametrize("small", [1e-9, 1e-13, 1e-15, 0.0, -1e-15, -1e-9])
def test_nees_near_a_singular_covariance_is_right_or_nan(small):
    """``[[1, r], [r, 1]]`` has the eigenvalues 1 + r and 1 - r along (1, 1) and (1, -1)."""
    r = 1 - small
    covariance = np.array([[1.0, r], [r, 1.0]])
    found = tma.nees([0.5, -0.5], [0.0, 0.0], covariance)
    if small >= 1e-13:
        assert found == pytest.approx(0.5 / (1.0 - r), rel=1e-2)
    else:
        assert np.isnan(found)


def test_nees_names_a_covariance_of_the_wrong_shape():
    with pytest.raises(ValueError, match=r"covariance must have shape \(..., 4, 4\), got \(4, 3\)"):
        tma.nees(np.zeros((2, 4)), np.zeros(4), np.zeros((4, 3)))


def test_ellipse_of_what_is_not_a_covariance():
    hole = np.eye(4)
    hole[0, 1] = np.nan
    for covariance, message in [
        (hole, "covariance of the position must be finite"),
        (np.full((2, 2), np.inf), "must be finite"),
        (np.ones(4), "covariance of the position must have shape"),
        (np.ones((3, 4, 4)), "must have shape"),
        (np.diag([1.0, -1e-9]), "positive semi-definite"),
    ]:
        with pytest.raises(ValueError, match=message):
            tma.confidence_ellipse(np.zeros(4), covariance)
    with pytest.raises(ValueError, match="centre must have shape"):
        tma.confidence_ellipse(0.0, np.eye(2))
    hole[0, 1], hole[3, 3] = 0.0, np.nan
    assert tma.confidence_ellipse(np.zeros(4), hole).area > 0, "only the position's block is used"
    for angle in np.linspace(0, 3, 50):  # a line: singular, and its eigenvalue may round below zero
        along = np.array([np.sin(angle), np.cos(angle)])
        axes = tma.confidence_ellipse((0, 0), 1e6 * np.outer(along, along)).semi_axes
        np.testing.assert_allclose(axes, [1e3 * np.sqrt(-2 * np.log(0.1)), 0.0], atol=1e-4)


@pytest.mark.parametrize("arguments", [(np.nan, 5), (4, np.nan), (4, 0), (4, 5, np.nan)])
def test_limits_of_what_is_not_a_number(arguments):
    with pytest.raises(ValueError, match=r"(n|runs|probability) must be (finite|a positive integer)"):
        tma.nees_limits(*arguments)


@pytest.mark.parametrize("seed", SEEDS)
def test_lost_runs_in_a_track_and_its_comparison(seed):
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng)
    times = [400.0, 500.0, 600.0]
    angles = scenario.simulate(6, rng)
    start = np.tile(scenario.state, (6, 1))
    late = int(np.flatnonzero(scenario.times > 500)[0])
    lost, first = angles.copy(), start.copy()
    lost[1, 0], lost[2, late], first[4, 0] = -np.inf, np.inf, np.nan
    found = tma.fit_over_time(scenario, lost, times, first)
    alone = tma.fit_over_time(scenario, angles[[0, 3, 5]], times, start[[0, 3, 5]])
    np.testing.assert_array_equal(found.finite[[0, 3, 5]], alone.finite)
    np.testing.assert_array_equal(found.finite[[1, 2, 4]], False)
    np.testing.assert_array_equal(found.state[[0, 3, 5]], alone.state)
    assert np.isfinite(found.state[2, :2]).all(), "lost later"
    assert np.isnan(found.state[2, 2]).all()
    compared, apart = tma.compare_with_truth(scenario, found), tma.compare_with_truth(scenario, alone)
    for field in ("nees", "inside", "finite"):
        np.testing.assert_array_equal(getattr(compared, field)[[0, 3, 5]], getattr(apart, field))
    gone = np.zeros((6, 3), dtype=bool)
    gone[[1, 4]], gone[2, 2] = True, True
    np.testing.assert_array_equal(compared.finite, ~gone)
    np.testing.assert_array_equal(np.isnan(compared.nees), gone)
    assert not compared.inside[gone].any()


def test_a_lost_covariance_in_a_comparison(scenario):
    angles = scenario.simulate(4, seed=1)
    prior = tma.prior_along_first_bearing(scenario, angles, 6e3, 2e3, 5.0)
    track = tma.ekf(scenario, angles, prior, record=[300.0, 600.0])
    before = tma.compare_with_truth(scenario, track)
    assert before.finite.all()
    track.covariance[1, 0], track.covariance[2, 1, 2, 2] = 0.0, -1.0
    after = tma.compare_with_truth(scenario, track)
    np.testing.assert_array_equal(after.finite, [[True, True], [False, True], [True, False], [True, True]])
    np.testing.assert_array_equal(after.nees[after.finite], before.nees[after.finite])
    np.testing.assert_array_equal(after.inside, before.inside & after.finite)


def test_a_track_names_the_time_that_has_no_bound(scenario):
    angles = scenario.simulate(2, seed=1)
    only = tma.Scenario(scenario.platform, scenario.sensors[:1], 600.0, scenario.target)
    with pytest.raises(
        ValueError, match=r"times: no bound at 100.0 s: the state is not observable: .* 3 of 4"
    ):
        tma.fit_over_time(only, only.simulate(2, seed=1), [100.0, 600.0], only.state)
    with pytest.raises(ValueError, match="times is empty"):
        tma.fit_over_time(scenario, angles, [], scenario.state)
