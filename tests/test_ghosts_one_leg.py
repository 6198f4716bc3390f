"""Ghosts of one leg: every member measures the same, nothing else does, and no hypothesis is idle."""

import contextlib
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares

import tmalib as tma
from tmalib.ghosts import admissible, ghosts_of_one_leg

TIMES = np.linspace(0.0, 600.0, 13)
ONE_RAY = {
    "direct": tma.DIRECT,
    "bottom": tma.BOTTOM_BOUNCE,
    "surface": tma.SURFACE_BOUNCE,
    "surface-bottom": tma.RayPath(-1, 1, 1),
    "bottom-surface-bottom": tma.RayPath(1, 2, 1),
}
SHAPES = (
    *("general", "broadside", "parallel", "rest", "over the axis", "equal depth"),
    *("endfire", "collision", "receding", "rest, equal depth", "target on the bottom", "array on the bottom"),
)


def scenario_of(
    start, velocity, depth, paths, *, heading=0.0, zo=200.0, bottom=4000.0, speed=5.0, times=TIMES
):
    """A scenario from the position and velocity relative to the array, in the array's own axes."""
    sin, cos = np.sin(heading), np.cos(heading)
    right, ahead = np.array([cos, -sin]), np.array([sin, cos])
    array = tma.Course((300.0, -200.0), speed, heading, [tma.Straight(np.inf)])
    position = array.position_at(0.0) + start[0] * right + start[1] * ahead
    target = tma.Target.from_velocity(
        position, speed * ahead + velocity[0] * right + velocity[1] * ahead, depth=depth
    )
    sensors = [tma.Sensor(tma.ConicalAngle(path, zo, bottom), times, 0.017) for path in paths]
    return tma.Scenario(array, sensors, reference_time=0.0, target=target)


def geometry(rng, shape, paths, heading=None):
    """A random scenario of this shape; `None` where the rays of these paths cannot have it."""
    bottom, zo, depth = 4000.0, rng.uniform(50, 400), rng.uniform(50, 400)
    x, y = rng.choice([-1, 1], 2) * rng.uniform(2e3, 9e3, 2)
    u, v = rng.choice([-1, 1], 2) * rng.uniform(0.5, 5, 2)
    if shape in ("equal depth", "endfire", "collision", "receding", "rest, equal depth"):
        depth = zo
    if shape == "broadside":
        y = v = 0.0
    if shape in ("parallel", "over the axis"):
        u = 0.0
    if shape in ("endfire", "over the axis"):
        x = u = 0.0
    if shape == "endfire":
        v = np.sign(y) * abs(v)
    if shape.startswith("rest"):
        u = v = 0.0
    if shape in ("collision", "receding"):
        ratio = rng.uniform(1e-4, 3e-4) * (-1 if shape == "collision" else 1)
        u, v = ratio * x, ratio * y
    if shape == "target on the bottom":
        depth, u = bottom, rng.choice([0.0, u])
    if shape == "array on the bottom":
        zo = bottom
    heading = rng.uniform(-7, 7) if heading is None else heading
    return scenario_of((x, y), (u, v), depth, paths, heading=heading, zo=zo, bottom=bottom)


def paths_of(name):
    return [tma.DIRECT, tma.BOTTOM_BOUNCE] if name == "two" else [ONE_RAY[name]]


def sample(rng, family, count=6):
    """Members at random values of the parameters and at the finite ends of their ranges."""
    members = []
    for k in range(count):
        values = {}
        for name, (low, high) in family.parameters.items():
            if np.isfinite([low, high]).all():
                values[name] = [low, high, *rng.uniform(low, high, count)][k]
            elif low == 0:
                values[name] = rng.uniform(0.2, 3) if name == "beta" else rng.uniform(1e3, 1e4)
            else:
                values[name] = rng.choice([-1, 1]) * rng.uniform(500, 2e4)
        with contextlib.suppress(ValueError):  # a depth of zO, say, on the direct path
            members.append(family.target(**values))
    assert members
    return members


