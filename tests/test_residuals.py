"""Tests of residuals against other formulas, their words, and what is left out."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest, chi2, norm

import tmalib as tma

KINDS = ("size", "drift", "correlation", "largest")


def lowest(rows, right):
    """Sums of squares of right sides ``(N, runs)`` that a linear fit leaves."""
    return np.sum((right - rows @ np.linalg.lstsq(rows, right, rcond=None)[0]) ** 2, axis=0)


@pytest.fixture(scope="module")
def found(scenario):
    return tma.fit(scenario, scenario.simulate(20, seed=1), tolerance=1e-6)


@pytest.fixture(scope="module")
def tests(found):
    return tma.residual_tests(found)


# -- other formulas ----------------------------------------------------------------------------------


def jacobian(fit, run):
    return fit.scenario.linearise(fit.state[run])[1] / fit.scenario.sigma[:, None]


@pytest.mark.parametrize("run", range(3))
def test_size_is_what_a_linear_fit_leaves(scenario, found, tests, run):
    """Of each sensor alone; of all, the criterion of the fit."""
    for i, block in enumerate(scenario.blocks):
        own = jacobian(found, run)[block.columns]
        left = lowest(own / np.linalg.norm(own, axis=0), found.residuals[run, block.columns])
        freedom = len(own) - 4
        tail = chi2.sf(left, freedom)
        np.testing.assert_allclose(tests.size.statistic[run, i], left, rtol=1e-6)
        assert tests.size.freedom[run, i] == freedom
        np.testing.assert_allclose(tests.size.p_value[run, i], 2 * min(tail, 1 - tail), rtol=1e-6)
    np.testing.assert_allclose(tests.size.statistic[run, -1], found.cost[run], rtol=1e-6)
    assert tests.size.freedom[run, -1] == found.freedom[run]


@pytest.mark.parametrize("run", range(3))
def test_drift_is_what_slow_functions_explain_besides_the_state(scenario, found, tests, run):
    """The likelihood ratio of the linear model with and without them."""
    rows, functions = jacobian(found, run), []
    rows = rows / np.linalg.norm(rows, axis=0)
    for block in scenario.blocks:
        t = block.sensor.times
        slow = np.zeros((len(rows), 8))
        slow[block.columns] = np.cos(np.pi * np.arange(8) * (t[:, None] - t[0]) / (t[-1] - t[0]))
        functions.append(slow)
    functions.append(np.hstack(functions))
    for i, slow in enumerate(functions):
        gain = lowest(rows, found.residuals[run]) - lowest(np.hstack([rows, slow]), found.residuals[run])
        np.testing.assert_allclose(tests.drift.statistic[run, i], gain, rtol=1e-5)
        assert tests.drift.freedom[run, i] == slow.shape[1]
        np.testing.assert_allclose(tests.drift.p_value[run, i], chi2.sf(gain, slow.shape[1]), rtol=1e-5)


def test_of_many_measurements_correlation_is_the_statistic_of_ljung_and_box():
    """The four unknowns among 3000 measurements shift it by less than a tenth."""
    still = tma.Course((0, 0), 5, 0.0, [tma.Straight(1500), tma.Straight(1500, heading=1.5)])
    sensor = tma.Sensor(tma.Bearing(), np.arange(0, 3000, 1.0), 0.01)
    many = tma.Scenario(still, [sensor], 0.0, tma.Target((4e3, 5e3), 3.0, 2.0))
    fit = tma.fit(many, many.simulate(30, seed=2))
    statistic = tma.residual_tests(fit, lags=6).correlation.statistic[:, 0]
    x = fit.residuals
    r = [np.sum(x[:, k:] * x[:, :-k], axis=1) / np.sum(x**2, axis=1) for k in range(1, 7)]
    classical = sum(3000 * 3002 * r[k - 1] ** 2 / (3000 - k) for k in range(1, 7))
    np.testing.assert_allclose(statistic, classical, rtol=0.1, atol=0.5)
    assert np.corrcoef(statistic, classical)[0, 1] > 0.99


def test_the_lag_product_has_the_stated_spread_about_its_mean(scenario):
    """The statistic of one lag is one in the mean of white noise, the projection included: 20 000 runs."""
    noise = np.random.default_rng(3).standard_normal((20_000, 61))
    watch = tma.Scenario(scenario.platform, scenario.sensors[:1], 600.0)
    exact = watch.with_target(scenario.target).measure()
    fit = tma.fit(watch, exact, scenario.state, tolerance=1e-9)
    few = 1e-6  # of sigma: the model is linear
    many = replace(
        fit,
        state=np.broadcast_to(fit.state, (20_000, 4)),
        cost=np.zeros(20_000),
        status=np.full(20_000, "converged"),
        measured=exact + few * watch.sigma * noise,
    )
    statistic = tma.residual_tests(many, lags=1).correlation.statistic[:, 0]
    assert abs(statistic.mean() - 1) < 4 * statistic.std() / np.sqrt(20_000)


@pytest.mark.parametrize("run", range(3))
def test_largest_is_the_largest_over_its_own_deviation(scenario, found, tests, run):
    rows = jacobian(found, run)
    hat = rows @ np.linalg.inv(rows.T @ rows) @ rows.T
    scaled = np.abs(found.residuals[run]) / np.sqrt(1 - np.diag(hat))
    for i, columns in enumerate([block.columns for block in scenario.blocks] + [slice(None)]):
        part = scaled[columns]
        np.testing.assert_allclose(tests.largest.statistic[run, i], part.max(), rtol=1e-5)
        chance = 1 - (1 - 2 * norm.sf(part.max())) ** len(part)
        np.testing.assert_allclose(tests.largest.p_value[run, i], chance, rtol=1e-4)
        assert tests.when[run, i] == scenario.times[columns][np.argmax(part)]


# -- words -------------------------------------------------------------------------------------------


def test_the_words_name_the_sensor_and_the_time(scenario):
    angles = scenario.simulate(1, seed=1)[0]
    assert tma.residual_tests(tma.fit(scenario, angles)).warnings() == []
    angles[63] += np.radians(8)  # the third of the sonar
    first, *_ = tma.residual_tests(tma.fit(scenario, angles)).warnings()
    assert first.startswith("The measurement of sonar at 80 s is ")
    assert "leave it out" in first


def test_words_are_of_one_run(tests):
    with pytest.raises(ValueError, match="warnings are of one run"):
        tests.warnings()


def test_a_fit_that_has_not_converged_is_said_so(scenario):
    fit = tma.fit(scenario, scenario.simulate(1, seed=1)[0], scenario.state * 3, max_iterations=1)
    tests = tma.residual_tests(fit)
    assert np.isnan(tests.size.p_value).all()
    assert tests.warnings() == [
        "The fit has not converged (iteration limit): its residuals say nothing. Try another start."
    ]


@pytest.mark.parametrize("count", [4, 5])
def test_without_freedom_nothing_is_said(scenario, count):
    times = np.linspace(0, 600, count)
    few = tma.Scenario(scenario.platform, [tma.Sensor(tma.Bearing(), times, 0.01)], 600.0, scenario.target)
    tests = tma.residual_tests(tma.fit(few, few.simulate(1, seed=1)[0], scenario.state))
    assert np.isnan(tests.size.p_value).all() == (count == 4)
    assert np.isnan(tests.correlation.p_value).all()
    if count == 4:
        assert np.isnan(tests.drift.p_value).all()
        assert "no more measurements than unknowns" in tests.warnings()[0]
    else:
        assert tests.size.freedom.tolist() == [1, 1]
        for kind in ("drift", "largest"):
            p = getattr(tests, kind).p_value
            assert (np.isnan(p) | ((p >= 0) & (p <= 1))).all()


# -- batches and what is left out --------------------------------------------------------------------


def test_a_lost_run_stays_alone(scenario, found, tests):
    angles = found.measured.copy()
    angles[4, 7] = np.inf
    lost = tma.residual_tests(tma.fit(scenario, angles, tolerance=1e-6))
    others = np.arange(20) != 4
    for kind in KINDS:
        p, whole = getattr(lost, kind).p_value, getattr(tests, kind).p_value
        assert np.isnan(p[4]).all()
        np.testing.assert_array_equal(p[others], whole[others])
    assert np.isnan(lost.when[4]).all()


def test_shapes_are_those_of_the_runs(scenario, found, tests):
    two = tma.residual_tests(tma.fit(scenario, found.measured.reshape(4, 5, -1), tolerance=1e-6))
    one = tma.residual_tests(tma.fit(scenario, found.measured[7], tolerance=1e-6))
    for kind in KINDS:
        for field in ("statistic", "freedom", "p_value"):
            whole = getattr(getattr(tests, kind), field)
            np.testing.assert_array_equal(getattr(getattr(two, kind), field), whole.reshape(4, 5, 3))
            np.testing.assert_array_equal(getattr(getattr(one, kind), field), whole[7])
    assert two.names == ("radar", "sonar", "all")


def test_a_residual_that_is_nan_is_left_out(scenario, found):
    """As if its sensor had never measured it; where it was in time matters to the correlation alone."""
    radar, sonar = scenario.sensors
    gone = [5, 17, 30]
    fewer = replace(scenario, sensors=[replace(radar, times=np.delete(radar.times, gone)), sonar])
    kept = np.delete(np.arange(77), gone)
    short = tma.fit(fewer, found.measured[:, kept], tolerance=1e-6)
    measured = found.measured.copy()
    measured[:, gone] = np.nan
    holes = replace(short, scenario=scenario, measured=measured)
    whole, part = tma.residual_tests(short), tma.residual_tests(holes)
    for kind in ("size", "drift", "largest"):
        np.testing.assert_array_equal(getattr(part, kind).freedom, getattr(whole, kind).freedom)
        np.testing.assert_allclose(getattr(part, kind).statistic, getattr(whole, kind).statistic, rtol=1e-7)
    assert np.isfinite(part.correlation.p_value[:, 0]).all()


@pytest.mark.parametrize("bad", [0, 2.5])
def test_bad_input_is_refused(found, bad):
    with pytest.raises(ValueError, match="lags must be"):
        tma.residual_tests(found, lags=bad)
    with pytest.raises(ValueError, match="cosines must be"):
        tma.residual_tests(found, cosines=bad)


def test_a_sigma_that_is_too_small_is_called_that_and_nothing_else(scenario):
    """Sigma a third of what it is: nearly all of 100 runs are told by size alone."""
    angles = scenario.measure() + 3 * (scenario.simulate(100, seed=21) - scenario.measure())
    said = [tma.residual_tests(tma.fit(scenario, run)).warnings() for run in angles]
    alone = sum(bool(texts) and all("as large as sigma says" in text for text in texts) for texts in said)
    assert binomtest(alone, 100).proportion_ci(0.999).low > 0.85


def test_a_wild_bearing_is_still_named_first(scenario):
    angles = scenario.simulate(100, seed=22)
    angles[:, 20] += np.radians(20)
    said = [tma.residual_tests(tma.fit(scenario, run)).warnings()[0] for run in angles]
    named = sum(f"at {scenario.times[20]:g} s" in text for text in said)
    assert named > 95
