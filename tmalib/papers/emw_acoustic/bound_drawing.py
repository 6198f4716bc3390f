"""`emw-acoustic`: drawings of the chapters on the delay, the bound, its observability and the estimators."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from ... import figures
from ...bearings import bearing, propagation_delay


def light_and_sound(target, velocity, speed_of_sound):
    """Figure 1 of the paper: the rays of the light and of the sound that arrive now, and their bearings.

    The observer is at the origin, the target's present position is in metres and its velocity in m/s.
    """
    observer = np.zeros(2)
    heard = target - propagation_delay(target, velocity, speed_of_sound) * velocity
    figure, ax = plt.subplots(figsize=(6.0, 4.4))
    figures.path(ax, [target - 4 * velocity, target + 1.2 * velocity], "target", label="target's course")
    arrow = {"arrowstyle": "->", "color": figures.colour("target")}
    ax.annotate("", (target + 1.2 * velocity) / 1e3, target / 1e3, arrowprops=arrow)
    for point, entity, style in ((target, "light", "-"), (heard, "sound", "--")):
        ray = np.stack([observer, point], 1) / 1e3
        ax.plot(*ray, style, color=figures.colour(entity), label=entity)
    for radius, point, text, entity in (
        (0.7, target, r"$\theta$", "light"),
        (1.15, heard, r"$\theta_D$", "sound"),
    ):
        arc = np.linspace(0, bearing(point), 51)
        curve = radius * np.stack([np.sin(arc), np.cos(arc)])
        ax.plot(*curve, color=figures.colour(entity), linewidth=1)
        ax.annotate(text, curve[:, 20], xytext=(0, 5), textcoords="offset points", ha="center")
    for point, text, offset in (
        (target, "$P_T(t)$", (8, 2)),
        (heard, r"$P_T(t-\tau)$", (6, 6)),
        (observer, "$P_O(t)$", (-42, -4)),
    ):
        ax.plot(*point / 1e3, "o", color="black", markersize=5)
        ax.annotate(text, point / 1e3, xytext=offset, textcoords="offset points")
    ax.plot([0, 0], [0, 3.2], color="#7F7F7F", linewidth=1)
    ax.annotate("North", (0, 3.2), xytext=(-4, -4), textcoords="offset points", ha="right", color="#5F5F5F")
    figures.map_axes(ax)
    ax.set(xlim=(-0.7, 3.7), ylim=(-0.25, 3.4), adjustable="box")
    ax.legend(loc="lower right")
    return figure


def stretched_tracks(times, tracks, shift):
    """The classical ambiguity: tracks with the same instantaneous bearings, and what sound makes of it.

    Parameters
    ----------
    times : ndarray
        ``(N,)``, seconds.
    tracks, shift : dict
        By stretching factor (0.5, 1 and 2): positions of the target at the times, ``(N, 2)``, and delayed
        minus instantaneous bearing in degrees, ``(N,)``. The observer is at the origin.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.6), width_ratios=(1, 1.1))
    looks = {0.5: (":", "v"), 1.0: ("-", "o"), 2.0: ("--", "^")}
    for factor, track in tracks.items():
        style, marker = looks[factor]
        label = f"× {factor:g}"
        figures.path(left, track, "target", label=label, linestyle=style)
        left.plot(*track[::100].T / 1e3, marker, color=figures.colour("target"), markersize=4)
        right.plot(times, shift[factor], style, color=figures.colour("sound"), label=label)
    for there in tracks[2.0][::100] / 1e3:
        left.plot([0, there[0]], [0, there[1]], color=figures.colour("light"), linewidth=0.8, zorder=0)
    left.plot(0, 0, "s", color=figures.colour("platform"))
    left.annotate("O", (0, 0), xytext=(6, -4), textcoords="offset points", fontweight="bold")
    figures.map_axes(left)
    left.legend(loc="upper left", fontsize=8)
    right.axhspan(-1, 1, color="#E9E9E9", zorder=0)
    right.set(xlabel="Time (s)", ylabel=r"$\theta_D - \theta$ (degrees)", ylim=(-1.2, 1.2))
    right.legend(loc="upper right", fontsize=8)
    return figure


