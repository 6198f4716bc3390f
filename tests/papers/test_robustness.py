"""The phrases of the third paper: their limits, and their measures against independent ones."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import least_squares

import tmalib as tma
from tmalib import judging, status
from tmalib.montecarlo import Runs, Source
from tmalib.papers.robustness import measures
from tmalib.papers.robustness import phrases as text
from tmalib.papers.robustness import scenarios as paper


def test_the_estimate_of_the_circle_is_scipys(geometry):
    straight, measured = geometry.straight, geometry.circle.measure()

    def residual(state):
        return straight.residual(measured, straight.linearise(state)[0])

    scale = tma.crlb_sigma(straight)
    peer = least_squares(residual, geometry.theta_star, x_scale=scale, method="lm", xtol=1e-12, ftol=1e-12)
    end = peer.x[:2] + 20 * peer.x[2:]
    error = np.hypot(*(end - geometry.target.position_at(20.0)))
    platform = geometry.platform.position_at(20.0)
    away = np.hypot(*(geometry.theta_star[:2] + 20 * geometry.theta_star[2:] - platform))
    assert measures.circular_error(geometry) == pytest.approx(error / away, rel=1e-4)


def test_final_sigma_is_that_of_an_ellipse(geometry):
    covariance = tma.crlb(geometry.straight.until(paper.DURATION))
    ellipse = tma.confidence_ellipse([0, 0], covariance, probability=1 - np.exp(-0.5))  # one sigma
    assert measures.final_sigma(geometry) == pytest.approx(
        ellipse.semi_axes[0] / geometry.final_range, rel=1e-9
    )


def test_worst_speed_is_that_of_the_displaced_target(geometry):
    times = geometry.straight.times
    deviations = []
    for sign in (1, -1):
        places = geometry.displaced(sign * geometry.worst_displacement).target.position_at(times)
        speed = np.hypot(*np.diff(places, axis=0).T) * paper.RATE
        deviations.append(np.abs(speed / np.hypot(*geometry.theta_star[2:]) - 1).max())
    assert measures.worst_speed(geometry) == pytest.approx(max(deviations), rel=0.05)


def test_an_estimate_without_a_minimum_is_infinite_and_bad():
    """The geometry whose estimate runs to infinity stays among the others."""
    lost = paper.random_geometry(np.random.SeedSequence(5, spawn_key=(16,)))
    assert measures.circular_error(lost) == np.inf
    assert text.PHRASES["BLS, circular target"].holds(np.inf)
    assert np.isnan(measures.development_error(lost))
    assert not text.PHRASES["first order, circular target"].holds(np.nan)


@pytest.fixture
def runs():
    """Made up: ten scenarios; clouds degenerate in the first four; the BLS bad in the last five."""
    found = {name: np.full(10, 0.2) for name in text.PHRASES}
    found["form"] = np.arange(10) % 4
    for case in text.CASES:
        found[f"families, {case}"] = np.array([1.0] * 4 + [10.0] * 6)
        found[f"BLS, {case}"] = np.array([0.05] * 5 + [0.2] * 5)
        found[f"particles against BLS, {case}"] = np.linspace(0.5, 1.4, 10)
    found["first order, circular target"] = np.array([np.nan] * 4 + [0.05] * 6)
    return found


def test_degenerate_clouds_and_a_good_bls_do_not_count(runs):
    shares = text.shares(runs)
    assert shares["BLS, circular target"] == (5, 10)
    assert shares["particles, circular target"] == (5, 5), "sound clouds, where the BLS is bad"
    assert shares["EKF against BLS, circular target"] == (0, 5), "where the BLS is bad"
    assert shares["bearings, worst perturbation"] == (5, 5)
    assert shares["speeds, worst perturbation"] == (0, 10)
    assert shares["particles against BLS, worst perturbation"] == (5, 5)
    assert shares["first order, circular target"] == (6, 10), "what is not a number does not hold"
    assert text.shares(runs, runs["form"] == 0)["particles, circular target"] == (1, 1)
    assert not text.sound("particles, circular target", runs)[:4].any()


def test_judged_by_the_share_of_scenarios(runs):
    runs = Runs(runs, Source("", "toy", 1, 0))
    table = text.judge_phrases(runs)
    assert len(table) == len(text.PHRASES) == 20
    assert table.of("other models", "claim").verdict == judging.DEPENDS, "ten of ten: the interval is wide"
    claim = table.of("particles, circular target", "claim")
    assert claim.note.startswith("holds in 5 of 5 plausible scenarios (48 to 100 %): at least 0.1 was asked")
    assert "left out" not in claim.note, "the BLS is good where the clouds are degenerate"
    few = {f"families, {text.CASES[0]}": np.array([2.0] * 7 + [11.0] * 3)}
    runs = Runs(dict(runs) | few, runs.source)
    claim = text.judge_phrases(runs).of("particles, circular target", "claim")
    assert "2 degenerate clouds are left out" in claim.note
    with pytest.raises(ValueError, match="our value"):
        text.judge_phrases(
            Runs(dict(runs) | {"first order, circular target": np.full(10, np.nan)}, runs.source)
        )
    assert text.middle("first order, circular target", [np.nan, 0.05, 0.06]) == 0.06
    assert text.middle("BLS, circular target", [np.nan, 0.05, 0.06]) == 0.05


def test_only_what_has_no_minimum_is_at_infinity(monkeypatch):
    """A fit that failed for another reason says nothing of where the estimate would be."""
    words = np.array([status.CONVERGED, status.NO_MINIMUM, status.RAN_AWAY, status.ITERATION_LIMIT])
    found = SimpleNamespace(state=np.ones((4, 4)), status=words, converged=words == status.CONVERGED)
    monkeypatch.setattr(measures, "fit", lambda *told, **more: found)
    state = measures.fit_or_infinity(SimpleNamespace(straight=None, theta_star=None), None)
    np.testing.assert_array_equal(state[:, 0], [1.0, np.inf, np.inf, np.nan])
