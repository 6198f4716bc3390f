"""Periodic and random displacements: `robustness`, Section III."""

import numpy as np
import pytest

import tmalib as tma
from tmalib import sensitivity
from tmalib.papers.robustness import periodic
from tmalib.papers.robustness import scenarios as paper


@pytest.fixture(scope="module")
def end(geometry):
    return sensitivity.position_criterion(geometry.straight, paper.DURATION)


def test_worst_phase_is_the_largest_over_many_phases(geometry, end):
    scenario = geometry.straight
    phase = np.linspace(0, 2 * np.pi, 1441)[:, None]
    wave = np.cos(2 * np.pi * scenario.times / 3.3 + phase)
    H = sensitivity.response(scenario).displacement(wave)
    lengths = np.linalg.norm(sensitivity.differential(scenario, H) @ end.T, axis=-1)
    worst = periodic.worst_phase(scenario, 3.3)
    assert lengths.max() <= worst * (1 + 1e-12)
    assert lengths.max() == pytest.approx(worst, rel=1e-5)  # 1 - cos(a quarter of a degree) < 1e-5


def test_worst_phase_of_several_periods_is_each_of_them(geometry):
    periods = np.array([[0.5, 1.0], [7.0, 20.0]])
    together = periodic.worst_phase(geometry.straight, periods)
    assert together.shape == (2, 2)
    np.testing.assert_allclose(together[1, 0], periodic.worst_phase(geometry.straight, 7.0), rtol=1e-12)
    assert np.all(periodic.comb_tops(geometry.straight, periods) >= together * (1 - 1e-12))


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan, [1.0, np.inf]])
def test_a_period_is_positive(geometry, period):
    with pytest.raises(ValueError, match="period must be positive and finite"):
        periodic.worst_phase(geometry.straight, period)


def test_a_period_of_one_sample_is_a_constant(geometry, end):
    """cos(2 pi 25 t_k + phase) does not depend on k: a displacement by one metre along every U_k."""
    scenario = geometry.straight
    constant = sensitivity.response(scenario).displacement(np.ones(500))
    shift = sensitivity.differential(scenario, constant) @ end.T
    assert periodic.worst_phase(scenario, 1 / 25) == pytest.approx(np.hypot(*shift), rel=1e-9)


def test_sampled_bearings_are_those_of_the_same_motion(geometry):
    fine = periodic.sampled(geometry, 100)
    assert fine.times[0] == 0.1
    assert fine.times[-1] == 19.9
    np.testing.assert_array_equal(fine.state, geometry.straight.state)
    with pytest.raises(ValueError, match="count"):
        periodic.sampled(geometry, 0)


def test_a_target_that_copies_the_weave_is_another_uniform_motion(geometry):
    """Exact geometry, and no fit: the bearings of the ghost are those of the copying target."""
    scenario = geometry.straight
    straight, weave = periodic.platform_weave(scenario)
    np.testing.assert_allclose(weave.sum(axis=0), 0, atol=1e-6)
    np.testing.assert_allclose(scenario.times @ weave, 0, atol=1e-4)
    seen = sensitivity.displaced_measurements(scenario, 0.25 * weave)
    ghost, _ = scenario.linearise(straight + (scenario.state - straight) / 0.75)
    np.testing.assert_allclose(scenario.residual(seen, ghost), 0, atol=1e-13)


def test_fits_agree_with_the_first_order_when_small(geometry):
    lengths, converged = periodic.fitted_phases(geometry.straight, [1.9, 7.0], 0.1, phases=72)
    assert lengths.shape == converged.shape == (2, 72)
    assert converged.all()
    # 1 - cos(2.5 degrees) = 1e-3; second order: 0.1 m times a hundred, over a distance of 6 km
    worst = 0.1 * periodic.worst_phase(geometry.straight, [1.9, 7.0])
    np.testing.assert_allclose(lengths.max(axis=1), worst, rtol=5e-3)


