"""Two legs, one ray. Lengths are of the order of one, so that a search over states is well conditioned."""

from dataclasses import replace
from fractions import Fraction as F

import numpy as np
import pytest
from scipy.optimize import least_squares

import tmalib as tma
from tmalib.ghosts import admissible, ghosts_of_two_legs
from tmalib.motion import unit

BOTTOM, ARRAY = 4.0, 1.0
INF = float("inf")


def build(p, velocity, headings=(0.3, 1.4), path=tma.DIRECT, depth=1.5, speed=1.0, legs=(1.0, 1.0)):
    """A scenario from the relative position ``p`` at the turn, at t = legs[0], place (0.4, -0.2)."""
    turn, place = legs[0], np.array([0.4, -0.2])
    start = place - speed * legs[0] * unit(headings[0])
    course = tma.Course(
        start, speed, headings[0], [tma.Straight(legs[0]), tma.Straight(legs[1], heading=headings[1])]
    )
    times = np.concatenate([np.linspace(0, turn - 0.02, 9), np.linspace(turn + 0.02, turn + legs[1], 9)])
    sensor = tma.Sensor(tma.ConicalAngle(path, ARRAY, BOTTOM), times, 0.01)
    target = tma.Target.from_velocity(place + p, velocity, depth=depth, time=turn)
    return tma.Scenario(course, [sensor], reference_time=turn, target=target)


def draw(kind, rng):
    """A random scenario of a named kind."""
    h = rng.uniform(-np.pi, np.pi)
    alpha = rng.choice([-1, 1]) * rng.uniform(0.4, 2.7)
    if kind.startswith("U-turn"):
        alpha = np.pi
    if "perpendicular" in kind:
        alpha = rng.choice([-1, 1]) * np.pi / 2
    headings = (h, h + alpha)
    e = unit(headings)
    n = e[:, ::-1] * [1, -1]
    p, velocity = rng.uniform(-2, 2, 2), rng.uniform(-1, 1, 2)
    path, depth = tma.DIRECT, rng.uniform(1.3, 2.5)
    i = rng.integers(2)
    a, b = rng.uniform(0.3, 1.5, 2) * rng.choice([-1, 1], 2)
    chord = e[1] - e[0]
    if "reflected" in kind:
        path = [tma.BOTTOM_BOUNCE, tma.SURFACE_BOUNCE, tma.RayPath(1, 2, 1)][rng.integers(3)]
    if "level" in kind:
        depth = ARRAY
    if "overhead" in kind:
        p = np.zeros(2)
    if "broadside" in kind:
        p, velocity = (a if "overhead" not in kind else 0.0) * n[i], e[i] + b * n[i]
    if "both" in kind:
        velocity = (e[0] + e[1]) / (1 + e[0] @ e[1])
    if "on the line" in kind:
        p = a * e[i]
    if "perpendicular" in kind:
        p = a * e[1 - i]
    if "rest" in kind:
        velocity = e[i]
    if "parallel" in kind:
        velocity = b * e[i]
    if "endfire" in kind:
        p, velocity = (4 * a) * e[i] * ("overhead" not in kind), b * e[i] * 0.9
    if "bisector" in kind:
        velocity = b * 0.7 * (e[0] + e[1]) / np.hypot(*(e[0] + e[1]))
    if "radial" in kind:
        p = 5 * p
        velocity = e[i] + 0.4 * b * p / np.hypot(*p)
    if "chord" in kind:
        p, velocity = 2 * a * chord, e[0] + (0.5 if "crossing" not in kind else 6 * a) * b * chord
        p = p * ("overhead" not in kind)
    return build(p, velocity, headings, path, depth) if clear(p, velocity, e) else draw(kind, rng)


