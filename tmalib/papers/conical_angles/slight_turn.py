"""`conical-angles`, beyond the paper: an array that turns by a degree, where nothing is exactly special.

Two rays, as in Section 5.2, and a target near enough for its depth to be estimated. Without the turn its
mirror image is an exact ghost (Theorem 3); with it the mirror image is a near ghost.
"""

from __future__ import annotations

import numpy as np

from ...batch import fit
from ...cones import BOTTOM_BOUNCE, DIRECT, ConicalAngle
from ...minima import alternatives
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
    """Fits without a start, and the probability that each has by its own alternatives.

    Before the measurements all minima count as equally likely. Alternatives below one in ninety are not
    listed.

    Returns
    -------
    dict
        ``right``, whether the estimate is on the target's side; ``probability`` stated for the estimate,
        ``1 / (1 + sum of likelihoods)``; ``alternatives``, how many; ``converged``; each ``(runs,)``.
    """
    scenario = scene(turn, DEPTH)
    found = {"right": [], "probability": [], "alternatives": [], "converged": []}
    for angles in scenario.simulate(runs, seed):
        estimate = fit(scenario, angles)
        others = alternatives(estimate)
        found["right"].append(estimate.state[0] > 0)
        found["probability"].append(1 / (1 + sum(other.likelihood for other in others)))
        found["alternatives"].append(len(others))
        found["converged"].append(estimate.converged)
    return {name: np.array(values) for name, values in found.items()}
