"""The theory of robustness, Section II, on any times and weights."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.optimize import least_squares

import tmalib as tma
from tmalib import sensitivity
from tmalib.papers.robustness import scenarios as paper
from tmalib.papers.robustness import theory
from tmalib.papers.robustness.paper import PAPER

ONES = np.ones(500)


def test_weights_of_one_are_the_discrete_problem(geometry):
    scenario = geometry.straight
    np.testing.assert_allclose(
        theory.information(scenario, ONES),
        tma.fisher_information(scenario) * paper.SIGMA**2,
        rtol=1e-12,
    )
    displacement = geometry.circle_displacement
    np.testing.assert_allclose(
        theory.weighted_differential(scenario, ONES, displacement),
        sensitivity.differential(scenario, displacement),
        rtol=1e-8,
    )


def test_the_operator_has_the_singular_structure_of_the_response(geometry):
    by_svd = sensitivity.modes(geometry.straight)
    by_hand = theory.operator(geometry.straight, ONES)
    np.testing.assert_allclose(
        by_hand.mu, by_svd.mu, rtol=1e-7
    )  # rounding over the smallest, 2e-7 of the largest
    np.testing.assert_allclose(np.abs(np.vecdot(by_hand.f, by_svd.f)), 1, rtol=1e-9)
    np.testing.assert_allclose(by_hand.e @ by_hand.e.T, np.eye(4), atol=1e-14)
    aligned = by_hand.d * np.sign(np.vecdot(by_hand.f, by_svd.f))[:, None]
    np.testing.assert_allclose(aligned, by_svd.d, rtol=1e-6, atol=1e-9)


def test_second_derivatives_against_differences(geometry):
    scenario, state = geometry.straight, geometry.theta_star
    found = theory.second_derivatives(scenario, state)
    step = np.array([0.1, 0.1, 0.01, 0.01])
    ahead = scenario.linearise(state + np.diag(step))[1]
    behind = scenario.linearise(state - np.diag(step))[1]
    differences = np.moveaxis((ahead - behind) / (2 * step[:, None, None]), 0, -1)
    # the error is of relative order (0.2 m / range)^2, and the range is at least 2 km
    assert np.all(np.abs(found - differences) <= 1e-8 * np.abs(found).max(axis=0))


def test_half_hessian_gives_the_sandwich(geometry):
    measured = geometry.circle.measure()
    state = theory.newton_estimate(geometry.straight, ONES, measured, geometry.theta_star)
    inverse = np.linalg.inv(theory.half_hessian(geometry.straight, ONES, measured, state))
    sandwich = inverse @ theory.information(geometry.straight, ONES, state) @ inverse
    by_differences = sensitivity.sandwich_covariance(geometry.straight, measured, state)
    np.testing.assert_allclose(sandwich * paper.SIGMA**2, by_differences, rtol=1e-5)


def test_estimate_against_scipy(geometry):
    scenario, measured = geometry.straight, geometry.circle.measure()
    site, lag = scenario.platform.position_at(scenario.times), scenario.times
    scale = tma.crlb_sigma(scenario)

    def residual(scaled):
        x, y, vx, vy = scaled * scale
        return np.arctan((x + lag * vx - site[:, 0]) / (y + lag * vy - site[:, 1])) - np.arctan(
            np.tan(measured)
        )

    start = geometry.theta_star / scale
    peer = least_squares(residual, start, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    ours = theory.newton_estimate(scenario, ONES, measured, geometry.theta_star)
    np.testing.assert_allclose(peer.x * scale, ours, rtol=1e-5)


@pytest.mark.parametrize("times_and_weights", [theory.midpoints(20_000), None])
def test_integrals_against_adaptive_quadrature(geometry, times_and_weights):
    times, weights = times_and_weights or theory.gauss(geometry.platform)
    scenario = theory.at_times(geometry.straight, times)

    def integrand(time):
        gradient = theory.at_times(geometry.straight, [time]).linearise(geometry.theta_star)[1][0]
        return np.outer(gradient, gradient) / paper.DURATION

    ends = np.cumsum([leg.duration for leg in geometry.platform.legs])[:-1]
    expected, _ = quad_vec(integrand, 0, paper.DURATION, points=ends, epsrel=1e-10)
    exact = times_and_weights is None
    found = theory.information(scenario, weights)
    np.testing.assert_allclose(found, expected, rtol=1e-9 if exact else 1e-6)
    assert weights.sum() == pytest.approx(1, rel=1e-12)


def test_uniform_times_end_with_the_observation():
    times, weights = theory.equal_steps(4)
    np.testing.assert_allclose(times, [5, 10, 15, 20])
    np.testing.assert_allclose(weights, 0.25)
    np.testing.assert_allclose(theory.midpoints(4)[0], [2.5, 7.5, 12.5, 17.5])


def test_following_starts_on_the_line_and_ends_at_the_estimate(geometry):
    states = theory.follow(geometry.straight, geometry.circle_displacement, steps=5)
    np.testing.assert_array_equal(states[0], geometry.theta_star)
    direct = theory.newton_estimate(geometry.straight, ONES, geometry.circle.measure(), states[0])
    np.testing.assert_allclose(states[-1], direct, rtol=1e-9)


def test_a_lost_minimum_is_nan_and_not_an_error():
    rng = np.random.default_rng(PAPER.stream("robustness/geometries").chunk())
    *_, lost = (paper.random_geometry(rng) for _ in range(6))
    states = theory.follow(lost.straight, lost.circle_displacement)
    assert np.isfinite(states[:3]).all()
    assert np.isnan(states[-1]).all()


def test_local_and_best_agree_on_the_reference(geometry):
    rng = np.random.default_rng(1)
    displacement = theory.smooth_displacement(geometry.straight, 15.0, rng)
    assert np.hypot(*displacement.T).max() == pytest.approx(15)
    local, best, costs = theory.local_and_best(geometry.straight, displacement, rng, starts=8)
    np.testing.assert_allclose(best, local, rtol=1e-3)
    assert costs[1] == pytest.approx(costs[0])


def test_no_minimum_is_an_error_that_says_so(geometry):
    scenario = replace(geometry.straight, platform=tma.Target((0, 0), 250.0, 0.0))  # never manoeuvres
    measured = scenario.measure() + 1e-3 * np.sin(scenario.times)
    with pytest.raises(ValueError, match="no minimum next to"):
        theory.newton_estimate(scenario, ONES, measured, geometry.theta_star)


def test_deviation_ratios_are_one_on_the_model(geometry):
    scenario = geometry.straight
    ratios = theory.deviation_ratios(scenario, ONES, scenario.measure(), scenario.state)
    np.testing.assert_allclose(ratios, 1, rtol=1e-9)