@pytest.mark.parametrize("rays", [*ONE_RAY, "two"])
def test_every_member_measures_the_same(rays):
    """Over 200 random geometries, with arbitrary headings: 1e-12 at all times."""
    rng = np.random.default_rng(11)
    for shape in SHAPES:
        for _ in range(3):
            scenario = geometry(rng, shape, paths_of(rays))
            for family in ghosts_of_one_leg(scenario):
                for ghost in sample(rng, family):
                    error = np.abs(replace(scenario, target=ghost).measure() - scenario.measure()).max()
                    assert error < 1e-12, (rays, shape, family.case, error)


EXPECTED_ONE = {
    "general": {"homothetic": ["depth"], "mirror-homothetic": ["depth"]},
    "broadside": {"broadside": ["across_end", "across_start", "depth"]},
    "parallel": {"parallel": ["across", "depth"]},
    "over the axis": {"parallel": ["across", "depth"]},
    "rest": {"relative rest": ["across", "depth"]},
}
ON_THE_LEVEL = {
    "equal depth": {"homothetic": ["beta"], "mirror-homothetic": ["beta"]},
    "endfire": {"endfire": ["range_end", "range_start"]},
}
EXPECTED_TWO = {
    "general": {"mirror": [], "homothetic": [], "mirror-homothetic": []},
    "broadside": EXPECTED_ONE["broadside"],
    "parallel": {"parallel, right": ["depth"], "parallel, left": ["depth"]},
    "rest": {"parallel, right": ["depth"], "parallel, left": ["depth"]},
    "equal depth": {"mirror": []},
    "collision": {"mirror": []},
    "endfire": {},
}


@pytest.mark.parametrize(
    ("rays", "shape", "expected"),
    [("bottom", *item) for item in EXPECTED_ONE.items()]
    + [("direct", *item) for item in (EXPECTED_ONE | ON_THE_LEVEL).items() if item[0] != "rest"]
    + [("two", *item) for item in EXPECTED_TWO.items()],
)
def test_the_case_and_its_parameters(rays, shape, expected):
    """Also on headings that no float holds exactly: the special cases survive rounding."""
    for degrees in (0, 30, 90, 123.4, 225, -77):
        scenario = geometry(np.random.default_rng(4), shape, paths_of(rays), np.radians(degrees))
        found = {family.case: sorted(family.parameters) for family in ghosts_of_one_leg(scenario)}
        assert found == expected


@pytest.mark.parametrize("shape", ["collision", "receding", "rest, equal depth", "rest"])
def test_constant_cosine_on_the_direct_path(shape):
    scenario = geometry(np.random.default_rng(8), shape, [tma.DIRECT])
    assert np.ptp(scenario.measure()) < 1e-12
    cases = [family.case for family in ghosts_of_one_leg(scenario)]
    assert cases == ["relative rest", "radial, right", "radial, left"]


# -- completeness -----------------------------------------------------------------------------------


def relative(scenario, target):
    """Start and end of a target relative to the array: ``(x0, y0, x1, y1)`` in the array's axes."""
    heading = scenario.platform.heading_at(0.0)
    sin, cos = np.sin(heading), np.cos(heading)
    d = target.position_at(TIMES[[0, -1]]) - scenario.platform.position_at(TIMES[[0, -1]])
    return np.stack([d @ [cos, -sin], d @ [sin, cos]], axis=1).ravel()


def distance(scenario, families, candidate):
    """Distance of a target to the nearest member of the families, relative to its own range."""
    x0, y0, x1, y1 = coordinates = relative(scenario, candidate)
    truth = relative(scenario, scenario.target)
    known = dict(depth=candidate.depth, across=x0, across_start=x0, across_end=x1)
    known |= dict(range_start=abs(y0), range_end=abs(y1), beta=y0 / truth[1] if truth[1] else np.nan)
    members = [scenario.target]
    for family in families:
        values = {}
        for name, (low, high) in family.parameters.items():
            values[name] = np.clip(known[name], low, high)
        try:
            members.append(family.target(**values))
        except ValueError:
            continue
    here = np.append(coordinates, candidate.depth)
    gaps = [np.abs(np.append(relative(scenario, member), member.depth) - here).max() for member in members]
    return min(gaps) / np.abs(coordinates).max()


