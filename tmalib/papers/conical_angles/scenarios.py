"""`conical-angles`: the scenarios of Sections 3.2, 4.2 and 5.2, as printed and as computed.

The target is the same in all three. What reproduces the printed bounds differs from the text in details,
which were inferred from the tables: one sample more than the duration over the period; the target's
velocity exactly 4 m/s to the north-east and not twice 2.83 m/s; the bound taken at the target's true
depth and not at the assumed one; in Section 4.2 an end at 800 s (the text's legs add up to 804 s) and a
heading half a sample old, with a turn of 405 s, as 135 degrees need, though 404 s would do as well; in
Section 5.2.1 the depths of array and target exchanged for the bounds with the depth in the state.
"""

from __future__ import annotations

import numpy as np

from ...cones import BOTTOM_BOUNCE, DIRECT, ConicalAngle
from ...motion import Course, Straight, Target, Turn
from ...scenario import Scenario, Sensor

PERIOD = 4.0  # s
SIGMA = 1.7e-2
ARRAY_DEPTH, TARGET_DEPTH, BOTTOM_DEPTH = 200.0, 100.0, 4000.0  # m


def target(depth=TARGET_DEPTH):
    """The target of all scenarios: from (5000, 7000) m, 4 m/s, heading 45 degrees."""
    return Target((5000.0, 7000.0), speed=4.0, heading=np.radians(45), depth=depth)


def _times(duration):
    return PERIOD * np.arange(int(duration / PERIOD) + 1)


def section_3_2(sigma=SIGMA, assumed_depth=TARGET_DEPTH):
    """One bottom-bounced ray and a straight course, 20 minutes (Tables 1 and 2).

    Parameters
    ----------
    sigma : float
        1.7e-2 in Table 1, 1.7e-4 in Table 2.
    assumed_depth : float
        In metres. The printed bounds are those at the true depth, the default; the printed estimator
        assumes 200 m.
    """
    platform = Course((0, 0), speed=5.0, heading=0.0, legs=[Straight(1200.0)])
    model = ConicalAngle(BOTTOM_BOUNCE, ARRAY_DEPTH, BOTTOM_DEPTH, assumed_depth)
    return Scenario(
        platform, [Sensor(model, _times(1200), sigma, "bottom bounce")], reference_time=0.0, target=target()
    )


def turning_array(turn=405.0, duration=800.0, lag=PERIOD / 2, assumed_depth=None, conventional=False):
    """The scenario of Section 4.2 with a chosen turn, duration and heading lag, in seconds.

    Parameters
    ----------
    turn, duration : float
        Length of the turn, and time of the last measurement. The second leg heads 270 degrees.
    lag : float
        Age of the heading that the measurement uses.
    assumed_depth : float, optional
        Depth that the estimator assumes for the target, in metres; `None` keeps it in the state.
    conventional : bool
        No elevation, ``cos(phi) = 1``, whatever the depth.
    """
    legs = [
        Straight(100.0),
        Turn(turn, np.radians(20) / 60),
        Straight(duration - 100.0 - turn, heading=np.radians(270)),
    ]
    platform = Course((0, 0), speed=5.0, heading=np.radians(135), legs=legs)
    ray, depth = (DIRECT, ARRAY_DEPTH) if conventional else (BOTTOM_BOUNCE, assumed_depth)
    model = ConicalAngle(ray, ARRAY_DEPTH, BOTTOM_DEPTH, depth, heading_lag=lag)
    return Scenario(
        platform,
        [Sensor(model, _times(duration), SIGMA, "bottom bounce")],
        reference_time=0.0,
        target=target(),
    )


def section_4_2(assumed_depth=None, path="computed", conventional=False):
    """One bottom-bounced ray and a turning array, 800 s (Tables 3 and 4, and the conventional estimator).

    Parameters
    ----------
    assumed_depth : float, optional
        In metres; `None` keeps the depth in the state (Table 3). Table 4's bound is that at the true
        depth, its estimator assumes 200 m.
    path : {"computed", "printed"}
        As computed: a turn of 405 s and a heading 2 s old. As printed: a turn of 404 s and no lag. The
        second leg lasts until 800 s.
    conventional : bool
        What the estimator of Section 4.2.3 assumes: no elevation, ``cos(phi) = 1``. Simulate another
        scenario, and fit this one.
    """
    if path not in ("computed", "printed"):
        raise ValueError(f"path must be 'computed' or 'printed', got {path!r}")
    course = {} if path == "computed" else {"turn": 404.0, "lag": 0.0}
    return turning_array(**course, assumed_depth=assumed_depth, conventional=conventional)


def section_5_2(bottom_depth, assumed_depth=None, exchanged=False):
    """Direct and bottom-bounced ray at a motionless array, 5 minutes (Tables 5 and 6, Section 5.2.1).

    Parameters
    ----------
    bottom_depth : float
        2000 m in the first scenario, 4000 m in the second.
    assumed_depth : float, optional
        In metres; `None` keeps the depth in the state. The printed bounds of the reduced state are those
        at the true depth, the printed estimator assumes 300 m.
    exchanged : bool
        Exchange the depths of array and target, as the five-state bounds of Section 5.2.1 need.
    """
    array, depth = (TARGET_DEPTH, ARRAY_DEPTH) if exchanged else (ARRAY_DEPTH, TARGET_DEPTH)
    platform = Course((0, 0), speed=0.0, heading=0.0, legs=[Straight(300.0)])
    sensors = [
        Sensor(ConicalAngle(ray, array, bottom_depth, assumed_depth), _times(300), SIGMA, name)
        for ray, name in ((DIRECT, "direct"), (BOTTOM_BOUNCE, "bottom bounce"))
    ]
    return Scenario(platform, sensors, reference_time=0.0, target=target(depth))


def close_target():
    """Not in the paper: two rays at a motionless array as in Section 5.2, and a target whose depth they tell.

    It passes close by, 300 m deep, with the array at 20 m and the bottom at 2000 m.
    """
    platform = Course((0, 0), speed=0.0, heading=0.0, legs=[Straight(300.0)])
    sensors = [
        Sensor(ConicalAngle(ray, 20.0, 2000.0), _times(300), SIGMA, name)
        for ray, name in ((DIRECT, "direct"), (BOTTOM_BOUNCE, "bottom bounce"))
    ]
    passing = Target.from_velocity((500.0, 800.0), (-2.0, -3.0), depth=300.0)
    return Scenario(platform, sensors, reference_time=0.0, target=passing)
