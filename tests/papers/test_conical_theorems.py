"""The modules behind the chapters on Theorems 1 and 2 of conical-angles."""

from fractions import Fraction as F

import numpy as np
import pytest
import sympy as sp

import tmalib as tma
from tmalib.ghosts import ghosts_of_two_legs
from tmalib.papers.conical_angles import (
    exact_classes,
    exact_search,
    rational,
    theorem_drawing,
    theorem_scenes,
)
from tmalib.papers.conical_angles.exact_classes import CLASSES, RationalGeometry

ARRAY = 100.0


def geometries(name, count=12):
    rng = np.random.default_rng([3, list(CLASSES).index(name)])
    return [exact_classes.draw_geometry(name, rng) for _ in range(count)]


# -- exact geometry ------------------------------------------------------------------------------------------


def test_vectors_against_floats():
    k, a, b = F(-3, 7), (F(5, 2), F(-1, 3)), (F(2, 9), F(4))
    e = rational.heading(k)
    angle = 2 * np.arctan(float(k))
    direction = np.array([np.sin(angle), np.cos(angle)])
    reflection = 2 * np.outer(direction, direction) - np.eye(2)
    x, y = np.array(a, float), np.array(b, float)
    assert e[0] ** 2 + e[1] ** 2 == 1
    np.testing.assert_allclose(np.array(e, float), direction, atol=1e-15)
    np.testing.assert_allclose(np.array(rational.mirrored(e, a), float), reflection @ x, atol=1e-14)
    np.testing.assert_allclose(
        np.array(rational.right(e), float), [np.cos(angle), -np.sin(angle)], atol=1e-15
    )
    np.testing.assert_allclose(float(rational.cross(a, b)), np.linalg.det([x, y]), rtol=1e-14)
    np.testing.assert_allclose(np.array(rational.add(a, b, k), float), x + float(k) * y, rtol=1e-14)


@pytest.mark.parametrize("rank", [0, 1, 2, 3])
@pytest.mark.parametrize("consistent", [True, False])
def test_linear_equations_against_sympy(rank, consistent):
    rng = np.random.default_rng([rank, consistent])
    for _ in range(10):
        left, right = rng.integers(-4, 5, (6, rank)), rng.integers(-4, 5, (rank, 3))
        matrix = sp.Matrix(6, 3, (left @ right).ravel().tolist())
        side = matrix * sp.Matrix([sp.Rational(1, 3), -2, 5])
        if not consistent:
            side += sp.Matrix(rng.integers(1, 4, 6).tolist())
        system = matrix.row_join(side)
        rows = [[F(int(x.p), int(x.q)) for x in system.row(j)] for j in range(6)]
        found = exact_search.solve_linear(rows)
        if matrix.rank() < system.rank():
            assert found is None
            continue
        dimension, solution = found
        assert dimension == 3 - matrix.rank()
        assert matrix * sp.Matrix([sp.Rational(x.numerator, x.denominator) for x in solution]) == side


# -- random geometries of two legs ---------------------------------------------------------------------------


def has(feature, geometry):
    """Whether a geometry has a feature that the name of its class promises, in floats."""
    p, velocity = np.array(geometry.p, float), np.array(geometry.velocity, float)
    e = np.array(geometry.headings, float)
    mine, w = e[geometry.leg], velocity - e[geometry.leg]
    both, chord = e[0] + e[1], e[1] - e[0]
    vanishing = {
        "over the array": p,
        "broadside in a leg": [mine @ p, mine @ w],
        "broadside in both legs": [*(e @ p), *(e @ velocity - 1)],
        "right angle": e[0] @ e[1],
        "relative rest in a leg": w,
        "parallel": np.linalg.det([velocity, mine]),
        "on a leg's line": np.linalg.det([p, mine]),
        "endfire in a leg": [np.linalg.det([p, mine]), np.linalg.det([w, mine])],
        "radial in a leg": np.linalg.det([p, w]),
        "along the chord": [np.linalg.det([p, chord]), np.linalg.det([w, chord])],
        "bisector": np.linalg.det([velocity, both]),
        "equal depths": float(geometry.zeta),
    }
    return np.allclose(vanishing[feature], 0, atol=1e-12)


FEATURES = (
    *("over the array", "broadside in a leg", "broadside in both legs", "right angle"),
    *("relative rest in a leg", "parallel", "on a leg's line", "endfire in a leg", "radial in a leg"),
    *("along the chord", "bisector", "equal depths"),
)


@pytest.mark.parametrize("name", CLASSES)
def test_geometries_are_what_their_class_says(name):
    promised = [feature for feature in FEATURES if feature in name]
    assert promised or name == "anywhere"
    for geometry in geometries(name):
        assert all(rational.dot(e, e) == 1 for e in geometry.headings)
        assert rational.cross(*geometry.headings) != 0
        assert all(has(feature, geometry) for feature in promised)
        assert has("equal depths", geometry) == ("equal depths" in name)
        assert has("over the array", geometry) == ("over the array" in name)


# -- the search ----------------------------------------------------------------------------------------------


def scenario_of(geometry, target=None):
    """The geometry in floats, for the direct path; the turn is at the origin at t = 1."""
    p, velocity, zeta = target or geometry.target
    headings = [np.arctan2(float(e[0]), float(e[1])) for e in geometry.headings]
    start = -np.array(geometry.headings[0], float)
    array = tma.Course(start, 1.0, headings[0], [tma.Straight(1.0), tma.Straight(1.0, heading=headings[1])])
    times = 1 + np.concatenate([-np.sqrt(np.arange(7, 0, -1)), np.sqrt(np.arange(1, 8))]) / np.sqrt(7.5)
    place, velocity = np.array(p, float), np.array(velocity, float)
    motion = tma.Target.from_velocity(place, velocity, depth=ARRAY + float(zeta), time=1.0)
    sensor = tma.Sensor(tma.ConicalAngle(tma.DIRECT, ARRAY, 1000.0), times, 0.01)
    return tma.Scenario(array, [sensor], reference_time=1.0, target=motion)