def search(scenario, rng, starts, depth=(0.0, 4000.0)):
    """Targets with the same measurements, found by least squares from random starts.

    A start has a random depth and random positions across the axis at the first and last measurement;
    ahead it is put where the first ray's cosines of these two instants want it. The depth is
    ``middle - half cos(q)``, so that the search needs no bounds.
    """
    sensors, measured = scenario.sensors, scenario.measure()
    sites = [sensor.model.observer_state(scenario.platform, sensor.times) for sensor in sensors]
    middle, half = np.mean(depth), np.diff(depth)[0] / 2
    unit = np.array([1e3, 1e3, half, 1.0, 1.0])
    sin, cos = sites[0][2:, 0]
    ends, times = [0, len(sensors[0]) - 1], sensors[0].times

    def state(q):
        return unit * [q[0], q[1], middle / half - np.cos(q[2]), q[3], q[4]]

    def parts(q, which):
        pairs = zip(sensors, sites, strict=True)
        return np.concatenate(
            [s.model.value_and_gradient(state(q), site, s.times)[which] for s, site in pairs], axis=-1
        )

    def slope(q):
        return (parts(q, 1) * (unit * [1, 1, np.sin(q[2]), 1, 1])[:, None]).T

    def start(k):
        z = rng.uniform(*depth) if k % 3 == 0 else rng.uniform(depth[0], min(depth[0] + 800, depth[1]))
        slope, offset = sensors[0].model.path.image(sensors[0].model.bottom_depth)
        x, m = rng.normal(size=2) * 10 ** rng.uniform(2, 4), measured[ends]
        y = m / np.sqrt(np.maximum(1 - m**2, 0.05)) * np.hypot(x, slope * z + offset - 200.0)
        first, last = np.stack([x * cos + y * sin, y * cos - x * sin], axis=1) + sites[0][:2, ends].T
        velocity = (last - first) / (times[-1] - times[0])
        position = first - times[0] * velocity
        return np.array([*position / 1e3, np.arccos((middle - z) / half), *velocity])

    found = []
    for k in range(starts):
        fit = least_squares(
            lambda q: parts(q, 0) - measured, start(k), slope,
            method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=1000,
        )  # fmt: skip
        x, y, z, vx, vy = state(fit.x)
        if np.abs(fit.fun).max() < 1e-11 and np.hypot(x, y) < 1e6:
            found.append(tma.Target.from_velocity((x, y), (vx, vy), depth=z))
    return found


COMPLETE = [(rays, shape) for rays in ("direct", "bottom", "two") for shape in SHAPES]


@pytest.mark.parametrize(("rays", "shape"), COMPLETE)
def test_nothing_else_measures_the_same(rays, shape):
    """Twelve starts for each of 36 geometries: all that is found is in a family, and some is found."""
    rng = np.random.default_rng(23)
    scenario = geometry(rng, shape, paths_of(rays))
    families = ghosts_of_one_leg(scenario)
    # Endfire, direct ray: most starts run away, for m tends to 1 with the range.
    found = search(scenario, rng, 60 if (rays, shape) == ("direct", "endfire") else 12)
    assert found
    for candidate in found:
        assert distance(scenario, families, candidate) < 1e-3, (rays, shape, candidate)


@pytest.mark.parametrize("left_out", [0, 1])
def test_the_search_can_fail(left_out):
    """With a family left out, the same search finds what is missing."""
    scenario = geometry(np.random.default_rng(23), "general", [tma.BOTTOM_BOUNCE])
    kept = ghosts_of_one_leg(scenario)[1 - left_out]
    found = search(scenario, np.random.default_rng(1), 24)
    assert max(distance(scenario, [kept], candidate) for candidate in found) > 0.01