def clear(p, velocity, e):
    """Whether the target stays off the array's place, but for the moment of the turn."""
    ends = [p + side * (velocity - e_i) for side, e_i in zip((-1, 1), e, strict=True)]
    return all(abs(p[0] * end[1] - p[1] * end[0]) > 1e-9 or p @ end >= 0 < np.hypot(*end) for end in ends)


KINDS = [
    "general", "general, reflected", "general, level",
    "broadside", "broadside, reflected", "broadside, level", "broadside, perpendicular",
    "broadside, perpendicular, level", "broadside, rest",
    "rest", "rest, reflected", "rest, level", "parallel", "parallel, reflected", "parallel, level",
    "on the line", "on the line, level", "on the line, parallel", "endfire, level", "radial, level",
    "chord, level", "chord", "bisector", "bisector, level",
    "overhead", "overhead, reflected", "overhead, bisector", "overhead, bisector, reflected",
    "overhead, broadside", "overhead, broadside, reflected", "overhead, parallel",
    "overhead, broadside, both", "overhead, broadside, both, reflected", "overhead, broadside, both, level",
    "overhead, level", "overhead, bisector, level", "overhead, broadside, level",
    "overhead, endfire, level", "overhead, chord, level", "overhead, chord, crossing, level",
    "U-turn", "U-turn, reflected", "U-turn, level", "U-turn, overhead", "U-turn, overhead, level",
    "U-turn, broadside", "U-turn, rest", "U-turn, parallel", "U-turn, parallel, reflected",
    "U-turn, parallel, level", "U-turn, radial, level", "U-turn, endfire, level",
    "U-turn, overhead, endfire, level", "U-turn, overhead, parallel",
]  # fmt: skip


def members(family, scenario, rng, count=4):
    """Some targets of a family; those of `make` that would pass through the array are not members."""
    if family.is_isolated:
        return [family.target()]
    found, own = [], parameters_of(family, scenario, scenario.target)
    for _ in range(60):
        values = {}
        for name, (low, high) in family.parameters.items():
            values[name] = float(np.clip(own[name] + rng.normal(), max(low, -9.0), min(high, 9.0)))
        try:
            found.append(family.target(**values))
        except ValueError:
            continue
        if len(found) == count:
            break
    return found


def parameters_of(family, scenario, target):
    """The parameters that a target would have if it belonged to the family."""
    (_, turn_x, turn_y), headings = scenario.platform.leg_starts[1][:3], scenario.platform.leg_starts[:, 3]
    time = scenario.platform.leg_starts[1, 0]
    e = unit(headings)
    p, chord = target.position_at(time) - [turn_x, turn_y], e[1] - e[0]
    image = tma.image_depth(scenario.sensors[0].model.path, target.depth, ARRAY, BOTTOM)
    values = dict(
        depth=target.depth,
        range=np.hypot(*p),
        share=(target.velocity - e[0]) @ chord / (chord @ chord),
        angle=np.arctan2(image, p @ [e[0][1], -e[0][0]]),
        ahead=p @ e[0],
        speed=target.velocity @ e[0],
    )
    return {name: values[name] for name in family.parameters}


def disagreement(scenario, target):
    """Largest difference of cosine, at the sensor's times and between them."""
    end = scenario.platform.end_time
    turn = scenario.platform.leg_starts[1, 0]
    times = np.setdiff1d(np.linspace(0, end, 101), [turn])
    model = scenario.sensors[0].model
    with np.errstate(invalid="ignore"):
        own = model.observe(scenario.target, scenario.platform, times)
        other = model.observe(target, scenario.platform, times)
    return np.nanmax(np.abs(own - other))


@pytest.mark.parametrize("kind", KINDS)
def test_every_ghost_gives_the_same_cosines(kind):
    rng = np.random.default_rng([7, KINDS.index(kind)])
    for _ in range(5):
        scenario = draw(kind, rng)
        for family in ghosts_of_two_legs(scenario):
            ghosts = members(family, scenario, rng)
            assert ghosts, f"no member of {family.case!r}"
            for ghost in ghosts:
                assert disagreement(scenario, ghost) < 1e-12, family.case
            if family.is_isolated:
                new = ghosts[0].state(0, ("x", "y", "z", "vx", "vy"))
                own = scenario.target.state(0, ("x", "y", "z", "vx", "vy"))
                assert np.max(np.abs(new - own)) > 1e-6, "the target itself"


