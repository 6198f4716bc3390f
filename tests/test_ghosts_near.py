"""Near ghosts: minima of chi-square, compared with the theorems and with a brute-force search by MINPACK."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

import tmalib as tma
from tmalib.ghosts.starts import grid_of_starts
from tmalib.ghosts.ways import bent, straight

NAMES = ("x", "y", "z", "vx", "vy")
BOTH = (tma.DIRECT, tma.BOTTOM_BOUNCE)
TIMES = np.arange(5.0, 1200.0, 20.0)


def legs_of(kind, h, rng):
    turn = h + rng.choice([-1, 1]) * (rng.uniform(0.02, 0.1) if "small" in kind else rng.uniform(0.4, 2.5))
    if "one leg" in kind:
        return [tma.Straight(1200)]
    if "three legs" in kind:  # of two speeds, which no theorem covers
        return [tma.Straight(400), tma.Straight(400, 6.0, turn), tma.Straight(400, heading=h - 0.3)]
    if "curved" in kind:
        return [tma.Straight(500), tma.Turn(200, rng.uniform(0.001, 0.005)), tma.Straight(500)]
    return [tma.Straight(600), tma.Straight(600, heading=turn)]


def draw(kind, seed, sigma=0.01):
    """A random scenario: nothing in it is special."""
    rng = np.random.default_rng([seed, len(kind)])
    bottom, h, b = rng.uniform(500, 4000), rng.uniform(-np.pi, np.pi), rng.uniform(-np.pi, np.pi)
    array_depth, depth = rng.uniform(50, min(300, bottom / 2)), rng.uniform(10, min(400, 0.9 * bottom))
    array = tma.Course((0, 0), 5.0, h, legs_of(kind, h, rng))
    place = rng.uniform(2e3, 12e3) * np.array([np.sin(b), np.cos(b)])
    target = tma.Target(place, rng.uniform(1, 8), rng.uniform(-np.pi, np.pi), depth=depth)
    paths = BOTH if "two rays" in kind else (tma.BOTTOM_BOUNCE if "bounce" in kind else tma.DIRECT,)
    sensors = [tma.Sensor(tma.ConicalAngle(path, array_depth, bottom), TIMES, sigma) for path in paths]
    return tma.Scenario(array, sensors, reference_time=600.0, target=target)


def chi_square(scenario, target):
    """From what a target is measured to give, not from the kernels."""
    difference = replace(scenario, target=target).measure() - scenario.measure()
    return np.sum((difference / scenario.sigma) ** 2)


def criterion(scenario):
    aim, sigma = scenario.measure(), scenario.sigma

    def at(states):
        return np.sum(((scenario.linearise(states)[0] - aim) / sigma) ** 2, axis=-1)

    return at


def states_of(ghosts, time=600.0):
    return np.array([ghost.target().state(time, NAMES) for ghost in ghosts]).reshape(-1, 5)


def brute_force(scenario, rng, count):
    """Ends of MINPACK from starts anywhere: bearing, range, depth and velocity at random."""
    unit, aim, sigma = np.array([1e3, 1e3, 1e2, 1, 1]), scenario.measure(), scenario.sigma[:, None]
    found = []
    for k in range(count):
        (b, g), r = rng.uniform(-np.pi, np.pi, 2), 10 ** rng.uniform(2.7, 4.6)
        v = rng.uniform(0, 12)
        z = rng.uniform(-500, 4500) if k % 2 else rng.uniform(-300, 500)
        start = np.array([r * np.sin(b), r * np.cos(b), z, v * np.sin(g), v * np.cos(g)]) / unit
        end = least_squares(
            lambda q: (scenario.linearise(q * unit)[0] - aim) / sigma[:, 0], start,
            lambda q: scenario.linearise(q * unit)[1] / sigma * unit,
            method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=600,
        )  # fmt: skip
        if end.status in (1, 2, 3) and np.hypot(*end.x[:2]) < 1e3:
            found.append(end.x * unit)
    return np.array(found)


KINDS = ["two legs", "two legs, bounce", "one leg, two rays", "small turn, two rays", "curved, two rays",
         "three legs", "three legs, two rays", "small turn"]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_brute_force_finds_no_other(kind):
    """70 starts in each of two random scenarios; what it finds below 30 is a ghost or the target."""
    for seed in range(2):
        scenario = draw(kind, seed)
        known = np.vstack([scenario.state, states_of(tma.near_ghosts(scenario, within=30.0))])
        found = brute_force(scenario, np.random.default_rng(seed), 70)
        at = criterion(scenario)
        found = found[(at(found) < 30.0) & (ranks(scenario, found) == 5)]
        for state in found:
            assert straight(at, known, np.broadcast_to(state, known.shape)).any(), (seed, state, at(state))


def ranks(scenario, states):
    """Directions in which a step of the own distance is seen."""
    jacobian = scenario.linearise(states)[1] / scenario.sigma[:, None]
    size = np.sqrt(states[..., :1] ** 2 + states[..., 1:2] ** 2) / [1, 1, 1, 1200, 1200]
    return np.sum(np.linalg.svd(jacobian * size[..., None, :], compute_uv=False) ** 2 > 0.02, axis=-1)


@pytest.mark.parametrize(("kind", "seed"), [(kind, seed) for kind in KINDS for seed in (3, 4)])
def test_every_near_ghost_is_a_minimum_away_from_the_target(kind, seed):
    scenario = draw(kind, seed)
    ghosts, at, rng = tma.near_ghosts(scenario, within=30.0), criterion(scenario), np.random.default_rng(1)
    for ghost, state in zip(ghosts, states_of(ghosts), strict=True):
        assert ghost.chi_square == pytest.approx(chi_square(scenario, ghost.target()), rel=1e-6, abs=1e-9)
        assert ghost.chi_square < 30.0
        assert ghost.in_water == tma.admissible(ghost.target(), scenario.sensors[0].model.bottom_depth)
        assert not straight(at, scenario.state[None], state[None]).any()
        steps = rng.standard_normal((200, 5)) * np.hypot(*state[:2]) / [1, 1, 1, 1200, 1200]
        for size in (1e-5, 1e-3, 1e-2):
            assert at(state + size * steps).min() > ghost.chi_square - (1e-6 if ghost.is_isolated else 0.01)
    assert [ghost.chi_square for ghost in ghosts] == sorted(ghost.chi_square for ghost in ghosts)


# -- the theorems -----------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 2, 6, 8])
def test_isolated_ghosts_of_theorem_3_are_near_ghosts_of_chi_square_zero(seed):
    scenario = draw("one leg, two rays", seed, sigma=1e-3)
    exact = states_of(tma.find_ghosts(scenario))
    near = tma.near_ghosts(scenario, within=5.0)
    assert len(exact) == 3
    zero = states_of([ghost for ghost in near if ghost.chi_square < 1e-12])
    for state in exact:
        assert np.min(np.abs(zero - state).max(axis=1)) < 0.1
    assert len(zero) == len(exact)


@pytest.mark.parametrize("seed", [3, 5, 7])
def test_homothetic_ghosts_of_which_the_depth_is_not_seen(seed):
    """The homothetic ghost is in the target's valley, the other in that of the mirror ghost."""
    scenario = draw("one leg, two rays", seed, sigma=1e-3)
    assert (ranks(scenario, states_of(tma.find_ghosts(scenario))) == 4).all()
    (valley,) = tma.near_ghosts(scenario, within=5.0)
    assert valley.rank == 4
    assert not valley.is_isolated
    assert valley.chi_square < 1e-6
    side = [right_of_the_array(scenario, g) for g in (scenario.target, valley.target())]
    assert side[0] != side[1]