def bounds_without_manoeuvre(bounds, every, ranges):
    """Bounds on the position of the six scenarios for three observers, and for all straight courses.

    Parameters
    ----------
    bounds : dict
        ``manoeuvring``, ``first leg`` and ``motionless``, each ``(6,)``, kilometres.
    every : ndarray
        ``(6, H)``: an observer that goes straight on one of H headings, kilometres.
    ranges : ndarray
        ``(6,)``: range of the target from the origin, kilometres.
    """
    figure, ax = plt.subplots(figsize=(6.8, 4.0))
    row = np.arange(1, 7)
    for n, values in zip(row, every, strict=True):
        label = "straight, any heading" if n == 1 else None
        ax.plot(values, np.full(values.size, n), ".", color=figures.colour("null"), markersize=3, label=label)
    for name, marker, entity, label in (
        ("manoeuvring", "D", "platform", "manoeuvring"),
        ("first leg", "s", "printed", "straight, first leg"),
        ("motionless", "o", "light", "motionless"),
    ):
        ax.plot(bounds[name], row, marker, color=figures.colour(entity), label=label)
    ax.plot(ranges, row, "|", color=figures.colour("target"), ms=18, mew=2.5, label="range of the target")
    ax.set_xscale("log")
    ax.set_xlim(0.05, 2500)
    ax.set_xticks([0.1, 1, 10, 100, 1000], ["0.1", "1", "10", "100", "1000"])
    ax.set_yticks(row)
    ax.invert_yaxis()
    ax.set(xlabel="Bound on the position (km)", ylabel="Scenario")
    ax.legend(fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return figure


def bounds_over_printed(ratio):
    """Computed over printed bounds, ``(6, 8)``: one row a scenario, the full problem and then BOTMA."""
    figure, ax = plt.subplots(figsize=(6.4, 3.2))
    ax.axvline(1, color="black", linewidth=1)
    colour = figures.colour("printed")
    for part, marker, shift, face, label in (
        (slice(0, 4), "o", -0.12, colour, "CRLB"),
        (slice(4, 8), "s", 0.12, "white", "BOTMA"),
    ):
        rows = np.repeat(np.arange(1, 7)[:, None] + shift, 4, axis=1)
        look = {"color": colour, "markerfacecolor": face, "label": label}
        ax.plot(ratio[:, part].ravel(), rows.ravel(), marker, **look)
    ax.set_xscale("log")
    ax.set_xticks([0.2, 0.5, 1, 2, 4], ["0.2", "0.5", "1", "2", "4"])
    ax.minorticks_off()
    ax.set_yticks(range(1, 7))
    ax.invert_yaxis()
    ax.set(xlabel="Bound with the path as printed / printed bound", ylabel="Scenario")
    ax.legend(loc="upper right")
    return figure


def filter_readings(worst, looks, used, limit, biases_of_six):
    """How far the EKF numbers of each table are from the printed ones, for each reading of the filter.

    Parameters
    ----------
    worst : dict
        ``(scenario, gradient, first_again)`` to the largest deviation, in standard errors.
    looks : dict
        ``(gradient, first_again)`` to its label and marker.
    used : dict
        Scenario to the reading that is used.
    limit : float
        What a table that is right exceeds in one case of twenty.
    biases_of_six : float
        Largest deviation of the biases alone, scenario 6.
    """
    figure, ax = plt.subplots(figsize=(6.4, 3.6))
    ekf, null = figures.colour("ekf"), figures.colour("null")
    ax.axvline(limit, color="black", linestyle="--", linewidth=1)
    for (number, *reading), value in worst.items():
        _, marker = looks[tuple(reading)]
        ours = {"markersize": 9, "color": ekf, "markeredgecolor": "black", "zorder": 4}
        other = {"markersize": 6, "color": null, "fillstyle": "none", "zorder": 3}
        ax.plot(value, number, marker, **(ours if tuple(reading) == used[number] else other))
    for label, marker in looks.values():
        ax.plot([], [], marker, color=null, fillstyle="none", label=label)
    ax.set_xscale("log")
    ax.set_xticks([1, 3, 10, 30, 100], ["1", "3", "10", "30", "100"])
    ax.set_yticks(list(used), [f"scenario {number}" for number in used])
    ax.invert_yaxis()
    ax.set_xlabel("Largest deviation from the printed values (standard errors)")
    figure.legend(loc="outside upper center", ncols=2, fontsize=9)
    ax.plot(biases_of_six, 6, "s", markersize=9, color=ekf, fillstyle="none")
    beside = {"xytext": (9, 0), "textcoords": "offset points", "va": "center", "fontsize": 9}
    ax.annotate("biases alone", (biases_of_six, 6), **beside)
    ax.set_xlim(0.25, 200)
    return figure


def prior_sweeps(velocity, position):
    """Error over bound and share of diverged runs of the EKF against the prior, in the six scenarios.

    Parameters
    ----------
    velocity, position : tuple
        What is varied: standard deviations ``(P,)`` in m/s and km; found, ``(6, P, 2)``, the worst error
        over the bound and the share diverged; and the paper's own standard deviation.
    """
    looks = {1: "-o", 2: "-o", 3: "--s", 4: "--s", 5: ":^", 6: ":^"}
    line = {"color": figures.colour("ekf"), "markersize": 4, "linewidth": 1.4}
    figure, axes = plt.subplots(3, 2, figsize=(7.2, 6.8), sharex="col", sharey="row", height_ratios=(3, 3, 2))
    for column, (x, found, mark) in enumerate((velocity, position)):
        for ax in axes[:, column]:
            ax.axvline(mark, color="black", linewidth=1)
            ax.set_xscale("log")
        for number, (error, diverged) in enumerate(np.moveaxis(found, -1, 1), start=1):
            fill = "full" if number % 2 else "none"
            axes[(number - 1) % 2, column].plot(x, error, looks[number], label=f"scenario {number}", **line)
            axes[2, column].plot(x, 100 * diverged, looks[number], fillstyle=fill, **line)
    for first, name in ((axes[0], "long range"), (axes[1], "short range")):
        for ax in first:
            ax.axhline(1, color=figures.colour("ellipse"), linewidth=1, linestyle=":")
            ax.set_yscale("log")
        first[0].set_yticks([1, 2, 5, 10], ["1", "2", "5", "10"])
        first[0].set_ylabel(f"Worst error / bound,\n{name}")
        first[0].legend(loc="upper right", fontsize=9)
    axes[2, 0].set_ylabel("Diverged (%)")
    axes[2, 0].set_xticks([0.5, 1, 2, 5, 10], ["0.5", "1", "2", "5", "10"])
    axes[2, 1].set_xticks([1, 2, 5, 10], ["1", "2", "5", "10"])
    for ax in axes.flat:
        ax.minorticks_off()
    axes[2, 0].set_xlabel("Prior σ of each velocity component (m/s)")
    axes[2, 1].set_xlabel("Prior σ of each position component (km)")
    return figure


def shares_by_start(ranges, found, true_ranges, starts, assumed=()):
    """Share of runs that find the minimum from each starting range, as the filling of a circle.

    Parameters
    ----------
    ranges : ndarray
        ``(S,)``, metres.
    found : dict
        Scenario to a dict from the name of a way to ``(S, runs)`` of bool; a panel a scenario, a row a way.
    true_ranges : dict
        Scenario to the true range at the first and at the last time, metres: a grey band.
    starts : dict
        Scenario to the starting range of the paper, metres: a line, dotted for the ``assumed`` ones.
    """
    shades = LinearSegmentedColormap.from_list("share", ["white", figures.colour("mle")])
    figure, axes = plt.subplots(3, 2, figsize=(7.2, 5.2), sharex=True, sharey=True)
    for (number, ways), ax in zip(found.items(), axes.flat, strict=True):
        ax.axvspan(*sorted(np.array(true_ranges[number]) / 1e3), color="#DDDDDD")
        style = ":" if number in assumed else "-"
        ax.axvline(starts[number] / 1e3, color="black", linewidth=1.2, linestyle=style)
        for row, reached in enumerate(ways.values()):
            look = {
                "cmap": shades,
                "vmin": 0,
                "vmax": 1,
                "edgecolors": figures.colour("mle"),
                "s": 52,
                "zorder": 3,
            }
            dots = ax.scatter(ranges / 1e3, np.full(len(ranges), row), c=reached.mean(axis=1), **look)
        ax.set_title(f"scenario {number}", loc="left", fontsize=10)
        ax.set_yticks(range(len(ways)), [name.replace(", ", ",\n") for name in ways], fontsize=9)
        ax.set(xscale="log", ylim=(len(ways) - 0.5, -0.5))
        ax.set_xticks([1, 3, 10, 30], ["1", "3", "10", "30"])
        ax.minorticks_off()
    figure.supxlabel("Starting range (km)", fontsize=10)
    bar = figure.colorbar(dots, ax=axes, location="top", shrink=0.6, aspect=30, ticks=[0, 0.5, 1])
    bar.ax.set_xticklabels(["0", "50", "100"])
    bar.set_label("Runs that find the minimum (%)")
    return figure