def search(scenario, rng, starts):
    """States (x, y, depth, vx, vy) at the turn with the target's cosines, from many starts.

    At the array's depth the gradient with respect to depth vanishes. There the depth is given.
    """
    aim = scenario.measure()
    (sensor,) = scenario.sensors
    level = sensor.model.path.is_direct and scenario.target.depth == ARRAY
    if level:
        model = tma.ConicalAngle(tma.DIRECT, ARRAY, BOTTOM, assumed_depth=ARRAY)
        scenario = replace(scenario, sensors=[tma.Sensor(model, sensor.times, sensor.sigma)])
    found = []
    for _ in range(starts):
        start = np.concatenate([rng.uniform(-3, 3, 2), rng.uniform(-3, 8, 1), rng.uniform(-2, 2, 2)])
        start = np.delete(start, 2) if level else start
        fit = least_squares(
            lambda state: scenario.linearise(state)[0] - aim,
            start, jac=lambda state: scenario.linearise(state)[1],
            xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=150,
        )  # fmt: skip
        if np.max(np.abs(fit.fun)) < 1e-11 and np.max(np.abs(fit.x)) < 50:
            found.append(np.insert(fit.x, 2, ARRAY) if level else fit.x)
    return found


def nearest_approach(scenario, target):
    """Smallest distance of target and array."""
    (sensor,) = scenario.sensors
    image = tma.image_depth(sensor.model.path, target.depth, ARRAY, BOTTOM)
    distances = [abs(image)]
    for leg, e in zip((-1.0, 1.0), unit(scenario.platform.leg_starts[:, 3]), strict=True):
        turn = scenario.reference_time
        p, w = target.position_at(turn) - scenario.platform.position_at(turn), target.velocity - e
        t = leg * np.clip(-leg * (p @ w) / max(w @ w, 1e-30), 0, 1)
        distances.append(np.hypot(*(p + t * w)))
    return np.hypot(distances[0], min(distances[1:]))


def known(scenario, families, state, close=1e-3):
    """Whether a state is the target, one of the ghosts, or a target that hits the array unseen."""
    names = ("x", "y", "z", "vx", "vy")
    time = scenario.reference_time
    candidate = tma.Target.from_velocity(state[:2], state[3:], depth=state[2], time=time)
    at_turn = np.hypot(*(candidate.position_at(time) - scenario.platform.position_at(time)))
    meets = nearest_approach(scenario, scenario.target) < close
    if nearest_approach(scenario, candidate) < close and (at_turn > 1e-6 or not meets):
        return True
    targets = [scenario.target]
    for family in families:
        values = parameters_of(family, scenario, candidate)
        for name, (low, high) in family.parameters.items():
            values[name] = np.clip(values[name], low, high) if name != "depth" else values[name]
        targets.append(family.make(**values) if values else family.target())
    return any(np.max(np.abs(t.state(time, names) - state)) < close for t in targets)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if "crossing" not in kind])
def test_a_search_over_states_finds_no_other(kind):
    rng = np.random.default_rng([8, KINDS.index(kind)])
    scenario = draw(kind, rng)
    families = ghosts_of_two_legs(scenario)
    found = search(scenario, rng, 12)
    for state in found:
        assert known(scenario, families, state), (state, [family.case for family in families])


# -- exact arithmetic: every coordinate a fraction, p at the turn at t = 0, legs of one second ------------

E_1, E_2 = (F(0), F(1)), (F(24, 25), F(7, 25))  # unit headings; cos(alpha / 2) = 4/5


