"""The one entry to the ghosts; the cases are tested in test_ghosts_one_leg and test_ghosts_two_legs."""

from dataclasses import replace

import numpy as np
import pytest

import tmalib as tma


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


def test_what_is_not_covered_is_refused():
    turning = scenario([tma.Straight(200), tma.Turn(200, 0.005), tma.Straight(200)])
    with pytest.raises(ValueError, match="leg"):
        tma.find_ghosts(turning)


def test_admissible():
    shallow, deep, flying = (tma.Target((1e3, 1e3), 1.0, 0.0, depth=z) for z in (100.0, 900.0, -5.0))
    assert tma.admissible(shallow, 4000.0)
    assert tma.admissible(deep, 4000.0)
    assert not tma.admissible(deep, 4000.0, deepest=400.0)
    assert not tma.admissible(flying, 4000.0)