def by_theory(scenario):
    """Velocities and depths of the ghosts below the array, by `tmalib.ghosts`; None for a family."""
    families = ghosts_of_two_legs(scenario)
    if not all(family.is_isolated for family in families):
        return None
    targets = [family.target() for family in families]
    return sorted([*target.velocity, target.depth] for target in targets if target.depth > ARRAY)


def passes_through_the_array(geometry):
    """Whether the target is on the array's place during a leg; then `tmalib` has no scenario or no ghosts."""
    for e, side in zip(np.array(geometry.headings, float), (-1, 1), strict=True):
        p, w = np.array(geometry.p, float), np.array(geometry.velocity, float) - e
        nearest = side * np.clip(-side * (p @ w) / max(w @ w, 1e-30), 1e-3, 1)
        if np.hypot(*(p + nearest * w)) < 1e-9:
            return True
    return False


COVERED = [name for name in CLASSES if name != "over the array, relative rest in a leg"]


@pytest.mark.parametrize("name", COVERED)
def test_the_search_finds_what_the_theory_says_and_the_array_cannot_tell_it(name):
    """`tmalib.ghosts` is itself tested against least squares from many starts."""
    clear = [geometry for geometry in geometries(name) if not passes_through_the_array(geometry)]
    assert len(clear) >= 4
    for geometry in clear:
        own, found = scenario_of(geometry), exact_search.ghosts(geometry)
        expected = by_theory(own)
        assert (found is None) == (expected is None)
        if found is None:
            continue
        others = [scenario_of(geometry, ghost) for ghost in found]
        for other in others:
            np.testing.assert_allclose(other.measure(), own.measure(), atol=1e-12)
        ours = sorted([*other.target.velocity, other.target.depth] for other in others)
        assert len(ours) == len(expected)
        np.testing.assert_allclose(ours, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("velocity", "beta"),
    [
        ((F(-3, 5), F(-4, 5)), F(5, 13)),  # along the bisector, V_T . (e_1 + e_2) = -8/5
        ((F(3, 10), F(2, 5)), F(5)),  # 4/5
        ((F(3), F(1)), F(25, 17)),  # broadside in leg 1
    ],
)
def test_the_search_finds_known_ghosts(velocity, beta):
    headings = ((F(0), F(1)), (F(24, 25), F(7, 25)))
    ((p, _, zeta),) = exact_search.ghosts(RationalGeometry(rational.ZERO, velocity, F(1, 2), headings))
    assert (p, zeta) == (rational.ZERO, beta / 2)
    beside = RationalGeometry((F(1, 10), F(0)), velocity, F(1, 2), headings)
    assert exact_search.ghosts(beside) == [], "they need a target over the array"


# -- pictures ------------------------------------------------------------------------------------------------


def test_one_leg_measures_the_cosine_in_relative_coordinates():
    start, velocity = np.array([600.0, -2000.0]), np.array([0.8, -2.0])
    scenario = theorem_scenes.one_leg(start, velocity, 500.0, tma.BOTTOM_BOUNCE)
    across, ahead = (start + scenario.times[:, None] * velocity).T
    zeta = 2 * 4000.0 - 500.0 - 200.0
    np.testing.assert_allclose(
        scenario.measure(), ahead / np.sqrt(across**2 + ahead**2 + zeta**2), atol=1e-14
    )
    places = theorem_scenes.relative(scenario, scenario.target, scenario.times)
    np.testing.assert_allclose(places, np.stack([across, ahead], axis=1), atol=1e-9)


def test_two_legs_measure_the_direction_at_the_turn():
    p, headings = np.array([1500.0, 800.0]), np.radians([-40, 60])
    scenario = theorem_scenes.two_legs(p, (2.0, 1.0), tma.DIRECT, 150.0, headings)
    turn, moment = theorem_scenes.TURN, 1e-6
    np.testing.assert_allclose(scenario.platform.position_at(turn), 0, atol=1e-9)
    model, motion, array = scenario.sensors[0].model, scenario.target, scenario.platform
    found = model.observe(motion, array, np.array([turn - moment, turn + moment]))
    expected = (p[0] * np.sin(headings) + p[1] * np.cos(headings)) / np.sqrt(p @ p + 50.0**2)
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_disagreement_is_zero_for_a_ghost_only():
    scenario = theorem_scenes.two_legs((900, 400), (1.0, 2.0), tma.DIRECT, 100.0)
    ghost, other = (
        tma.Target.from_velocity((900, 400), (1.0, 2.0), depth=depth, time=theorem_scenes.TURN)
        for depth in (300.0, 290.0)
    )
    assert theorem_scenes.disagreement(scenario, ghost) < 1e-12
    assert theorem_scenes.disagreement(scenario, other) > 1e-5


def test_a_folded_ray_bounces_between_surface_and_bottom():
    depth, step, place, found = 30.0, 1.0, 30.0, []
    for _ in range(500):
        found.append(place)
        place += step
        if not 0 <= place <= 100:
            step = -step
            place += 2 * step
    np.testing.assert_allclose(theorem_drawing.folded(depth + np.arange(500.0), 100.0), found)
