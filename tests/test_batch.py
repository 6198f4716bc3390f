from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

import tmalib as tma
from tmalib import levenberg_marquardt, status
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.papers.robustness import scenarios as paper


@pytest.fixture(scope="module")
def runs(scenario):
    angles = scenario.simulate(60, seed=5)
    return angles, tma.along_first_bearing(scenario, angles, 8e3)


def by_scipy(scenario, angles, start):
    """The same minimum by MINPACK, one run at a time."""

    def residuals(x):
        return -scenario.residual(angles, scenario.linearise(x)[0]) / scenario.sigma

    return least_squares(residuals, start, method="lm", x_scale=(1e3, 1e3, 1, 1), xtol=1e-12, ftol=1e-14)


def test_minimum_is_that_of_scipy(scenario, runs):
    angles, start = runs
    fit = tma.fit(scenario, angles, start, tolerance=1e-6)
    assert fit.converged.all()
    sigma = tma.crlb_sigma(scenario)
    for i in range(0, 60, 6):
        other = by_scipy(scenario, angles[i], start[i])
        np.testing.assert_allclose(fit.state[i] / sigma, other.x / sigma, atol=1e-4)
        assert fit.cost[i] == pytest.approx(2 * other.cost, rel=1e-8)


def test_batch_equals_loop_bit_for_bit(scenario, runs, monkeypatch):
    angles, start = runs
    whole = tma.fit(scenario, angles, start)
    for i in (0, 17, 59):
        alone = tma.fit(scenario, angles[i], start[i])
        np.testing.assert_array_equal(alone.state, whole.state[i])
        assert alone.iterations == whole.iterations[i]
    monkeypatch.setattr(levenberg_marquardt, "BLOCK_ELEMENTS", 7 * 61)
    np.testing.assert_array_equal(tma.fit(scenario, angles, start).state, whole.state)


def test_charts_and_tolerance_do_not_move_the_minimum(scenario, runs):
    angles, start = runs
    sigma = tma.crlb_sigma(scenario)
    polar = tma.fit(scenario, angles, start, tolerance=1e-6)
    cartesian = tma.fit(scenario, angles, scenario.state, chart=tma.Cartesian, tolerance=1e-6)
    loose = tma.fit(scenario, angles, start)
    np.testing.assert_allclose(cartesian.state / sigma, polar.state / sigma, atol=1e-4)
    np.testing.assert_allclose(loose.state / sigma, polar.state / sigma, atol=5e-3)


def test_the_last_step_is_taken(scenario, runs):
    """From within the tolerance of the minimum there is one step, to about 1e-4 standard deviations of it."""
    angles, start = runs
    minimum = tma.fit(scenario, angles, start, tolerance=1e-8).state
    away = np.random.default_rng(6).normal(size=minimum.shape)
    away *= 0.008 / np.linalg.norm(away, axis=1)[:, None]
    found = tma.fit(scenario, angles, minimum + away @ np.linalg.cholesky(tma.crlb(scenario)).T)
    assert np.all(found.iterations == 1)
    np.testing.assert_allclose((found.state - minimum) / tma.crlb_sigma(scenario), 0, atol=2e-4)


@pytest.mark.parametrize("later", [-50_000.0, 2_000.0, 1e6])
def test_a_reference_time_far_away_moves_the_state_along(scenario, runs, later):
    """The minimum is that of a reference time within the measurements, at another time."""
    angles, start = runs
    near = tma.fit(scenario, angles, start, tolerance=1e-6)
    far = replace(scenario, reference_time=scenario.reference_time + later)
    found = tma.fit(far, angles, tma.propagate(start, later), tolerance=1e-6)
    assert found.converged.all()
    assert found.scenario.reference_time == far.reference_time
    back = tma.propagate(found.state, -later)
    np.testing.assert_allclose(
        back / tma.crlb_sigma(scenario), near.state / tma.crlb_sigma(scenario), atol=1e-3
    )


def test_noise_free_measurements_give_the_truth(scenario):
    fit = tma.fit(scenario, scenario.measure(), scenario.state + [500, -500, 1, 1], tolerance=1e-8)
    np.testing.assert_allclose(fit.state, scenario.state, rtol=1e-7)
    assert fit.cost < 1e-12


def test_efficient_where_the_problem_is_mild(scenario):
    angles = scenario.simulate(4000, seed=11)
    fit = tma.fit(scenario, angles, scenario.state)
    nees = tma.nees(fit.state, scenario.state, tma.crlb(scenario))
    low, high = tma.nees_limits(4, 4000, 0.999)
    assert fit.converged.all()
    assert low < nees.mean() < high + 0.1
    # C at the minimum is chi-square with N - n degrees of freedom
    assert fit.cost.mean() == pytest.approx(77 - 4, abs=5 * np.sqrt(2 * 73 / 4000))


