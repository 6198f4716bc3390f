"""An array that turns by a degree: the scene, its mirror ghost and the odds of its fits."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.papers.conical_angles import slight_turn


def cosines(state, turn):
    """Both rays by hand, at the depth of the scene's target."""
    x, y, vx, vy = state
    times, angle = np.arange(0, 601, 20.0), np.radians(turn)
    late = np.maximum(times - 300, 0)
    east = x + vx * times - 3 * late * np.sin(angle)
    north = y + vy * times - 3 * (np.minimum(times, 300) + late * np.cos(angle))
    heading = np.where(times > 300, angle, 0)
    ahead = east * np.sin(heading) + north * np.cos(heading)
    images = (300.0 - 20.0, 2 * 2000.0 - 300.0 - 20.0)
    return np.concatenate([ahead / np.sqrt(east**2 + north**2 + image**2) for image in images])


def off_the_turn(values):
    """Without the instant of the turn, where the heading is either."""
    return np.delete(values, [15, 46])


def test_the_scene_by_hand():
    scene = slight_turn.scene(2.0, assumed_depth=300.0)
    by_hand = cosines([1500.0, 2500.0, -2.0, -3.0], 2.0)
    np.testing.assert_allclose(off_the_turn(scene.measure()), off_the_turn(by_hand), atol=1e-12)
    assert scene.sigma == pytest.approx(0.012)


def test_without_a_turn_the_mirror_image_is_exact_and_with_one_it_costs_its_square():
    assert slight_turn.mirror_ghost(0.0).cost < 1e-12
    small, double = (slight_turn.mirror_ghost(turn) for turn in (0.1, 0.2))
    assert double.cost / small.cost == pytest.approx(4, rel=0.02)
    state, scene = double.state, slight_turn.scene(0.2, 300.0)
    residuals = (cosines(state, 0.2) - cosines(scene.state, 0.2)) / 0.012
    assert np.sum(residuals**2) == pytest.approx(double.cost, rel=0.1), "the instant of the turn apart"


def test_odds_are_those_of_a_fit_without_a_start_and_its_alternatives():
    """What is fitted from both sides is what is found from neither."""
    found = slight_turn.odds(3, 12, 1.0)
    scene = slight_turn.scene(1.0, 300.0)
    for k, measured in enumerate(scene.simulate(12, 3)):
        estimate = tma.fit(scene, measured)
        others = tma.alternatives(estimate, within=60)
        assert found["right"][k] == (estimate.state[0] > 0)
        stated = 1 / (1 + sum(other.likelihood for other in others))
        assert found["probability"][k] == pytest.approx(stated, abs=1e-3)
