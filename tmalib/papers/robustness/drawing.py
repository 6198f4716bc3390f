"""`robustness`: drawing what `filters.filtered` returns (Figures 5 to 8)."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ... import figures
from ...bearings import bearing, wrap
from . import scenarios as paper
from .filters import density

WINDOW = (-10.0, 15.0), (-6.0, 8.0)  # km, the axes of the paper's Figure 1
NORTH_OF_KALMAN = 14.0  # km: its first seconds are outside
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
        "target": (found.scenario.target.position_at(times), "target"),
        "platform": (found.scenario.platform.position_at(times), "platform"),
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
    ax.set_ylim(WINDOW[1][0], NORTH_OF_KALMAN if kalman else WINDOW[1][1])


def kalman_distances(ax, found):
    """Distance of the Kalman filter from the BLS track and from the target, against time."""
    times, track = found.kalman.times, found.kalman.state[:, :2]
    others = {
        "target": (found.scenario.target.position_at(times), "from the target", "-"),
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
    track = bearing(found.bls_at(times)[:, :2] - scenario.platform.position_at(times))
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
        values = density(cloud[:, i], places)
        ax.fill_between(places, values, color=figures.colour("null"), alpha=0.5, lw=0)
        ax.axvline(estimate[i], color=figures.colour("mle"))
        ax.axvline(truth[i], color=figures.colour("target"), linestyle="--")
        ax.set_xlabel(NAMES[i])
        ax.set_yticks([])
        ax.set_ylim(0, 1.1 * values.max())


def true_state(found):
    """State of the target at the end, ``(4,)``; the velocity over the last interval."""
    before, end = found.scenario.target.position_at(found.scenario.times[-2:])
    return np.concatenate([end, (end - before) * paper.RATE])


def cloud_and_marginals(found):
    """Figure: the map with the last cloud, and the marginal densities of its four coordinates."""
    fig = plt.figure(figsize=(9.2, 3.6))
    left, right = fig.subfigures(1, 2, width_ratios=(1.35, 1))
    ax = left.subplots()
    courses(ax, found, particles=True)
    ax.legend(loc="lower right", fontsize=8, markerscale=3)
    marginals(right.subplots(2, 2).ravel(), found)
    return fig


def draws(clouds, names):
    """Figure: densities along the axis from the BLS estimate to the target, several clouds a panel.

    Parameters
    ----------
    clouds : dict
        ``(case, setting)`` to a list of `Filtered`; a row a case, a column a setting, which labels it.
    names : dict
        Case to what it is called.
    """
    settings = list(dict.fromkeys(setting for _, setting in clouds))
    fig, axes = plt.subplots(len(names), len(settings), figsize=(9.2, 4.2), squeeze=False)
    for row, (case, name) in zip(axes, names.items(), strict=True):
        reach = np.concatenate(
            [f.along(f.cloud[::10, :2]) for setting in settings for f in clouds[case, setting]]
        )
        places = np.linspace(*np.quantile(reach, [0.002, 0.998]), 401)
        for ax, setting in zip(row, settings, strict=True):
            for found in clouds[case, setting]:
                values = density(found.along(found.cloud[:, :2]), places)
                ax.plot(places, values, color=figures.colour("null"), linewidth=1.1)
            _reference_lines(ax.axvline)
            ax.set_yticks([])
            ax.set_ylim(bottom=0)
        row[0].set_ylabel(name)
    for ax, setting in zip(axes[0], settings, strict=True):
        ax.set_title(setting, fontsize=9)
    for ax in axes[-1]:
        ax.set_xlabel("Place between BLS (0) and target (1)")
    return fig


def against_beta(swept, betas, names):
    """Figure: median and intervals of 50 and 90 per cent of clouds along the same axis, against beta.

    ``swept`` maps a case to a list of `Filtered`, one for each of the ``betas``; open dots are degenerate.
    """
    fig, axes = plt.subplots(1, len(names), figsize=(9.2, 3.2))
    for ax, (case, name) in zip(axes, names.items(), strict=True):
        levels = np.array(
            [np.quantile(f.along(f.cloud[:, :2]), [0.05, 0.25, 0.5, 0.75, 0.95]) for f in swept[case]]
        )
        for low, high, alpha in ((0, 4, 0.25), (1, 3, 0.4)):
            ax.fill_between(
                betas, levels[:, low], levels[:, high], color=figures.colour("null"), alpha=alpha, lw=0
            )
        ax.semilogx(betas, levels[:, 2], color="black")
        few = np.array([f.particles.degenerate for f in swept[case]])
        ax.plot(betas[~few], levels[~few, 2], "o", color="black", markersize=5)
        ax.plot(betas[few], levels[few, 2], "o", color="black", markersize=5, markerfacecolor="white")
        _reference_lines(ax.axhline)
        ax.set_xticks(betas, [f"{beta:g}" for beta in betas])
        ax.minorticks_off()
        ax.set_xlabel(r"$\beta$ (m/s²), " + name)
    axes[0].set_ylabel("Place between BLS (0)\nand target (1)")
    return fig


def _reference_lines(line):
    line(0, color=figures.colour("mle"))
    line(1, color=figures.colour("target"), linestyle="--")
