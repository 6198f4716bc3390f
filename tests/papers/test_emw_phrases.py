"""What the sentences of emw-acoustic are measured by, and the scenarios with other periscopes."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.papers.emw_acoustic import experiments, periscope, phrases
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.papers.emw_acoustic.paper import PAPER

RNG = np.random.default_rng(20)


def repeated(measure, draw, times=200):
    """Values and standard errors of a measure in repeated experiments."""
    found = [measure(draw()) for _ in range(times)]
    return np.array([ours.value for ours in found]), np.array([ours.se for ours in found])


@pytest.mark.parametrize(
    ("measure", "truth"),
    [
        (phrases.mean_nees, 4.0),
        (phrases.median_of, 3.3566939),
        (lambda values: phrases.smallest_share(values[:, None] < 7.7794403), 0.9),
        (lambda values: phrases.share_far(np.stack([values, 0 * values], 1), 7.7794403), 0.1),
    ],
)
def test_standard_errors_are_those_of_repetition(measure, truth):
    """Chi-square with four degrees of freedom: mean 4, median 3.357, 90 % below 7.779 (its tables)."""
    values, errors = repeated(measure, lambda: RNG.chisquare(4, 500))
    assert abs(values.mean() - truth) < 4 * values.std() / np.sqrt(len(values))
    assert np.median(errors) == pytest.approx(values.std(), rel=0.25)


def test_root_mean_squares_are_over_the_bound():
    bound = np.array([1.0, 2.0, 3.0, 4.0])
    true = np.array([1.5, 1.0, 2.0, 1.2])

    def draw():
        return RNG.normal(size=(500, 4)) * true * bound

    values, errors = repeated(lambda found: phrases.rms_over_bound(found, bound)[0], draw)
    assert abs(values.mean() - 1.5) < 0.01
    assert np.median(errors) == pytest.approx(values.std(), rel=0.25)
    all_four = phrases.rms_over_bound(draw(), bound)
    assert phrases.least(all_four) is all_four[1]
    assert phrases.most(all_four) is all_four[2]


def test_the_limit_of_a_bias_is_exceeded_by_chance_in_five_of_a_hundred():
    limit = PAPER.phrases["Section V.D"]["MLE, bias"]["at_most"]
    values, _ = repeated(phrases.largest_bias, lambda: RNG.normal(size=(500, 4)), times=2000)
    assert 0.03 < np.mean(values > limit) < 0.075
    assert phrases.largest_bias(RNG.normal(size=(500, 4)) + [0, 0, 1, 0]).value > 0.8


def test_covariance_off_finds_the_direction():
    covariance = tma.crlb(emw.scenario(4))
    factor = np.linalg.cholesky(covariance)
    limit = PAPER.phrases["Section V.D"]["MLE, covariance"]["at_most"]
    white = RNG.normal(size=(200_000, 4))
    assert phrases.covariance_off(white @ factor.T, covariance).value < 0.01
    turned, _ = np.linalg.qr(RNG.normal(size=(4, 4)))
    stretched = (white * [1, 1.3, 1, 1]) @ turned.T @ factor.T
    assert phrases.covariance_off(stretched, covariance).value == pytest.approx(0.3, abs=0.01)
    values, _ = repeated(
        lambda errors: phrases.covariance_off(errors, covariance),
        lambda: RNG.normal(size=(500, 4)) @ factor.T,
    )
    assert np.median(values) < limit < 2 * np.median(values), "what 500 runs reach by chance"


def test_off_course_is_the_distance_from_the_line():
    target = tma.Target((1000.0, 2000.0), speed=5.0, heading=np.radians(30))
    along, right = (np.array([np.sin(h), np.cos(h)]) for h in (np.radians(30), np.radians(120)))
    places = target.position_at(50.0) + np.array([[700 * along - 40 * right, 3 * right]] * 9)
    assert [round(ours.value, 6) for ours in phrases.off_course(places, target)] == [40, 3]


def test_every_two_minutes_is_the_scenario_of_the_paper():
    seed = PAPER.stream("emw/2").chunk()
    for number in periscope.SHORT_RANGE:
        every = periscope.scenario_every(number, 120.0)
        assert np.array_equal(every.times, emw.scenario(number).times)
        assert np.array_equal(tma.crlb(every), tma.crlb(emw.scenario(number)))
    found, tables = periscope.errors_every(seed, 20, 2, 120.0), experiments.both_estimators(seed, 20, 2)
    for name in ("mle", "ekf"):
        np.testing.assert_array_equal(found[name], tables[name])


def test_an_infinite_period_leaves_the_first_bearing():
    alone = periscope.scenario_every(6, np.inf)
    assert [len(sensor.times) for sensor in alone.sensors] == [1, 300]
    assert len(periscope.scenario_every(6, 4.0).sensors[0].times) == 300
    for number, period, name in ((1, 120.0, "number"), (2, 6.0, "period"), (2, 0.0, "period")):
        with pytest.raises(ValueError, match=name):
            periscope.scenario_every(number, period)
