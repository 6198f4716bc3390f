"""A constant bias of the sonar, the open question of `emw-acoustic`: scenarios, task, drawings."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import norm

from .. import figures
from ..batch import fit
from ..bearings import Bearing
from ..biased import Biased
from ..bounds import crlb, nees
from ..montecarlo import Stream
from ..motion import Course, Straight, Target, unit
from ..nuisance import nuisance
from ..papers.emw_acoustic import geometries
from ..papers.emw_acoustic import scenarios as emw
from ..scenario import Scenario
from ..sensors import Sensor

STREAM = Stream("beyond/acoustic_bias")
NUMBERS = tuple(range(1, 7))
LOOKS = {
    1: ("platform", "-", "o"),
    2: ("light", "--", "s"),
    3: ("target", "-.", "^"),
    4: ("ellipse", ":", "v"),
    5: ("sound", (0, (5, 1)), "D"),
    6: ("printed", (0, (3, 1, 1, 1)), "P"),
}  # of the scenarios: colour, dash, mark


def with_bias(scenario, true_bias=0.0):
    """The scenario with the bias of the sonar, in radians, as a fifth unknown."""
    *others, sonar = scenario.sensors
    model = Biased(sonar.model, "bias", true_bias)
    return replace(scenario, sensors=[*others, replace(sonar, model=model)])


def at_rest(scenario):
    """The scenario with an observer that stays where it is at the start."""
    here = scenario.platform.position_at(0.0)
    return replace(scenario, platform=Course(here, 0.0, 0.0, [Straight(np.inf)]))


def sonar_alone(scenario):
    """The scenario without its electromagnetic bearings."""
    return replace(scenario, sensors=scenario.sensors[-1:])


def heard_at(scenario, times):
    """The scenario with sonar bearings at other times."""
    *others, sonar = scenario.sensors
    heard = Sensor(sonar.model, np.asarray(times, dtype=float), sonar.sigma, sonar.name)
    return replace(scenario, sensors=[*others, heard])


def passing_scene(rng, moving):
    """A random target that passes, and when two of its sounds tell no bias.

    The target is 5 to 20 km away when it is nearest, 300 s after the start; speeds are 1 to 15 m/s, and the
    observer is in straight motion or at rest. Both sensors listen for ten minutes.

    Returns
    -------
    Scenario
    float
        The time ``t`` for which sounds at ``t - s`` and ``t + s`` have the same ``Q``, in seconds.
    """
    velocity, observer = (rng.uniform(1, 15) * unit(rng.uniform(0, 2 * np.pi)) for _ in range(2))
    observer = observer * moving
    w = velocity - observer
    nearest = rng.choice([-1, 1]) * rng.uniform(5e3, 20e3) * np.array([w[1], -w[0]]) / np.hypot(*w)
    scenario = geometries.scene(nearest - 300 * w, velocity, observer)
    # Q = c^2 |d|^2 - (V x d)^2 with d = nearest + s w
    turned = cross(velocity, w)
    vertex = cross(velocity, nearest) * turned / (emw.SOUND_SPEED**2 * (w @ w) - turned**2)
    return scenario, 300 + vertex


def on_a_u(listening, model, place, velocity):
    """A biased sonar on three sides of a U: 10 minutes east, 20 north, 10 west at 5 m/s.

    Parameters
    ----------
    listening : ndarray
        Times of its bearings, in seconds from the start.
    model : measurement model
        Of the bearings without the bias.
    place, velocity : complex
        Of the target half way, east + i north, in metres and m/s.
    """
    legs = [Straight(600), Straight(1200, heading=0.0), Straight(600, heading=-np.pi / 2)]
    course = Course((-6000, 0), 5.0, np.pi / 2, legs)
    start = place - 1200 * velocity
    target = Target.from_velocity((start.real, start.imag), (velocity.real, velocity.imag))
    ear = Sensor(Biased(model), listening, np.radians(1))
    return Scenario(course, [ear], 1200, target)


def tries(scenario, vertex):
    """Names and scenarios with a bias: both kinds, two sounds only, the sonar alone."""
    both = with_bias(scenario)
    alone = sonar_alone(both)
    (sonar,) = alone.sensors
    at_once = replace(sonar, model=Biased(Bearing()))
    return [
        ("light and sound", both),
        ("two sounds, equal Q", heard_at(both, [vertex - 99, vertex + 99])),
        ("two other sounds", heard_at(both, [vertex - 99, vertex + 150])),
        ("sound alone", alone),
        ("sound alone, no delay", replace(alone, sensors=[at_once])),
    ]


def cross(a, b):
    """Of two plane vectors, a number."""
    return a[0] * b[1] - a[1] * b[0]


def price_of(scenario):
    """`Nuisance` of the bias of a scenario without one."""
    return nuisance(with_bias(scenario), "bias")


def estimated_and_ignored(seed, runs, number, bias):
    """One chunk of bearings with a bias, fitted with the bias as an unknown and without.

    Parameters
    ----------
    seed : see `Scenario.simulate`
    runs : int
    number : int
        Scenario 1 to 6, the observer's path as computed.
    bias : float
        True bias in radians.

    Returns
    -------
    dict
        ``estimated``: errors of the five unknowns ``(runs, 5)``, from the paper's start and no bias; ``nees``
        of these against the bound, and how far the fit without a start is ``apart`` from them, in standard
        deviations of the bound, ``(runs,)``; ``ignored``: errors of the state ``(runs, 4)``, and
        ``p_value`` of that fit; ``converged``, ``(runs, 3)``: with a start, without, ignored.
    """
    plain = emw.scenario(number)
    now = with_bias(plain, bias)
    angles = now.simulate(runs, seed)
    start = emw.start(plain, angles, number)
    bound = crlb(now)
    first = fit(now, angles, np.concatenate([start, np.zeros((runs, 1))], axis=1))
    alone = fit(now, angles)
    ignored = fit(plain, angles, start)
    apart = np.abs(alone.state - first.state) / np.sqrt(np.diag(bound))
    return {
        "estimated": first.state - now.state,
        "nees": nees(first.state, now.state, bound),
        "apart": apart.max(axis=1),
        "ignored": ignored.state - plain.state,
        "p_value": ignored.p_value,
        "converged": np.stack([first.converged, alone.converged, ignored.converged], axis=1),
    }


def task(number, bias):
    """`estimated_and_ignored` of a scenario and a bias, to be run."""
    return partial(estimated_and_ignored, number=number, bias=float(bias))


def along_hardest(found, errors):
    """Errors ``(runs, 4)`` along the direction that an ignored bias hits hardest, over the bound there."""
    direction = np.linalg.solve(found.known, found.shift) / found.displaced
    return errors[..., :4] @ direction


def told_by_estimate(multiple, false_alarms=0.01):
    """Chance that an estimated bias is significant when the true one is a multiple of its bound."""
    limit = norm.isf(false_alarms / 2)
    return norm.sf(limit - multiple) + norm.cdf(-limit - multiple)


# -- drawings -----------------------------------------------------------------------------------------


def draw_twins(times, tracks, shifts, bias, heard):
    """Two targets and the bias that makes them one, for two bearings of sound.

    Parameters
    ----------
    times : ndarray
        ``(N,)``, seconds from the closest approach.
    tracks : sequence of ndarray
        Positions of the two targets at the times, ``(N, 2)``, metres.
    shifts : sequence of ndarray
        Delayed minus instantaneous bearing of each, ``(N,)``, radians.
    bias : float
        That of the second, radians.
    heard : ndarray
        ``(2,)``: times of the two bearings of sound.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.4, 3.4), width_ratios=[1.1, 1])
    looks = (("target", "-", "target, no bias"), ("sound", "--", "twice as far and as fast, biased"))
    for track, shift, added, (entity, dash, label) in zip(tracks, shifts, (0.0, bias), looks, strict=True):
        figures.path(left, track, entity, label=label, linestyle=dash)
        at = [np.interp(heard, times, part) / 1e3 for part in track.T]
        left.plot(*at, "o", color=figures.colour(entity), markersize=6)
        right.plot(times, np.degrees(shift + added), dash, color=figures.colour(entity), label=label)
    far = [np.interp(heard, times, part) / 1e3 for part in tracks[1].T]
    for x, y in zip(*far, strict=True):
        left.plot([0, x], [0, y], ":", color="#5F5F5F", linewidth=1)
    left.plot(0, 0, "s", color=figures.colour("platform"))
    left.annotate("observer", (0, 0), xytext=(7, -3), textcoords="offset points", fontsize=9)
    figures.map_axes(left, step=8)
    left.set(xlim=(-19, 19), ylim=(-10, 17), adjustable="box")
    left.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 1.25))
    for time in heard:
        right.axvline(time, color="#5F5F5F", linestyle=":", linewidth=1)
        value = np.degrees(np.interp(time, times, shifts[0]))
        right.plot(time, value, "o", color="black", markersize=6, zorder=3)
    right.set(xlabel="Time from the closest approach (s)", ylabel="Sound minus light (degrees)")
    return figure


