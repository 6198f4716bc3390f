"""Condensed bearings against straight lines that numpy fits, and their sigma against their weights."""

import numpy as np
import pytest

import tmalib as tma
from tmalib import condensed

TIMES = np.sort(np.random.default_rng(3).uniform(0, 3000, 617))
SENSOR = tma.Sensor(tma.Bearing(), TIMES, sigma=0.01)


def weights(made, count):
    """What each value is made of, ``(values, N)``: bearings near zero do not wrap, so that all is linear."""
    step = 1e-3
    return made.of(step * np.eye(count)).T / step


def test_lines_are_those_of_polyfit():
    angles = np.random.default_rng(4).normal(0, 0.1, (3, len(TIMES)))
    made = condensed.lines(SENSOR)
    assert isinstance(made, condensed.Lines)
    values, ends = made.of(angles), [*made.first[1:], len(TIMES)]
    for k, (first, end) in enumerate(zip(made.first, ends, strict=True)):
        times = TIMES[first:end]
        pair = made.sensor.times[2 * k : 2 * k + 2]
        np.testing.assert_allclose(pair, times.mean() + np.array([-1, 1]) * times.std())
        slope, level = np.polyfit(times - times.mean(), angles[:, first:end].T, 1)
        np.testing.assert_allclose(
            values[:, 2 * k : 2 * k + 2], level[:, None] + np.outer(slope, [-1, 1]) * times.std(), atol=1e-12
        )


@pytest.mark.parametrize("make", [condensed.lines, condensed.means, condensed.unchanged])
def test_sigma_follows_from_the_weights(make):
    """Exactly where all groups are of one size, else within one bearing of a group."""
    sensor = tma.Sensor(tma.Bearing(), np.arange(600.0), sigma=0.01)
    made = make(sensor)
    covariance = 0.01**2 * weights(made, 600) @ weights(made, 600).T
    sigma = np.broadcast_to(made.sensor.sigma, made.sensor.times.shape)
    np.testing.assert_allclose(covariance, np.diag(sigma**2), atol=1e-9 * 0.01**2)
    uneven = condensed.lines(SENSOR)
    square = np.diag(weights(uneven, len(TIMES)) @ weights(uneven, len(TIMES)).T)
    smallest, largest = uneven.size.min(), uneven.size.max()
    share = (uneven.sensor.sigma / SENSOR.sigma) ** 2 / square
    assert np.all(share >= smallest / largest)
    assert np.all(share <= largest / smallest)


def test_a_sigma_for_each_bearing():
    own = np.linspace(0.01, 0.02, 95)
    made = condensed.means(tma.Sensor(tma.Bearing(), np.arange(95.0), own))
    parts = weights(made, 95)
    assert made.sensor.times.shape == (31,)  # of three; a rest of two is left out
    np.testing.assert_allclose(parts @ np.arange(95.0), made.sensor.times)
    np.testing.assert_allclose((parts * own) @ (parts * own).T, np.diag(made.sensor.sigma**2), atol=1e-18)


@pytest.mark.parametrize("make", [condensed.lines, condensed.means])
def test_bearings_through_south_are_as_those_through_north(make):
    """The values turn with the bearings."""
    angles = 0.4 * np.sin(TIMES / 400) + np.random.default_rng(5).normal(0, 0.01, (2, len(TIMES)))
    made = make(SENSOR)
    turned = made.of(tma.bearings.wrap(angles + np.pi))
    np.testing.assert_allclose(tma.bearings.wrap(turned - made.of(angles) - np.pi), 0, atol=1e-12)