# -- exact geometries -------------------------------------------------------------------------------


def squares_agree(x, y, zeta, gx, gy, gzeta):
    """Whether ``y^2 (x'^2 + zeta'^2) = y'^2 (x^2 + zeta^2)`` at seven rational times, exactly."""
    for t in range(7):
        a, b, c, d = ((start + t * rate) for start, rate in (x, y, gx, gy))
        if b**2 * (c**2 + gzeta**2) != d**2 * (a**2 + zeta**2) or (b > 0) != (d > 0):
            return False
    return True


def line(start, rate=0):
    return Fraction(start), Fraction(rate)


# Over six seconds, with zO = 200, on the direct path:
# (x, u), (y, v), zeta; parameters of a member; its (x', u'), (y', v'), zeta'.
TRIANGLE, REST = (line(30), line(7, 1), 40), (line(30), line(70), 40)
EXACT = {
    "homothetic": (
        (line(3, 1), line(4, 2), -100), dict(depth=50),
        (line("9/2", "3/2"), line(6, 3), -150),
    ),
    "mirror-homothetic": (
        (line(3, 1), line(4, 2), -100), dict(depth=300),
        (line(-3, -1), line(4, 2), 100),
    ),
    "parallel": (TRIANGLE, dict(across=60, depth=120), (line(60), line(14, 2), -80)),
    "relative rest": (REST, dict(across=-36, depth=248), (line(-36), line(84), 48)),
    "radial, left": (
        REST, dict(range_start=140, range_end=280),
        (line(-100, "-50/3"), line(140, "70/3"), 0),
    ),
    "endfire": (
        (line(0), line(70, 2), 0), dict(range_start=10, range_end=64),
        (line(0), line(10, 9), 0),
    ),
    "broadside": (
        (line(7, 2), line(0), 9), dict(across_start=1, across_end=7, depth=7),
        (line(1, 1), line(0), -193),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", EXACT)
def test_exact_geometry(case):
    """The member is the one computed with fractions, and the fractions satisfy the identity exactly."""
    (x, y, zeta), values, (gx, gy, gzeta) = EXACT[case]
    assert squares_agree(x, y, zeta, gx, gy, gzeta)
    times = np.arange(7.0)
    start, velocity = (float(x[0]), float(y[0])), (float(x[1]), float(y[1]))
    scenario = scenario_of(start, velocity, 200.0 + zeta, [tma.DIRECT], times=times)
    (family,) = (family for family in ghosts_of_one_leg(scenario) if family.case == case)
    ghost = family.target(**values)
    d = ghost.position_at(times) - scenario.platform.position_at(times)
    np.testing.assert_allclose(d[:, 0], float(gx[0]) + times * float(gx[1]), atol=1e-9)
    np.testing.assert_allclose(d[:, 1], float(gy[0]) + times * float(gy[1]), atol=1e-9)
    assert ghost.depth == pytest.approx(200.0 + gzeta)


def test_two_rays_by_fractions():
    """D = 10, zO = 4, zT = 1: the product of the heights above the bottom is 36, so z' = 6, beta = 2/3."""
    bottom, zo, z = Fraction(10), Fraction(4), Fraction(1)
    other, beta = bottom - (bottom - zo) ** 2 / (bottom - z), (bottom - zo) / (bottom - z)
    assert (other, beta) == (6, Fraction(2, 3))
    x, y = line(3, 1), line(4, 2)
    gx, gy = (-beta * x[0], -beta * x[1]), (beta * y[0], beta * y[1])
    for image in (lambda z: z - zo, lambda z: 2 * bottom - z - zo):
        assert squares_agree(x, y, image(z), gx, gy, image(other))
    scenario = scenario_of((3, 4), (1, 2), 1.0, paths_of("two"), zo=4.0, bottom=10.0, times=np.arange(7.0))
    assert [f.target().depth for f in ghosts_of_one_leg(scenario)] == pytest.approx([1, 6, 6])


# -- every hypothesis is needed ---------------------------------------------------------------------


def proportional(scenario, ghost):
    _, y0, _, y1 = relative(scenario, scenario.target)
    _, g0, _, g1 = relative(scenario, ghost)
    return abs(y0 * g1 - y1 * g0) < 1e-6 * max(abs(y0), abs(y1)) * max(abs(g0), abs(g1))


def same(scenario, ghost):
    return np.abs(replace(scenario, target=ghost).measure() - scenario.measure()).max() < 1e-12


def test_y_is_proportional_only_if_the_cosine_varies():
    varying = scenario_of((5000, 7000), (-2, -3), 200.0, [tma.DIRECT])
    for family in ghosts_of_one_leg(varying):
        assert proportional(varying, family.target(beta=1.7))
    constant = scenario_of((5000, 7000), (-5, -7), 200.0, [tma.DIRECT])
    ghost = ghosts_of_one_leg(constant)[0].target(across=3000.0, depth=900.0)
    assert same(constant, ghost)
    assert not proportional(constant, ghost)


def test_beta_is_positive_because_m_has_a_sign():
    scenario = scenario_of((5000, 7000), (2, -3), 100.0, [tma.DIRECT])
    ghost = tma.Target.from_velocity(
        2 * scenario.platform.position_at(0.0) - scenario.target.position,
        2 * np.array([0.0, 5.0]) - scenario.target.velocity,
        depth=100.0,
    )
    opposite = replace(scenario, target=ghost).measure()
    np.testing.assert_allclose(opposite**2, scenario.measure() ** 2, atol=1e-12)
    assert not same(scenario, ghost)


def test_parallel_is_about_the_relative_velocity():
    """An opposite course and a motionless target are in case 3, which the printed theorem excludes."""
    for v in (-10.0, -5.0):
        scenario = scenario_of((5000, 7000), (0, v), 100.0, [tma.BOTTOM_BOUNCE])
        assert [family.case for family in ghosts_of_one_leg(scenario)] == ["parallel"]


def test_depth_mirror_belongs_to_the_direct_path():
    scenario = scenario_of((5000, 7000), (2, -3), 100.0, [tma.DIRECT])
    ghost = tma.Target.from_velocity(scenario.target.position, scenario.target.velocity, depth=300.0)
    assert same(scenario, ghost)
    assert not same(scenario_of((5000, 7000), (2, -3), 100.0, [tma.BOTTOM_BOUNCE]), ghost)


def test_three_instants_are_not_enough():
    """Across the axis any start and a speed for which the three places ahead lie on a line in time."""
    full = scenario_of((5000, 7000), (2, -3), 100.0, [tma.BOTTOM_BOUNCE])
    short = replace(full, sensors=[tma.Sensor(full.sensors[0].model, TIMES[::6], 0.017)])
    m, zeta = short.measure(), 7700.0

    def ahead(u):
        return m / np.sqrt(1 - m**2) * np.hypot(12e3 + u * TIMES[::6], zeta)

    u = brentq(lambda u: np.diff(ahead(u), 2)[0], -30.0, 30.0, xtol=1e-14)
    x, y = np.array([12e3, 12e3 + 600 * u]), ahead(u)[[0, -1]]
    start = full.platform.position_at(0.0) + [x[0], y[0]]
    ghost = tma.Target.from_velocity(start, [u, 5 + (y[1] - y[0]) / 600], depth=100.0)
    assert same(short, ghost)
    assert not same(full, ghost)
    assert distance(full, ghosts_of_one_leg(full), ghost) > 0.1
    with pytest.raises(ValueError, match="at least 4 instants, got 3"):
        ghosts_of_one_leg(short)


def test_endfire_needs_one_ray_only():
    assert ghosts_of_one_leg(scenario_of((0, 7000), (0, 3), 200.0, paths_of("two"))) == []
    assert len(ghosts_of_one_leg(scenario_of((0, 7000), (0, 3), 200.0, [tma.DIRECT]))) == 1


def test_fisher_information_does_not_tell():
    """Endfire, two rays: no ghost at all, and yet a Fisher information of deficient rank."""
    scenario = scenario_of((0, 7000), (0, 3), 200.0, paths_of("two"))
    assert tma.information_rank(scenario) < 5


@pytest.mark.parametrize(("zo", "depth", "inside"), [(200.0, 100.0, True), (400.0, 900.0, False)])
def test_at_most_three(zo, depth, inside):
    """The ghost at the other depth may be above the surface; it still measures the same."""
    scenario = scenario_of((5000, 7000), (2, -3), depth, paths_of("two"), zo=zo)
    ghosts = [family.target() for family in ghosts_of_one_leg(scenario)]
    assert all(same(scenario, ghost) for ghost in ghosts)
    assert [admissible(ghost, 4000.0) for ghost in ghosts] == [True, inside, inside]
    if not inside:
        assert ghosts[1].depth < 0


def test_parallel_ghosts_do_not_exist_at_every_depth():
    scenario = scenario_of((500, 7000), (0, 3), 100.0, paths_of("two"))
    right, left = ghosts_of_one_leg(scenario)
    assert right.parameters == left.parameters
    low, high = right.parameters["depth"]
    assert 0 <= low < 100.0 < high < 4000.0
    with pytest.raises(ValueError, match="depth must be between"):
        right.target(depth=high + 1)
    found = search(scenario, np.random.default_rng(3), 12, depth=(high + 20, 4000.0))
    assert not found


def test_one_heading_is_needed():
    """The mirror ghost of one leg is seen through by a turn."""
    scenario = scenario_of((5000, 7000), (2, -3), 100.0, paths_of("two"))
    mirror = ghosts_of_one_leg(scenario)[0].target()
    turning = tma.Course((300.0, -200.0), 5.0, 0.0, [tma.Turn(np.inf, 1e-3)])
    assert not same(replace(scenario, platform=turning), mirror)
    with pytest.raises(ValueError, match="one straight leg"):
        ghosts_of_one_leg(replace(scenario, platform=turning))


# -- bad input --------------------------------------------------------------------------------------


def test_what_is_not_covered():
    good = scenario_of((5000, 7000), (2, -3), 100.0, paths_of("two"))

    def cone(path=tma.DIRECT, zo=200.0, bottom=4000.0, times=TIMES):
        return tma.Sensor(tma.ConicalAngle(path, zo, bottom), times, 0.017)

    bearings = replace(good, sensors=[tma.Sensor(tma.Bearing(), TIMES, 0.01)])
    with pytest.raises(ValueError, match="must be ConicalAngle"):
        ghosts_of_one_leg(bearings)
    with pytest.raises(ValueError, match="Target with a depth"):
        ghosts_of_one_leg(replace(bearings, target=tma.Target((1e3, 1e3), 1, 0)))
    with pytest.raises(ValueError, match="same array_depth"):
        ghosts_of_one_leg(replace(good, sensors=[cone(), cone(tma.BOTTOM_BOUNCE, zo=100.0)]))
    with pytest.raises(ValueError, match="one path, or the direct path and the bottom"):
        ghosts_of_one_leg(replace(good, sensors=[cone(), cone(tma.SURFACE_BOUNCE)]))
    with pytest.raises(ValueError, match="at least 4 instants, got 3"):
        ghosts_of_one_leg(replace(good, sensors=[cone(), cone(tma.BOTTOM_BOUNCE, times=TIMES[:3])]))
    with pytest.raises(ValueError, match="depth must be between"):
        ghosts_of_one_leg(scenario_of((5000, 7000), (2, -3), 4500.0, [tma.DIRECT]))
    uneven = tma.Course((300.0, -200.0), 5.0, 0.0, [tma.Straight(300), tma.Straight(np.inf, speed=6)])
    with pytest.raises(ValueError, match="one straight leg"):
        ghosts_of_one_leg(replace(good, platform=uneven))


def test_sensors_of_one_path_and_an_assumed_depth_count_as_one_ray():
    model = tma.ConicalAngle(tma.RayPath(-1, 0, 0), 200.0, 4000.0, assumed_depth=300.0)
    split = [tma.Sensor(model, TIMES[:7], 0.01), tma.Sensor(model, TIMES[7:], 0.01)]
    scenario = replace(scenario_of((5000, 7000), (2, -3), 100.0, [tma.DIRECT]), sensors=split)
    (a, _), (b, _) = (
        ghosts_of_one_leg(scenario),
        ghosts_of_one_leg(scenario_of((5000, 7000), (2, -3), 100.0, [tma.DIRECT])),
    )
    np.testing.assert_allclose(
        a.target(depth=350.0).position_at(TIMES), b.target(depth=350.0).position_at(TIMES)
    )


def test_members_on_the_array_are_refused():
    direct = ghosts_of_one_leg(scenario_of((5000, 7000), (2, -3), 100.0, [tma.DIRECT]))[0]
    with pytest.raises(ValueError, match="beta = 0"):
        direct.target(depth=200.0)
    endfire = ghosts_of_one_leg(scenario_of((0, 7000), (0, 3), 200.0, [tma.DIRECT]))[0]
    with pytest.raises(ValueError, match="must be positive"):
        endfire.target(range_start=0.0, range_end=1.0)
    broadside = ghosts_of_one_leg(scenario_of((500, 0), (1, 0), 100.0, [tma.DIRECT]))[0]
    with pytest.raises(ValueError, match="pass through the array"):
        broadside.target(across_start=-1.0, across_end=1.0, depth=200.0)
    parallel = ghosts_of_one_leg(scenario_of((500, 90), (0, 1), 100.0, [tma.DIRECT]))[0]
    with pytest.raises(ValueError, match="on the array's line"):
        parallel.target(across=0.0, depth=200.0)


# -- right over the array ---------------------------------------------------------------------------


@pytest.mark.parametrize("rays", ["direct", "bottom", "surface", "two"])
@pytest.mark.parametrize("when", [0.0, 150.0, 600.0])
def test_right_over_the_array_at_a_measurement(rays, when):
    """The cases of any target, every member the same, and a search finds no other."""
    rng = np.random.default_rng(31)
    for parallel in (False, True):
        u, v = rng.uniform(1, 5) * (not parallel), rng.choice([-1, 1]) * rng.uniform(1, 5)
        scenario = scenario_of((-u * when, -v * when), (u, v), 300.0, paths_of(rays), heading=0.7)
        gap = scenario.target.position_at(when) - scenario.platform.position_at(when)
        assert np.hypot(*gap) < 1e-9
        families = ghosts_of_one_leg(scenario)
        expected = EXPECTED_TWO if rays == "two" else EXPECTED_ONE
        cases = {family.case: sorted(family.parameters) for family in families}
        assert cases == expected["parallel" if parallel else "general"]
        for family in families:
            for ghost in sample(rng, family):
                assert same(scenario, ghost)
        found = search(scenario, rng, 24)
        assert found
        for candidate in found:
            assert distance(scenario, families, candidate) < 1e-3


def test_at_rest_right_over_the_array():
    for rays in ("direct", "bottom", "two"):
        scenario = scenario_of((0, 0), (0, 0), 300.0, paths_of(rays), heading=0.7)
        assert np.abs(scenario.measure()).max() < 1e-12
        (family,) = ghosts_of_one_leg(scenario)
        assert family.case == "broadside"
        assert same(scenario, family.target(across_start=-40.0, across_end=900.0, depth=1.0))


@pytest.mark.parametrize("rays", ["direct", "two"])
def test_a_target_that_passes_through_the_array_is_refused(rays):
    for x, y, u, v in [(0, 2000, 0, -4.5), (1000, 2000, -2.25, -4.5)]:
        with pytest.raises(ValueError, match="passes through the array"):
            ghosts_of_one_leg(scenario_of((x, y), (u, v), 200.0, paths_of(rays)))


# -- special for the numbers given ------------------------------------------------------------------


def disturbed(scenario, by, rng):
    """The same scenario with every number of the target changed by less than ``by`` metres (at the end)."""
    target, change = scenario.target, rng.uniform(-by, by, 5)
    moved = tma.Target.from_velocity(
        target.position + change[:2], target.velocity + change[2:4] / 600, target.depth + change[4]
    )
    return replace(scenario, target=moved)


SPECIAL = [(rays, shape) for rays in ("direct", "bottom", "two") for shape in SHAPES if "bottom" not in shape]


@pytest.mark.parametrize(("rays", "shape"), SPECIAL)
def test_a_millimetre_leaves_a_case_what_it_is(rays, shape):
    """Positions to a millimetre; every member agrees within twice the tolerance, and mostly much better."""
    rng = np.random.default_rng(17)
    for _ in range(4):
        exact = geometry(rng, shape, paths_of(rays), np.radians(rng.integers(360)))
        rounded = disturbed(exact, 5e-4, rng)
        families = ghosts_of_one_leg(rounded)
        assert [f.case for f in families] == [f.case for f in ghosts_of_one_leg(exact)]
        for family in families:
            ghosts = sample(rng, family)
            assert len(ghosts) == 6, "none is refused"
            for ghost in ghosts:
                error = np.abs(replace(rounded, target=ghost).measure() - rounded.measure()).max()
                assert error < 2e-6


def test_how_much_is_special_is_the_users_choice():
    rng = np.random.default_rng(5)
    exact = geometry(rng, "parallel", [tma.DIRECT], np.radians(45))
    choices = [(1e-9, 1e-6, "parallel"), (1e-3, 1e-12, "homothetic"), (1.0, 1e-3, "parallel")]
    for by, tolerance, case in choices:
        assert ghosts_of_one_leg(disturbed(exact, by, rng), tolerance=tolerance)[0].case == case
    for wrong in (0.0, 1e-13, 2e-3, np.nan):
        with pytest.raises(ValueError, match="tolerance"):
            ghosts_of_one_leg(exact, tolerance=wrong)


@pytest.mark.parametrize("rays", ["direct", "two"])
def test_no_member_differs_noticeably(rays):
    """From rounding to ten metres off a special case: whatever is claimed, the bound holds."""
    rng = np.random.default_rng(29)
    for shape in SHAPES:
        for by in 10.0 ** np.arange(-10, 2):
            for tolerance in (1e-9, 1e-6, 1e-4):
                scenario = disturbed(geometry(rng, shape, paths_of(rays)), by, rng)
                if not 0 <= scenario.target.depth <= 4000.0:
                    continue
                for family in ghosts_of_one_leg(scenario, tolerance=tolerance):
                    for ghost in sample(rng, family):
                        change = np.abs(replace(scenario, target=ghost).measure() - scenario.measure())
                        assert change.max() <= 2 * tolerance


def test_the_origin_of_coordinates_does_not_count():
    """On a national grid, 5000 km from its origin, a metre is not nothing."""
    near = scenario_of((3000, 5000), (1e-3, 3.0), 100.0, [tma.DIRECT])
    far = np.array([4e5, 5e6])
    moved = replace(
        near,
        target=tma.Target.from_velocity(near.target.position + far, near.target.velocity, depth=100.0),
        platform=replace(near.platform, start=near.platform.start + far),
    )
    assert [f.case for f in ghosts_of_one_leg(moved)] == ["homothetic", "mirror-homothetic"]
    assert [f.case for f in ghosts_of_one_leg(moved, tolerance=1e-3)] == ["parallel"]
