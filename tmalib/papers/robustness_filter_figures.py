"""`robustness`, Figures 5 to 8: drawing what `robustness_filters.filtered` returns."""

from __future__ import annotations

import numpy as np

from .. import figures
from ..bearings import bearing, wrap
from . import robustness as paper
from .robustness_filters import density

WINDOW = (-10.0, 15.0), (-6.0, 8.0)  # km, the axes of the paper's Figure 1
NAMES = ("$x$ (km)", "$y$ (km)", r"$\dot x$ (m/s)", r"$\dot y$ (m/s)")
BLS = "BLS estimate"


def courses(ax, found, *, kalman=False, particles=False):
    """Map of target, platform and BLS track, ends circled; the Kalman filter's track, or the last cloud."""
    times = found.scenario.times
    if particles:
        figures.cloud(
            ax, found.cloud[:: len(found.cloud) // 5000, :2], "null", "particles at the end", size=3
        )
    tracks = {
        "target": (found.scenario.target.position(times), "target"),
        "platform": (found.scenario.platform.position(times), "platform"),
        "mle": (found.bls_at(times)[:, :2], BLS),
    }
    for entity, (positions, label) in tracks.items():
        figures.path(ax, positions, entity, label)
        ax.plot(*positions[-1] / 1e3, "o", color=figures.colour(entity), markersize=8, fillstyle="none")
    if kalman:
        figures.path(ax, found.kalman.state[:, :2], "ekf", "Kalman filter", linewidth=1.0)
        ax.plot(*found.kalman.state[-1, :2] / 1e3, "x", color=figures.colour("ekf"), markersize=8)
    figures.map_axes(ax, step=5)
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlim(WINDOW[0])
    ax.set_ylim(WINDOW[1])


def settling(ax, found):
    """Distance of the Kalman filter from the BLS track and from the target, against time."""
    times, track = found.kalman.times, found.kalman.state[:, :2]
    others = {
        "target": (found.scenario.target.position(times), "from the target", "-"),
        "mle": (found.bls_at(times)[:, :2], "from the BLS track", "-"),
    }
    for entity, (positions, label, style) in others.items():
        ax.semilogy(
            times, np.hypot(*(track - positions).T) / 1e3, style, color=figures.colour(entity), label=label
        )
    ax.set_xlabel("Time (s)")
    ax.set_ylabel("Kalman filter's distance (km)")
    ax.legend(loc="lower left")


def seen(ax, found):
    """Bearings of the BLS track and of the noisy measurements, less the target's, in standard deviations."""
    scenario, times = found.scenario, found.scenario.times
    track = bearing(found.bls_at(times)[:, :2] - scenario.platform.position(times))
    for value, entity, style, label in (
        (found.measured, "null", ".", "measured"),
        (track, "mle", "-", BLS),
    ):
        off = wrap(value - scenario.measure()) / scenario.sigma
        ax.plot(times, off, style, color=figures.colour(entity), markersize=3, label=label)
    ax.set_xlabel("Time (s)")
    ax.set_ylabel(r"Bearing less the target's ($\sigma$)")
    ax.legend(loc="upper right", ncols=2)
    ax.set_ylim(-4, 5)


def marginals(axes, found):
    """Marginal densities of the last cloud, one axis a coordinate, with the BLS estimate and the truth."""
    scale = np.array([1e3, 1e3, 1, 1])
    cloud, estimate = found.cloud / scale, found.bls_at(paper.DURATION) / scale
    truth = true_state(found) / scale
    for i, ax in enumerate(axes):
        low, high = np.quantile(cloud[:, i], [0.001, 0.999])
        low, high = min(low, truth[i], estimate[i]), max(high, truth[i], estimate[i])
        places = np.linspace(low - 0.1 * (high - low), high + 0.1 * (high - low), 201)
        ax.fill_between(places, density(cloud[:, i], places), color=figures.colour("null"), alpha=0.5, lw=0)
        ax.axvline(estimate[i], color=figures.colour("mle"), label=BLS)
        ax.axvline(truth[i], color=figures.colour("target"), linestyle="--", label="target")
        ax.set_xlabel(NAMES[i])
        ax.set_yticks([])
        ax.set_ylim(bottom=0)


def true_state(found):
    """State of the target at the end, ``(4,)``; the velocity over the last interval."""
    before, end = found.scenario.target.position(found.scenario.times[-2:])
    return np.concatenate([end, (end - before) * paper.RATE])


def along(ax, clouds, places):
    """Densities of several clouds along the axis from the BLS estimate, 0, to the target, 1."""
    for found in clouds:
        values = density(found.along(found.cloud[:, :2]), places)
        ax.plot(places, values, color=figures.colour("null"), linewidth=1.1)
    ax.axvline(0, color=figures.colour("mle"))
    ax.axvline(1, color=figures.colour("target"), linestyle="--")
    ax.set_yticks([])
    ax.set_xlim(places[0], places[-1])
    ax.set_ylim(bottom=0)
