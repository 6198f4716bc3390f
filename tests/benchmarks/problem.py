"""What everybody solves: scenario 1 of `emw-acoustic`, bearings that arrive at once and late ones."""

from dataclasses import dataclass

import numpy as np

import tmalib as tma
from tmalib.papers.emw_acoustic import scenarios as emw

RANGE = 10e3  # m along the first bearing, the paper's start
PASSES = 6  # of Gauss and Newton from there: enough for a thousandth of a standard deviation


@dataclass(frozen=True)
class Problem:
    """Measurements of some runs, the paper's start and prior, and flat arrays for who knows no scenario.

    Attributes
    ----------
    scenario : Scenario
    angles, start : ndarray, shapes (runs, N) and (runs, 4)
    early : int
        How many of the N bearings arrive at once; they come first.
    x, y, lag, sigma, sound : ndarray, shape (N,)
        Platform's place, time since the reference time, standard deviation, speed of sound or zero.
    """

    scenario: tma.Scenario
    angles: np.ndarray
    start: np.ndarray
    early: int
    x: np.ndarray
    y: np.ndarray
    lag: np.ndarray
    sigma: np.ndarray
    sound: np.ndarray

    @property
    def prior(self):
        return tma.Prior(self.start, np.diag(emw.PRIOR_VARIANCE), 0.0)

    @property
    def groups(self):
        """Places of the bearings that a filter uses, an array for each time, in order."""
        times = self.scenario.times
        return [np.flatnonzero(times == time) for time in np.unique(times[times > 0])]


def problem(runs, seed=1, scenario=None):
    """A `Problem` with so many runs."""
    scenario = emw.scenario(1) if scenario is None else scenario
    light, late = scenario.blocks
    angles = scenario.simulate(runs, seed=seed)
    x, y = (np.concatenate([light.observer[i], late.observer[i]]) for i in range(2))
    lag = np.concatenate([light.elapsed, late.elapsed])
    sound = np.where(np.arange(len(lag)) < len(light.elapsed), 0.0, late.sensor.model.c)
    start = tma.along_first_bearing(scenario, angles, RANGE)
    return Problem(scenario, angles, start, len(light.elapsed), x, y, lag, scenario.sigma, sound)
