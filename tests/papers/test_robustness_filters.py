from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import gaussian_kde

import tmalib as tma
from tmalib.papers.robustness import filters
from tmalib.papers.robustness import scenarios as paper
from tmalib.papers.robustness.paper import PAPER


@pytest.fixture(scope="module")
def found(geometry):
    return filters.filtered(
        geometry, geometry.circle, PAPER.stream("robustness/filters").chunk(), particles=2000
    )


def test_means_of_bearings(geometry):
    """Across north, where the mean of angles is not the mean of numbers; noise shrinks as claimed."""
    course = tma.Course((0.0, 0.0), 200.0, 0.0, [tma.Straight(paper.DURATION)])
    target = tma.Target((-300.0, 5e3), 100.0, np.pi / 2)
    scenario = replace(geometry.straight, platform=course, target=target)
    noisy = scenario.simulate(400, seed=1)
    fewer, _ = tma.average_measurements(scenario, noisy[0], 10)
    means = np.array([tma.average_measurements(scenario, row, 10)[1] for row in noisy])
    error = tma.wrap(means - fewer.measure())
    assert fewer.times[0] == pytest.approx(np.mean(scenario.times[:10]))
    assert fewer.sigma[0] == pytest.approx(paper.SIGMA / np.sqrt(10))
    assert error.std() == pytest.approx(paper.SIGMA / np.sqrt(10), rel=5 / np.sqrt(2 * error.size))
    assert np.abs(error.mean(axis=0)).max() < 5 * fewer.sigma[0] / np.sqrt(400)


def test_means_of_ten_hide_nothing_of_the_weave(geometry):
    """The platform leaves its chord by 50 (0.4)^2 / 24 = 0.33 m on average, 1 / 15 of sigma at 3 km."""
    fewer, means = tma.average_measurements(geometry.circle, geometry.circle.measure(), 10)
    assert np.abs(tma.wrap(means - fewer.measure())).max() < 0.1 * fewer.sigma[0]


def test_same_seed_same_bearings_other_draw_other_particles(geometry, found):
    seed = PAPER.stream("robustness/filters").chunk()
    again = filters.filtered(geometry, geometry.circle, seed, particles=2000)
    other = filters.filtered(geometry, geometry.circle, seed, particles=2000, draw=1)
    np.testing.assert_array_equal(found.cloud, again.cloud)
    np.testing.assert_array_equal(found.measured, other.measured)
    np.testing.assert_array_equal(found.bls, other.bls)
    assert np.all(found.cloud.mean(axis=0) != other.cloud.mean(axis=0))
    averaged = filters.filtered(geometry, geometry.circle, seed, particles=2000, together=10)
    np.testing.assert_array_equal(found.measured, averaged.measured)
    assert len(averaged.particles.times) == 49, "the first mean is the cloud's"


def test_along_is_zero_at_the_estimate_and_one_at_the_truth(found):
    ends = np.stack([found.bls_at(paper.DURATION)[:2], found.end])
    np.testing.assert_allclose(found.along(ends), [0, 1], atol=1e-12)
    across = np.array([[0, 1], [-1, 0]]) @ (ends[1] - ends[0])
    assert found.along(ends[1] + across) == pytest.approx(1)


def test_density_equals_that_of_scipy():
    """A value moves by half a cell, a sixteenth of the width, at most, and to either side."""
    values = np.random.default_rng(1).gamma(2.0, size=3000)
    places = np.linspace(-1, 12, 300)
    ours, theirs = filters.density(values, places), gaussian_kde(values, "silverman")(places)
    assert np.abs(ours - theirs).max() < 0.01 * theirs.max()


def stand_in(geometry, cloud, track=None, bls=(0.0, 0.0, 0.0, 0.0)):
    """A `Filtered` with a chosen cloud and Kalman track: target at rest at 1 km north, BLS at the origin."""
    scenario = replace(geometry.straight, target=tma.Target((0.0, 1e3), 0.0, 0.0))
    times = scenario.times[1:]
    kalman = SimpleNamespace(times=times, state=np.zeros((len(times), 4)) if track is None else track(times))
    cloud = SimpleNamespace(particles=cloud, times=np.array([paper.DURATION]))
    return filters.Filtered(scenario, scenario.measure(), np.array(bls), kalman, cloud)


