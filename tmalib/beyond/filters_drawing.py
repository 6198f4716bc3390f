"""Drawings of the chapter on recursive estimators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure

from .. import figures
from ..types import FloatArray
from . import filters

LABEL = dict(facecolor="white", edgecolor="none", pad=1.5)
GAP = 0.5  # of a row, between two groups
LOOKS: dict[str, dict[str, Any]] = {
    filters.CORRECT: dict(color=figures.colour("ekf"), linestyle="-", marker="o"),
    filters.POLAR: dict(color=figures.colour("light"), linestyle="--", marker="^"),
    filters.SECOND: dict(color=figures.colour("printed"), linestyle="-.", marker="s"),
    filters.CUBATURE: dict(color=figures.colour("target"), linestyle=":", marker="D"),
    filters.BANK: dict(color=figures.colour("null"), linestyle="-", marker="x"),
    filters.BOUNDED: dict(color="black", linestyle="-", marker="", linewidth=2.5),
}


def table_of_ratios(groups: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Ratios and shares lost as a coloured table.

    ``groups`` has, by a heading and then by a name, ratios and shares of runs that are lost, each ``(6,)``.
    """
    colours = LinearSegmentedColormap.from_list("orange", ["white", "#F6C9A8", figures.colour("target")])
    norm, top, ticks, names = LogNorm(1.02, 10.0, clip=True), 0.0, [], []
    figure, ax = plt.subplots(figsize=(6.8, 7.0))
    for heading, rows in groups.items():
        ax.text(-0.5, top, heading, fontsize=9, fontweight="bold", va="center")
        for name, (ratios, shares) in rows.items():
            top += 1
            ticks.append(top)
            names.append(name)
            for k, (ratio, share) in enumerate(zip(ratios, shares, strict=True)):
                square = plt.Rectangle(
                    (k - 0.5, top - 0.5), 1, 1, facecolor=colours(norm(ratio)), edgecolor="white"
                )
                ax.add_patch(square)
                down = 0.16 if share > 0 else 0.0
                text = f"{ratio:.2f}" if ratio < 10 else f"{ratio:.0f}"
                ax.text(k, top - down, text, ha="center", va="center", fontsize=9)
                if share > 0:
                    lost = f"{100 * share:.0f}" if share >= 0.01 else f"{100 * share:.1f}"
                    ax.text(k, top + 0.26, f"{lost} % lost", ha="center", va="center", fontsize=7)
        top += 1 + GAP
    ax.set(xlim=(-0.5, 5.5), ylim=(top - 0.7, -0.5), xticks=range(6), yticks=ticks, yticklabels=names)
    ax.set_xticks(range(6), [f"scenario {k}" for k in filters.NUMBERS])
    ax.xaxis.tick_top()
    ax.tick_params(length=0, labelsize=9)
    ax.grid(False)
    for side in ax.spines.values():
        side.set_visible(False)
    return figure


def ratios_over_time(
    times: Mapping[int, Sequence[float]], ratios: Mapping[int, Mapping[str, FloatArray]]
) -> Figure:
    """Ratios of the position's error against time, a panel a scenario, ``{number: {name: (T,)}}``."""
    figure, axes = plt.subplots(3, 2, figsize=(6.8, 7.2), sharey=True)
    for number, ax in zip(times, axes.flat, strict=True):
        for name, curve in ratios[number].items():
            ax.plot(times[number], curve, label=name, markersize=3.5, **({"linewidth": 1.2} | LOOKS[name]))
        ax.set(yscale="log", ylim=(0.8, 20))
        ax.set_yticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
        ax.minorticks_off()
        ax.annotate(
            f"scenario {number}", (0.97, 0.93), xycoords="axes fraction", ha="right", va="top", bbox=LABEL
        )
    for ax in axes[:, 0]:
        ax.set_ylabel("Error over batch")
    for ax in axes[-1]:
        ax.set_xlabel("Time (s)")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=9)
    return figure


def consistency(
    ratios: Mapping[int, FloatArray], mean_nees: Mapping[int, FloatArray], limits: FloatArray
) -> Figure:
    """Mean NEES against the position's bound over the range, a mark a scenario, with the limits as a band."""
    figure, ax = plt.subplots(figsize=(6.4, 3.4))
    ax.axhspan(*limits, color="#E0E0E0", zorder=0, label="95 % limits")
    ax.axhline(4, color=figures.colour("null"), linewidth=1)
    ax.axvline(0.2, color=figures.colour("null"), linestyle=":", linewidth=1)
    shades = [figures.colour(name) for name in ("platform", "target", "mle", "ekf", "light", "null")]
    for number, marker, shade in zip(ratios, "os^Dvx", shades, strict=True):
        ax.plot(
            ratios[number], mean_nees[number], marker, color=shade, markersize=5, label=f"scenario {number}"
        )
    ax.set(xscale="log", yscale="log", xlabel="Bound of the position over the range", ylabel="Mean NEES")
    ax.set(xlim=(0.5, 0.008), ylim=(3.5, 40))
    ax.set_xticks([0.5, 0.2, 0.1, 0.05, 0.02, 0.01], ["0.5", "0.2", "0.1", "0.05", "0.02", "0.01"])
    ax.set_yticks([4, 5, 10, 20, 40], ["4", "5", "10", "20", "40"])
    ax.minorticks_off()
    beyond = [
        (ratio, number)
        for number in ratios
        for ratio, mean in zip(ratios[number], mean_nees[number], strict=True)
        if mean > 40
    ]
    for ratio, _ in beyond:
        ax.plot(np.clip(ratio, 0.008, 0.5), 37, "^", color="black", markersize=4)
    ax.legend(ncols=2, fontsize=8)
    return figure