def right_of_the_array(scenario, target):
    h = scenario.platform.heading
    gap = target.position_at(600.0) - scenario.platform.position_at(600.0)
    return bool(gap @ [np.cos(h), -np.sin(h)] > 0)


@pytest.mark.parametrize("seed", [1, 6, 7])
def test_the_depth_mirror_of_theorem_2(seed):
    scenario = draw("two legs", seed, sigma=1e-3)
    (exact,) = tma.find_ghosts(scenario)
    (near,) = (ghost for ghost in tma.near_ghosts(scenario, within=1.0) if ghost.chi_square < 1e-12)
    np.testing.assert_allclose(states_of([near]), states_of([exact]), atol=1e-2)


def test_a_family_is_a_valley():
    """One leg, one ray: four valleys about the axis, of which the target is in one."""
    scenario = draw("one leg", 0)
    ghosts = tma.near_ghosts(scenario, within=5.0)
    assert ghosts
    assert not any(ghost.is_isolated for ghost in ghosts)
    mirrored = tma.find_ghosts(scenario)[1]
    for ghost in ghosts:
        assert ghost.chi_square < 1e-9
    depths = [ghost.target().depth for ghost in ghosts]
    members = [mirrored.target(depth=z) for z in depths if 0 <= z <= mirrored.parameters["depth"][1]]
    gaps = [np.abs(states_of(ghosts) - m.state(600.0, NAMES)).max(axis=1).min() for m in members]
    assert min(gaps) < 1.0