def test_bad_members_are_reported_and_harm_nobody(scenario, runs):
    angles, start = (array.copy() for array in runs)
    clean = tma.fit(scenario, angles, start)
    angles[3, 10] = np.inf  # NaN would be a measurement left out
    start[7] = np.inf
    start[9, :2] = scenario.platform.position_at(600.0)  # on the platform
    fit = tma.fit(scenario, angles, start)
    bad = np.isin(np.arange(60), [3, 7, 9])
    assert not fit.converged[bad].any()
    assert np.all(fit.status[bad] == status.NOT_FINITE)
    assert np.isnan(fit.state[bad]).all()
    np.testing.assert_array_equal(fit.state[~bad], clean.state[~bad])


def test_iteration_limit_is_reported(scenario, runs):
    fit = tma.fit(scenario, *runs, max_iterations=1)
    assert np.all(fit.status == status.ITERATION_LIMIT)
    assert np.all(fit.iterations == 1)
    np.testing.assert_allclose(fit.state, runs[1])


def test_unobservable_runs_do_not_stop_the_batch(scenario):
    blind = replace(scenario, sensors=[tma.Sensor(tma.Bearing(), [0.0, 10.0], 0.01)])
    angles = blind.simulate(5, seed=1)
    fit = tma.fit(blind, angles, blind.state)
    assert fit.state.shape == (5, 4)
    assert set(fit.status) <= set(status.ADVICE)


def test_safeguard_rescues_plain_gauss_newton():
    """Scenario 6 from the paper's start: plain Gauss-Newton in Cartesian coordinates fails."""
    scenario = emw.scenario(6)
    angles = scenario.simulate(50, seed=2)
    start = tma.along_first_bearing(scenario, angles, 10e3)
    plain = tma.fit(scenario, angles, start, chart=tma.Cartesian, safeguard=False)
    safe = tma.fit(scenario, angles, start)
    far = tma.nees(plain.state, scenario.state, tma.crlb(scenario)) > 100
    assert safe.converged.all()
    assert np.all(tma.nees(safe.state, scenario.state, tma.crlb(scenario)) < 40)
    assert np.mean(far | ~plain.converged) > 0.5


def test_misspecified_on_purpose(scenario):
    """Taking the late bearings for instantaneous ones biases the estimate by about the drift in the delay."""
    naive = replace(
        scenario,
        sensors=[scenario.sensors[0], tma.Sensor(tma.Bearing(), scenario.sensors[1].times, np.radians(0.7))],
    )
    fit = tma.fit(naive, scenario.measure(), scenario.state, tolerance=1e-6)
    right = tma.fit(scenario, scenario.measure(), scenario.state, tolerance=1e-6)
    assert right.cost < 1e-6 < fit.cost
    assert np.hypot(*(fit.state - scenario.state)[:2]) > 1.0


def test_what_has_converged_is_finite():
    """A wrong model from random starts: some runs end at the edge of the chart; none has converged there."""
    model, truth = conical.section_4_2(conventional=True), conical.section_4_2()
    starts = np.random.default_rng(5).uniform(-1, 1, (400, 4)) * [3e4, 3e4, 5, 5]
    fit = tma.fit(model, truth.measure(), starts, max_iterations=300)
    assert fit.converged.any()
    assert np.isfinite(fit.state[fit.converged]).all()


def test_every_ghost_is_a_minimum_of_its_own():
    """Two rays, depth in the state: target, mirror image and the two scaled ghosts, all at criterion zero."""
    scenario = conical.section_5_2(4000.0)
    ghosts = [family.target().state(0.0, scenario.coordinates) for family in tma.find_ghosts(scenario)]
    minima = np.array([scenario.state, *ghosts])
    starts = np.concatenate([minima * (1 + change) for change in (-0.01, 0.0, 0.01)])
    states, costs, hits = tma.distinct_minima(
        scenario, scenario.measure(), starts, tolerance=1e-6, separation=1e-4
    )
    assert len(states) == len(minima) == 4
    np.testing.assert_allclose(costs, 0, atol=1e-10)
    assert hits.sum() == len(starts)
    for minimum in minima:
        assert np.min(np.abs(states[:, :2] - minimum[:2]).max(axis=1)) < 5.0


def test_one_minimum_is_found_once(scenario, runs):
    angles, start = runs
    starts = scenario.state + np.random.default_rng(0).normal(size=(20, 4)) * [200, 200, 1, 1]
    states, costs, hits = tma.distinct_minima(scenario, angles[0], starts)
    assert states.shape == (1, 4)
    assert hits.tolist() == [20]
    assert costs[0] == pytest.approx(tma.fit(scenario, angles[0], start[0]).cost, rel=1e-4)
    with pytest.raises(ValueError, match="one run and a list of starts"):
        tma.distinct_minima(scenario, angles, starts)


