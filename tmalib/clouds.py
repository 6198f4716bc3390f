"""The first cloud of a particle filter: what is known of a state, as many equally likely states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .batch import first_bearing
from .checks import check_array, check_count, check_is, check_pair, check_scalar, check_seed, set_fields
from .priors import check_others, first_prediction
from .scenario import Scenario
from .types import Array, FloatArray, Seed
from .uniform import moving_pairs


@dataclass(frozen=True, eq=False)
class Cloud:
    """What is known of the state before filtering: equally likely states ``(N, n)`` at ``time``.

    Like a `Prior` it holds all that was measured up to and at its time. The components of a state are in the
    scenario's order.
    """

    states: Array
    time: float

    def __post_init__(self) -> None:
        set_fields(
            self,
            states=check_array("states", self.states, (None, None)),
            time=check_scalar("time", self.time),
        )
        if not len(self.states):
            raise ValueError("states is empty; a cloud needs at least one particle")


def cloud_along_first_bearing(
    scenario: Scenario,
    angles: ArrayLike,
    range: tuple[float, float],
    speed: float,
    particles: int,
    seed: Seed,
    others: Mapping[str, tuple[float, float]] | None = None,
) -> Cloud:
    """First `Cloud`: uniform in range along the first bearing, velocity uniform in a disc.

    Parameters
    ----------
    scenario : Scenario
    angles : array_like, shape (N,)
        Measurements of one run.
    range : pair of float
        Smallest and largest range in metres.
    speed : float
        Largest speed in m/s.
    particles : int
    seed : int, SeedSequence or Generator
    others : dict, optional
        Name of every further unknown to its mean and standard deviation, of a Gaussian. Where they change
        the first bearing, as a bias does, each particle's direction is corrected for its own.

    Returns
    -------
    Cloud
        At the time of the first measurement, which it uses up: bearings scatter about it by its sigma.

    Raises
    ------
    ValueError
        For more than one run, a first bearing of NaN, or `others` that are not the scenario's.

    Notes
    -----
    Source: `robustness`, Section IV, which gives neither the ranges nor the velocities.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(60)])
    >>> compass = tma.Biased(tma.Bearing(), "compass")
    >>> watch = tma.Scenario(ship, [tma.Sensor(compass, [0.0, 60.0], 0.01)], reference_time=60)
    >>> cloud = cloud_along_first_bearing(watch, [0.5, 0.6], (1e3, 9e3), 10, 500, 1, {"compass": (0, 0.02)})
    >>> cloud.states.shape
    (500, 5)
    """
    angles, others = one_run(scenario, angles), check_others(scenario, others)
    near, far = (check_scalar("range", value, above=0.0) for value in check_pair("range", range))
    if near >= far:
        raise ValueError(f"range must be a smaller and a larger distance, got {range}")
    speed = check_scalar("speed", speed, minimum=0.0)
    count = check_count("particles", particles)
    rng = check_seed(seed)
    first, platform = first_bearing(scenario)
    time, (places, speeds) = float(scenario.times[first]), moving_pairs(scenario.coordinates)
    if not np.isfinite(angles[first]):
        raise ValueError(f"measurements must have a first bearing, at {time} s, got {angles[first]}")
    theta = angles[first] + scenario.sigma[first] * rng.standard_normal(count)
    r, v, heading = rng.uniform(near, far, count), speed * np.sqrt(rng.random(count)), rng.random(count)
    heading *= 2 * np.pi
    states = np.empty((count, len(scenario.coordinates)))
    for name, (mean, sigma) in others.items():
        mean, sigma = check_scalar(name, mean), check_scalar(f"sigma of {name}", sigma, minimum=0.0)
        states[:, scenario.coordinates.index(name)] = mean + sigma * rng.standard_normal(count)
    (x, y), (i, j) = platform.position_at(time), places
    states[:, speeds[0]], states[:, speeds[1]] = v * np.sin(heading), v * np.cos(heading)
    states[:, i], states[:, j] = x + r * np.sin(theta), y + r * np.cos(theta)
    if others:
        theta = 2 * theta - first_prediction(scenario, first, states)[0]
        states[:, i], states[:, j] = x + r * np.sin(theta), y + r * np.cos(theta)
    return Cloud(states, time)


def one_run(scenario: Scenario, angles: ArrayLike) -> FloatArray:
    """Measurements of one run as an array ``(N,)``; `ValueError` for more than one."""
    angles = check_is("scenario", scenario, Scenario).check_measurements(angles)
    if angles.ndim != 1:
        raise ValueError(f"a particle filter takes one run, measurements of shape (N,), got {angles.shape}")
    return angles
