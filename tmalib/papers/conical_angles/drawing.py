"""`conical-angles`: the clouds of estimates of Figures 4 to 10, and the readings of the course.

Positions are ``(runs, 2)`` in metres, east and north; the array is at the origin when a scenario starts.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ... import figures
from ...ellipse import confidence_ellipse

OFF_THE_SCALE = 5.0  # per cent


def outward(shape):
    """Unit vector, east and north, along the long axis of an `Ellipse` and away from the origin."""
    axis = np.array([np.sin(shape.heading), np.cos(shape.heading)])
    return axis * np.sign(axis @ shape.centre)


def courses(ax, scenario):
    """Courses of array (O) and target (T) at the times of measurement."""
    for entity, label, mark in (("platform", "array", "O"), ("target", "target", "T")):
        moving = getattr(scenario, entity)
        figures.path(ax, moving.position_at(scenario.times), entity, label=label, mark=mark)


def figure_4(scenario, estimates, curve):
    """Figure 4: courses, estimates and the curve on which they lie, ``(N, 2)``.

    A run without a finite estimate is NaN; an arrow at the end of the curve stands for all of them.
    """
    finite = np.isfinite(estimates).all(axis=1)
    fig, ax = plt.subplots(figsize=(6.6, 5.0))
    ax.plot(*curve.T / 1e3, color="black", linewidth=0.8, label="hyperbola")
    figures.cloud(ax, estimates[finite], "mle", label="estimates", size=26)
    array, target = (m.position_at(scenario.times) for m in (scenario.platform, scenario.target))
    figures.path(ax, array, "platform", label="array", mark="O")
    figures.path(ax, target, "target", label="target", mark="T", zorder=4)
    tip = curve[-1] / 1e3
    arrow = {"arrowstyle": "-|>", "color": figures.colour("light"), "lw": 2.5}
    ax.annotate("", tip + [2.2, 1.65], xytext=tip, arrowprops=arrow)
    ax.annotate(
        f"{(~finite).sum()} of {len(finite)} runs:\nat infinity", tip, xytext=(-8, 4),
        textcoords="offset points", ha="right", color="#8A5A00",
    )  # fmt: skip
    figures.map_axes(ax)
    ax.set(xlim=(-1, 28), ylim=(-1, 23), aspect="equal", adjustable="box")
    ax.legend(loc="lower right")
    return fig


def figure_5(estimates, shape, ghost, curve):
    """Figure 5: the map, and the same along and across the ellipse of the bound, whose centre is the target.

    ``ghost`` is the position, ``(2,)``, about which the cloud should lie; ``curve``, ``(N, 2)``, the points
    with the target's first measurement at the assumed depth.
    """
    truth = shape.centre
    fig, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.6), width_ratios=(1.15, 1))
    left.plot(*curve.T / 1e3, color="#7F7F7F", linewidth=1, label="hyperbola")
    figures.cloud(left, estimates, "mle", label="estimates", size=9)
    figures.ellipse(left, shape, label="90 % ellipse")
    left.plot(*truth / 1e3, "o", color=figures.colour("target"), label="target", markersize=5)
    left.set(xlabel="East (km)", ylabel="North (km)", xlim=(4.45, 5.55), ylim=(6.55, 7.45), aspect="equal")
    left.legend(loc="upper left", fontsize=8)
    east, north = outward(shape)
    axes = np.array([[east, -north], [north, east]])  # columns: along, across
    right.scatter(
        *((estimates - truth) @ axes).T, s=5, color=figures.colour("mle"), alpha=0.5, rasterized=True
    )
    right.plot(*((shape.boundary() - truth) @ axes).T, color="black")
    place = (ghost - truth) @ axes
    right.plot(*place, "k+", markersize=10)
    right.plot(0, 0, "o", color=figures.colour("target"), markersize=5)
    right.annotate("ghost", place, xytext=(0, 9), textcoords="offset points", ha="center")
    right.annotate("target", (0, 0), xytext=(0, -14), textcoords="offset points", ha="center")
    right.set(xlabel="Along the ellipse (m)", ylabel="Across (m)", ylim=(-75, 12))
    return fig


def readings_of_the_course(off, agree):
    """Nine bounds under several readings of the course of Section 4.2, a row a reading.

    ``off`` maps a reading to how far our bounds are above the printed ones, in per cent; ``agree`` to whether
    each is within a unit of the last printed digit. The readings with which the most agree are blue.
    """
    fig, ax = plt.subplots(figsize=(7.2, 3.7))
    ax.axvline(0, color="black", linewidth=1)
    most = max(hits.sum() for hits in agree.values())
    for place, (values, hits) in enumerate(zip(off.values(), agree.values(), strict=True)):
        colour = figures.colour("platform" if hits.sum() == most else "target")
        if np.abs(values).max() < OFF_THE_SCALE:
            for hit, face in ((True, colour), (False, "white")):
                x = values[hits == hit]
                ax.plot(x, np.full(len(x), place), "o", color=colour, markerfacecolor=face, markersize=6)
        else:
            text = f"off the scale: {values.min():.0f} to {values.max():+.0f} %"
            text = text.replace("-", "\N{MINUS SIGN}")
            ax.annotate(text, (0, place), ha="center", va="center", color=colour, backgroundcolor="white")
        count = f"{hits.sum()} of {len(hits)}"
        ax.annotate(count, (1.02, place), xycoords=("axes fraction", "data"), va="center")
    ax.set_yticks(range(len(off)), off)
    ax.set_ylim(len(off) - 0.5, -0.5)
    ax.set_xlim(-1.4, 1.4)
    ax.set_xlabel("Our bound above the printed one (%)")
    return fig


def figures_6_and_7(scenario, errors, covariance):
    """Figure 6 or 7: courses, estimates and the ellipse of a bound; and the errors across and along it.

    ``errors`` are those of the estimates, ``(runs, n)``; ``covariance``, ``(n, n)``, is the bound.
    """
    errors, truth = errors[:, :2], scenario.state[:2]
    shape = confidence_ellipse(truth, covariance)
    fig, (ax, close) = plt.subplots(1, 2, figsize=(7.6, 5.2), width_ratios=[1.5, 1])
    figures.cloud(ax, truth + errors, "mle", label=f"{len(errors)} estimates", size=8)
    courses(ax, scenario)
    figures.ellipse(ax, shape, label="90 % ellipse", linewidth=0.8)
    figures.map_axes(ax)
    ax.set(xlim=(-2.5, 9), ylim=(-2.5, 12.5), aspect="equal", adjustable="box")
    ax.legend(loc="upper left")
    east, north = outward(shape)
    axes = np.array([[north, east], [-east, north]])  # columns: across, along
    figures.cloud(close, errors @ axes, "mle", size=8)
    close.plot(*((shape.boundary() - shape.centre) @ axes / 1e3).T, color=figures.colour("ellipse"))
    mean = errors.mean(axis=0) @ axes / 1e3
    close.plot(*mean, "D", color="white", markeredgecolor="black", label="mean")
    close.plot(0, 0, "+", color="black", markersize=10, label="truth")
    close.set(xlim=(-0.45, 0.45), ylim=(-4.2, 5.2))
    close.set(xlabel="Across the ellipse (km)", ylabel="Along the ellipse, away from the array (km)")
    close.legend(loc="upper left")
    return fig


def figures_9_and_10(estimates, mirrored, shape):
    """Figure 9 or 10: the array, the cloud and its mirror image; and the cloud magnified.

    ``mirrored`` are the estimates from a start on the other side; the ellipse's centre is the target.
    """
    fig, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.9), width_ratios=(1.5, 1))
    for ax in (left, right):
        figures.cloud(ax, estimates, "mle", label="estimates", size=7)
        figures.ellipse(ax, shape, label="90 % ellipse")
        ax.plot(*shape.centre / 1e3, "o", color=figures.colour("target"), markersize=4, label="target")
    figures.cloud(left, mirrored, "null", label="mirrored start", size=7)
    left.plot(0, 0, "s", color=figures.colour("platform"), label="array")
    left.set(xlim=(-7, 7), ylim=(-0.7, 9.2), aspect="equal", xlabel="East (km)", ylabel="North (km)")
    right.set(xlim=(3.6, 6.2), ylim=(5.2, 8.3), aspect="equal", xlabel="East (km)", ylabel="North (km)")
    handles, labels = left.get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper center", ncols=5, fontsize=9, markerscale=2)
    return fig
