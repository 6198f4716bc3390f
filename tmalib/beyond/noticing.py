"""Noticing: targets that leave their uniform motion before tests of residuals.

The *watch* is a ship that turns once in twenty minutes and takes bearings as in the study of recorded ships:
one in ten seconds, to half a degree. The state is wanted at the last bearing. Kinds of departure are scaled
to a *size* of one metre: the largest distance of the target from its own nearest uniform motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from .. import sensitivity
from ..batch import fit
from ..bearings import Bearing
from ..curved import TurningBearing
from ..departed import Departed
from ..departures import departure_effect
from ..montecarlo import Stream
from ..motion import Course, SampledCourse, Straight, Target
from ..papers.robustness import scenarios as paper
from ..residuals import residual_tests
from ..scenario import Scenario
from ..sensors import Sensor
from ..study.cases import AT_SEA

STREAM = Stream("beyond/noticing")
OWN_SPEED, OWN_TURN = 6.0, np.radians(90)
TARGET_START, TARGET_SPEED, TARGET_HEADING = (3000.0, 7500.0), 5.0, np.radians(270)
ZIGZAG = 200.0  # s, its period
SLIGHT = 1e-8  # rad/s: a turn so slight that its circle is a parabola
TESTS = ("size", "drift", "correlation", "largest")
KINDS = ("turn", "zigzag", "worst", "copy")
PAPER_KINDS = ("none", "circle", "periodic", "worst", "stealth")


@dataclass(frozen=True)
class ModelMotion:
    """The motion of a model of `tmalib.curved` with its state at a time."""

    model: object
    state: tuple
    time: float

    def position_at(self, t):
        """Position at the times ``t``, shape ``t.shape + (2,)``, in metres."""
        return np.moveaxis(self.model.motion(self.state, np.asarray(t) - self.time)[0], 0, -1)


def watch_from(own, target):
    """The `Scenario` of a watch."""
    sensor = Sensor(Bearing(), AT_SEA.times, AT_SEA.sigma, "bearings")
    return Scenario(own, [sensor], reference_time=AT_SEA.length, target=target)


def own_course(speed, headings):
    """Straight legs of equal length that fill a watch."""
    legs = [Straight(AT_SEA.length / len(headings), heading=heading) for heading in headings]
    return Course((0.0, 0.0), speed, 0.0, legs)


@cache
def watch():
    """The watch of the chapter, its target on a uniform motion."""
    own = own_course(OWN_SPEED, [0.0, OWN_TURN])
    return watch_from(own, Target(TARGET_START, TARGET_SPEED, TARGET_HEADING))


def turning(scenario, rate):
    """The target of a scenario turning at a rate (rad/s), its state at the reference time unchanged."""
    return ModelMotion(TurningBearing(), (*scenario.state, rate), scenario.reference_time)


def turn_of(scenario):
    """A slight turn of the target, of whatever size."""
    return turning(scenario, SLIGHT)


def displaced(scenario, displacement):
    """The target of a scenario, displaced at its measurements by ``(N, 2)``."""
    places = scenario.target.position_at(scenario.times) + displacement
    return SampledCourse(scenario.times, places)


def departures_of(scenario):
    """The kinds of departure, a dict of motions; their sizes are whatever they are.

    - "turn": a slight turn at a constant rate, its state at the reference time unchanged;
    - "zigzag": a cosine of time across the target's course;
    - "worst": the strongest mode of the last position (`sensitivity.worst_energy`), a metre at most;
    - "copy": what the own ship departs from its own nearest uniform motion.
    """
    times, end = scenario.times, scenario.reference_time
    vx, vy = scenario.state[2:] / np.hypot(*scenario.state[2:])
    final = sensitivity.position_criterion(scenario, end)
    own = scenario.platform.position_at(times)
    line = sensitivity.nearest_motion(times, own, end, "squares")
    copied = own - line[:2] - (times - end)[:, None] * line[2:]
    return {
        "turn": turn_of(scenario),
        "zigzag": displaced(scenario, np.cos(2 * np.pi * times / ZIGZAG)[:, None] * [vy, -vx]),
        "worst": displaced(scenario, sensitivity.worst_energy(scenario, 1.0, criterion=final)),
        "copy": displaced(scenario, copied),
    }


def a_metre_of(scenario, motion):
    """The motion of a departure with a size of one metre."""
    size = departure_effect(scenario, motion).size(1.0)
    return Departed(scenario.target, (motion,), (1 / float(size),))


@cache
def effect(kind):
    """`departure_effect` of a kind in the watch, amounts in metres."""
    return departure_effect(watch(), a_metre_of(watch(), departures_of(watch())[kind]))


def rate_of(size):
    """The rate (rad/s) of a turn in the watch with a size in metres."""
    return SLIGHT * size / float(departure_effect(watch(), turn_of(watch())).size(1.0))


def target_of(kind, size):
    """The target of the watch with a departure of a size; a turn is a circle, and no parabola."""
    if size == 0:
        return watch().target
    return turning(watch(), rate_of(size)) if kind == "turn" else effect(kind).target(size)


def p_values(found):
    """P-values of a fit, ``(runs,)`` each: of its criterion, and the other three of `residual_tests`."""
    tests = residual_tests(found)
    others = {name: getattr(tests, name).p_value[..., -1] for name in ("drift", "correlation", "largest")}
    return {"size": found.p_value} | others


def noticed(seed, runs, kind, size):
    """Task: fits of the watch with a departure; p-values, and errors of the last position ``(runs, 2)``."""
    target = target_of(kind, size)
    found = fit(watch(), watch().with_target(target).simulate(runs, seed))
    errors = found.state[:, :2] - target.position_at(AT_SEA.length)
    return p_values(found) | {"error": errors, "converged": found.converged}


def noise_free(kind, sizes):
    """What fits of the watch without noise say of a departure of some sizes, a dict of arrays.

    ``error`` of the last position in metres; ``size`` and ``drift``: the statistics of these two tests, which
    are their noncentralities with noise.
    """
    targets = [target_of(kind, size) for size in sizes]
    measured = np.stack([watch().with_target(target).measure() for target in targets])
    found = fit(watch(), measured, watch().state, tolerance=1e-6)
    ends = np.stack([target.position_at(AT_SEA.length) for target in targets])
    tests = residual_tests(found)
    return {
        "error": np.hypot(*(found.state[:, :2] - ends).T),
        "size": found.cost,
        "drift": tests.drift.statistic[:, -1],
    }


@cache
def paper_displacement(kind):
    """Departures as in `robustness`, from the uniform motion nearest to its circle, ``(N, 2)``."""
    geometry = paper.reference()
    straight = geometry.straight
    if kind == "none":
        return np.zeros((len(straight.times), 2))
    if kind == "circle":
        return geometry.circle_displacement
    if kind == "periodic":
        return paper.periodic_displacement(geometry)
    if kind == "worst":
        return geometry.worst_displacement
    final = sensitivity.position_criterion(straight, paper.DURATION)
    return sensitivity.worst_stealth(straight, paper.WORST, criterion=final)[0]


def noticed_of_paper(seed, runs, kind):
    """Task: as `noticed`, of the reference geometry and departures of `robustness`."""
    straight, displacement = paper.reference().straight, paper_displacement(kind)
    noise = np.random.default_rng(seed).standard_normal((runs, len(straight.times))) * straight.sigma
    measured = sensitivity.displaced_measurements(straight, displacement) + noise
    found = fit(straight, measured)
    final = sensitivity.position_criterion(straight, paper.DURATION)
    errors = (found.state - straight.state) @ final.T - displacement[-1]
    return p_values(found) | {"error": errors, "converged": found.converged}