def test_measures_of_a_cloud(geometry):
    """A Gaussian cloud 0.4 of the way to the target with a spread of 0.3 of it."""
    normal = np.random.default_rng(2).standard_normal((100_000, 4))
    cloud = np.array([0.0, 400.0, 0.0, 0.0]) + normal * [10.0, 300.0, 1.0, 1.0]
    found = stand_in(geometry, cloud)
    assert filters.cloud_maximum(found) == pytest.approx(0.4, abs=0.1)
    assert filters.truth_tail(found) == pytest.approx(0.0455, abs=5 * np.sqrt(2 * 0.0455 / 1e5))  # two sigma
    quantile = np.sqrt(-2 * np.log(0.1))
    assert filters.cloud_size(found) * found.range == pytest.approx(300 * quantile, rel=0.02)


def test_measures_of_a_track(geometry):
    def steady(times):
        return np.stack([100 * times, 0 * times, 0 * times, 0 * times], axis=-1)

    def jumping(times):
        jumps = np.where(times < 10, 1e3 * (-1.0) ** np.arange(len(times)), 0.0)
        return steady(times) + jumps[:, None] * [0, 1, 0, 0]

    cloud = np.zeros((10, 4))
    assert filters.early_wandering(stand_in(geometry, cloud, steady)) == pytest.approx(0.9, abs=0.01), (
        "9 s of 10"
    )
    assert filters.early_wandering(stand_in(geometry, cloud, jumping)) > 100
    end = stand_in(geometry, cloud, steady)
    assert filters.kalman_departure(end) == pytest.approx(2.0), "2 km from the BLS, which is 1 km off"
    same = stand_in(geometry, cloud, steady, bls=(0.0, 1e3, 0.0, 0.0))
    assert filters.bearings_apart(same) == pytest.approx(0, abs=1e-9)
    assert filters.bearings_apart(end) > 1


def test_the_worse_sign_is_worse(geometry):
    """Against the exact minimum of each, found from the truth."""
    worse = filters.worse_perturbation(geometry)
    error = []
    for displacement in (worse, -worse):
        scenario = geometry.displaced(displacement)
        state = tma.fit(geometry.straight, scenario.measure(), geometry.theta_star).state
        end = state[:2] + paper.DURATION * state[2:]
        error.append(np.hypot(*(end - scenario.target.position_at(paper.DURATION))))
    assert error[0] > error[1]
    assert np.hypot(*worse.T).max() == pytest.approx(paper.WORST)


def test_halfway_and_error_over_bls(geometry):
    """A Gaussian cloud about the BLS, at the origin, with half the distance as its spread; target at 1 km."""
    normal = np.random.default_rng(3).standard_normal((100_000, 4))
    wide = stand_in(geometry, normal * [10.0, 500.0, 1.0, 1.0])
    narrow = stand_in(geometry, normal * [10.0, 100.0, 1.0, 1.0])
    assert filters.density_between(wide) == pytest.approx(np.exp(-0.5), abs=0.03)
    assert filters.density_between(narrow) < 1e-3
    at_the_truth = stand_in(geometry, normal * [1.0, 1.0, 1.0, 1.0] + [0.0, 1e3, 0.0, 0.0])
    assert filters.error_over_bls(at_the_truth, at_the_truth.cloud[:, :2]) < 1e-3
    assert filters.error_over_bls(wide, wide.cloud[:, :2]) == pytest.approx(1, abs=0.01)
    assert filters.error_over_bls(wide, np.array([300.0, 1e3])) == pytest.approx(0.3)
    assert filters.error_over_bls(wide, np.array([np.nan, 1e3])) == np.inf
    lost = stand_in(geometry, normal, bls=(np.nan,) * 4)
    assert filters.error_over_bls(lost, np.array([300.0, 1e3])) == 0


def test_cases_together_are_the_cases_alone(geometry):
    """Bit for bit in the particles; the Kalman filters run side by side and do not know of each other."""
    seeds = PAPER.stream("robustness/filters").chunk().spawn(2)
    cases = {"circle": (geometry.circle, seeds[0]), "calm": (geometry.straight, seeds[1])}
    options = dict(particles=300, beta=40.0, together=10, draw=1, prior_range=8e3)
    together = filters.filtered_cases(geometry, cases, **options)
    for name, (scenario, seed) in cases.items():
        alone = filters.filtered(geometry, scenario, seed, **options)
        np.testing.assert_array_equal(together[name].cloud, alone.cloud)
        np.testing.assert_allclose(together[name].kalman.state, alone.kalman.state, rtol=1e-9)
        np.testing.assert_allclose(together[name].bls, alone.bls, rtol=1e-9)
    other = filters.filtered(geometry, geometry.circle, seeds[0], **options | {"prior_range": 2e4})
    assert np.all(other.kalman.state[-1] != together["circle"].kalman.state[-1])
