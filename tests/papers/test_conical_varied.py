"""Causes that were tried for Tables 5 and 6 of conical-angles: without size they change nothing."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.conical_angles import tables, variants, varied
from tmalib.papers.conical_angles.paper import PAPER

SEED = PAPER.stream("conical/5.2").chunk()
AS_DESCRIBED = variants.attempt(SEED, 50, 2000.0)["errors"]


@pytest.mark.parametrize("cause", list(varied.SETTINGS)[-4:])
def test_without_a_size_nothing_changes(cause):
    np.testing.assert_allclose(varied.varied_runs(SEED, 50, 2000.0, cause, 0.0), AS_DESCRIBED, atol=1e-4)


@pytest.mark.parametrize(
    ("cause", "size"),
    [("assumed depth, fixed", 300.0), ("assumed depth, 300 m to a limit", 300.0)]
    + [(cause, 0.0) for cause in varied.SETTINGS if "bottom, " in cause],
)
def test_as_described(cause, size):
    np.testing.assert_allclose(varied.varied_runs(SEED, 50, 2000.0, cause, size), AS_DESCRIBED, atol=1e-4)


def test_cosines_are_those_of_the_scenario_and_of_a_turned_one():
    scenario = conical.section_5_2(4000.0, 100.0)
    ours = varied.cosines(scenario, 4000.0, array=np.array([200.0, 150.0]))
    np.testing.assert_allclose(ours[0], scenario.measure(), rtol=1e-14)
    exchanged = varied.cosines(scenario, 4000.0, array=np.array([0.0]))[0]
    assert np.all(exchanged[76:] < ours[0, 76:]), "higher above the bottom, a smaller cosine"
    place = scenario.target.position_at(scenario.sensors[0].times)
    turned = varied.cosines(scenario, 4000.0, heading=np.array([0.1]))[0, :76]
    across, along = place @ [[np.cos(0.1)], [-np.sin(0.1)]], place @ [[np.sin(0.1)], [np.cos(0.1)]]
    np.testing.assert_allclose(turned, (along / np.sqrt(along**2 + across**2 + 100**2)).ravel())
    upright = varied.cosines(scenario, 4000.0, pitch=np.array([np.pi / 2]))[0, 76:]
    np.testing.assert_allclose(upright, 7700 / np.sqrt((place**2).sum(axis=1) + 7700**2))


def test_a_varied_depth_is_a_mixture_of_fixed_ones():
    """First order: the mean error is that of the mean depth, 350 m."""
    errors = varied.varied_runs(SEED, 2000, 2000.0, "assumed depth, 300 m to a limit", 400.0)
    fixed = varied.varied_runs(SEED, 2000, 2000.0, "assumed depth, fixed", 350.0)
    error = tma.statistics(errors).bias_se()
    assert np.all(np.abs(errors.mean(axis=0) - fixed.mean(axis=0)) < 3 * error)
    assert errors.std(axis=0)[0] > fixed.std(axis=0)[0]


def test_chi_square_of_gaussian_errors_by_the_closed_form():
    """Their sample deviations have the covariance ``c^2 / (2 s_i s_j n)``, means ``c / n``."""
    std = np.array([400.0, 250.0, 1.2, 2.4])
    signs = np.array([1, 1, -1, -1])
    covariance = 0.85 * np.outer(signs * std, signs * std) + 0.15 * np.diag(std**2)
    errors = np.random.default_rng(1).multivariate_normal(np.zeros(4), covariance, 400_000)
    blocks = {"bias": covariance, "std_sample": covariance**2 / (2 * np.outer(std, std))}
    expected = 0.0
    for column, value in (("bias", 0), ("std_sample", std)):
        printed = [PAPER.printed("Table 5", row, column) for row in tables.ROWS]
        rounding = np.diag([p.last_digit**2 / 12 for p in printed])
        off = value - np.array([p.value for p in printed])
        expected += off @ np.linalg.solve(blocks[column] / 500 + rounding, off)
    assert varied.chi_square("Table 5", errors) == pytest.approx(expected, rel=0.03)
