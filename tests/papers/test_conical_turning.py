"""The experiment of conical-angles, Section 4.2."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.conical_angles import turning


def test_the_course_as_computed_leg_by_leg():
    """The scenario of Section 4.2, put together by hand."""
    turn, west = tma.Turn(405.0, np.radians(20) / 60), np.radians(270)
    array = tma.Course(
        (0, 0), 5.0, np.radians(135), [tma.Straight(100.0), turn, tma.Straight(295.0, heading=west)]
    )
    model = tma.ConicalAngle(tma.BOTTOM_BOUNCE, 200.0, 4000.0, heading_lag=2.0)
    sensor = tma.Sensor(model, 4.0 * np.arange(201), conical.SIGMA)
    by_hand = tma.Scenario(array, [sensor], 0.0, tma.Target((5e3, 7e3), 4.0, np.radians(45), depth=100.0))
    np.testing.assert_allclose(tma.crlb_sigma(by_hand), tma.crlb_sigma(conical.section_4_2()), rtol=1e-9)


def test_estimators_of_the_text_have_its_turn_and_no_lag():
    for name, scenario in turning.estimators("printed").items():
        assert scenario.sensors[0].model.heading_lag == 0, name
        assert scenario.platform.heading_at(502.0) < np.radians(270) - 0.01, "404 s are not over"
        assert scenario.platform.heading_at(504.5) == pytest.approx(np.radians(270)), "and now they are"
    bound = turning.reference_covariances("printed")["reduced"]
    by_hand = tma.crlb(conical.turning_array(404.0, lag=0.0, assumed_depth=100.0))
    np.testing.assert_array_equal(bound, by_hand)
    found = turning.three_estimators(seed=1, runs=20, path="printed")
    assert found["plain_cost"].mean() == pytest.approx(196, abs=25)


def test_an_array_that_points_north_measures_the_northward_cosine():
    scenario = turning.held_north(conical.turning_array(405.0, lag=0.0))
    dx, dy = (scenario.target.position_at(scenario.times) - scenario.platform.position_at(scenario.times)).T
    zeta = 2 * conical.BOTTOM_DEPTH - conical.TARGET_DEPTH - conical.ARRAY_DEPTH
    np.testing.assert_allclose(scenario.measure(), dy / np.sqrt(dx**2 + dy**2 + zeta**2), rtol=1e-12)


def test_experiment_loses_no_run_and_separates_right_from_wrong_models():
    found = turning.three_estimators(seed=1, runs=40)
    for name, scenario in turning.estimators().items():
        assert found[name].shape == (40, len(scenario.coordinates))
        assert np.isfinite(found[name]).all()
    assert found["plain_cost"].mean() == pytest.approx(196, abs=15)
    assert found["conventional_cost"].min() > 10 * found["plain_cost"].max()
    known = turning.with_assumed_depth(seed=1, runs=40, depth=turning.ASSUMED_DEPTH)["errors"]
    np.testing.assert_array_equal(known, found["reduced"])


def test_random_starts_stay_within_reach():
    starts = turning.random_starts(50, reach=1e3, speed=2.0)
    assert np.hypot(*starts[:, :2].T).max() <= 1e3
    assert np.hypot(*starts[:, 2:].T).max() <= 2.0