def test_start_along_first_bearing(scenario):
    start = tma.along_first_bearing(scenario, scenario.measure(), 7e3)
    assert np.hypot(*start[:2]) == pytest.approx(7e3)
    assert tma.bearing(start[:2]) == pytest.approx(float(tma.bearing([4e3, 5e3])))
    np.testing.assert_array_equal(start[2:], 0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"tolerance": 0.0}, "tolerance must be greater than 0"),
        ({"max_iterations": 0}, "max_iterations must be a positive integer"),
        ({"start": np.zeros(5)}, "state must have shape"),
    ],
)
def test_bad_input(scenario, change, message):
    arguments = {"angles": scenario.measure(), "start": scenario.state} | change
    with pytest.raises(ValueError, match=message):
        tma.fit(scenario, **arguments)


def test_bad_range(scenario):
    with pytest.raises(ValueError, match="range must be greater than 0"):
        tma.along_first_bearing(scenario, scenario.measure(), 0.0)


def test_modified_polar_chart_round_trip():
    chart = tma.ModifiedPolar((100.0, -200.0))
    rng = np.random.default_rng(4)
    states = rng.normal(size=(50, 4)) * [1e4, 1e4, 10, 10]
    points = chart.from_state(states)
    np.testing.assert_allclose(chart.to_state(points), states, rtol=1e-9)
    jacobian = chart.jacobian(points)
    for i in range(4):
        step = np.zeros(4)
        step[i] = 1e-6 * np.abs(points[:, i]).mean()
        slope = (chart.to_state(points + step) - chart.to_state(points - step)) / (2 * step[i])
        scale = np.abs(jacobian[..., i]).max(axis=-1, keepdims=True)
        np.testing.assert_allclose(slope / scale, jacobian[..., i] / scale, atol=1e-5)
    assert np.isnan(chart.to_state(np.array([0.1, -1e-4, 0.0, 0.0]))).all()


def off_the_model(seed):
    """A circular target seen by a weaving platform, and what a uniform motion makes of it."""
    return paper.random_geometry(np.random.SeedSequence(5, spawn_key=(seed,)))


@pytest.mark.parametrize("seed", [1, 5, 15])
def test_large_residuals(seed):
    """A target off the model leaves residuals so large that plain steps climb; scipy goes no lower."""
    geometry = off_the_model(seed)
    measured = geometry.circle.measure()
    found = tma.fit(geometry.straight, measured, geometry.theta_star, tolerance=1e-5)
    assert found.converged

    def residual(state):
        return geometry.straight.residual(measured, geometry.straight.linearise(state)[0]) / 5e-3

    peer = least_squares(residual, found.state, x_scale=tma.crlb_sigma(geometry.straight), method="lm")
    assert found.cost == pytest.approx(2 * peer.cost, rel=1e-6)


@pytest.mark.parametrize("chart", [None, tma.Cartesian])
def test_an_estimate_that_runs_to_infinity_says_so(chart):
    """The criterion falls as the target recedes: the limit is a target at infinity."""
    geometry = off_the_model(16)
    found = tma.fit(
        geometry.straight, geometry.circle.measure(), geometry.theta_star, chart=chart, max_iterations=400
    )
    assert not found.converged
    assert found.status == status.NO_MINIMUM


def test_a_start_on_the_platforms_path_does_not_stop_the_others(scenario):
    """The gradient is infinite there; the run fails, the one beside it does not."""
    measured = scenario.measure()
    on_path = [*scenario.platform.position_at(scenario.times[3]), 0.0, 0.0]
    found = tma.fit(scenario, measured, [on_path, scenario.state * 1.01], chart=tma.Cartesian)
    assert not found.converged[0]
    assert found.converged[1]


def test_starts_without_information_do_not_stop_the_others():
    """Five bearings from a platform that does not turn: at some starts the equations are exactly singular."""
    platform = tma.Course((0, 0), 5.0, 1.0, [tma.Straight(100)])
    sensor = tma.Sensor(tma.Bearing(), np.linspace(0, 100, 5), 0.01)
    scenario = tma.Scenario(platform, [sensor], reference_time=100, target=tma.Target((3e3, 4e3), 5.0, 2.0))
    rng = np.random.default_rng(0)
    starts = np.concatenate([rng.normal(0, 1e4, (2000, 2)), rng.normal(0, 50, (2000, 2))], axis=1)
    starts[:5], starts[5] = 0.0, [*platform.position_at(100.0), 0.0, 0.0]
    starts[6:9] = [[0.0, 4e3, 0.0, 0.0], [1e-300, 1e3, 0.0, 0.0], [1e200, 1.0, 0.0, 0.0]]
    for chart in (None, tma.Cartesian):
        for safeguard in (True, False):
            found = tma.fit(scenario, scenario.measure(), starts, chart=chart, safeguard=safeguard)
            assert np.mean(found.status == status.NOT_OBSERVABLE) > 0.9
            assert not found.converged.any()


def test_exactly_singular_equations_get_no_step():
    matrix = np.stack([np.eye(2), np.ones((2, 2)), 2 * np.eye(2)])
    found = levenberg_marquardt._solve(matrix, np.ones((3, 2)))
    np.testing.assert_array_equal(found, [[1, 1], [np.nan, np.nan], [0.5, 0.5]])
