"""Drawings of the chapter on what the delay is worth."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from .. import figures
from .worth_of_delay import even_speed

LEVELS = (0.01, 0.1, 0.3, 1, 3, 10, 30)


def draw_map(maps, examples):
    """Bound by the best manoeuvre over bound by the delay, for a crossing target.

    Parameters
    ----------
    maps : sequence of tuple
        ``(setting, ranges (R,), speeds (S,), ratio (R, S))``.
    examples : dict
        By name, ``(setting, range, speed)``: targets to be marked.
    """
    figure, axes = plt.subplots(1, len(maps), figsize=(7.6, 4.0))
    shades = plt.get_cmap("PuOr")
    for ax, (setting, places, speeds, ratio) in zip(axes, maps, strict=True):
        edges = np.linspace(-2, 2, 17)
        drawn = ax.contourf(places / 1e3, speeds, np.log10(ratio).T, edges, cmap=shades, extend="both")
        lines = ax.contour(
            places / 1e3,
            speeds,
            ratio.T,
            LEVELS,
            colors="black",
            linewidths=[2 if x == 1 else 0.7 for x in LEVELS],
        )
        ax.clabel(lines, fmt="%g", fontsize=8)
        fine = np.geomspace(*places[[0, -1]], 60)
        ax.plot(fine / 1e3, even_speed(setting, fine), "--", color="white", linewidth=3)
        ax.plot(fine / 1e3, even_speed(setting, fine), "--", color=figures.colour("target"), linewidth=1.6)
        for name, (where, place, speed) in examples.items():
            if where is setting:
                ax.plot(place / 1e3, speed, "o", color="black", markersize=4)
                left = setting.ranges[0] * 3 < place < setting.ranges[1] / 1.5
                where_to = {"xytext": (-5, -11) if left else (5, 5), "ha": "right" if left else "left"}
                box = {"facecolor": "white", "alpha": 0.7, "linewidth": 0, "pad": 0.5}
                there = (place / 1e3, speed)
                ax.annotate(name, there, textcoords="offset points", fontsize=8, bbox=box, **where_to)
        ax.set(xscale="log", yscale="log", ylim=(speeds[0], speeds[-1]), xlabel="Range (km)")
        ax.set_xlim(places[0] / 1e3, places[-1] / 1e3)
        ax.set_title(
            f"{setting.name}: {setting.duration / 60:g} min, own speed {setting.own_speed:g} m/s", fontsize=9
        )
        for axis, ticks in (
            (ax.xaxis, (0.5, 1, 2, 5, 10, 20, 50, 100)),
            (ax.yaxis, (2, 5, 10, 20, 50, 100, 200)),
        ):
            axis.set_major_locator(plt.FixedLocator(ticks))
            axis.set_major_formatter(plt.FormatStrFormatter("%g"))
            axis.set_minor_locator(plt.NullLocator())
    axes[0].set_ylabel("Speed of the target across (m/s)")
    bar = figure.colorbar(drawn, ax=axes, shrink=0.85, pad=0.02, ticks=[-2, -1, 0, 1, 2])
    bar.set_ticklabels(["0.01", "0.1", "1", "10", "100"])
    bar.set_label("manoeuvre / delay, bounds")
    return figure


def draw_collapse(delays, against):
    """Both laws against the bounds: without a manoeuvre (left), and against the best one (right).

    Parameters
    ----------
    delays : dict
        By label, ``(law, bound)``, each ``(count,)``.
    against : dict
        By label, ``(worth, ratio of the bounds, whether the way is less than a fifth of the range)``.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.8))
    looks = (("platform", "o"), ("light", "s"), ("target", "^"), ("ellipse", "x"))
    for (label, (law, bound)), (entity, mark) in zip(delays.items(), looks, strict=True):
        shown = law < 10
        left.plot(
            law[shown], bound[shown], mark, color=figures.colour(entity), markersize=3, alpha=0.6, label=label
        )
    for (label, (value, ratio, far)), (entity, mark) in zip(against.items(), looks[::2], strict=True):
        look = {"color": figures.colour(entity), "markersize": 3.5, "linestyle": "none", "marker": mark}
        right.plot(value[far], ratio[far], label=f"{label}, far", **look)
        right.plot(value[~far], ratio[~far], markerfacecolor="none", label=f"{label}, near", **look)
    for ax in (left, right):
        ax.set(xscale="log", yscale="log")
        ends = np.array(ax.get_xlim())
        ax.plot(ends, ends, color="black", linewidth=1, zorder=0)
        ax.set_xlim(ends)
        ax.legend(fontsize=8, loc="upper left")
    for line in (right.axhline, right.axvline):
        line(1, color="black", linestyle=":", linewidth=1)
    left.set(xlabel="Law: error over range", ylabel="Bound: error over range")
    right.set(xlabel="Laws: manoeuvre over delay", ylabel="Bounds: manoeuvre over delay")
    return figure
