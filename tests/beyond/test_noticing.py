"""What the chapter on noticing rests on: kinds to scale, rules of choice, process noise by batch, watches."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import chi2, norm

import tmalib as tma
from tmalib.beyond import noticing
from tmalib.beyond import noticing_answers as answers
from tmalib.study.results import read_rows


@pytest.mark.parametrize("kind", noticing.KINDS)
def test_a_kind_of_departure_has_the_size_that_is_asked_for(kind):
    """By fitting a line to the places, component by component."""
    times = noticing.AT_SEA.times
    places = noticing.target_of(kind, 30.0).position_at(times)
    lines = np.stack([np.polyval(np.polyfit(times, p, 1), times) for p in places.T], axis=-1)
    np.testing.assert_allclose(np.hypot(*(places - lines).T).max(), 30.0, rtol=2e-2)


def test_a_turn_keeps_speed_and_last_state():
    scenario, rate = noticing.watch(), noticing.rate_of(300.0)
    target = noticing.target_of("turn", 300.0)
    ahead = np.array([1199.0, 1200.0])
    np.testing.assert_allclose(target.position_at(1200.0), scenario.state[:2], atol=1e-6)
    np.testing.assert_allclose(np.diff(target.position_at(ahead), axis=0)[0], scenario.state[2:], atol=5e-3)
    steps = np.diff(target.position_at(np.arange(0, 1201, 1.0)), axis=0)
    np.testing.assert_allclose(np.hypot(*steps.T), 5.0, rtol=1e-6)
    turned = np.unwrap(np.arctan2(*steps.T))
    np.testing.assert_allclose(np.diff(turned), rate, rtol=1e-6)


def test_a_copy_has_the_bearings_of_a_uniform_motion():
    target = noticing.target_of("copy", 200.0)
    copied = noticing.watch().with_target(target)
    found = tma.fit(noticing.watch(), copied.measure(), tolerance=1e-9)
    assert found.cost < 1e-15
    assert np.hypot(*(found.state[:2] - target.position_at(1200.0))) > 1000


def test_without_noise_a_fit_does_what_the_first_order_says():
    for kind in ("turn", "zigzag", "worst"):
        effect, exact = noticing.effect(kind), noticing.noise_free(kind, [5.0])
        for test in ("size", "drift"):
            np.testing.assert_allclose(exact[test], effect.noncentrality([[5.0]], test), rtol=0.05)
        np.testing.assert_allclose(exact["error"], effect.error([[5.0]]), rtol=0.05)


def test_tasks_give_a_row_a_run():
    seed = noticing.STREAM.chunk(7)
    found = noticing.noticed(seed, 40, "zigzag", 50.0)
    assert set(found) == {*noticing.TESTS, "error", "converged"}
    assert found["error"].shape == (40, 2)
    of_paper = noticing.noticed_of_paper(seed, 20, "circle")
    assert of_paper["size"].shape == (20,)
    answered = answers.answered(seed, 20, 50.0, (1e-4,))
    assert answered["turning"].shape == answered["filter_0"].shape == (20, 2)
    assert answered["covariance_0"].shape == (20, 2, 2)
    assert np.all(answered["rise"] > -1e-3), "a richer model fits better"


# -- rules of choice ------------------------------------------------------------------------------------


@pytest.mark.parametrize("shift", [0.0, 0.7, 2.1, 5.0])
def test_the_risk_of_a_choice_by_significance_is_known_in_closed_form(shift):
    c = norm.isf(0.025)
    inside = norm.cdf(c - shift) - norm.cdf(-c - shift)
    edges = (c - shift) * norm.pdf(c - shift) + (c + shift) * norm.pdf(c + shift)
    closed = 1 - inside + edges + shift**2 * inside
    jumps = sum(abs((s * c - shift) ** 2 - shift**2) * norm.pdf(s * c - shift) for s in (1, -1))
    wrong = answers.risk(shift, answers.accepted_by(1)) - closed
    assert abs(wrong) <= 0.001 * jumps + 1e-9, "a sum with steps of 0.001, of what jumps at c"


def test_the_risk_of_a_choice_by_many_degrees_of_freedom_is_what_simulation_gives():
    rng, shift, freedom = np.random.default_rng(5), 3.0, 20
    z = shift + rng.standard_normal(200_000)
    whole = z**2 + rng.chisquare(freedom - 1, len(z))
    losses = (np.where(whole > chi2.isf(0.05, freedom), z, 0.0) - shift) ** 2
    mean, error = losses.mean(), losses.std() / np.sqrt(len(z))
    assert abs(answers.risk(shift, answers.accepted_by(freedom)) - mean) < 4 * error


# -- process noise ----------------------------------------------------------------------------------------


def test_what_white_acceleration_does_to_places_before_the_last():
    """The covariance of the double integral backwards in time, by quadrature."""
    for a, b in ((30.0, 70.0), (50.0, 50.0)):
        expected = quad(lambda s, a=a, b=b: (a - s) * (b - s), 0, min(a, b))[0]
        np.testing.assert_allclose(min(a, b) ** 2 * (3 * max(a, b) - min(a, b)) / 6, expected, rtol=1e-9)


@pytest.mark.parametrize("density", [1e-5, 1e-3])
def test_the_batch_with_process_noise_claims_what_a_linear_filter_claims(density):
    """A Kalman filter with the gradients at the truth, backwards in nothing but its own code."""
    scenario = noticing.watch()
    claimed, straight, _ = answers.wandering(scenario, density, np.zeros(len(scenario.times)))
    noise, covariance, before = tma.ProcessNoise(density), np.diag([1e12, 1e12, 1e8, 1e8]), 0.0
    for time, gradient in zip(scenario.times, local_gradients(scenario), strict=True):
        phi = tma.transition(time - before)
        covariance = phi @ covariance @ phi.T + noise.covariance(time - before)
        spread = gradient @ covariance @ gradient + scenario.sigma[0] ** 2
        gain = covariance @ gradient / spread
        covariance = covariance - np.outer(gain, gain) * spread
        before = time
    np.testing.assert_allclose(claimed, covariance[:2, :2], rtol=1e-3)
    assert np.trace(tma.crlb(scenario)[:2, :2]) <= np.trace(straight) <= np.trace(claimed)


def local_gradients(scenario):
    """Of each bearing by the state at its own time."""
    gap = scenario.target.position_at(scenario.times) - scenario.platform.position_at(scenario.times)
    square = np.sum(gap**2, axis=1)
    zero = np.zeros(len(gap))
    return np.stack([gap[:, 1] / square, -gap[:, 0] / square, zero, zero], axis=-1)


# -- other watches, and tracks ---------------------------------------------------------------------------


def test_random_watches_are_as_they_say():
    rng = np.random.default_rng(3)
    for legs in (2, 5):
        scenario = answers.random_watch(legs, rng)
        gap = scenario.target.position_at(scenario.times) - scenario.platform.position_at(scenario.times)
        apart = np.hypot(*gap.T)
        assert apart.min() >= 1e3
        assert len(scenario.platform.legs) == legs
        assert np.sqrt(np.trace(tma.crlb(scenario)[:2, :2])) < apart[-1] / 10
        row = answers.price_of_turn(scenario)
        np.testing.assert_allclose(row["price"], np.sqrt(1 + row["harm"] ** 2), rtol=1e-6)
        np.testing.assert_allclose(row["price"] * row["bound"], answers.bound_that_turns(scenario), rtol=1e-3)


def test_harms_of_tracks_are_counted_from_the_table():
    rows = read_rows("ships_short")
    found = answers.harms_of_tracks(rows)["harm"]
    one = [
        bias / bound / misfit**0.5
        for bias, bound, misfit, distance in zip(
            *(rows[name] for name in ("bias", "bound", "misfit", "distance")), strict=True
        )
        if bound < 0.3 * distance and misfit <= 100 and np.isfinite(bias)
    ]
    np.testing.assert_allclose(found, one, rtol=1e-12)
    hidden = answers.hidden_of_tracks(rows, 1.0)
    assert 0 < hidden["harmful"] < hidden["hidden"] < len(one)
