"""Bearings: closed forms against definitions, gradients by three independent routes."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

import tmalib as tma

C = 1500.0
coordinate = st.floats(1.0, 30e3) | st.floats(-30e3, -1.0)
speed = st.floats(-400.0, 400.0)


@given(coordinate, coordinate, speed, speed)
def test_delay_satisfies_its_definition(dx, dy, vx, vy):
    tau = tma.propagation_delay([dx, dy], [vx, vy], C)
    assert tau >= 0
    assert C * tau == pytest.approx(np.hypot(dx - tau * vx, dy - tau * vy), rel=1e-9, abs=1e-6)


@given(coordinate, coordinate)
def test_bearings_are_clockwise_from_north(dx, dy):
    """North is one and east is i: the argument of a complex number."""
    assert tma.bearing([dx, dy]) == pytest.approx(np.angle(dy + 1j * dx))


def test_delay_limits():
    assert tma.propagation_delay([3000.0, 4000.0], [0.0, 0.0], C) == pytest.approx(5000 / C)
    receding, approaching = tma.propagation_delay([[1000.0, 0.0]] * 2, [[300.0, 0.0], [-300.0, 0.0]], C)
    assert receding == pytest.approx(1000 / (C + 300))
    assert approaching == pytest.approx(1000 / (C - 300))


@given(st.floats(-100, 100))
def test_wrap(angle):
    wrapped = tma.wrap(angle)
    assert abs(wrapped) <= np.pi + 1e-12
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * angle), abs=1e-9)


def test_residual_across_the_cut():
    for model in (tma.Bearing(), tma.DelayedBearing(C)):
        assert model.residual(np.pi - 0.01, -np.pi + 0.01) == pytest.approx(-0.02)
        assert model.residual(-np.pi + 0.01, np.pi - 0.01) == pytest.approx(0.02)


def exact_bearing(state, site, lag, c):
    """Bearing from the definition, at 50 digits; c is None for the instantaneous one."""
    x, y, vx, vy = state

    def gap(tau):
        return x + (lag - tau) * vx - site[0], y + (lag - tau) * vy - site[1]

    tau = mp.mpf(0)
    for _ in range(0 if c is None else 60):
        tau = mp.hypot(*gap(tau)) / c
    return mp.atan2(*gap(tau))


def exact_gradient(state, site, lag, c):
    with mp.workdps(50):
        state = [mp.mpf(float(q)) for q in state]
        step, slopes = mp.mpf(10) ** -15, []
        for i in range(4):
            ends = []
            for sign in (1, -1):
                moved = list(state)
                moved[i] += sign * step
                ends.append(exact_bearing(moved, site, mp.mpf(lag), c))
            slopes.append(float((ends[0] - ends[1]) / (2 * step)))
        return slopes


def symbolic_gradient():
    """Gradient by implicit differentiation of the definition of the delay, as a numeric function."""
    x, y, vx, vy, xo, yo, s, tau, c = sp.symbols("x y v_x v_y x_o y_o s tau c", real=True)
    ex, ey = x + (s - tau) * vx - xo, y + (s - tau) * vy - yo
    definition = c**2 * tau**2 - ex**2 - ey**2
    angle = sp.atan2(ex, ey)
    slopes = [
        sp.diff(angle, q) - sp.diff(angle, tau) * sp.diff(definition, q) / sp.diff(definition, tau)
        for q in (x, y, vx, vy)
    ]
    return sp.lambdify((x, y, vx, vy, xo, yo, s, tau, c), slopes)


@pytest.mark.parametrize("c", [None, 1500.0, 340.0])
def test_gradients_by_three_routes(c):
    model = tma.Bearing() if c is None else tma.DelayedBearing(c)
    rng = np.random.default_rng(7)
    implicit = symbolic_gradient()
    for _ in range(20):
        state = rng.uniform(-1, 1, 4) * [1e4, 1e4, 50, 50]
        site, lag = rng.uniform(-2e3, 2e3, 2), rng.uniform(-1000, 0)
        value, gradient = model.value_and_gradient(state, site, lag)
        scale = np.abs(gradient).max()
        # 1: differences of the definition at 50 digits
        np.testing.assert_allclose(gradient / scale, exact_gradient(state, site, lag, c) / scale, atol=1e-12)
        # 2: computer algebra on the definition
        gap = state[:2] + lag * state[2:] - site
        tau = 0.0 if c is None else float(tma.propagation_delay(gap, state[2:], c))
        by_algebra = implicit(*state, *site, lag, tau, c or 1.0)
        if c is not None:
            np.testing.assert_allclose(gradient / scale, np.array(by_algebra) / scale, atol=1e-11)
        # 3: differences of the value in double precision
        for i, step in enumerate((1e-1, 1e-1, 1e-4, 1e-4)):
            h = step * np.eye(4)[i]
            rise = tma.wrap(
                model.value_and_gradient(state + h, site, lag)[0]
                - model.value_and_gradient(state - h, site, lag)[0]
            )
            assert rise / (2 * step) / scale == pytest.approx(gradient[i] / scale, abs=1e-5)
        assert value == pytest.approx(float(exact_bearing(state, site, lag, c)), abs=1e-11)


def test_fast_sound_gives_the_instantaneous_bearing():
    state, site, lag = np.array([3e3, -2e3, 4.0, 7.0]), np.array([100.0, 200.0]), -50.0
    value, gradient = tma.Bearing().value_and_gradient(state, site, lag)
    late_value, late_gradient = tma.DelayedBearing(1e12).value_and_gradient(state, site, lag)
    assert late_value == pytest.approx(value, abs=1e-10)
    np.testing.assert_allclose(late_gradient, gradient, rtol=1e-7)


def test_observed_target_that_turns():
    """The fixed point of the delay for a circular target, against a root finder."""
    from scipy.optimize import brentq

    target = tma.Course((5e3, 1e3), 20.0, 0.0, [tma.Turn(400.0, 0.02)], start_time=-100.0)
    platform = tma.Course((0, 0), 5.0, 1.0, [tma.Straight(300.0)])
    times = np.array([0.0, 100.0, 250.0])
    seen = tma.DelayedBearing(C).observe(target, platform, times)
    for t, angle in zip(times, seen, strict=True):
        here = platform.position_at(t)

        def mismatch(tau, t=t, here=here):
            return C * tau - np.hypot(*(target.position_at(t - tau) - here))

        tau = brentq(mismatch, 0, 50, xtol=1e-13)
        assert angle == pytest.approx(float(tma.bearing(target.position_at(t - tau) - here)), abs=1e-10)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: tma.DelayedBearing(0.0), "c must be greater than 0"),
        (lambda: tma.DelayedBearing(np.nan), "c must be finite"),
        (lambda: tma.propagation_delay([1, 1], [1500.0, 0], C), "slower than c"),
        (lambda: tma.propagation_delay([1, 1], [np.nan, 0], C), "slower than c"),
        (lambda: tma.propagation_delay([1, 1], [1, 0], -5), "c must be greater than 0"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_target_faster_than_sound_is_refused():
    away = tma.Target((1e3, 0.0), speed=2000.0, heading=np.pi / 2)
    still = tma.Course((0, 0), 0.0, 0.0, [tma.Straight(10.0)])
    sensor = tma.Sensor(tma.DelayedBearing(C), [0.0, 5.0], 0.01)
    toward = tma.Target((1e3, 0.0), speed=2000.0, heading=-np.pi / 2)
    for target in (away, toward):
        with pytest.raises(ValueError, match="slower than"):
            tma.Scenario(still, [sensor], reference_time=0.0, target=target)
