"""The one entry to the ghosts; the cases are tested in test_ghosts_one_leg and test_ghosts_two_legs."""

from dataclasses import replace

import numpy as np
import pytest

import tmalib as tma
from tmalib.ghosts.family import Family, verified


def scenario(legs, paths=(tma.BOTTOM_BOUNCE,)):
    times = np.arange(0.0, 601.0, 20.0)
    sensors = [tma.Sensor(tma.ConicalAngle(path, 200.0, 4000.0), times, 0.01) for path in paths]
    platform = tma.Course((0, 0), 5.0, 0.3, legs)
    return tma.Scenario(
        platform, sensors, reference_time=0.0, target=tma.Target((5e3, 7e3), 4.0, 0.8, depth=100.0)
    )


@pytest.mark.parametrize(
    ("legs", "paths"),
    [
        ([tma.Straight(600)], (tma.BOTTOM_BOUNCE,)),
        ([tma.Straight(600)], (tma.DIRECT, tma.BOTTOM_BOUNCE)),
        ([tma.Straight(300), tma.Straight(300, heading=1.4)], (tma.BOTTOM_BOUNCE,)),
    ],
)
def test_every_isolated_ghost_gives_the_same_measurements(legs, paths):
    true = scenario(legs, paths)
    families = tma.find_ghosts(true)
    for family in families:
        if family.is_isolated:
            ghost = replace(true, target=family.target())
            np.testing.assert_allclose(ghost.measure(), true.measure(), atol=1e-12)
    assert any("mirror" in family.case for family in families)


TWO = [tma.Straight(300), tma.Straight(300, heading=1.4)]


def measured_between(scenario, first, last):
    times = [np.clip(s.times, first, last) for s in scenario.sensors]
    sensors = [replace(s, times=np.unique(t)) for s, t in zip(scenario.sensors, times, strict=True)]
    return replace(scenario, sensors=sensors)


@pytest.mark.parametrize(("first", "last", "heading"), [(0, 299, 0.3), (301, 600, 1.4), (300, 600, 1.4)])
def test_the_legs_with_measurements_count(first, last, heading):
    """Two legs, measured on one: the ghosts of a course that has this leg only."""
    for paths in [(tma.BOTTOM_BOUNCE,), (tma.DIRECT, tma.BOTTOM_BOUNCE)]:
        partly = measured_between(scenario(TWO, paths), first, last)
        start = partly.platform.position_at(first)
        alone = replace(partly, platform=tma.Course(start, 5.0, heading, [tma.Straight(600)], first))
        found, expected = tma.find_ghosts(partly), tma.find_ghosts(alone)
        assert [f.case for f in found] == [f.case for f in expected] != []
        for family, other in zip(found, expected, strict=True):
            values = dict.fromkeys(family.parameters, 700.0)
            one, two = family.target(**values), other.target(**values)
            np.testing.assert_allclose(one.position_at([0, 600]), two.position_at([0, 600]), atol=1e-6)


def test_two_legs_of_three_and_two_that_are_one():
    expected = tma.find_ghosts(scenario(TWO))
    start = scenario(TWO).platform.position_at(0.0) - 100 * np.array([np.sin(2.0), np.cos(2.0)])
    before = [tma.Straight(20), tma.Straight(300, heading=0.3), TWO[1]]
    three = replace(scenario(TWO), platform=tma.Course(start, 5.0, 2.0, before, start_time=-20.0))
    after = replace(three, platform=tma.Course((0, 0), 5.0, 0.3, [*TWO, tma.Turn(100, 0.02)]))
    for longer in (three, after):
        longer = measured_between(longer, 0, 599)
        (family,) = tma.find_ghosts(longer)
        assert family.case == expected[0].case == "depth mirror"
        assert family.target().depth == pytest.approx(expected[0].target().depth)
    one = tma.find_ghosts(scenario([tma.Straight(200), tma.Straight(400)]))
    assert [f.case for f in one] == [f.case for f in tma.find_ghosts(scenario([tma.Straight(600)]))]


def test_legs_that_do_not_follow_each_other_are_refused():
    apart = [tma.Straight(200), tma.Turn(200, 0.005), tma.Straight(200)]
    (sensor,) = scenario(apart).sensors
    gap = replace(sensor, times=sensor.times[(sensor.times < 200) | (sensor.times > 400)])
    with pytest.raises(ValueError, match=r"two Straight legs, one after the other.*legs \[0, 2\]"):
        tma.find_ghosts(replace(scenario(apart), sensors=[gap]))


def test_what_is_not_covered_is_refused():
    turning = scenario([tma.Straight(200), tma.Turn(200, 0.005), tma.Straight(200)])
    with pytest.raises(ValueError, match="leg"):
        tma.find_ghosts(turning)


def test_what_is_no_ghost_is_not_handed_out():
    """A mistake in a case: members that differ are refused, an isolated one is left out."""
    true = scenario([tma.Straight(600)])

    def member(speed):
        return replace(true.target, speed=speed)

    right, wrong = (Family("alone", "here", lambda by=by: member(4.0 + by)) for by in (0.0, 0.1))
    many = Family("many", "here", member, {"speed": (0.0, 10.0)})
    one, family = verified(true, [right, wrong, many], 1e-6)
    assert one.target().speed == family.target(speed=4.0).speed == 4.0
    with pytest.raises(ValueError, match=r"the cosines of the member .* differ by"):
        family.target(speed=4.1)


def test_admissible():
    shallow, deep, flying = (tma.Target((1e3, 1e3), 1.0, 0.0, depth=z) for z in (100.0, 900.0, -5.0))
    assert tma.admissible(shallow, 4000.0)
    assert tma.admissible(deep, 4000.0)
    assert not tma.admissible(deep, 4000.0, deepest=400.0)
    assert not tma.admissible(flying, 4000.0)


SLIGHT = [tma.Straight(300), tma.Straight(300, heading=0.32)]  # the search finds ghosts, but for a sharp turn


@pytest.mark.parametrize("legs", [[tma.Straight(600)], SLIGHT])
def test_theorems_refuse_an_array_elsewhere_and_the_search_takes_it(legs):
    """One array is what the theorems are about; the search compares measurements of any."""
    true, one_ray = scenario(legs, (tma.DIRECT, tma.BOTTOM_BOUNCE)), scenario(legs)
    here = true.platform
    elsewhere = replace(here, start=here.start + 5e3)
    carried = [replace(sensor, platform=here) for sensor in true.sensors]
    apart = replace(one_ray, sensors=[replace(one_ray.sensors[0], platform=elsewhere)])
    with pytest.raises(ValueError, match="carried by the scenario's platform"):
        tma.find_ghosts(apart)
    named = replace(one_ray, sensors=[replace(one_ray.sensors[0], platform=one_ray.platform)])
    assert [f.case for f in tma.find_ghosts(named)] == [f.case for f in tma.find_ghosts(one_ray)]
    moved = replace(true, sensors=carried, platform=elsewhere)
    found, again = tma.near_ghosts(true, 50.0), tma.near_ghosts(moved, 50.0)
    assert len(found) > 0
    for one, two in zip(found, again, strict=True):
        assert abs(one.chi_square - two.chi_square) < 1e-3
