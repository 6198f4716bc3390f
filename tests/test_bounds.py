from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest
from scipy.stats import chi2

import tmalib as tma
from tmalib.bounds import whitened_jacobian


def test_information_is_additive_symmetric_and_semidefinite(scenario):
    whole = tma.fisher_information(scenario)
    parts = [tma.fisher_information(replace(scenario, sensors=[sensor])) for sensor in scenario.sensors]
    np.testing.assert_allclose(whole, sum(parts), rtol=1e-12)
    for part in [whole, *parts]:
        np.testing.assert_allclose(part, part.T)
        assert np.linalg.eigvalsh(part).min() > -1e-12 * np.abs(part).max()


def test_information_is_of_measurements_in_standard_deviations(scenario):
    """Against differences of the predictions; the standard deviations are those of the fixture."""
    steps = np.diag([1.0, 1.0, 1e-2, 1e-2])
    ends = (scenario.linearise(scenario.state + sign * steps)[0] for sign in (1, -1))
    slope = np.subtract(*ends).T / (2 * np.diag(steps))
    weight = 1 / np.radians(np.repeat([0.5, 0.7], [61, 16])) ** 2
    np.testing.assert_allclose(
        tma.fisher_information(scenario), slope.T @ (weight[:, None] * slope), rtol=1e-5
    )


def test_one_more_sensor_never_hurts(scenario):
    alone = tma.crlb(replace(scenario, sensors=scenario.sensors[:1]))
    assert np.linalg.eigvalsh(alone - tma.crlb(scenario)).min() > -1e-6


def test_bound_against_exact_arithmetic(scenario):
    jacobian = mp.matrix(whitened_jacobian(scenario).tolist())
    with mp.workdps(60):
        exact = np.array(((jacobian.T * jacobian) ** -1).tolist(), dtype=float)
    np.testing.assert_allclose(tma.crlb(scenario), exact, rtol=1e-9)


def test_bound_moves_with_the_reference_time(scenario):
    start = replace(scenario, reference_time=0.0)
    phi = tma.transition(600.0)
    np.testing.assert_allclose(tma.crlb(scenario), phi @ tma.crlb(start) @ phi.T, rtol=1e-8)


def test_batch_of_states(scenario):
    states = scenario.state + np.array([[0.0] * 4, [50.0, -20.0, 0.1, 0.2]])
    bounds = tma.crlb(scenario, states)
    np.testing.assert_allclose(bounds[0], tma.crlb(scenario))
    np.testing.assert_allclose(bounds[1], tma.crlb(scenario, states[1]))
    np.testing.assert_allclose(tma.crlb_sigma(scenario, states)[1], np.sqrt(np.diag(bounds[1])))


def test_straight_observer_and_instantaneous_bearings_are_not_observable(scenario):
    straight = tma.Course((0, 0), 8.0, np.pi / 2, [tma.Straight(600)])
    blind = replace(scenario, platform=straight, sensors=scenario.sensors[:1])
    assert tma.information_rank(blind) == 3
    with pytest.raises(ValueError, match="rank 3 of 4"):
        tma.crlb(blind)
    few = replace(scenario, sensors=[tma.Sensor(tma.Bearing(), [0.0, 10.0], 0.1)])
    with pytest.raises(ValueError, match="rank 2 of 4"):
        tma.crlb(few)


def test_ellipse_holds_its_share():
    covariance = np.array([[9.0, 5.0], [5.0, 4.0]])
    centre = np.array([10.0, -3.0])
    shape = tma.confidence_ellipse(centre, covariance, 0.9)
    boundary = shape.boundary(60)
    np.testing.assert_allclose(tma.nees(boundary, centre, covariance), chi2.ppf(0.9, 2))
    points = np.random.default_rng(0).multivariate_normal(centre, covariance, 20_000)
    assert np.mean(tma.nees(points, centre, covariance) <= chi2.ppf(0.9, 2)) == pytest.approx(0.9, abs=0.01)
    x, y = (boundary - centre)[:-1].T
    shoelace = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    assert shape.area == pytest.approx(shoelace, rel=0.01)
    assert shape.area == pytest.approx(np.pi * chi2.ppf(0.9, 2) * np.sqrt(np.linalg.det(covariance)))


def test_ellipse_heading_is_clockwise_from_north():
    shape = tma.confidence_ellipse((0, 0), np.diag([100.0, 1.0]))
    assert np.sin(shape.heading) ** 2 == pytest.approx(1.0)  # long axis east-west
    assert shape.semi_axes[0] > shape.semi_axes[1]


def test_nees_is_chi_square():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(4, 4))
    covariance = root @ root.T
    values = tma.nees(rng.normal(size=(20_000, 4)) @ root.T, np.zeros(4), covariance)
    low, high = tma.nees_limits(4, 20_000, 0.999)
    assert low < values.mean() < high
    assert low < 4 < high
    assert np.var(values) == pytest.approx(8, rel=0.1)


@pytest.mark.parametrize(("gap", "there"), [(1e-12, True), (4e-15, False), (0.0, False)])
def test_a_covariance_that_is_singular_to_rounding_has_no_nees(gap, there):
    """Correlation ``1 - gap``: the error along its small axis has the square ``2 / gap`` or so."""
    found = tma.nees([1.0, -1.0], [0.0, 0.0], [[1.0, 1 - gap], [1 - gap, 1.0]])
    assert np.isfinite(found) == there
    assert not there or found == pytest.approx(2 / gap, rel=1e-3)


def test_nees_limits_shrink_with_runs():
    one, many = tma.nees_limits(4, 1), tma.nees_limits(4, 500)
    assert one[0] < many[0] < 4 < many[1] < one[1]
    np.testing.assert_allclose(one, chi2.ppf([0.05, 0.95], 4))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: tma.confidence_ellipse((0, 0), np.eye(2), 1.0), "probability must be below 1"),
        (lambda: tma.confidence_ellipse((0, 0), np.eye(2), 0.0), "probability must be greater"),
        (lambda: tma.confidence_ellipse((0, np.nan), np.eye(2)), "centre must be finite"),
        (lambda: tma.confidence_ellipse((0, 0), -np.eye(2)), "positive semi-definite"),
        (lambda: tma.nees_limits(4, 0), "runs must be a positive integer"),
        (lambda: tma.nees_limits(4, 10, 1.5), "probability must be below 1"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