def exactly_the_same(target, ghost, headings=(E_1, E_2)):
    """Whether two (p, zeta, velocity) have the same cosines on both legs: squares and signs, 5 instants."""
    for e, side in zip(headings, (-1, 1), strict=True):
        for k in range(1, 6):
            t, values = side * F(k, 5), []
            for p, zeta, velocity in (target, ghost):
                d = [p[j] + t * (velocity[j] - e[j]) for j in (0, 1)]
                along, square = d[0] * e[0] + d[1] * e[1], d[0] ** 2 + d[1] ** 2 + zeta**2
                values.append((along, square))
            (s, r), (s_new, r_new) = values
            if s * s * r_new != s_new * s_new * r or (s > 0) != (s_new > 0) or (s < 0) != (s_new < 0):
                return False
    return True


def of_case(case, p, velocity, **options):
    """The ghosts of a case, in the frame of the exact checks."""
    scenario = build(np.array(p, float), np.array(velocity, float), (0.0, np.arctan2(24, 7)), **options)
    return [family for family in ghosts_of_two_legs(scenario) if family.case == case]


@pytest.mark.parametrize(
    ("case", "velocity", "beta"),
    [
        ("bisector", (F(-3, 5), F(-4, 5)), F(5, 13)),  # V_T . (e_1 + e_2) = -8/5, beta = 1 / (1 + 8/5)
        ("bisector", (F(3, 10), F(2, 5)), F(5)),  # 4/5
        ("broadside in leg 1", (F(3), F(1)), F(25, 17)),
    ],
)
def test_ghosts_over_the_array_in_exact_arithmetic(case, velocity, beta):
    if case == "broadside in leg 1":
        sin, cos = E_2
        c = velocity[0]
        assert beta == (1 - cos) / (c * 2 * sin * cos + (cos * cos - sin * sin) - cos), "as printed, v = 1"
    p, zeta = (F(0), F(0)), F(1, 2)
    e = E_2 if "broadside" in case else E_1
    w = [velocity[j] - e[j] for j in (0, 1)]
    mirrored = [2 * (w[0] * e[0] + w[1] * e[1]) * e[j] - w[j] for j in (0, 1)]
    new = tuple(e[j] + beta * mirrored[j] for j in (0, 1))
    assert exactly_the_same((p, zeta, velocity), (p, beta * zeta, new))
    assert exactly_the_same((p, zeta, velocity), (p, -beta * zeta, new))
    beside, new_beside = (F(1, 10), F(0)), (beta / 10, F(0))
    assert not exactly_the_same((beside, zeta, velocity), (new_beside, beta * zeta, new)), "needs p = 0"

    families = of_case(case, (0, 0), velocity)
    assert len(families) == 2
    for family, sign in zip(families, (1, -1), strict=True):
        ghost = family.target()
        assert np.allclose(ghost.velocity, np.array(new, float), atol=1e-13)
        assert ghost.depth == pytest.approx(float(ARRAY + sign * beta * zeta), abs=1e-13)


def test_constant_cosine_in_exact_arithmetic():
    chord = [E_2[j] - E_1[j] for j in (0, 1)]
    target = (tuple(2 * c for c in chord), F(0), tuple(E_1[j] + chord[j] / 3 for j in (0, 1)))
    for distance, share in ((F(3), F(1, 2)), (F(5, 2), F(-1)), (F(9), F(7, 3))):
        ghost = (
            tuple(distance * c for c in chord),
            F(0),
            tuple(E_1[j] + share * chord[j] for j in (0, 1)),
        )
        assert exactly_the_same(target, ghost)
    assert not exactly_the_same(target, (target[0], F(1, 9), target[2])), "only at the array's depth"


# -- one counterexample for each hypothesis of the corrected theorem ------------------------------------