def draw_ignored(found, runs, sizes):
    """What a bias does and who notices it, against its size over its own bound.

    Parameters
    ----------
    found : dict
        `Nuisance` by scenario.
    runs : dict
        By scenario, one of `estimated_and_ignored` a size.
    sizes : sequence of float
        Multiples of the bound on the bias.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.9))
    grid = np.geomspace(0.1, 100, 200)
    for number, one in found.items():
        entity, dash, mark = LOOKS[number]
        look = {"color": figures.colour(entity)}
        left.plot(grid, np.hypot(1, grid * one.sigma * one.displaced), linestyle=dash, **look)
        right.plot(grid, 100 * one.noticed(grid * one.sigma), linestyle=dash, **look)
        rms = [np.sqrt(np.mean(along_hardest(one, run["ignored"]) ** 2)) for run in runs[number]]
        kept = [np.sqrt(np.mean(along_hardest(one, run["estimated"]) ** 2)) for run in runs[number]]
        share = [100 * np.mean(run["p_value"] < 0.01) for run in runs[number]]
        left.plot(sizes, rms, mark, markersize=4, **look)
        left.plot(sizes, kept, mark, markersize=4, markerfacecolor="white", **look)
        right.plot(sizes, share, mark, markersize=4, **look)
        left.plot([], [], linestyle=dash, marker=mark, markersize=4, label=f"{number}", **look)
    low, high = (extreme(one.price for one in found.values()) for extreme in (min, max))
    left.axhspan(low, high, color="#BFBFBF", zorder=0)
    left.axvline(1, color="black", linewidth=1)
    right.plot(grid, 100 * told_by_estimate(grid), color="black", linewidth=2)
    right.annotate(
        "the estimated\nbias itself", (2.4, 62), xytext=(-6, 0), textcoords="offset points", ha="right"
    )
    right.annotate("chi-square", (13, 30), xytext=(6, -6), textcoords="offset points")
    left.annotate("bias estimated", (0.11, high), xytext=(0, 4), textcoords="offset points")
    left.annotate("bias ignored", (10, 7), xytext=(-6, 4), textcoords="offset points", ha="right")
    left.set(yscale="log", ylabel="Error in the direction hit hardest\n(over the bound of a known bias)")
    right.set(ylabel="Noticed, with 1 % false alarms (%)", ylim=(-3, 103))
    for ax in (left, right):
        ax.set(xscale="log", xlim=(0.1, 100), xlabel="Bias over its own bound")
        ax.set_xticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    left.set_yticks([1, 2, 5, 10, 20, 50], ["1", "2", "5", "10", "20", "50"])
    left.yaxis.set_minor_locator(plt.NullLocator())
    left.legend(fontsize=8, title="scenario", title_fontsize=8, loc="upper left")
    return figure