def test_noise_is_added_to_the_bearings(geometry, end):
    level = 1e-6 * np.random.default_rng(1).standard_normal(500)
    errors, converged = periodic.end_errors(geometry.straight, np.zeros((500, 2)), level)
    jacobian = geometry.straight.linearise(geometry.theta_star)[1]
    np.testing.assert_allclose(errors, end @ np.linalg.lstsq(jacobian, level)[0], atol=5e-4)
    assert converged


def test_covariance_of_the_end_is_the_average_over_samples(geometry, end):
    """The closed form against the sum over components that it replaces."""
    scenario = geometry.straight
    K = periodic.markov(scenario.times, 1.0)
    root = np.linalg.cholesky(K)
    total = np.zeros((2, 2))
    for axis in np.eye(2):
        columns = root.T[:, :, None] * axis  # every column of the root as a displacement
        shifts = sensitivity.differential(scenario, columns) @ end.T
        total += shifts.T @ shifts
    np.testing.assert_allclose(periodic.end_covariance(scenario, K), total, rtol=1e-9)
    assert periodic.end_spread(scenario, K) == pytest.approx(np.sqrt(np.trace(total)))


def test_covariances_have_unit_variance_and_the_right_limits():
    times = np.arange(1, 201) / 25
    for K in (periodic.independent(times), periodic.markov(times, 0.7), periodic.random_phase(times, 3.0)):
        np.testing.assert_allclose(np.diagonal(K), 1)
        assert np.linalg.eigvalsh(K).min() > -1e-10
    np.testing.assert_allclose(periodic.markov(times, 1e-4), np.eye(200), atol=1e-12)
    np.testing.assert_allclose(periodic.markov(times, 1e9), 1, atol=1e-7)
    with pytest.raises(ValueError, match="correlation_time must be greater than 0"):
        periodic.markov(times, 0.0)
    with pytest.raises(ValueError, match="period must be greater than 0"):
        periodic.random_phase(times, -1.0)


def test_random_acceleration_is_white_noise_twice_integrated():
    """The closed form against the sum over small kicks: a kick at s gives the position (t - s)."""
    times = np.arange(1, 41) / 4
    kicks = (np.arange(4000) + 0.5) / 400
    position = np.maximum(times[:, None] - kicks, 0.0)
    basis = np.stack([np.ones(40), times], axis=-1)
    position = position - basis @ np.linalg.lstsq(basis, position)[0]
    covariance = position @ position.T
    covariance /= np.mean(np.diagonal(covariance))
    np.testing.assert_allclose(periodic.random_acceleration(times), covariance, atol=1e-5)


def test_samples_have_the_covariance_asked_for():
    times = np.arange(1, 26) / 25
    runs = 20_000
    for K, V in (
        (periodic.markov(times, 0.3), periodic.gaussian(1, periodic.markov(times, 0.3), runs)),
        (periodic.random_phase(times, 0.8), periodic.random_sines(1, times, 0.8, runs)),
    ):
        assert V.shape == (runs, 25, 2)
        for axis in (0, 1):
            found = V[..., axis].T @ V[..., axis] / runs
            assert np.abs(found - K).max() < 5 * np.sqrt(2 / runs)  # five standard errors of a variance
        assert np.abs(np.mean(V[..., 0] * V[..., 1])) < 5 / np.sqrt(runs)


def test_second_order_bias_of_a_random_constant_is_zero(geometry):
    """A constant displacement is followed exactly, so the second derivative vanishes."""
    found = periodic.second_order_bias(geometry.straight, np.ones((500, 500)))
    assert np.abs(found).max() < 1e-4


def test_second_order_bias_does_not_depend_on_the_step(geometry):
    K = periodic.random_phase(geometry.straight.times, 7.0)
    one, two = (periodic.second_order_bias(geometry.straight, K, step) for step in (0.5, 1.0))
    np.testing.assert_allclose(one, two, rtol=0.02)


def test_another_weave_keeps_the_target(geometry):
    other = periodic.weaving(geometry, 5.0)
    np.testing.assert_array_equal(other.theta_star, geometry.theta_star)
    assert isinstance(other.platform, tma.Course)
    assert not np.allclose(other.platform.position_at(10.0), geometry.platform.position_at(10.0))