CASES_OF = {
    "reflected path": ("general, reflected", {"depth mirror"}),
    "direct path": ("general", {"depth mirror"}),
    "equal depths": ("general, level", set()),
    "endfire in a leg": ("endfire, level", set()),
    "broadside in a leg": ("broadside", {"depth mirror"}),
    "broadside in a leg, ahead in the other": ("broadside, perpendicular", {"depth mirror"}),
    "relative rest in a leg": ("rest", {"depth mirror"}),
    "parallel in a leg": ("parallel", {"depth mirror"}),
    "equal depths, relative motion along V_2 - V_1": ("chord, level", {"constant cosine in both legs"}),
    "the same at another depth": ("chord", {"depth mirror"}),
    "over the array at the turn": ("overhead", {"depth mirror"}),
    "over the array, broadside in both": ("overhead, broadside, both", {"broadside in both legs"}),
    "U-turn": ("U-turn", {"mirror", "depth mirror", "mirror, depth mirror"}),
    "U-turn, equal depths": ("U-turn, level", {"mirror"}),
    "U-turn, parallel": ("U-turn, parallel", {"parallel course"}),
    "U-turn, endfire": ("U-turn, endfire, level", {"endfire"}),
}


@pytest.mark.parametrize("name", CASES_OF)
def test_the_list_of_cases(name):
    kind, cases = CASES_OF[name]
    for seed in range(6):
        families = ghosts_of_two_legs(draw(kind, np.random.default_rng([9, seed])))
        found = {family.case for family in families}
        assert found == cases


def test_depth_mirror_of_a_reflected_path_is_out_of_the_water():
    rng = np.random.default_rng(10)
    for _ in range(20):
        (family,) = ghosts_of_two_legs(draw("general, reflected", rng))
        assert not admissible(family.target(), BOTTOM)
    (family,) = ghosts_of_two_legs(build([2, 1], [0.3, 0.2], depth=1.5))
    assert family.target().depth == pytest.approx(2 * ARRAY - 1.5)
    assert admissible(family.target(), BOTTOM)
    (family,) = ghosts_of_two_legs(build([2, 1], [0.3, 0.2], depth=3.5))
    assert not admissible(family.target(), BOTTOM), "2 zO - zT may be above the surface"


def test_a_ghost_over_the_array_on_a_reflected_path_can_be_in_the_water():
    bisector = unit(0.3) + unit(1.4)
    families = ghosts_of_two_legs(build([0, 0], -0.2 * bisector, path=tma.BOTTOM_BOUNCE))
    depths = {f.case: f.target() for f in families if admissible(f.target(), BOTTOM)}
    assert set(depths) == {"bisector"}


def test_no_ghost_when_the_target_outruns_the_bisector_limit():
    bisector = (unit(0.3) + unit(1.4)) / np.hypot(*(unit(0.3) + unit(1.4)))
    limit = 1 / np.hypot(*(unit(0.3) + unit(1.4)))
    for speed, count in ((0.99 * limit, 3), (1.01 * limit, 1), (0.0, 1), (-5.0, 3)):
        assert len(ghosts_of_two_legs(build([0, 0], speed * bisector))) == count


def test_a_member_on_the_array_is_refused():
    (family,) = ghosts_of_two_legs(draw("overhead, broadside, both", np.random.default_rng(1)))
    with pytest.raises(ValueError, match="on the array"):
        family.target(depth=ARRAY)
    chord = unit(1.4) - unit(0.3)
    (family,) = ghosts_of_two_legs(build(2 * chord, unit(0.3) + 0.5 * chord, depth=ARRAY))
    with pytest.raises(ValueError, match="through the array"):
        family.target(range=0.1, share=5.0)


def test_a_target_that_passes_through_the_array_is_refused():
    chord = unit(1.4) - unit(0.3)
    scenario = build(0.5 * chord, unit(0.3) - 0.4 * chord, depth=ARRAY)
    with pytest.raises(ValueError, match="passes through the array"):
        ghosts_of_two_legs(scenario)


