"""Worst perturbations, harder weaves, other motion models of robustness: against fits, geometry, limits."""

from dataclasses import replace

import numpy as np
import pytest

import tmalib as tma
from tmalib import sensitivity as sens
from tmalib.papers.robustness import scenarios as paper
from tmalib.papers.robustness import worst


@pytest.fixture(scope="module")
def final(geometry):
    return sens.position_criterion(geometry.straight, paper.DURATION)


def test_power_is_the_level_when_nothing_is_wrong_and_that_of_simulated_runs(geometry):
    straight, displacement = geometry.straight, 3 * geometry.circle_displacement / 4
    assert worst.residual_test_power(straight, 0.0) == pytest.approx(worst.LEVEL, abs=1e-9)
    measured = sens.displaced_measurements(straight, displacement)
    cost = tma.fit(straight, measured, start=geometry.theta_star, tolerance=1e-6).cost
    runs = 2000
    noise = straight.sigma * np.random.default_rng(1).standard_normal((runs, len(straight.times)))
    found = tma.fit(straight, measured + noise, start=geometry.theta_star).cost
    limit = np.quantile(np.sum(np.random.default_rng(2).standard_normal((20_000, 496)) ** 2, axis=1), 0.95)
    expected = float(worst.residual_test_power(straight, cost))
    assert 0.3 < expected < 0.95, "neither certain nor hopeless"
    # four standard errors of a share, and the quantile's own
    assert abs((found > limit).mean() - expected) < 4 * np.sqrt(expected * (1 - expected) / runs) + 0.02


def test_damage_is_that_of_the_displaced_scenario(geometry, final):
    displacement = geometry.worst_displacement
    found = worst.damage(geometry, displacement)
    for k, sign in enumerate((1, -1)):
        truth = geometry.displaced(sign * displacement)
        fitted = tma.fit(geometry.straight, truth.measure(), start=geometry.theta_star, tolerance=1e-6)
        assert found.actual[k] == pytest.approx(np.linalg.norm(final @ (fitted.state - geometry.theta_star)))
    small = worst.damage(geometry, 1e-3 * displacement)
    assert small.actual == pytest.approx(small.linear, rel=1e-3), "first order for small displacements"
    wave = 2.0 * np.cos(3.0 * geometry.straight.times)[:, None] * np.array([0.6, 0.8])
    assert worst.damage(geometry, wave).acceleration == pytest.approx(18.0, rel=2e-3)


@pytest.mark.parametrize("acceleration", [2.0, 20.0])
def test_flyable_limit_encloses(geometry, final, acceleration):
    """Random flyable waves stay below, the programme's displacement comes within the polygons' corners."""
    straight = geometry.straight
    found = sens.worst_flyable(straight, 15.0, acceleration, criterion=final, directions=1)
    shift = final @ sens.differential(straight, found)
    direction = shift / np.linalg.norm(shift)
    limit = worst.flyable_limit(straight, 15.0, acceleration, direction, final)
    assert np.cos(np.pi / 12) * limit * (1 - 1e-6) < direction @ shift <= limit
    rng = np.random.default_rng(3)
    for _ in range(50):
        period, phase = rng.uniform(3, 20), rng.uniform(0, 2 * np.pi)
        size = min(15.0, acceleration * (period / (2 * np.pi)) ** 2)
        heading = np.array([np.sin(3 * phase), np.cos(3 * phase)])
        wave = size * np.cos(2 * np.pi * straight.times / period + phase)[:, None] * heading
        assert abs(direction @ final @ sens.differential(straight, wave)) <= limit


def test_flyable_limit_without_a_limit_of_acceleration_is_the_support_function(geometry, final):
    w = np.array([0.6, -0.8])
    gain = w @ final @ sens.response(geometry.straight).gain
    limit = worst.flyable_limit(geometry.straight, 15.0, 1e6, w, final)
    assert limit == pytest.approx(15.0 * np.abs(gain).sum(), rel=1e-6)


def test_harder_turns_harder_at_the_same_times(geometry):
    twice = worst.harder(geometry, 2.0)
    dt, at = 1e-3, np.array([0.5, 3.0, 8.0, 15.0])
    for course, expected in ((geometry.platform, 50.0), (twice.platform, 100.0)):
        before, now, after = (course.position_at(at + shift) for shift in (-dt, 0.0, dt))
        assert np.hypot(*(after - 2 * now + before).T) / dt**2 == pytest.approx(expected, rel=1e-4)
        assert np.hypot(*(after - before).T) / (2 * dt) == pytest.approx(250.0, rel=1e-6)
    assert worst.harder(geometry, 1.0).platform.position_at(20.0) == pytest.approx(
        geometry.platform.position_at(20.0)
    )
    assert twice.theta_star == pytest.approx(geometry.theta_star), "the target is the same"


def test_worst_final_is_linear_in_the_bound_and_falls_with_the_manoeuvre(geometry):
    assert worst.worst_final(geometry, 30.0) == pytest.approx(2 * worst.worst_final(geometry, 15.0))
    gain = worst.manoeuvre_gain(geometry)
    assert gain == pytest.approx(worst.worst_final(worst.harder(geometry, 2.0)) / worst.worst_final(geometry))
    assert 0.3 < gain < 0.8


