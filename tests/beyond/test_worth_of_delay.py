"""The two laws of the chapter on the delay, against the bounds of the library and against quadrature."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import tmalib as tma
from tmalib.beyond import worth_of_delay as study
from tmalib.beyond import worth_of_delay_drawing as draw
from tmalib.beyond.worth_of_delay import AIR, SEA


def test_a_state_half_way_is_seen_due_north():
    state = study.halfway_state(4e3, 10.0, np.radians(30))
    target = tma.Target.from_velocity(state[:2], state[2:])
    observer = study.straight(SEA, (0.0, 0.0))
    assert tma.Bearing().observe(target, observer, np.array([0.0])) == pytest.approx(0)
    assert np.hypot(*state[2:]) == pytest.approx(10)
    assert study.straight(SEA, (3.0, -4.0)).position_at(SEA.duration / 2) == pytest.approx([0, 0], abs=1e-9)


def test_random_states_keep_the_limits():
    states = study.random_states(AIR, np.random.default_rng(1), 500)
    for values, ends in ((states[:, 1], AIR.ranges), (np.hypot(*states[:, 2:].T), AIR.speeds)):
        assert ends[0] <= values.min() < 1.1 * ends[0]
        assert 0.9 * ends[1] < values.max() <= ends[1]


def test_later_is_the_bound_at_another_reference_time():
    """Against a scenario whose reference time is the end."""
    state = study.halfway_state(6e3, 100.0, 1.0)
    watch = study.watch(AIR, study.straight(AIR, (0.0, 0.0)))
    then = state + 30 * np.array([*state[2:], 0.0, 0.0])
    expected = tma.crlb_sigma(replace(watch, reference_time=60.0), then)[:2]
    assert study.relative_bound(watch, state, later=30.0) == pytest.approx(
        np.hypot(*expected) / np.hypot(*then[:2]), rel=1e-9
    )


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (7.0, 0.0), (-3.0, 4.0)])
def test_the_law_of_the_delay_is_the_bound_for_a_slow_far_target(velocity):
    states = study.random_states(replace(SEA, ranges=(20e3, 60e3)), np.random.default_rng(3), 50)
    law = np.hypot(*study.law_of_delay(SEA, states, velocity))
    assert study.by_delay(SEA, states, velocity) == pytest.approx(law, rel=0.03)


def test_the_second_term_counts_where_sound_travels_for_longer_than_one_listens():
    """With it the law is nearer to the bound than without, and both reach it as one listens for longer."""
    state, gaps = study.halfway_state(15e3, 10.0, np.pi / 2), []
    for duration in (20.0, 40.0, 80.0, 160.0):
        setting = replace(SEA, duration=duration)
        first, second = study.law_of_delay(setting, state)
        assert second / first == pytest.approx(np.sqrt(3) * 10 / duration, rel=1e-3)
        bound = study.by_delay(setting, state)
        gaps.append([abs(bound / np.hypot(first, second) - 1), abs(bound / first - 1)])
    whole, alone = np.array(gaps).T
    assert np.all(whole < alone / 2)
    assert np.all(np.diff(whole) < 0)
    assert whole[-1] < 0.01


def test_the_law_of_the_manoeuvre_is_the_bound_of_the_best_for_a_far_target():
    """For crossing targets of several speeds; the grid of headings and turns is coarse."""
    states = study.halfway_state(200e3, np.array([0.5, 2.0, 7.0, 15.0, 40.0]), np.pi / 2)
    assert study.best_manoeuvre(SEA, states) == pytest.approx(study.law_of_manoeuvre(SEA, states), rel=0.08)


def test_the_ends_of_the_baseline_are_exact():
    assert study.baseline(0.0) == pytest.approx(1 / (4 * np.sqrt(3)), rel=0.01)
    assert study.baseline(500.0) == pytest.approx(1 / (5 * np.sqrt(15)), rel=0.01)


def test_equal_kinds_have_the_least_imbalance():
    assert study.imbalance(SEA) == pytest.approx(2)
    assert study.imbalance(replace(SEA, sigma_light=SEA.sigma_light / 10)) == pytest.approx(10.1)


def test_a_target_of_even_speed_is_even():
    speed = study.even_speed(AIR, np.array([3e3, 5e3]))
    worth = study.worth(AIR, study.halfway_state(np.array([3e3, 5e3]), speed, np.pi / 2))
    assert worth == pytest.approx(1, abs=0.05)
    assert np.isnan(study.even_speed(SEA, 10.0))


def test_the_drawings_draw():
    places, speeds = np.array([1e3, 3e3, 9e3]), np.array([10.0, 50.0, 200.0])
    ratio = np.outer(places, speeds) / 1e5
    assert len(draw.draw_map([(AIR, places, speeds, ratio)] * 2, {"a": (AIR, 2e3, 20.0)}).axes) == 3
    value, far = np.array([0.1, 2.0]), np.array([True, False])
    assert (
        len(
            draw.draw_collapse(
                dict.fromkeys("abcd", (value, value)), dict.fromkeys("ef", (value, value, far))
            ).axes
        )
        == 2
    )
    plt.close("all")