# -- bad input ----------------------------------------------------------------------------------------


def changed(**changes):
    return replace(build([2, 1], [0.3, 0.2]), **changes)


def course(*legs, speed=1.0):
    return tma.Course((0, 0), speed, 0.3, legs)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(platform=course(tma.Straight(1), tma.Straight(1))), "same heading"),
        (dict(platform=course(tma.Straight(2))), "two Straight legs"),
        (dict(platform=course(tma.Straight(1), tma.Turn(1, 0.5))), "two Straight legs"),
        (dict(platform=course(tma.Straight(1), tma.Straight(1, speed=2, heading=1))), "positive speed"),
        (dict(platform=course(tma.Straight(1), tma.Straight(1, heading=1), speed=0)), "positive speed"),
        (dict(platform=course(tma.Straight(1.99), tma.Straight(1, heading=1))), "5 instants"),
        (dict(target=tma.SampledCourse([0, 2], [[5, 5], [6, 6]])), "depth"),
    ],
)
def test_bad_scenario(changes, message):
    if "target" in changes:
        with pytest.raises((ValueError, AttributeError)):
            changed(**changes)
        return
    with pytest.raises(ValueError, match=message):
        ghosts_of_two_legs(changed(**changes))


def test_bad_sensors():
    scenario = build([2, 1], [0.3, 0.2])
    (sensor,) = scenario.sensors
    other = tma.Sensor(tma.ConicalAngle(tma.BOTTOM_BOUNCE, ARRAY, BOTTOM), sensor.times, 0.01)
    with pytest.raises(ValueError, match="one ConicalAngle"):
        ghosts_of_two_legs(replace(scenario, sensors=[sensor, other]))
    late = tma.Sensor(tma.ConicalAngle(tma.DIRECT, ARRAY, BOTTOM, heading_lag=0.1), sensor.times, 0.01)
    with pytest.raises(ValueError, match="heading_lag"):
        ghosts_of_two_legs(replace(scenario, sensors=[late]))
    bearing = tma.Sensor(tma.Bearing(), sensor.times, 0.01)
    with pytest.raises(ValueError, match="one ConicalAngle"):
        ghosts_of_two_legs(replace(scenario, sensors=[bearing]))


# -- right over the array -----------------------------------------------------------------------------


def with_instants(scenario, *more):
    (sensor,) = scenario.sensors
    return replace(scenario, sensors=[replace(sensor, times=np.union1d(sensor.times, more))])


OVERHEAD = [kind for kind in KINDS if "overhead" in kind and "level" not in kind]


@pytest.mark.parametrize("kind", OVERHEAD)
def test_right_over_the_array_at_a_measurement(kind):
    """The turn itself is measured."""
    rng = np.random.default_rng([10, OVERHEAD.index(kind)])
    for _ in range(4):
        scenario = with_instants(draw(kind, rng), 1.0)
        families = ghosts_of_two_legs(scenario)
        assert families
        for family in families:
            for ghost in members(family, scenario, rng):
                assert disagreement(scenario, ghost) < 1e-12
                own = replace(scenario, target=ghost).measure()
                np.testing.assert_allclose(own, scenario.measure(), atol=1e-12)
    for state in search(scenario, rng, 12):
        assert known(scenario, families, state), (state, [family.case for family in families])


@pytest.mark.parametrize("path", [tma.DIRECT, tma.BOTTOM_BOUNCE])
@pytest.mark.parametrize("turned", [1.1, 2.5, np.pi])
@pytest.mark.parametrize("leg", [0, 1])
def test_right_over_the_array_during_all_of_a_leg(path, turned, leg):
    """Relative rest, broadside in that leg: kappa = 2 + 2 cos(turn) < 1 has a ghost, too."""
    headings = (0.3, 0.3 + turned)
    scenario = with_instants(build([0, 0], unit(headings[leg]), headings, path), 1.0)
    families, rng = ghosts_of_two_legs(scenario), np.random.default_rng(16)
    cases = [family.case for family in families]
    ghost = [f"broadside in leg {leg + 1}"] * (2 if turned > 2 * np.pi / 3 else 0)
    assert cases == (["parallel course"] if turned == np.pi else ["depth mirror", *ghost])
    for family in families:
        for target in members(family, scenario, rng):
            assert disagreement(scenario, target) < 1e-12
    for state in search(scenario, rng, 20):
        assert known(scenario, families, state), (state, cases)


