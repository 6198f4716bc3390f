"""What the chapter on recursive estimators compares, against independent computations."""

import numpy as np
import pytest
from scipy.optimize import minimize

import tmalib as tma
from tmalib.beyond import filters, filters_drawing
from tmalib.papers.emw_acoustic import scenarios as emw


def test_the_mode_of_the_posterior_is_the_lowest_of_prior_and_measurements():
    """Against scipy's simplex on the criterion, written out with the model's values only."""
    now = emw.scenario(4)
    angles = now.simulate(2, seed=5)
    prior = filters.prior_of(4, angles)
    found = filters.posterior_mode(now, angles, prior)
    later = now.times > 0
    sigma = np.sqrt(np.diagonal(prior.covariance))

    def criterion(x, run):
        off = now.residual(angles[run], now.linearise(x)[0]) / now.sigma
        first = (tma.propagate(x, -now.reference_time) - prior.mean[run]) / sigma
        return np.sum(off[later] ** 2) + np.sum(first**2)

    for run in range(2):
        scale = np.array([100.0, 100.0, 0.3, 0.3])
        simplex = found[run] + np.vstack([np.zeros(4), np.diag(scale)])
        options = dict(initial_simplex=simplex, xatol=1e-6, fatol=1e-10, maxiter=4000)
        best = minimize(criterion, found[run], args=(run,), method="Nelder-Mead", options=options)
        assert criterion(found[run], run) - best.fun < 1e-3
        assert np.all(np.abs(best.x - found[run]) < 0.05 * scale)


def test_a_component_of_the_state_is_a_model():
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(100)])
    for place in range(4):
        state = np.array([1e3, -2e3, 3.0, 4.0])
        assert tma.check_model(filters.Component(place), ship, [0.0, 50.0], state, 100.0) < 1e-6
        value, _ = filters.Component(place).value_and_gradient(state, np.zeros((1, 1)), np.array([-100.0]))
        assert value[0] == tma.propagate(state, -100.0)[place]


@pytest.mark.parametrize("number", filters.NUMBERS)
def test_instants_begin_when_the_range_is_known_to_a_half(number):
    times = filters.instants(number)
    assert len(times) == filters.INSTANTS
    assert times[-1] == emw.scenario(number).reference_time
    assert filters.bound_over_range(number, times[0]) < 0.5 <= filters.bound_over_range(number, times[0] - 20)


def test_the_honest_prior_knows_the_first_bearing():
    now = emw.scenario(2)
    angles = now.simulate(3, seed=1)
    prior = filters.prior_of(2, angles, honest=True)
    for run in range(3):
        range_, bearing = 10e3, angles[run, 0]
        across = np.array([np.cos(bearing), -np.sin(bearing)])
        along = np.array([np.sin(bearing), np.cos(bearing)])
        covariance = prior.covariance[run, :2, :2]
        np.testing.assert_allclose(np.sqrt(across @ covariance @ across), range_ * now.sigma[0], rtol=1e-6)
        np.testing.assert_allclose(np.sqrt(along @ covariance @ along), 20e3 / np.sqrt(12), rtol=1e-6)
    np.testing.assert_allclose(prior.covariance[:, 2, 2] + prior.covariance[:, 3, 3], 5.0**2)


def test_ratios_of_known_errors():
    """Errors twice as large as the batch's, of which some are lost."""
    batch = np.random.default_rng(1).normal(size=(500, 4)) * [100, 200, 1, 2]
    error = 2 * batch
    error[:5] = np.nan
    error[5:8] = 1e6
    gone = filters.lost(1, error, 1199.0)
    assert gone.sum() == 8
    np.testing.assert_allclose(filters.over_batch(error, batch, ~gone), 2.0)
    np.testing.assert_allclose(filters.interval_over_batch(error, batch, ~gone), 2.0)


def test_the_interval_of_a_ratio_holds_it_as_often_as_it_says():
    """Two hundred samples of 100 runs with the true ratio 1.5 of correlated errors."""
    rng = np.random.default_rng(4)
    held = 0
    for _ in range(200):
        batch = rng.normal(size=(100, 4))
        error = batch + rng.normal(size=(100, 4)) * np.sqrt(1.25)
        error[:, 1:] *= 0.1  # so that the first component is the worst
        low, high = filters.interval_over_batch(error, batch, np.ones(100, dtype=bool), draws=400)
        held += low < 1.5 < high
    assert 0.88 < held / 200 < 0.99


@pytest.mark.parametrize("honest", [False, True])
def test_all_filters_are_compared_on_the_same_bearings(honest):
    names = (*filters.WITH_PRIOR, filters.BANK, filters.BOUNDED, filters.BATCH)
    found = filters.filters_over_time(3, 4, 2, names, honest)
    for name in names:
        assert found[f"{name}: error"].shape == (4, filters.INSTANTS, 4)
    end = filters.filters_at_the_end(3, 4, 2, names[:-1], honest)
    for name in names[:-1]:
        np.testing.assert_allclose(end[name], found[f"{name}: error"][:, -1], rtol=1e-3, atol=2.0)
    batch = tma.fit(emw.scenario(2), emw.scenario(2).simulate(4, 3)).state - emw.scenario(2).state
    np.testing.assert_allclose(found[f"{filters.BATCH}: error"][:, -1], batch, rtol=1e-2, atol=1e-1)


def test_a_larger_memory_is_nearer_to_the_batch_estimate():
    found = filters.distances_by_memory(1, 20, 6, (16, 64, 512))
    assert found["16"].mean() > found["64"].mean() > found["512"].mean()
    assert found["512"].mean() < 1e-3


def test_drawings():
    two = np.full(6, 1.5), np.array([0, 0.2, 0.004, 0, 0, 0])
    figure = filters_drawing.table_of_ratios({"a": {"x": two, "y": two}, "b": {"z": two}})
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert texts.count("20 % lost") == 3
    assert texts.count("0.4 % lost") == 3
    times = {k: [0.0, 1.0] for k in filters.NUMBERS}
    curves = {k: dict.fromkeys(filters_drawing.LOOKS, np.ones(2)) for k in filters.NUMBERS}
    assert len(filters_drawing.ratios_over_time(times, curves).axes) == 6
    small = {k: np.array([0.3, 0.02]) for k in filters.NUMBERS}
    mean = {k: np.array([1e5, 4.1]) for k in filters.NUMBERS}
    ax = filters_drawing.consistency(small, mean, np.array([3.9, 4.1])).axes[0]
    assert sum(line.get_marker() == "^" and line.get_color() == "black" for line in ax.lines) == 6
