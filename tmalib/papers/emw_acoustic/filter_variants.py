"""`emw-acoustic`: two more readings of the filter, which give the printed EKF columns as well.

They show how much of the reading that the book uses is decided by the tables, and how much is not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...bearings import Bearing, delay_of, displacement
from ...recursive import ekf
from ...scenario import Sensor
from . import scenarios as emw

VARIANTS = ("lever", "sonar at t_1")


@dataclass(frozen=True)
class RadarWithLever(emw.RadarOfTheTables):
    """The instantaneous bearing; without a sonar bearing its gradient's velocity part belongs to ``s - tau``.

    Where a radar bearing comes alone, the gradient is ``[g, (s - tau) g]`` with the position part ``g`` of
    the *instantaneous* bearing and the delay ``tau``: of equation (7) the lever only.
    """

    def value_and_gradient(self, state, observer, elapsed):
        value, gradient = Bearing().value_and_gradient(state, observer[:2], elapsed)
        dx, dy = displacement(state, observer, elapsed)
        lever = elapsed - delay_of(dx, dy, state[2], state[3], self.c)
        alone = np.stack([*gradient[:2], *(lever * gradient[:2])])
        return value, np.where(observer[2] > 0, alone, gradient)


def filter_variant(seed, runs, number, variant):
    """Errors of the EKF, ``{"ekf": (runs, 4)}``, for one of two more readings.

    Parameters
    ----------
    seed : see `Scenario.simulate`
    runs : int
    number : int
        Scenario 1 to 6. The bearings are those of `experiments.both_estimators`.
    variant : {"lever", "sonar at t_1"}
        The gradient of `RadarWithLever`, and nothing processed at t_1; or the gradient of the tables, and of
        the two bearings at t_1 the sonar's processed: the radar's or periscope's made the starting point.

    Raises
    ------
    ValueError
        For another variant.
    """
    if variant not in VARIANTS:
        raise ValueError(f"variant must be one of {VARIANTS}, got {variant!r}")
    now = emw.scenario(number)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    assumed = emw.filter_scenario(now)
    optical, sonar = assumed.sensors
    again = variant == "sonar at t_1"
    model, first = (optical.model, 1) if again else (RadarWithLever(), 0)
    optical = Sensor(model, optical.times[first:], optical.sigma, optical.name)
    assumed = replace(assumed, sensors=[optical, sonar])
    track = ekf(assumed, angles[:, first:], emw.prior(start, first_again=again))
    return {"ekf": track.state[:, -1] - now.state}
