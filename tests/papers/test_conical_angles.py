"""The scenarios of conical-angles against the printed bounds."""

import numpy as np
import pytest
from scipy.optimize import least_squares

import tmalib as tma
from tmalib.papers.conical_angles import experiments, quadratic, tables
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.conical_angles.paper import PAPER


def misses(table, rows, bound):
    """Rows whose bound is more than one unit of the last printed digit off."""
    printed = [PAPER.printed(table, row, "std_crlb") for row in rows]
    return [
        p.row
        for p, ours in zip(printed, bound, strict=True)
        if abs(ours - p.value) > p.last_digit * (1 + 1e-9)
    ]


@pytest.mark.parametrize(
    ("table", "scenario", "rows", "known"),
    [
        ("Table 1", conical.section_3_2(), tables.ROWS, []),
        ("Table 2", conical.section_3_2(sigma=1.7e-4), tables.ROWS, []),
        ("Table 3", conical.section_4_2(), tables.ROWS_WITH_DEPTH, ["yT"]),
        ("Table 4", conical.section_4_2(assumed_depth=100.0), tables.ROWS, []),
        ("Table 5", conical.section_5_2(2000.0, assumed_depth=100.0), tables.ROWS, []),
        ("Table 6", conical.section_5_2(4000.0, assumed_depth=100.0), tables.ROWS, []),
        (
            "Section 5.2.1 scenario 1",
            conical.section_5_2(2000.0, exchanged=True),
            tables.ROWS_WITH_DEPTH,
            [],
        ),
        (
            "Section 5.2.1 scenario 2",
            conical.section_5_2(4000.0, exchanged=True),
            tables.ROWS_WITH_DEPTH,
            [],
        ),
    ],
)
def test_bounds_agree_with_the_tables(table, scenario, rows, known):
    """All but one, which misses by three units of a fifth digit that is a zero."""
    assert misses(table, rows, tma.crlb_sigma(scenario)) == known


def test_the_course_as_printed_gives_other_bounds():
    assert (
        len(misses("Table 3", tables.ROWS_WITH_DEPTH, tma.crlb_sigma(conical.section_4_2(path="printed"))))
        >= 3
    )


def test_the_conventional_estimator_is_misspecified():
    wrong = conical.section_4_2(conventional=True)
    right = conical.section_4_2(assumed_depth=100.0)
    np.testing.assert_allclose(right.linearise(right.state)[0], right.measure(), atol=1e-14)
    assert np.abs(wrong.linearise(right.state)[0] - right.measure()).max() > 10 * conical.SIGMA


def test_bad_path():
    with pytest.raises(ValueError, match="path must be"):
        conical.section_4_2(path="guessed")


def test_quadratic_coordinates_are_the_state_and_infinity_is_their_edge():
    scenario = conical.section_3_2(assumed_depth=200.0)
    states = scenario.state + np.array([[0, 0, 0, 0], [-6000, 500, 2, -1], [4e6, 3e6, 1e3, 1e3]])
    points = quadratic.to_quadratic(scenario, states)
    back = quadratic.from_quadratic(scenario, points)
    side = np.where(states[:, :1] < 0, -1, 1) * [1, 0, 1, 0] + [0, 1, 0, 1]
    np.testing.assert_allclose(back, states * side, rtol=1e-6)
    same, _ = quadratic.quadratic_scenario(scenario).linearise(points)
    np.testing.assert_allclose(same, scenario.linearise(states)[0], atol=1e-14)
    _, b, c, p = points[0]
    assert np.isnan(quadratic.from_quadratic(scenario, [b * b / c, b, c, p])).all()


@pytest.mark.parametrize("kappa", [None, 0.0, 0.5])
def test_gradient_in_quadratic_coordinates(kappa):
    scenario = quadratic.quadratic_scenario(conical.section_3_2(assumed_depth=200.0), kappa)
    point = np.array([1.6, 3e-4, 2e-7, -3e-4] if kappa is None else [0.7, 4e-4, -3e-4])
    gradient = scenario.linearise(point)[1]
    for i, step in enumerate(1e-6 * point):
        ahead, behind = (scenario.linearise(point + s * step * np.eye(len(point))[i])[0] for s in (1, -1))
        np.testing.assert_allclose(gradient[:, i], (ahead - behind) / (2 * step), rtol=1e-3, atol=1e-5)


