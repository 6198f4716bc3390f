"""`emw-acoustic`: drawings of the chapter on fits without a start."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from ... import figures
from ...bearings import bearing
from ...motion import unit

MANY = (figures.colour("mle"), figures.colour("mle"))  # of curves that differ by line


def basins(side, reached, scenarios):
    """Maps of the starts from which a fit reaches the minimum, one row a scenario, one column a chart.

    Parameters
    ----------
    side : ndarray
        ``(S,)``: coordinates of the starts east and north, metres, equally spaced.
    reached : dict
        ``(name of the scenario, name of the chart)`` to ``(S, S)`` of bool, first axis north.
    scenarios : dict
        Name of the scenario to `Scenario`; its platform and target are drawn.
    """
    names, charts = list(scenarios), list(dict.fromkeys(chart for _, chart in reached))
    shape = {"squeeze": False, "sharex": True, "sharey": True}
    size = (3.7 * len(charts), 3.55 * len(names) + 0.4)
    figure, axes = plt.subplots(len(names), len(charts), figsize=size, **shape)
    lost, found = "#DDDDDD", "#4DBB9D"  # grey, and the colour of the MLE, lighter
    squares = {"cmap": ListedColormap([lost, found]), "vmin": 0, "vmax": 1, "rasterized": True}
    halo = [withStroke(linewidth=4.5, foreground="white")]
    for (name, chart), grid in reached.items():
        ax, now = axes[names.index(name), charts.index(chart)], scenarios[name]
        ax.pcolormesh(side / 1e3, side / 1e3, grid, edgecolors="white", linewidth=0.4, **squares)
        for entity, body in (("platform", now.platform), ("target", now.target)):
            course = body.position_at(np.unique(now.times))
            figures.path(ax, course, entity, linewidth=2.5, path_effects=halo, solid_capstyle="round")
            ax.plot(*course[0] / 1e3, "o", color=figures.colour(entity), ms=5, mec="white", mew=0.8)
        ax.set(aspect="equal", title=f"{name}, {chart}: {100 * grid.mean():.0f} %")
        ax.grid(visible=False)
    for ax in axes[-1]:
        ax.set_xlabel("Start, east (km)")
    for ax in axes[:, 0]:
        ax.set_ylabel("Start, north (km)")
    patches = [Patch(color=found, label="reaches the minimum"), Patch(color=lost, label="lost")]
    lines = [
        plt.Line2D([], [], color=figures.colour(entity), marker="o", linewidth=2.5, label=label)
        for entity, label in (("platform", "observer"), ("target", "target"))
    ]
    figure.legend(handles=[*patches, *lines], loc="outside upper center", ncols=4, fontsize=9)
    return figure


def guesses(side, maps, course, lost, without, work):
    """What a guess of the range is worth, for targets all around: two maps over their places, two curves.

    Parameters
    ----------
    side : ndarray
        ``(S,)``: coordinates of the targets east and north, metres, equally spaced.
    maps : tuple
        Share of the guesses that work, and evaluations without a start, each ``(S, S)``, first axis north.
    course : ndarray
        ``(N, 2)``: positions of the observer.
    lost : dict
        Name of a chart to ranges of the guess in metres and shares lost, each ``(R,)``.
    without : tuple
        Share lost without a start, and its interval.
    work : dict
        Name of a start to evaluations, one value a target, in any order.
    """
    figure, ((left, right), (below, beside)) = plt.subplots(2, 2, figsize=(7.6, 6.6), height_ratios=(1.5, 1))
    looks = ({"vmin": 50, "vmax": 100}, {"norm": LogNorm(2, 500), "cmap": "viridis_r"})
    labels = "Starting ranges that work (%)", "Evaluations a run, without a start"
    halo = [withStroke(linewidth=4, foreground="white")]
    for ax, values, look, label in zip((left, right), maps, looks, labels, strict=True):
        mesh = ax.pcolormesh(side / 1e3, side / 1e3, values, rasterized=True, **look)
        bar = figure.colorbar(mesh, ax=ax, location="top", shrink=0.9, label=label)
        figures.path(ax, course, "platform", linewidth=2.5, path_effects=halo)
        ax.grid(visible=False)
        ax.set(aspect="equal", xlabel="Target, east (km)", ylabel="Target, north (km)")
    bar.set_ticks([3, 10, 30, 100, 300], labels=["3", "10", "30", "100", "300"])
    entities = zip(lost.items(), ("mle", "light"), "o^", strict=True)
    for (name, (ranges, share)), entity, marker in entities:
        look = {"color": figures.colour(entity), "marker": marker, "markersize": 4}
        below.semilogx(ranges / 1e3, 100 * share, label=name, **look)
    share, interval = without
    below.axhspan(*(100 * np.array(interval)), color="#BBBBBB", linewidth=0)
    below.axhline(100 * share, color="black", label="without a start")
    below.set_xticks([1, 3, 10, 30], ["1", "3", "10", "30"])
    below.set(xlabel="Starting range (km)", ylabel="Runs lost (%)")
    for (name, values), style, colour in zip(work.items(), ("-", "--", ":"), ("black", *MANY), strict=True):
        beside.ecdf(np.ravel(values), label=name, linestyle=style, color=colour)
    beside.set(xscale="log", xlabel="Evaluations a run, at most", ylabel="Share of targets")
    beside.set_xticks([3, 10, 30, 100, 300], ["3", "10", "30", "100", "300"])
    for ax in (below, beside):
        ax.minorticks_off()
        ax.legend(fontsize=8)
    return figure


def ellipse_and_region(runs, observer, target):
    """Ellipse and likelihood region of some runs of one scenario, as seen by the observer, a panel a run.

    Along is the direction from the observer to the target, across is to its right.

    Parameters
    ----------
    runs : sequence of (Ellipse, Region)
    observer, target : ndarray
        ``(2,)``: their positions in metres at the time of the ellipses.
    """
    theta = bearing(target - observer)
    axis = np.stack([unit(theta), unit(theta + np.pi / 2)], axis=-1)

    def seen(points):
        along, across = ((points - observer) @ axis).T
        return along / 1e3, across

    figure, axes = plt.subplots(len(runs), 1, figsize=(7.2, 1.6 * len(runs) + 0.6), sharex=True, sharey=True)
    for ax, (ellipse, region) in zip(axes, runs, strict=True):
        for k, line in enumerate(region.boundary):
            label = "likelihood region" if k == 0 else None
            ax.fill(*seen(line), color=figures.colour("mle"), alpha=0.35, linewidth=0, label=label)
        ax.plot(*seen(ellipse.boundary()), color=figures.colour("ellipse"), linewidth=1.3, label="ellipse")
        ax.plot(*seen(ellipse.centre), "+", color="black", markersize=8, label="estimate")
        ax.plot(*seen(target), "o", color=figures.colour("target"), mec="white", ms=7, label="target")
        ax.axvline(0, color=figures.colour("platform"), label="observer")
        ax.set_ylabel("Across (m)")
    axes[-1].set_xlabel("Along the line of sight (km)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=5, fontsize=9)
    return figure
