"""`conical-angles`, beyond the paper: an array that turns by a degree, where nothing is exactly special.

Two rays, as in Section 5.2, and a target near enough for its depth to be estimated. Without the turn its
mirror image is an exact ghost (Theorem 3); with it the mirror image is a near ghost.
"""

from __future__ import annotations

import numpy as np

from ...batch import fit
from ...cones import BOTTOM_BOUNCE, DIRECT, ConicalAngle
from ...motion import Course, Straight, Target
from ...scenario import Scenario, Sensor

DEPTH = 300.0  # of the target, in metres
MIRROR = np.array([-1.0, 1.0, -1.0, 1.0])


def scene(turn, assumed_depth=None):
    """The scenario with a turn of so many degrees after five of ten minutes.

    ``assumed_depth`` in metres; `None` keeps the depth in the state.
    """
    legs = [Straight(300.0), Straight(300.0, heading=np.radians(turn))]
    platform = Course((0, 0), speed=3.0, heading=0.0, legs=legs)
    sensors = [
        Sensor(ConicalAngle(ray, 20.0, 2000.0, assumed_depth), np.arange(0, 601, 20), 0.012, name)
        for ray, name in ((DIRECT, "direct"), (BOTTOM_BOUNCE, "bottom bounce"))
    ]
    target = Target.from_velocity((1500.0, 2500.0), (-2.0, -3.0), depth=DEPTH)
    return Scenario(platform, sensors, reference_time=0.0, target=target)


def mirror_ghost(turn):
    """The minimum near the mirror image with the right depth assumed: a `Fit` without noise."""
    scenario = scene(turn, DEPTH)
    return fit(scenario, scenario.measure(), MIRROR * scenario.state)


def odds(seed, runs, turn):
    """Estimates, and the probability that each has beside the other minimum.

    Every run is fitted from the target and from its mirror image; the lower minimum is the estimate. Before
    the measurements both count as equally likely.

    Returns
    -------
    dict
        ``right``, whether the estimate is on the target's side; ``probability`` of the estimate,
        ``1 / (1 + likelihood of the other)``; ``converged``, both; each ``(runs,)``.
    """
    scenario = scene(turn, DEPTH)
    angles = scenario.simulate(runs, seed)
    here, there = (fit(scenario, angles, start) for start in (scenario.state, MIRROR * scenario.state))
    return {
        "right": here.cost < there.cost,
        "probability": 1 / (1 + np.exp(-np.abs(there.cost - here.cost) / 2)),
        "converged": here.converged & there.converged,
    }