def test_weave_across_is_what_a_target_must_do_to_look_farther(geometry):
    """The parallax: exact geometry of the stealth displacement."""
    track = geometry.platform.position_at(geometry.straight.times)
    steady = sens.nearest_motion(geometry.straight.times, track, norm="squares")
    beta = 1 / (1 - 1e-3)
    found = sens.stealth(geometry.straight, steady + beta * (geometry.theta_star - steady))
    along = sens.response(geometry.straight).along(found)
    weave = worst.weave_across(geometry)
    assert np.abs(along / 1e-3 - weave).max() < 0.03 * np.abs(weave).max()  # weave over range: second order


MODELS = [
    (worst.AcceleratedBearing(), [400.0, 6000.0, -20.0, -260.0, 3.0, -5.0]),
    (worst.TurningBearing(), [400.0, 6000.0, -20.0, -260.0, 0.026]),
    (worst.TurningBearing(), [400.0, 6000.0, -20.0, -260.0, 0.0]),
    (worst.TurningBearing(), [400.0, 6000.0, -20.0, -260.0, 3e-6]),
]


@pytest.mark.parametrize(("model", "state"), MODELS)
def test_gradient_of_the_other_models(geometry, model, state):
    truth = geometry.straight
    scenario = replace(truth, sensors=[tma.Sensor(model, truth.times, paper.SIGMA)])
    state = np.array(state)
    _, gradient = scenario.linearise(state)
    step = np.array([1.0, 1.0, 1e-1, 1e-1, *np.full(len(state) - 4, 1e-5 if len(state) == 5 else 1e-2)])
    for i, size in enumerate(step):
        up, down = (scenario.linearise(state + sign * size * np.eye(len(state))[i])[0] for sign in (1, -1))
        # differences of second order, rounding 1e-16 / step
        assert np.abs((up - down) / (2 * size) - gradient[:, i]).max() < 1e-5 * np.abs(gradient[:, i]).max()


def test_other_models_move_like_the_motions_they_are_named_for(geometry):
    times = geometry.circle.times
    course, rate = geometry.target, geometry.target.legs[0].rate
    velocity = course.speed * np.array([np.sin(course.heading), np.cos(course.heading)])
    place, _ = worst.TurningBearing().motion([*course.start, *velocity, rate], times)
    np.testing.assert_allclose(place.T, course.position_at(times), rtol=0, atol=1e-8)
    place, _ = worst.TurningBearing().motion([*course.start, *velocity, 0.0], times)
    np.testing.assert_allclose(place.T, course.start + times[:, None] * velocity, rtol=1e-12)
    place, _ = worst.AcceleratedBearing().motion([0.0, 0.0, *velocity, 2.0, -4.0], times)
    second = np.diff(place, 2, axis=1) * paper.RATE**2
    np.testing.assert_allclose(second.T, np.tile([2.0, -4.0], (len(times) - 2, 1)), atol=1e-6)


def test_a_model_is_fitted_by_the_estimator_and_responds_as_the_differential_says(geometry):
    truth = geometry.straight
    scenario = replace(truth, sensors=[tma.Sensor(worst.AcceleratedBearing(), truth.times, paper.SIGMA)])
    state = np.array([*geometry.theta_star, 0.0, 0.0])
    displacement = 1e-2 * geometry.worst_displacement
    expected = sens.differential(scenario, displacement, state)
    measured = sens.displaced_measurements(scenario, np.stack([displacement, -displacement]), state)
    found = tma.fit(scenario, measured, start=state, tolerance=1e-8)
    assert found.converged.all()
    assert (found.state[0] - found.state[1]) / 2 == pytest.approx(expected, rel=1e-3, abs=1e-3)


def test_other_models(geometry):
    found = worst.other_models(geometry)
    assert found["linear"] == pytest.approx(worst.worst_final(geometry) / geometry.final_range)
    assert set(found) == {"linear", "polynomial", "circular"}
    assert found["polynomial"] > found["linear"], "twice the degree, the same 15 m"


def test_the_rule_of_thumb_is_a_lower_bound(geometry):
    """A copied weave is stealthy and has ``bound`` as its largest value across: it attains the rule."""
    found = worst.times_the_rule(geometry)
    weave = worst.weave_across(geometry)
    assert found["rule"] == pytest.approx(paper.WORST / np.abs(weave).max())
    straight = geometry.straight
    copied = found["rule"] * sens.response(straight).displacement(weave)
    assert np.hypot(*copied.T).max() == pytest.approx(paper.WORST)
    final = sens.position_criterion(straight, paper.DURATION)
    moved = np.linalg.norm(final @ sens.differential(straight, copied))
    attained = moved / geometry.final_range / found["rule"]
    assert attained == pytest.approx(1, abs=2 * np.abs(weave).max() / geometry.final_range)
    assert attained <= found["stealth"] * (1 + 1e-6)
    assert found["stealth"] < found["sup"]
    assert found["sup"] * found["rule"] * geometry.final_range == pytest.approx(worst.worst_final(geometry))
