"""`conical-angles`, Theorem 1: the live view of the ghosts against depth and course of the target.

An array and a target of one speed, the target seven kilometres off, ahead to the right, and the direct path:
the steps of the sliders meet most cases of the theorem.
"""

from itertools import product

import numpy as np

from ...cones import DIRECT
from ...figures import colour
from ...ghosts import find_ghosts
from ...judging.live import Axis, Curve, Panel, Slider, fixed, frames, live
from . import theorem_scenes as scenes
from .scenarios import ARRAY_DEPTH, BOTTOM_DEPTH

DEPTHS = (0, 50, 100, 150, 180, 200, 220, 250, 300, 400, 600, 800)  # m
COURSES = tuple(range(0, 360, 30))  # degrees
START = (5000.0, 5000.0)  # m, across and ahead
BETAS = (0.5, 1.0, 1.5)
ASIDE = (-8e3, -5e3, -2e3, 2e3, 8e3)  # m
ENDS = np.array([0.0, 600.0])  # s, of the measurements
WORDS = {
    "depth": "Otherwise: at each depth but the array's a ghost on either side, the target among them. "
    "Those with β = 0.5, 1 and 1.5 are drawn.",
    "beta": "Otherwise, in the array's depth: there, for each β, a ghost on either side, the target among "
    "them. Those with β = 0.5, 1 and 1.5 are drawn.",
    "across, depth": "Parallel: ghosts at any distance across and any depth. Some are drawn.",
    "across, depth, range_end, range_start": "Constant cosine: ghosts at relative rest at any depth, and "
    "radial ones in the array's depth. Some are drawn.",
}


def target_on(depth, course):
    """The target at a depth (m) on a course (degrees), a scenario of `theorem_scenes.one_leg`."""
    turned = np.radians(course) - scenes.HEADING
    velocity = scenes.SPEED * np.array([np.sin(turned), np.cos(turned) - 1])
    return scenes.one_leg(START, velocity, float(depth), DIRECT)


def members(family, depth):
    """Some targets of a family of ghosts of a target at a depth."""
    free = set(family.parameters)
    if free == {"depth"}:
        offsets = np.outer([-1, 1], BETAS).ravel() * abs(depth - ARRAY_DEPTH)
        values = [{"depth": z} for z in ARRAY_DEPTH + offsets if 0 <= z <= BOTTOM_DEPTH]
    elif free == {"beta"}:
        values = [{"beta": beta} for beta in BETAS]
    elif free == {"across", "depth"}:
        values = [{"across": x, "depth": z} for x, z in product(ASIDE, (depth, 500.0))]
    elif free == {"range_start", "range_end"}:
        values = [{"range_start": near, "range_end": far} for near, far in ((2e3, 4e3), (9e3, 7e3))]
    else:
        raise ValueError(f"a family with the parameters {sorted(free)} is not drawn")
    return [family.target(**value) for value in values]


def drawn(depth, course):
    """The scenario, the ghosts that are drawn, and the sentence on the case."""
    scenario = target_on(depth, course)
    families = find_ghosts(scenario)
    free = ", ".join(sorted(set().union(*(family.parameters for family in families))))
    return scenario, [ghost for family in families for ghost in members(family, float(depth))], WORDS[free]


def ghosts_view(instead):
    """Show the view; returns what it is made of, by depth and course: scenario, ghosts, sentence."""
    made = {place: drawn(*place) for place in product(DEPTHS, COURSES)}
    sliders = [
        Slider("Depth", DEPTHS, "m", 0, DEPTHS.index(100)),
        Slider("Course", COURSES, "°", 0, COURSES.index(90)),
    ]
    of_frames = {
        function: frames(lambda *place, make=function: make(*made[place][:2]), sliders, (0, 1))
        for function in (_tracks, _starts, _at_depth, _own_track, _own_start, _own_depth)
    }
    green, red, array = colour("mle"), colour("target"), fixed([0], [0])
    plan = (
        Curve("array, which points up", "square", colour("platform"), array),
        Curve("ghosts", "line", green, of_frames[_tracks]),
        Curve("", "ring", green, of_frames[_starts]),
        Curve("target", "line", red, of_frames[_own_track]),
        Curve("at the start", "circle", red, of_frames[_own_start]),
    )
    section = (
        Curve("surface", "thin", None, fixed([-12, 12], [0, 0])),
        Curve("array", "square", colour("platform"), fixed([0], [ARRAY_DEPTH])),
        Curve("ghosts at the start", "ring", green, of_frames[_at_depth]),
        Curve("target at the start", "circle", red, of_frames[_own_depth]),
    )
    across = Axis("Across the array (km)", (-11, 11))
    live(
        "Ghosts of a target, one ray and one leg",
        sliders,
        [
            Panel("Map relative to the array: the target's track and those of ghosts.", across,
                  Axis("Ahead (km)", (-7, 11)), plan, equal=True),
            Panel("Section across the array: depths of the target and of the ghosts at the start.", across,
                  Axis("Depth (m)", (1200, -100)), section),
        ],
        frames(lambda *place: made[place][2], sliders, (0, 1)),
        instead,
        buttons=[
            ("In the array's depth", [ARRAY_DEPTH, 90]),
            ("Parallel", [100, 210]),
            ("Collision course", [ARRAY_DEPTH, 300]),
            ("At relative rest", [100, 30]),
        ],
        digits=3,
    )  # fmt: skip
    return made


def _relative(scenario, motions):
    """Start and end relative to the array in kilometres, ``(number, 2, 2)``: time, then across and ahead."""
    return np.array([scenes.relative(scenario, motion, ENDS) for motion in motions]).reshape(-1, 2, 2) / 1e3


def _tracks(scenario, ghosts):
    return _broken(_relative(scenario, ghosts))


def _broken(lines):
    """Lines one after the other, NaN between them."""
    gap = np.full((len(lines), 1, 2), np.nan)
    return tuple(np.concatenate([lines, gap], axis=1).reshape(-1, 2).T)


def _starts(scenario, ghosts):
    return tuple(_relative(scenario, ghosts)[:, 0].T)


def _at_depth(scenario, ghosts):
    return _starts(scenario, ghosts)[0], np.array([ghost.depth for ghost in ghosts])


def _own_track(scenario, _):
    return _tracks(scenario, [scenario.target])


def _own_start(scenario, _):
    return _starts(scenario, [scenario.target])


def _own_depth(scenario, _):
    return _at_depth(scenario, [scenario.target])
