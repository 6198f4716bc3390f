"""Beside the tables of emw-acoustic: clouds, other courses, readings of the filter."""

import numpy as np
import pytest
from scipy.stats import chi2

import tmalib as tma
from tmalib.papers.emw_acoustic import against_bound, courses, experiments, filter_variants
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.papers.emw_acoustic.paper import PAPER

SEED = PAPER.stream("emw/1").chunk()


def test_against_bound_is_what_the_figure_draws():
    """At the figure's instants: the same estimates, held against its ellipses by their own geometry."""
    times = emw.instants(1)
    found = against_bound.against_bound(SEED, 40, 1, times)
    drawn = experiments.positions_at_instants(SEED, 40, 1)
    observer = emw.scenario(1).platform.position_at(times)
    for name in ("mle", "ekf"):
        for k, shape in enumerate(experiments.ellipses(1)):
            axis = np.array([np.sin(shape.heading), np.cos(shape.heading)])
            off = drawn[name][:, k] - shape.centre
            along, across = off @ axis, off @ [axis[1], -axis[0]]
            inside = np.hypot(along / shape.semi_axes[0], across / shape.semi_axes[1]) < 1
            np.testing.assert_array_equal(found[f"{name}_inside"][:, k], inside)
            outwards = np.sign(
                np.hypot(*(drawn[name][:, k] - observer[k]).T) - np.hypot(*(shape.centre - observer[k]))
            )
            far = np.abs(found[f"{name}_along"][:, k]) > 0.3
            assert far.sum() > 10
            np.testing.assert_array_equal(np.sign(found[f"{name}_along"][far, k]), outwards[far])


def test_as_computed_the_errors_are_those_of_the_tables():
    found, tables = courses.final_errors(SEED, 20, 5), experiments.both_estimators(SEED, 20, 5)
    for name in ("mle", "ekf"):
        np.testing.assert_array_equal(found[name], tables[name])


@pytest.mark.parametrize("path", ["computed", "printed"])
@pytest.mark.parametrize("number", [5, 6])
def test_straight_on_is_the_same_scenario_up_to_the_second_turn(number, path):
    """Same times, target and course up to the turn; then 7 m/s towards the north-west."""
    now, without = emw.scenario(number, path), courses.scenario_on(number, path, second_turn=False)
    np.testing.assert_array_equal(now.times, without.times)
    before = emw.scenario(number - 4).reference_time
    early, late = now.times[now.times <= before], now.times[now.times > before]
    there, here = (s.platform.position_at(early) for s in (now, without))
    np.testing.assert_allclose(there, here, atol=1e-9)
    step = np.diff(without.platform.position_at(late), axis=0)
    expected = np.diff(late)[:, None] * 7 * np.array([-1, 1]) / np.sqrt(2)
    np.testing.assert_allclose(step, expected, atol=1e-9)
    reached = without.platform.position_at(late[0]) - without.platform.position_at(before)
    assert np.hypot(*reached) == pytest.approx(7 * (late[0] - before))
    assert not np.allclose(now.platform.position_at(late), without.platform.position_at(late))


def test_other_courses_are_refused():
    with pytest.raises(ValueError, match=r"number must be 5 or 6, .* got 1"):
        courses.scenario_on(1, second_turn=False)
    with pytest.raises(ValueError, match=r"path must be .* got 'sailed'"):
        courses.scenario_on(5, "sailed")


def test_gradient_with_lever():
    """With a sonar bearing (6); alone the position part of (6) and the velocity part at -tau, at s = 0."""
    now = emw.scenario(1)
    model, times = filter_variants.RadarWithLever(), np.array([1196.0, 1199.0])
    observer = model.observer_state(now.platform, times)
    value, gradient = model.value_and_gradient(now.state, observer, np.zeros(2))
    off = now.state[:2, None] - observer[:2]
    square = np.sum(off**2, axis=0)
    np.testing.assert_allclose(value, np.arctan2(*off))
    np.testing.assert_allclose(gradient[:2], [off[1] / square, -off[0] / square])
    tau = 0.0
    for _ in range(30):  # the recursion of Section II
        tau = np.hypot(*(off - tau * now.state[2:, None])) / 1500.0
    lever = [0.0, -tau[1]]
    np.testing.assert_allclose(gradient[2:], lever * gradient[:2], rtol=1e-9, atol=1e-20)


def test_sonar_at_t1_changes_nothing_but_the_first_instant():
    """It is the filter of the tables, started with the posterior of the first sonar bearing."""
    now = emw.scenario(2)
    angles = now.simulate(8, SEED)
    found = filter_variants.filter_variant(SEED, 8, 2, "sonar at t_1")["ekf"]
    periscope = len(now.sensors[0])
    for run, bearings in enumerate(angles):
        start = emw.start(now, bearings, 2)
        value, gradient = now.sensors[1].model.value_and_gradient(
            start, now.platform.position_at([0.0]).T, np.zeros(1)
        )
        before, row = np.diag(emw.PRIOR_VARIANCE), gradient[:, 0]
        gain = before @ row / (row @ before @ row + now.sensors[1].sigma ** 2)
        state = start + gain * tma.wrap(bearings[periscope] - value[0])
        after = before - np.outer(gain, row @ before)
        track = tma.ekf(now, bearings, tma.Prior(state, after, time=0.0))
        np.testing.assert_allclose(track.state[-1] - now.state, found[run], rtol=1e-6, atol=1e-6)


def test_unknown_variant():
    with pytest.raises(ValueError, match=r"variant must be one of .* got 'radar'"):
        filter_variants.filter_variant(SEED, 1, 1, "radar")


def test_limit_of_the_efficiency_is_that_of_500_runs():
    """The mean of 500 chi-square values with 4 degrees of freedom, upper 5 %."""
    for table in ("Conclusion", "Section V.B", "Section V.F"):
        limit = PAPER.phrases[table]["MLE, efficiency"]["at_most"]
        assert limit == pytest.approx(chi2.ppf(0.95, 2000) / 500, abs=0.005)


def test_one_turn_with_the_numbers_of_the_tables_is_the_path_as_computed():
    ours = courses.one_turn(200.0, 7.0, (emw.EAST, emw.NORTH_WEST), np.radians(20) / 60)
    theirs = emw.course_as_computed(1)
    np.testing.assert_array_equal(ours.times, theirs.times)
    np.testing.assert_allclose(ours.positions, theirs.positions, atol=1e-9)
    np.testing.assert_allclose(ours.headings, theirs.headings, atol=1e-12)


def test_one_turn_at_another_rate_keeps_its_circle():
    """All samples of the turn are on a circle of the radius, and the heading has turned by rate and time."""
    course = courses.one_turn(300.0, 6.0, (0.4, -1.0), 0.004)
    centre = course.positions[199] + 300 * np.array([-np.cos(0.4), np.sin(0.4)])
    np.testing.assert_allclose(np.hypot(*(course.positions[200:600] - centre).T), 300)
    assert course.headings[200] - course.headings[599] == pytest.approx(399 * 0.004)
    chord = np.hypot(*(course.positions[599] - course.positions[200]))
    assert chord == pytest.approx(600 * np.sin(399 * 0.002))
