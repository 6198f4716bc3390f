"""`emw-acoustic`: errors along the long axis of the bound's ellipse, where nearly all of the error lies.

The ellipses of Figures 2-7 are needles that point along the line of sight: bearings fix the direction and
leave the range open.
"""

from __future__ import annotations

import numpy as np

from . import experiments
from . import scenarios as emw


def sigma(shape):
    """Standard deviation in metres along the long axis of a confidence `Ellipse`."""
    return shape.semi_axes[0] / np.sqrt(-2 * np.log(1 - shape.probability))


def errors(number, positions):
    """Errors along the long axis in units of the bound's `sigma` there; positive is away from the observer.

    Parameters
    ----------
    number : int
        Scenario 1 to 6.
    positions : dict
        Estimated positions at the three instants of the scenario's figure, ``(runs, 3, 2)`` in metres, by
        estimator, as `experiments.positions_at_instants` gives them.

    Returns
    -------
    dict
        ``(runs, 3)`` by estimator.
    """
    platform, found = emw.scenario(number).platform, {name: [] for name in positions}
    for k, (shape, time) in enumerate(zip(experiments.ellipses(number), emw.instants(number), strict=True)):
        axis = np.array([np.sin(shape.heading), np.cos(shape.heading)])
        axis *= np.sign(axis @ (shape.centre - platform.position_at(time)))
        for name, estimates in positions.items():
            found[name].append((estimates[:, k] - shape.centre) @ axis / sigma(shape))
    return {name: np.stack(columns, axis=1) for name, columns in found.items()}
