"""The scenarios of the chapter on a biased sonar, against plain kinematics and against first order."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.stats import norm

import tmalib as tma
from tmalib.beyond import acoustic_bias as study
from tmalib.papers.emw_acoustic import scenarios as emw


@pytest.mark.parametrize("moving", [False, True])
def test_two_sounds_at_the_vertex_have_the_same_derivative_along_the_lost_direction(moving):
    """And others have not: the gradient of the library along the stretch, not the formula of the chapter."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        scene, vertex = study.passing_scene(rng, moving)
        here, next_second = scene.platform.position_at(scene.reference_time + np.array([0.0, 1.0]))
        stretch = scene.state - np.concatenate([here, next_second - here])
        heard = study.heard_at(scene, [vertex - 80, vertex + 80, vertex + 200])
        first, same, other = heard.linearise(scene.state)[1][-3:] @ stretch
        assert same == pytest.approx(first, rel=1e-9)
        assert abs(other / first - 1) > 1e-8
        if not moving:
            assert vertex == pytest.approx(300)


def test_the_bias_is_added_to_the_sonar_alone():
    plain = emw.scenario(2)
    biased = study.with_bias(plain, 0.01)
    light = len(plain.sensors[0])
    assert biased.measure()[:light] == pytest.approx(plain.measure()[:light])
    assert biased.measure()[light:] - plain.measure()[light:] == pytest.approx(0.01)
    assert study.sonar_alone(biased).coordinates[-1] == "bias"
    assert np.ptp(study.at_rest(plain).platform.position_at([0.0, 500.0]), axis=0) == pytest.approx([0, 0])


def test_a_track_turned_about_a_motionless_observer_is_told_by_no_sound():
    biased = study.sonar_alone(study.with_bias(study.at_rest(emw.scenario(2))))
    turn = 0.3
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    x = biased.state
    turned = np.concatenate([rotation @ x[:2], rotation @ x[2:4], [x[4] - turn]])
    assert tma.wrap(biased.linearise(turned)[0] - biased.linearise(x)[0]) == pytest.approx(0, abs=1e-12)


def test_the_task_finds_what_first_order_says():
    found = study.price_of(emw.scenario(6))
    bias = 4 * found.sigma
    run = study.task(6, bias)(np.random.SeedSequence(1), 400)
    assert {key: value.shape[1:] for key, value in run.items()} == {
        "estimated": (5,), "nees": (), "apart": (), "ignored": (4,), "p_value": (), "converged": (3,),
    }  # fmt: skip
    assert run["converged"].all()
    assert run["apart"].max() < 0.01
    error = study.along_hardest(found, run["ignored"])
    assert error.mean() == pytest.approx(bias * found.displaced, abs=4 / np.sqrt(400) + 0.05)
    assert error.std() == pytest.approx(1, abs=4 / np.sqrt(800))


def test_the_u_is_a_u():
    """Its sides, and the target half way."""
    scene = study.on_a_u(np.array([0.0, 600.0, 1800.0, 2400.0]), tma.Bearing(), 3e3 + 9e3j, -10 + 5j)
    expected = [[-6e3, 0], [-3e3, 0], [-3e3, 6e3], [-6e3, 6e3]]
    assert scene.platform.position_at(scene.times) == pytest.approx(np.array(expected), abs=1e-6)
    assert scene.state == pytest.approx([3e3, 9e3, -10, 5, 0])


def test_how_often_the_estimate_tells():
    draws = 4 + np.random.default_rng(2).standard_normal(200_000)
    share = np.mean(abs(draws) > norm.isf(0.005))
    assert study.told_by_estimate(4) == pytest.approx(share, abs=0.003)
    assert study.told_by_estimate(0) == pytest.approx(0.01)


def test_the_drawings_draw():
    times = np.linspace(-10, 10, 21)
    track = np.stack([100 * times, np.full(21, 500.0)], axis=-1)
    figure = study.draw_twins(times, [track, 2 * track], [0 * times, 0 * times], 0.1, np.array([-5, 5]))
    assert len(figure.axes) == 2
    found = {6: study.price_of(emw.scenario(6))}
    run = study.task(6, found[6].sigma)(np.random.SeedSequence(1), 20)
    assert len(study.draw_ignored(found, {6: [run]}, [1]).axes) == 2
    plt.close("all")
