"""Drawings of the chapter on curved rays."""

import matplotlib.pyplot as plt
import numpy as np

from .. import figures
from ..papers.conical_angles import scenarios as conical
from ..ray_tracing import trace_ray
from ..sound_profile import SoundSpeedProfile

QUIET = -20.0  # dB, below which direct sound is not drawn
DEEPEST = 600.0  # m, of the drawn rays
FARTHEST = 12e3  # m
LEVELS = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0)


def direct_sound(profiles, heard, distance):
    """Rays that leave the array in two profiles, and where direct sound arrives in all.

    Parameters
    ----------
    profiles : dict from place to SoundSpeedProfile
        The rays of the first two are drawn.
    heard : dict from place to (distances, levels)
        In metres and decibels; a bar where the level is at least `QUIET`.
    distance : float
        Of the paper's target, in metres.
    """
    fig = plt.figure(figsize=(7.0, 6.6))
    grid = fig.add_gridspec(3, 2, width_ratios=(1, 3.2), height_ratios=(1, 1, 0.8))
    for row, (place, profile) in enumerate(list(profiles.items())[:2]):
        speed, rays = (fig.add_subplot(grid[row, column]) for column in (0, 1))
        shown = profile.depths <= DEEPEST + 100
        speed.plot(profile.speeds[shown], profile.depths[shown], color="black")
        speed.set(xlabel="Sound speed (m/s)", ylabel="Depth (m)", ylim=(DEEPEST, 0), title=place)
        _fan(rays, profile)
        rays.plot(distance / 1e3, conical.TARGET_DEPTH, "o", color=figures.colour("target"), markersize=8)
        rays.annotate(
            "target", (distance / 1e3, conical.TARGET_DEPTH), xytext=(6, -13), textcoords="offset points",
            color=figures.colour("target"), fontweight="bold", bbox=_white(),
        )  # fmt: skip
        rays.plot(0, conical.ARRAY_DEPTH, ">", color=figures.colour("platform"), markersize=10, clip_on=False)
        rays.annotate(
            "array", (0, conical.ARRAY_DEPTH), xytext=(4, -15), textcoords="offset points",
            color=figures.colour("platform"), fontweight="bold", bbox=_white(),
        )  # fmt: skip
        rays.set(xlabel="Distance (km)", xlim=(0, FARTHEST / 1e3), ylim=(DEEPEST, 0))
        rays.grid(False)
    _bars(fig.add_subplot(grid[2, :]), heard, distance)
    return fig


def _white():
    return {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}


def _fan(ax, profile):
    """Rays from the array until they bounce."""
    depths = np.union1d(profile.depths, np.arange(0, 1000.0, 5))
    depths = depths[depths <= profile.depths[-1]]
    fine, bottom = SoundSpeedProfile(depths, profile.speed_at(depths)), profile.depths[-1]
    for angle in np.radians(np.arange(-14.75, 15, 0.5)):
        x, z = trace_ray(fine, conical.ARRAY_DEPTH, angle, FARTHEST, bottom).T
        bounced = np.flatnonzero(z[1:] <= 0)
        last = bounced[0] + 2 if len(bounced) else len(x)
        ax.plot(x[:last] / 1e3, z[:last], color="0.45", linewidth=0.6)


def _bars(ax, heard, distance):
    """Where direct sound is not weaker than a hundredth of that along a straight line."""
    for row, (distances, levels) in enumerate(heard.values()):
        step, loud = distances[1] - distances[0], np.concatenate([[False], levels >= QUIET, [False]])
        starts, ends = (np.flatnonzero(np.diff(loud.astype(int)) == turn) for turn in (1, -1))
        spans = [
            ((distances[i] - step / 2) / 1e3, (j - i) * step / 1e3) for i, j in zip(starts, ends, strict=True)
        ]
        ax.broken_barh(spans, (row - 0.3, 0.6), facecolor="0.35")
    ax.axvline(distance / 1e3, color=figures.colour("target"), linewidth=2)
    ax.annotate(
        "the paper's target", (distance / 1e3, -0.75), xytext=(5, 0), textcoords="offset points",
        color=figures.colour("target"), fontweight="bold", va="center", annotation_clip=False,
    )  # fmt: skip
    ax.set_yticks(range(len(heard)), heard)
    ax.set(xlabel="Distance (km)", xlim=(0, FARTHEST / 1e3), ylim=(len(heard) - 0.5, -1.1))
    ax.grid(False)


def bias_maps(ranges, maps, limit, point):
    """Bias in units of the bound over range and depth of the bottom; a row a place, a column a way to steer.

    Parameters
    ----------
    ranges : ndarray, shape (R,)
        In metres.
    maps : dict from place to (bottom depths, dict from title to sizes of shape (D, R))
    limit : float
        Beyond it the truth is outside the confidence region; a thick line.
    point : tuple of float
        Range and bottom depth of the paper's scenario.
    """
    fig, axes = plt.subplots(2, 2, figsize=(7.0, 5.6), sharex=True, sharey="row")
    for row, (place, (bottoms, sizes)) in zip(axes, maps.items(), strict=True):
        for ax, (title, size) in zip(row, sizes.items(), strict=True):
            shown = (ranges / 1e3, bottoms / 1e3, size)
            filled = ax.contourf(*shown, levels=LEVELS, cmap="cividis_r")
            lines = ax.contour(*shown, levels=LEVELS[1:-1], colors="black", linewidths=0.5)
            ax.clabel(lines, fontsize=8, fmt="%g")
            ax.contour(*shown, levels=[limit], colors="black", linewidths=2.2)
            ax.set_facecolor("0.88")
            ax.plot(*np.divide(point, 1e3), "X", color="white", markeredgecolor="black", markersize=9)
            ax.set_title(f"{place}\n{title}", fontsize=9.5)
            ax.grid(False)
        row[0].set(ylabel="Depth of the bottom (km)", ylim=(bottoms[-1] / 1e3, bottoms[0] / 1e3))
    for ax in axes[1]:
        ax.set_xlabel("Range of the target (km)")
    fig.colorbar(filled, ax=axes, label="Bias in units of the bound", shrink=0.7, ticks=LEVELS)
    return fig