def test_runs_without_a_finite_estimate_prefer_infinity():
    found = experiments.one_ray(1, 200, conical.SIGMA)
    finite = np.isfinite(found["state"]).all(axis=1)
    assert 80 < finite.sum() < 150
    measured = conical.section_3_2().simulate(200, 1)
    kappas = [0.0, 1e-3, 0.03, 0.1, 0.3, 0.6, 1.0]
    cost = quadratic.profile(conical.section_3_2(assumed_depth=200.0), measured[~finite], kappas)
    assert np.all(cost[:, 1:].min(axis=1) > cost[:, 0] - 1e-4)


def test_the_nearest_target_at_infinity_is_a_minimum_to_nine_digits():
    """By scipy, in other coordinates: the direction and its change, and the speed along over the range."""
    scenario = conical.section_3_2(assumed_depth=200.0)
    measured, times = scenario.measure(), scenario.times

    def residuals(unknowns):
        across, change, along = unknowns * [1.0, 1e-3, 1e-3]
        ahead = 1 + along * times
        return (ahead / np.hypot(ahead, across + change * times) - measured) / conical.SIGMA

    best = least_squares(residuals, [0.7, 0.4, -0.3], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    found = quadratic.nearest_at_infinity(scenario)
    assert found.cost == pytest.approx(2 * best.cost, rel=1e-9)


def test_the_optimiser_of_scipy_finds_the_estimate_where_there_is_one():
    scenario = conical.section_3_2(1.7e-4, assumed_depth=200.0)
    found = experiments.one_ray_by_scipy(5, 20, 1.7e-4, 1e-12)["state"]
    ours = tma.fit(scenario, scenario.simulate(20, 5), scenario.state, tolerance=1e-8)
    np.testing.assert_allclose(found, ours.state, rtol=1e-4)


def test_the_optimiser_of_scipy_goes_farther_with_a_smaller_tolerance():
    coarse, fine = (experiments.one_ray_by_scipy(5, 60, conical.SIGMA, t)["state"] for t in (1e-4, 1e-6))
    assert np.ptp(fine[:, 1]) > 3 * np.ptp(coarse[:, 1])


def test_two_rays_by_gauss_newton_step_by_step():
    scenario = conical.section_5_2(2000.0, assumed_depth=300.0)
    measured, state = scenario.simulate(1, 4)[0], np.array([8000.0, 8000.0, 0.0, 0.0])
    for _ in range(20):
        value, gradient = scenario.linearise(state)
        state = state + np.linalg.lstsq(gradient, measured - value)[0]
    found = experiments.two_rays_by_gauss_newton(4, 1, bottom_depth=2000.0)
    assert found["converged"].all()
    np.testing.assert_allclose(found["state"][0], state, rtol=1e-3)


def test_the_close_target_has_an_estimable_depth():
    """The bound from differences of cosines that are written out by hand."""

    def cosines(state):
        x, y, z, vx, vy = state
        times = np.arange(0, 301, 4.0)
        east, north = x + vx * times, y + vy * times
        images = (z - 20.0, 2 * 2000.0 - z - 20.0)
        return np.concatenate([north / np.sqrt(east**2 + north**2 + image**2) for image in images])

    truth, steps = np.array([500.0, 800.0, 300.0, -2.0, -3.0]), np.diag([0.1, 0.1, 0.1, 1e-3, 1e-3])
    columns = [(cosines(truth + s) - cosines(truth - s)) / (2 * s.sum()) for s in steps]
    jacobian = np.stack(columns, axis=1) / 1.7e-2
    by_hand = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    np.testing.assert_allclose(tma.crlb_sigma(conical.close_target()), by_hand, rtol=1e-4)
    assert by_hand[2] < 10
    found = experiments.close_target_runs(1, 50)
    assert found["converged"].all()
    assert np.abs(found["errors"]).max(axis=0)[2] < 5 * by_hand[2]


def test_first_order_bias_of_a_small_error_is_the_bias():
    scenario = conical.section_5_2(2000.0, assumed_depth=101.0)
    fit = tma.fit(scenario, scenario.measure(), scenario.state, tolerance=1e-6)
    np.testing.assert_allclose(
        experiments.first_order_bias(scenario, scenario.state), scenario.state - fit.state, rtol=0.02
    )


def test_the_papers_bias_is_truth_minus_estimate():
    errors = np.random.default_rng(1).normal([3.0, -2.0], 1.0, (1000, 2))
    ours = tables.signed_bias_and_std("xT", 0, errors)
    assert abs(ours["xT", "bias"].value + 3) < 0.2
    assert abs(ours["xT", "std_sample"].value - 1) < 0.2
    flipped = tables.signed_bias_and_std("xT", 0, errors, "a", "b", sign=-1)
    assert flipped["xT", "bias"].value == -ours["xT", "bias"].value
    assert (flipped["xT", "bias"].erratum, flipped["xT", "std_sample"].erratum) == ("a, b", "a")
