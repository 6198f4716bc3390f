"""`robustness`: drawing what `filters.filtered` returns (Figures 5 to 8)."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ... import figures
from ...bearings import bearing, wrap
from . import scenarios as paper
from .filters import density

WINDOW = (-10.0, 15.0), (-6.0, 8.0)  # km, the axes of the paper's maps
NAMES = ("$x$ (km)", "$y$ (km)", r"$\dot x$ (m/s)", r"$\dot y$ (m/s)")
BLS = "BLS estimate"


def map_and_window(tracks):
    """Figures 1 to 3: a map of tracks, their ends circled, and beside it the same on the paper's axes.

    ``tracks`` maps a label to positions ``(N, 2)`` in metres, the entity and the line style.
    """
    fig, (ax, small) = plt.subplots(1, 2, figsize=(7.0, 4.4), width_ratios=(1.5, 1))
    for label, (positions, entity, style) in tracks.items():
        for where, width in ((ax, 1.8), (small, 1.0)):
            figures.path(where, positions, entity, label=label, linestyle=style, linewidth=width)
        ax.plot(*positions[-1] / 1e3, "o", color=figures.colour(entity), markersize=9, fillstyle="none")
    _limits(ax, [positions for positions, *_ in tracks.values()])
    figures.map_axes(small, step=5)
    small.set(xlim=WINDOW[0], ylim=WINDOW[1], aspect="equal", adjustable="box", anchor="S", ylabel="")
    small.set_title("the paper's axes", fontsize=9)
    handles, labels = ax.get_legend_handles_labels()
    small.legend(handles, labels, loc="lower center", bbox_to_anchor=(0.5, 1.2))
    return fig


def _limits(ax, tracks, margin=0.6, step=2):
    """Make a map with all tracks in it, kilometres around them."""
    points = np.concatenate(tracks) / 1e3
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    figures.map_axes(ax, step=step)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", adjustable="box")


def _tracks(found):
    """Target, platform and BLS track by entity: positions, label and line style."""
    times = found.scenario.times
    return {
        "target": (found.scenario.target.position_at(times), "target", "-"),
        "platform": (found.scenario.platform.position_at(times), "platform", "-"),
        "mle": (found.bls_at(times)[:, :2], BLS, "--"),
    }


def courses(ax, found):
    """Target, platform and BLS track on a map, their ends circled."""
    for entity, (positions, label, style) in _tracks(found).items():
        figures.path(ax, positions, entity, label, linestyle=style)
        ax.plot(*positions[-1] / 1e3, "o", color=figures.colour(entity), markersize=9, fillstyle="none")


def with_kalman(found, over_time):
    """Figures 5 and 7: the map with the Kalman filter's track, its end magnified, and a drawing over time.

    ``over_time(ax, found)`` draws the lower panel. The cross is the end of the filter's track.
    """
    fig, axes = plt.subplot_mosaic("ab;cc", figsize=(7.2, 6.4), height_ratios=(1.35, 1))
    state, end = found.kalman.state[:, :2], found.scenario.target.position_at(paper.DURATION)
    ends = np.stack([end, found.bls_at(paper.DURATION)[:2], state[-1]])
    for name in "ab":
        courses(axes[name], found)
        cross = {"color": figures.colour("ekf"), "markersize": 11, "markeredgewidth": 2.5, "zorder": 5}
        figures.path(axes[name], state, "ekf", "Kalman filter", linewidth=0.8)
        axes[name].plot(*state[-1] / 1e3, "x", **cross)
    _limits(axes["a"], [positions for positions, *_ in _tracks(found).values()] + [state[10:]], step=5)
    _limits(axes["b"], [ends], margin=1.4, step=1)
    axes["b"].set_ylabel("")
    axes["a"].set_title("(a) all of it", loc="left", fontsize=10)
    axes["b"].set_title("(b) the ends", loc="left", fontsize=10)
    over_time(axes["c"], found)
    axes["c"].set_title("(c)", loc="left", fontsize=10)
    handles, labels = axes["a"].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=9)
    return fig


def kalman_distances(ax, found):
    """Distance of the Kalman filter from the BLS track and from the target, against time."""
    times, track = found.kalman.times, found.kalman.state[:, :2]
    others = {
        "target": (found.scenario.target.position_at(times), "from the target", "-"),
        "mle": (found.bls_at(times)[:, :2], "from the BLS track", "--"),
    }
    for entity, (positions, label, style) in others.items():
        ax.semilogy(
            times, np.hypot(*(track - positions).T) / 1e3, style, color=figures.colour(entity), label=label
        )
    ax.set_xlabel("Time (s)")
    ax.set_ylabel("Filter's distance (km)")
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
    """Figures 6 and 8: the map with the last cloud, and the marginal densities of its four coordinates."""
    fig, axes = plt.subplot_mosaic("aaaa;bcde", figsize=(7.2, 5.8), height_ratios=(2.4, 1))
    cloud = found.cloud[:: len(found.cloud) // 5000, :2]
    figures.cloud(axes["a"], cloud, "null", "particles at the end", size=3)
    courses(axes["a"], found)
    inside = np.quantile(cloud, [0.001, 0.999], axis=0)
    _limits(axes["a"], [positions for positions, *_ in _tracks(found).values()] + [inside])
    axes["a"].legend(loc="center left", bbox_to_anchor=(1.02, 0.5), fontsize=9, markerscale=4)
    marginals([axes[name] for name in "bcde"], found)
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
    fig, axes = plt.subplots(len(names), len(settings), figsize=(7.6, 4.2), squeeze=False)
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
        ax.set_title(setting, fontsize=8.5)
    axes[-1, 1].set_xlabel("Place between BLS (0) and target (1)")
    return fig


def against_beta(swept, betas, names):
    """Figure: median and intervals of 50 and 90 per cent of clouds along the same axis, against beta.

    ``swept`` maps a case to a list of `Filtered`, one for each of the ``betas``; open dots are degenerate.
    """
    fig, axes = plt.subplots(1, len(names), figsize=(7.6, 3.2))
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