def test_nearly_special():
    """A turn of a twentieth of a degree: the three ghosts of one leg, moved a little."""
    exact = draw("one leg, two rays", 6)
    legs = [tma.Straight(600), tma.Straight(600, heading=exact.platform.heading + 1e-3)]
    nearly = replace(exact, platform=replace(exact.platform, legs=legs))
    ghosts = tma.near_ghosts(nearly, within=1.2)
    assert len(ghosts) == 3
    for family in tma.find_ghosts(exact):
        gaps = np.abs(states_of(ghosts) - family.target().state(600.0, NAMES)).max(axis=1)
        near = ghosts[int(np.argmin(gaps))]
        assert min(gaps) < 20
        assert 1e-8 < near.chi_square < chi_square(nearly, family.target()) < 1.2
        assert near.is_isolated


# -- one entry --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("seed", "listed", "more"), [(1, 1, 0), (4, 2, 2)])
def test_find_ghosts_lists_both_and_nothing_twice(seed, listed, more):
    scenario = draw("two legs", seed)
    (exact,) = tma.find_ghosts(scenario)
    first, *rest = tma.find_ghosts(scenario, within=20.0)
    assert first.case == exact.case == "depth mirror"
    assert all(isinstance(ghost, tma.NearGhost) for ghost in rest)
    everything = tma.near_ghosts(scenario, within=20.0)
    assert (len(everything), len(rest)) == (listed, more)
    assert all(ghost.chi_square > 1.0 for ghost in rest)
    few = tma.near_ghosts(scenario, within=1.0)
    assert len(few) == sum(ghost.chi_square < 1.0 for ghost in everything)


def test_assumed_depth_and_starts_of_the_user():
    scenario = draw("two legs", 0)
    (sensor,) = scenario.sensors
    assumed = replace(scenario, sensors=[replace(sensor, model=replace(sensor.model, assumed_depth=40.0))])
    start = scenario.state + [100, 0, 0, 0, 0]
    one, other = (tma.near_ghosts(s, 30.0, starts=start) for s in (scenario, assumed))
    np.testing.assert_allclose(states_of(one), states_of(other))


def test_the_grid_has_the_first_and_the_last_cosine_and_the_target_itself():
    scenario = draw("two legs, bounce", 1)
    starts = grid_of_starts(scenario)
    off = np.abs(scenario.linearise(starts)[0] - scenario.measure())
    assert np.mean(off[:, [0, -1]].max(axis=1) < 1e-9) > 0.3  # the others are nearer than the image is deep
    assert np.min(np.abs(starts - scenario.state).max(axis=1)) < 1e-6


def test_ways():
    """On a circular valley in the first two coordinates, and over a barrier."""

    def circle(states):
        return 1e4 * (np.hypot(states[..., 0], states[..., 1]) - 1) ** 2

    def relax(states):
        r = np.hypot(states[..., 0], states[..., 1])
        scale = np.stack([r, r, *np.ones((3, *r.shape))], axis=-1)
        return states / scale

    here, there = np.array([[1.0, 0, 0, 0, 0]]), np.array([[0, 1.0, 0, 0, 0]])
    assert not straight(circle, here, there).any()
    assert not bent(circle, relax, here[0], there[0]), "pieces of 1/11 of a quarter are seen at 1e4"
    assert bent(lambda s: circle(s) / 100, relax, here[0], there[0])
    assert straight(circle, here, here + [0, 0, 7, 0, 0]).all()

    def two(states):
        return (states[..., 0] ** 2 - 1) ** 2

    assert not straight(two, here, -here).any()
    assert not bent(two, lambda s: np.sign(s), here[0], -here[0])


def test_bad_input():
    scenario = draw("two legs", 0)
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="within"):
            tma.near_ghosts(scenario, wrong)
    with pytest.raises(ValueError, match="state must have shape"):
        tma.near_ghosts(scenario, 1.0, starts=np.zeros((2, 4)))
    bearings = replace(scenario, sensors=[tma.Sensor(tma.Bearing(), TIMES, 0.01)])
    with pytest.raises(ValueError, match="must be ConicalAngle"):
        tma.near_ghosts(bearings, 1.0)
    (sensor,) = scenario.sensors
    with pytest.raises(ValueError, match="two instants"):
        tma.near_ghosts(replace(scenario, sensors=[replace(sensor, times=TIMES[:1])]), 1.0)
