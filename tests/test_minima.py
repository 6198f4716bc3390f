"""Starts from conical angles alone, and alternatives: against the theorems on ghosts, and odds that hold."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

import tmalib as tma
from tmalib.papers.conical_angles import scenarios as conical


def random_array(rng, turning):
    """An array in four kilometres of water that hears a direct and a bounced ray; a target in the water."""
    legs = [tma.Straight(300), tma.Straight(300, heading=rng.uniform(1.0, 5.0) if turning else None)]
    array = tma.Course((0, 0), rng.uniform(2, 8), 0.0 if turning else rng.uniform(0, 6), legs)
    place = rng.uniform(2e3, 15e3) * np.array([np.sin(a := rng.uniform(0, 6.28)), np.cos(a)])
    depth = rng.uniform(50, 3900)
    target = tma.Target(place, rng.uniform(1, 8), rng.uniform(0, 6.28), depth=depth)
    rays = [tma.ConicalAngle(ray, 200.0, 4000.0) for ray in (tma.DIRECT, tma.BOTTOM_BOUNCE)]
    return tma.Scenario(array, [tma.Sensor(ray, np.arange(0, 601, 10), 1e-3) for ray in rays], 0, target)


def test_a_fit_of_cosines_finds_what_a_fit_from_the_truth_finds():
    """Never a criterion above it, in twenty random scenarios, three runs each."""
    rng = np.random.default_rng(1)
    for k in range(20):
        scenario = random_array(rng, turning=k % 2)
        angles = scenario.simulate(3, rng)
        watch = replace(scenario, target=None)
        found, best = tma.fit(watch, angles), tma.fit(watch, angles, scenario.state, max_iterations=300)
        assert np.all(found.cost[best.converged] <= best.cost[best.converged] + 1e-2), k
        told = best.converged & (best.sigma[:, 2] < 1000)  # no minimum at all at the array's own depth
        assert found.converged[told].all(), k


def test_alternatives_without_noise_are_the_ghosts_of_the_theorems():
    """Isolated members of `find_ghosts`, each as likely as the target."""
    for depth in (2000.0, 4000.0):
        scenario = conical.section_5_2(depth, assumed_depth=100.0)
        scenario = replace(scenario, sensors=[replace(s, sigma=1e-3) for s in scenario.sensors])
        found = tma.fit(replace(scenario, target=None), scenario.measure(), tolerance=1e-6)
        listed = [other.state for other in tma.alternatives(found)] + [found.state]
        ghosts = [g.target() for g in tma.find_ghosts(scenario) if g.is_isolated]
        ghosts = [g.state(0, scenario.coordinates) for g in ghosts if abs(g.depth - 100.0) < 1e-6]
        assert ghosts
        for state in [scenario.state, *ghosts]:
            assert min(np.max(np.abs(np.subtract(state, other))) for other in listed) < 1.0
        for other in tma.alternatives(found):
            assert other.likelihood == pytest.approx(1.0, abs=1e-3)


def test_the_likelihood_is_the_odds_of_two_ghosts():
    """Targets left or right of an array that turns by half a degree: what is said to be right often is."""
    rng, said, right = np.random.default_rng(3), [], []
    legs = [tma.Straight(300), tma.Straight(300, heading=np.radians(0.5))]
    array = tma.Course((0, 0), 5.0, 0.0, legs)
    ray = tma.ConicalAngle(tma.DIRECT, 200.0, 4000.0, 100.0)
    other = tma.ConicalAngle(tma.BOTTOM_BOUNCE, 200.0, 4000.0, 100.0)
    watch = tma.Scenario(array, [tma.Sensor(r, np.arange(0, 601, 20), 0.01) for r in (ray, other)], 0)
    for _ in range(120):
        side = rng.choice([-1, 1])
        target = tma.Target((side * 5e3, 7e3), 4.0, side * 0.8, depth=100.0)
        found = tma.fit(watch, watch.with_target(target).simulate(1, rng)[0])
        mirror = [o for o in tma.alternatives(found, within=30) if o.state[0] * found.state[0] < 0]
        odds = mirror[0].likelihood if mirror else 0.0
        said.append(odds / (1 + odds))
        right.append(np.sign(found.state[0]) == side)
    said, right = np.array(said), np.array(right)
    unsure = said > 0.2  # the estimate is the truth in a share 1 - p
    low, high = binomtest(int(right[unsure].sum()), int(unsure.sum())).proportion_ci(0.999)
    assert unsure.sum() > 30
    assert low < 1 - said[unsure].mean() < high


def test_alternatives_of_bearings(scenario):
    """A well-seen target has none; a straight ship's run that is not observable is not searched."""
    found = tma.fit(scenario, scenario.simulate(1, seed=1)[0])
    assert tma.alternatives(found) == []
    ship = tma.Course((0, 0), 5.0, 0.0, [tma.Straight(600)])
    blind = replace(scenario, platform=ship, sensors=scenario.sensors[:1])
    assert tma.alternatives(tma.fit(blind, blind.simulate(1, seed=1)[0])) == []


def test_what_alternatives_refuse(scenario):
    found = tma.fit(scenario, scenario.simulate(2, seed=1))
    with pytest.raises(ValueError, match="are of one run"):
        tma.alternatives(found)
    one = tma.fit(scenario, scenario.simulate(1, seed=1)[0])
    with pytest.raises(ValueError, match="within must be greater than 0"):
        tma.alternatives(one, within=0)
    instant = tma.Sensor(tma.ConicalAngle(tma.DIRECT, 100.0, 4000.0, 100.0), [1.0], 0.1)
    with pytest.raises(ValueError, match="two instants or more"):
        tma.fit(tma.Scenario(scenario.platform, [instant], 0.0), [0.1])
