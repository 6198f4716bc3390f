"""What a fit says of itself: against many runs, other formulas and the bound."""

import numpy as np
import pytest

import tmalib as tma


@pytest.fixture(scope="module")
def found(scenario):
    return tma.fit(scenario, scenario.simulate(2000, seed=9))


def test_the_predicted_ellipse_holds_the_target(scenario, found):
    """Five minutes ahead, in nine of ten runs."""
    later, inside = found.at(900.0), 0
    truth = scenario.target.position_at(900.0)
    for state, covariance in zip(later.state[:, :2], later.covariance[:, :2, :2], strict=True):
        inside += tma.nees(state, truth, covariance) <= -2 * np.log(0.1)
    assert abs(inside / 2000 - 0.9) < 4 * np.sqrt(0.09 / 2000)


def test_prediction_is_that_of_the_motion(scenario, found):
    later = found.at(750.0)
    target = tma.Target.from_velocity(found.state[3, :2], found.state[3, 2:], time=scenario.reference_time)
    np.testing.assert_allclose(later.state[3], target.state(750.0), rtol=1e-12)
    phi = tma.transition(150.0)
    np.testing.assert_allclose(
        later.covariance[3], phi @ tma.crlb(scenario, found.state[3]) @ phi.T, rtol=1e-9
    )
    one = tma.fit(scenario, found.measured[3]).at(750.0)
    shape = one.ellipse(0.9)
    area = -2 * np.log(0.1) * np.pi * np.sqrt(np.linalg.det(one.covariance[:2, :2]))
    assert shape.area == pytest.approx(area)


def test_sigma_is_that_of_the_errors(scenario, found):
    spread = (found.state - scenario.state).std(axis=0, ddof=1)
    np.testing.assert_allclose(found.sigma.mean(axis=0), spread, rtol=0.1)


def test_the_sandwich_is_the_bound_on_the_model(scenario):
    """Without noise the residuals vanish."""
    one = tma.fit(scenario, scenario.measure(), tolerance=1e-8)
    np.testing.assert_allclose(one.sandwich, one.covariance, rtol=1e-4)


def test_one_run_where_one_is_needed(found):
    with pytest.raises(ValueError, match="an ellipse is of one run"):
        found.at(700.0).ellipse()
    with pytest.raises(ValueError, match="the sandwich is of one run"):
        found.sandwich  # noqa: B018


def test_without_freedom_there_is_no_p_value(scenario):
    short = tma.Scenario(scenario.platform, [tma.Sensor(tma.Bearing(), [0.0, 200, 400, 600], 0.01)], 600.0)
    some = tma.fit(short, short.with_target(scenario.target).measure(), scenario.state)
    assert some.freedom == 0
    assert np.isnan(some.p_value)
