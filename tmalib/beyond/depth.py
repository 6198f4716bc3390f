"""`conical-angles`, beyond: what tells a depth. A third ray, equal depths, and a prior.

The scenario of Section 5.2, a motionless array and five minutes, with rays of one's choice, and a target that
passes close by, of which two rays tell the depth.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..batch import fit
from ..bounds import nees
from ..checks import check_seed
from ..cones import BOTTOM_BOUNCE, DIRECT, SURFACE_BOUNCE, ConicalAngle, RayPath
from ..ghosts import find_ghosts
from ..known import KnownComponent
from ..minima import distinct_minima
from ..montecarlo import Stream
from ..motion import Target
from ..papers.conical_angles import scenarios as paper
from ..scenario import Scenario, Sensor

STREAM = Stream("beyond/depth")
TWO = (DIRECT, BOTTOM_BOUNCE)
THIRD = {
    "surface": SURFACE_BOUNCE,
    "bottom-surface-bottom": RayPath(1, 2, 1),
    "surface-bottom": RayPath(-1, 1, 1),
}
BOTTOM = 2000.0  # m
DEEPEST = 400.0  # m: a target is anywhere from the surface to there
UNIFORM = (DEEPEST / 2, DEEPEST / np.sqrt(12))  # mean and standard deviation of such a depth
CLOSE_DEPTH = 300.0  # m: of the array that a target passes
LEVEL = -2 * np.log(0.1)  # of the 90 % ellipse


def far(*third, depth=paper.TARGET_DEPTH, assumed_depth=None):
    """The first scenario of Section 5.2 with further rays, given by their names in `THIRD`."""
    now = paper.section_5_2(BOTTOM, assumed_depth)
    return replace(_with_rays(now, third), target=paper.target(depth))


def close(*third, depth, sigma=paper.SIGMA):
    """A target that passes half a mile off at a depth, and an array at `CLOSE_DEPTH`."""
    now = paper.section_5_2(BOTTOM)
    passing = Target.from_velocity((500.0, 800.0), (-2.0, -3.0), depth=depth)
    return replace(_with_rays(now, third, CLOSE_DEPTH, sigma), target=passing)


def _with_rays(now, third, array_depth=None, sigma=None):
    """The two rays of a scenario and others like them; the array at another depth, another sigma."""
    first = now.sensors[0]
    model = first.model if array_depth is None else replace(first.model, array_depth=array_depth)
    sigma = first.sigma if sigma is None else sigma
    rays = {"direct": DIRECT, "bottom": BOTTOM_BOUNCE} | {name: THIRD[name] for name in third}
    sensors = [Sensor(replace(model, path=ray), first.times, sigma, name) for name, ray in rays.items()]
    return Scenario(now.platform, sensors, now.reference_time)


def with_depth_known(scenario, sigma):
    """The scenario with a prior on the depth, as one more measurement: its mean is the last column."""
    prior = Sensor(KnownComponent("z"), scenario.times[:1], sigma, "prior")
    return replace(scenario, sensors=[*scenario.sensors, prior])


def depth_sigma_at_once(scenario):
    """Bound on the depth from the rays of each instant alone, without any motion, ``(N,)`` in metres."""
    gradient = scenario.linearise(scenario.state)[1] / scenario.sigma[:, None]
    rays = len(scenario.sensors)
    at_once = gradient.reshape(rays, -1, 5).swapaxes(0, 1)[..., :3]
    information = at_once.mT @ at_once
    return np.sqrt(np.linalg.inv(information)[:, 2, 2])


def null_direction(scenario):
    """Where two rays tell nothing at equal depths: a change of the state ``(5,)`` with one metre of depth."""
    image = 2 * BOTTOM - CLOSE_DEPTH - scenario.target.depth
    return np.array([-1, -1, 0, -1, -1]) * scenario.state / image + [0, 0, 1, 0, 0]


def squared_depth_sigma(scenario):
    """Standard deviation, in m^2, of the squared depth difference between target and array, at zero.

    Along the null direction the measurements change with its square only. This is the least-squares error of
    that square beside the rest of the state, to the lowest order.
    """
    step, state = null_direction(scenario), scenario.state
    plus, minus, here = (scenario.linearise(state + k * step)[0] for k in (1.0, -1.0, 0.0))
    bend = (plus + minus - 2 * here) / 2 / scenario.sigma
    jacobian = scenario.linearise(state)[1] / scenario.sigma[:, None]
    rest = jacobian[:, [0, 1, 3, 4]]
    bend -= rest @ np.linalg.lstsq(rest, bend, rcond=None)[0]
    return 1 / np.linalg.norm(bend)


# -- tasks --------------------------------------------------------------------------------------------


def errors(seed, runs, third):
    """Estimates from three rays in the far scenario, started at the truth.

    Returns ``error (runs, 5)``, ``square (runs,)``, the NEES, ``converged`` and ``in_water``.
    """
    now = far(third)
    found = fit(now, now.simulate(runs, seed), now.state)
    square = nees(found.state, now.state, found.covariance)
    depth = found.state[:, 2]
    return {
        "error": found.state - now.state,
        "square": np.where(found.converged, square, np.inf),
        "converged": found.converged,
        "in_water": (depth >= 0) & (depth <= BOTTOM),
    }


def depth_errors(seed, runs, depth, sigma):
    """Errors of the depth of the close target from two rays, ``error (runs,)``, in metres.

    A target is known to be no less deep than the array: of the two minima that are mirror images of
    each other in its depth, nearly, the deeper one is the estimate. The search starts at the truth, or below
    the array by what the squared depth tells, if that is deeper.
    """
    now = close(depth=depth, sigma=sigma)
    start = np.array(now.state)
    unsure = squared_depth_sigma(close(depth=CLOSE_DEPTH, sigma=sigma)) ** 0.5
    start[2] = max(depth, CLOSE_DEPTH + unsure)
    found = fit(now, now.simulate(runs, seed), start)
    return {"error": CLOSE_DEPTH + np.abs(found.state[:, 2] - CLOSE_DEPTH) - depth}


def unknown_depth(seed, runs, third=(), assumed=None, prior=False):
    """Whether the 90 % ellipse holds a far target whose depth is anywhere down to `DEEPEST`.

    Parameters
    ----------
    third : sequence of str
        Rays beside the two.
    assumed : float, optional
        Depth that the estimator assumes; the state then is without one.
    prior : bool
        Whether the estimator knows mean and standard deviation of such a depth.

    Returns
    -------
    dict
        ``held (runs,)``; ``area`` of the ellipse in square metres, NaN for a fit that has not converged,
        which holds nothing; ``error (runs, 2)`` of the position.
    """
    rng, now = check_seed(seed), far(*third)
    truth = np.tile(now.state, (runs, 1))
    truth[:, 2] = rng.uniform(0, DEEPEST, runs)
    measured = now.linearise(truth)[0] + now.sigma * rng.standard_normal((runs, len(now.times)))
    start = truth
    if assumed is not None:
        now, start = far(*third, assumed_depth=assumed), truth[:, [0, 1, 3, 4]]
    if prior:
        now = with_depth_known(now, UNIFORM[1])
        measured = np.column_stack([measured, np.full(runs, UNIFORM[0])])
    found = fit(now, measured, start)
    covariance = found.covariance[:, :2, :2]
    square = nees(found.state[:, :2], truth[:, :2], covariance)
    (a, b), (_, d) = np.moveaxis(covariance, 0, -1)
    return {
        "held": found.converged & (square <= LEVEL),
        "area": np.pi * LEVEL * np.sqrt(a * d - b * b),
        "error": found.state[:, :2] - truth[:, :2],
    }


def minima_at_ghosts(found):
    """All minima near an estimate and the exact ghosts that Theorem 3 gives it with two rays.

    Returns states ``(M, 5)``, lowest first, and their likelihoods relative to the lowest, ``(M,)``.
    """
    x, y, z, *velocity = found.state
    estimated = Target.from_velocity((x, y), velocity, depth=z)
    rays = [sensor for sensor in found.scenario.sensors if isinstance(sensor.model, ConicalAngle)][:2]
    two = replace(found.scenario, sensors=rays, target=estimated)
    ghosts = [ghost.target().state(two.reference_time, two.coordinates) for ghost in find_ghosts(two)]
    states, costs, _ = distinct_minima(found.scenario, found.measured, np.array([found.state, *ghosts]))
    return states, np.exp((costs[0] - costs) / 2)
