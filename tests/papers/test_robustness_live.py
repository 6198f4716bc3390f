"""The live view of period and size: the phase, the fit and the bearings, each against another way."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from tmalib.papers.robustness import period_view as view
from tmalib.papers.robustness import periodic, scenarios


@pytest.mark.parametrize("period", [1, 3.1, 7, 15])
def test_the_worst_phase_has_the_size_of_the_semi_axis(geometry, period):
    scenario = geometry.straight
    phase = view.worst_phase_of(scenario, period)
    wave = np.cos(2 * np.pi * scenario.times / period + phase)
    shift = periodic.end_gain(scenario) @ wave
    assert np.hypot(*shift) == pytest.approx(periodic.worst_phase(scenario, period), rel=1e-4)
    away = scenario.target.position_at(20.0) - scenario.platform.position_at(20.0)
    assert shift @ away > 0, "away from the platform"


def test_the_estimate_is_the_least_squares_fit_of_what_is_seen(geometry):
    """By scipy, with finite differences, of the bearings of the displaced positions."""
    scenario, found = geometry.straight, view.perturbed(geometry.straight, 7, 15)
    here = scenario.platform.position_at(scenario.times)
    there = scenario.target.position_at(scenario.times) + found.displacement

    def angles(places):
        return np.arctan2(*(places - here).T)

    assert np.allclose(found.seen, angles(there) - scenario.measure(), atol=1e-12)
    other = least_squares(
        lambda x: angles(x[:2] + scenario.times[:, None] * x[2:]) - angles(there),
        scenario.state, x_scale=[1e3, 1e3, 100, 100], xtol=1e-14, ftol=1e-14, gtol=1e-14,
    ).x  # fmt: skip
    assert np.allclose(other, found.state, rtol=1e-3)
    end = found.state[:2] + 20 * found.state[2:]
    assert np.hypot(*(end - scenario.target.position_at(20.0))) == pytest.approx(found.error)
    assert np.allclose(angles(view.track(found.state, scenario.times)), scenario.measure() + found.fitted)


def test_a_run_without_an_estimate_says_so(geometry):
    found = view.perturbed(geometry.straight, 7, 100)
    assert np.isnan(found.state).all()
    assert np.isnan(found.fitted).all()
    assert np.isfinite(found.seen).all()
    assert view.in_words(found).startswith("No estimate")
    assert "13.1 m off" in view.in_words(
        view.Perturbed(found.displacement, found.state, 13.1, found.seen, found.seen)
    )


def test_sizes_are_those_of_the_paper_too():
    assert {scenarios.WORST, scenarios.PERIODIC_AMPLITUDE} <= set(view.AMPLITUDES)
    assert {scenarios.WEAVE_PERIOD, scenarios.PERIODIC_PERIOD} <= set(view.PERIODS)
    assert list(view.PERIODS) == sorted(view.PERIODS)