def test_right_over_the_array_during_a_leg():
    """Before the turn, at an instant: nothing special."""
    rng = np.random.default_rng(12)
    for _ in range(6):
        velocity = rng.uniform(-1, 1, 2)
        scenario = with_instants(build(0.5 * (velocity - unit(0.3)), velocity), 0.5)
        gap = scenario.target.position_at(0.5) - scenario.platform.position_at(0.5)
        assert np.hypot(*gap) < 1e-12
        (family,) = ghosts_of_two_legs(scenario)
        assert family.case == "depth mirror"
        assert disagreement(scenario, family.target()) < 1e-12


# -- special for the numbers given --------------------------------------------------------------------


def disturbed(scenario, by, rng):
    """Every number of target and array changed by less than ``by``; lengths here are of the order of one."""
    target, course, change = scenario.target, scenario.platform, rng.uniform(-by, by, 8)
    moved = tma.Target.from_velocity(
        target.position + change[:2], target.velocity + change[2:4], target.depth + change[4], target.time
    )
    first, second = course.legs
    second = replace(second, heading=second.heading + change[6])
    return replace(
        scenario,
        target=moved,
        platform=replace(course, heading=course.heading + change[5], legs=[first, second]),
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_case_holds_for_the_numbers_given(kind):
    """Numbers to 2e-8, and to 5e-10 for a target that meets the array, thus the cases of exact numbers."""
    rng = np.random.default_rng([13, KINDS.index(kind)])
    for _ in range(4):
        exact = draw(kind, rng)
        rounded = disturbed(exact, 5e-10 if "overhead" in kind and "level" in kind else 2e-8, rng)
        families = ghosts_of_two_legs(rounded)
        assert [f.case for f in families] == [f.case for f in ghosts_of_two_legs(exact)]
        for family in families:
            ghosts = members(family, rounded, rng)
            assert ghosts
            for ghost in ghosts:
                own = replace(rounded, target=ghost).measure()
                assert np.abs(own - rounded.measure()).max() <= 2e-6


@pytest.mark.parametrize("kind", KINDS)
def test_no_member_differs_noticeably(kind):
    rng = np.random.default_rng([14, KINDS.index(kind)])
    for by in 10.0 ** np.arange(-12, -1):
        for tolerance in (1e-9, 1e-6, 1e-4):
            scenario = disturbed(draw(kind, rng), by, rng)
            try:
                families = ghosts_of_two_legs(scenario, tolerance=tolerance)
            except ValueError:  # through the array during a leg
                continue
            for family in families:
                for ghost in members(family, scenario, rng, count=2):
                    change = np.abs(replace(scenario, target=ghost).measure() - scenario.measure())
                    assert change.max() <= 2 * tolerance, (family.case, by, tolerance)


def test_how_much_is_special_is_the_users_choice():
    for off, count in ((1e-7, 3), (1e-4, 1)):
        scenario = build([off, 0], -0.2 * (unit(0.3) + unit(1.4)))
        assert len(ghosts_of_two_legs(scenario)) == count
        assert len(ghosts_of_two_legs(scenario, tolerance=1e-3)) == 3
        assert len(ghosts_of_two_legs(scenario, tolerance=1e-12)) == 1
    with pytest.raises(ValueError, match="tolerance must be at most"):
        ghosts_of_two_legs(scenario, tolerance=0.1)
