"""`conical-angles`: drawings of the chapters on the measurement and on Theorems 1 and 2.

Lengths come in metres. Maps are in kilometres, vertical sections have the depth downwards in metres.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ... import figures
from ...bearings import bearing
from ...cones import image_depth
from . import theorem_scenes as scenes

GREY = "#7F7F7F"
DARK_GREY = "#5F5F5F"
WATER = "#DCEAF5"

# -- the measurement -----------------------------------------------------------------------------------------


def lines_of_sight(ax, heading, target, mirror):
    """Map of an array at the origin with its heading h, a target, its bearing theta, and the line of sight
    that gives the same measurement, to ``mirror``."""
    array, along = np.zeros(2), np.array([np.sin(heading), np.cos(heading)])
    figures.path(ax, [array - 1500 * along, array + 4500 * along], "platform", label="array and its course")
    figures.path(ax, [target, target + [1400, 1400]], "target", label="target and its course")
    ax.plot(*np.stack([array, target], 1) / 1e3, color="black", linewidth=1)
    ax.plot(*np.stack([array, mirror], 1) / 1e3, "--", color="black", linewidth=1, label="same measurement")
    ax.plot([0, 0], [0, 4.6], color=GREY, linewidth=1)
    for radius, angle, text in ((1.3, heading, "$h$"), (2.2, bearing(target), r"$\theta$")):
        arc = np.linspace(0, angle, 41)
        curve = radius * np.stack([np.sin(arc), np.cos(arc)])
        ax.plot(*curve, color="#555555", linewidth=1)
        ax.annotate(text, curve[:, 20], xytext=(2, 5), textcoords="offset points")
    ax.annotate("North", (0, 4.6), xytext=(4, 0), textcoords="offset points", color=DARK_GREY)
    for point, text in ((array, "$P_O$"), (target, "$P_T$")):
        ax.plot(*point / 1e3, "o", color="black", markersize=5)
        ax.annotate(text, point / 1e3, xytext=(8, -12), textcoords="offset points")
    figures.map_axes(ax)
    ax.legend(loc="lower right")


def folded(depth, bottom):
    """Depth in the water, between 0 and ``bottom``, of a point of an unfolded ray at ``depth``."""
    depth = np.mod(depth, 2 * bottom)
    return np.where(depth > bottom, 2 * bottom - depth, depth)


def _ends_of_rays(ax, array_depth, target_depth, distance):
    ax.plot(0, array_depth, "s", color=figures.colour("platform"), label="array")
    ax.plot(distance / 1e3, target_depth, "o", color=figures.colour("target"), label="target")


def rays_and_images(ax, paths, array_depth, target_depth, bottom, distance):
    """Vertical section with three rays, ``paths`` by name, and the straight lines to their images."""
    ax.axhspan(-250, 0, color=WATER)
    ax.axhspan(bottom, 16000, color="#E9E2D6")
    x = np.linspace(0, distance, 2001)
    looks = (("-", "light"), ("-.", "sound"), ("--", "mle"))
    for (name, path), (style, entity) in zip(paths.items(), looks, strict=True):
        colour = figures.colour(entity)
        depth = array_depth + image_depth(path, target_depth, array_depth, bottom) * x / distance
        ax.plot(x / 1e3, folded(depth, bottom), style, color=colour, label=name)
        if not path.is_direct:
            ax.plot(x / 1e3, depth, style, color=colour, linewidth=0.7)
            ax.plot(distance / 1e3, depth[-1], "o", markerfacecolor="none", color=colour)
    _ends_of_rays(ax, array_depth, target_depth, distance)
    ax.set(ylim=(16200, -250), xlabel="Horizontal distance (km)", ylabel="Depth (m)")
    ax.grid(False)
    for text, depth in (("surface", 0), ("bottom", bottom)):
        beside = {"xytext": (4, 0), "textcoords": "offset points", "va": "center", "color": DARK_GREY}
        ax.annotate(text, (1, depth), xycoords=("axes fraction", "data"), **beside)
    for text, depth in (("image", 7900), ("image", 15900)):
        ax.annotate(text, (distance / 1e3, depth), xytext=(-8, -3), textcoords="offset points", ha="right")
    ax.set_yticks(range(0, 16001, 4000))
    ax.legend(loc="lower left", fontsize=9)


def cones(ax, target, image):
    """Half cones around the north, the axis of an array at the origin, through a target and its image.

    Both are (east, north, down) from the array; ``ax`` has three dimensions.
    """
    turn, reach = np.meshgrid(np.linspace(0, 2 * np.pi, 61), np.linspace(0, 9000, 10))
    for point, colour in ((image, figures.colour("sound")), (target, figures.colour("light"))):
        slope = np.hypot(point[0], point[2]) / point[1]
        cone = np.stack([slope * reach * np.cos(turn), reach, slope * reach * np.sin(turn)]) / 1e3
        ax.plot_surface(*cone, color=colour, alpha=0.18, linewidth=0, rasterized=True)
        ax.plot(*np.stack([np.zeros(3), point], 1) / 1e3, color=colour, linewidth=1.6)
        ax.scatter(*point / 1e3, color=colour, s=25)
    ax.plot([0, 0], [0, 9], [0, 0], color="black", linewidth=1.5)
    ax.text(*(target / 1e3), "  target")
    ax.text(*(image / 1e3), "  image")
    ax.set(xlabel="East (km)", ylabel="North, the array's axis (km)", zlabel="Depth below array (km)")
    ax.invert_zaxis()
    ax.view_init(18, -62)


def elevations(ax, zetas, array_depth, target_depth, bottom, distance):
    """Vertical section with the direct and the bottom-bounced ray and the elevation of each.

    ``zetas`` has the depth of the image below the array for "direct" and "bottom bounce".
    """
    x = np.linspace(0, distance, 1001)
    looks = {"direct": ("light", 4.6, -16), "bottom bounce": ("sound", 2.2, 4)}  # and where its label is
    for name, (entity, reach, shift) in looks.items():
        zeta, colour = zetas[name], figures.colour(entity)
        style = "-" if name == "direct" else "-."
        ax.plot(x / 1e3, folded(array_depth + zeta * x / distance, bottom), style, color=colour, label=name)
        ax.annotate(
            rf"$\phi^{{{name[0].upper()}}}$ = {np.degrees(np.arctan2(zeta, distance)):.1f}°",
            (reach, array_depth + zeta * reach * 1e3 / distance),
            xytext=(6, shift), textcoords="offset points", color=colour,
        )  # fmt: skip
    _ends_of_rays(ax, array_depth, target_depth, distance)
    ax.axhline(bottom, color="#8C7B5E")
    ax.annotate("bottom", (0.2, bottom), xytext=(0, 4), textcoords="offset points", color=DARK_GREY)
    ax.set(ylim=(4200, -400), xlabel="Horizontal distance (km)", ylabel="Depth (m)")
    ax.legend(loc="upper left", bbox_to_anchor=(1, 1), fontsize=9)


# -- Theorem 1 -----------------------------------------------------------------------------------------------


def ghosts_from_above(ax, scenario, ghosts, case, linewidth=1.2):
    """Map relative to the array of one leg, which points up: target and ghosts, each with a dot at its start.

    ``case`` is written into a corner. A ghost at relative rest is a dot.
    """
    for ghost in ghosts:
        track = scenes.relative(scenario, ghost, scenario.times) / 1e3
        at_rest = np.ptp(track, axis=0).max() < 1e-6
        ax.plot(*track[0], "o", markersize=4, color=figures.colour("mle"))
        if not at_rest:
            head = dict(arrowstyle="->", color=figures.colour("mle"), lw=linewidth, shrinkA=0, shrinkB=0)
            ax.annotate("", track[-1], track[0], arrowprops=head)
    track = scenes.relative(scenario, scenario.target, scenario.times) / 1e3
    arrow = dict(arrowstyle="-|>", color=figures.colour("target"), lw=2.5, shrinkA=0, shrinkB=0)
    ax.annotate("", track[-1], track[0], arrowprops=arrow)
    ax.plot(*track[0], "D", markersize=7, color=figures.colour("target"))
    ax.plot(0, 0, "s", markersize=7, color=figures.colour("platform"))
    axis = dict(arrowstyle="-", color=figures.colour("platform"), lw=2)
    ax.annotate("", (0, 1.5), (0, 0), arrowprops=axis)
    ax.set_title(case, loc="left", fontsize=10)
    ax.set(xlim=(-9.5, 9.5), ylim=(-4, 4) if case == "broadside" else (-1, 11), aspect="equal")
    ax.set(xlabel="Across the axis (km)", ylabel="Along the axis (km)")


def _along_the_axis(ax, scenario, markersize):
    across, _ = scenes.relative(scenario, scenario.target, 0.0)
    target = figures.colour("target")
    ax.plot(across, scenario.target.depth, "o", markersize=markersize, color=target)
    ax.plot(0, scenes.ARRAY_DEPTH, "s", color=figures.colour("platform"))
    ax.axhspan(-120, 0, color=WATER)
    ax.set(xlim=(-1600, 1600), ylim=(1500, -120), xlabel="Across the axis (m)", aspect="equal")
    ax.set_xticks([-1000, 0, 1000])


def circles_around_the_axis(ax, scenario, circles):
    """Section across the array's axis: the target and what of ``circles``, ``(across, depth)`` by beta, is
    in the water."""
    for (beta, (across, depths)), style in zip(circles.items(), (":", "-", "--"), strict=True):
        wet = depths >= 0
        arc = np.where(wet, across, np.nan), np.where(wet, depths, np.nan)
        ax.plot(*arc, style, color=figures.colour("mle"))
        lowest = (0, depths.max())
        plain = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none"}
        ax.annotate(rf"$\beta = {beta:g}$", lowest, ha="center", va="center", fontsize=9, bbox=plain)
    _along_the_axis(ax, scenario, markersize=6)


def half_lines_from_the_axis(ax, scenario, half_lines):
    """Section across the array's axis: the target and, at the start, the ghosts of each list of
    ``half_lines``."""
    for ghosts in half_lines:
        across = [scenes.relative(scenario, ghost, 0.0)[0] for ghost in ghosts]
        depths = [ghost.depth for ghost in ghosts]
        ax.plot(across, depths, "-o", markersize=3, color=figures.colour("mle"))
    _along_the_axis(ax, scenario, markersize=8)


# -- Theorem 2 -----------------------------------------------------------------------------------------------


def two_leg_maps(panels, with_line_of_sight=()):
    """Six maps of two legs, as a figure: ``panels`` has a scenario and its ghosts by the panel's letter.

    Dots are positions at the turn, arrowheads are at the end; some panels have the line of sight at the turn,
    dotted.
    """
    fig, axes = plt.subplots(2, 3, figsize=(7.6, 5.6))
    for (letter, (scenario, ghosts)), ax in zip(panels.items(), axes.flat, strict=True):
        _two_leg_map(ax, scenario, ghosts, letter in with_line_of_sight)
        ax.annotate(f"({letter})", (0.02, 0.98), xycoords="axes fraction", va="top", fontweight="bold")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper center", ncols=3)
    for ax in axes[0]:
        ax.set_xlabel("")
    for ax in axes[:, 1:].flat:
        ax.set_ylabel("")
    return fig


def _two_leg_map(ax, scenario, ghosts, line_of_sight):
    times, turn = np.linspace(0, 2 * scenes.TURN, 121), scenes.TURN
    figures.path(ax, scenario.platform.position_at(times), "platform", label="array", linewidth=2.5)
    figures.path(ax, scenario.target.position_at(times), "target", linewidth=3)
    if line_of_sight:
        line = np.stack([np.zeros(2), 1.8 * scenario.target.position_at(turn)], axis=1)
        ax.plot(*line / 1e3, ":", color=GREY, linewidth=1)
    for j, ghost in enumerate(ghosts):
        label = "ghost" if j == 0 else "_"
        figures.path(ax, ghost.position_at(times), "mle", label=label, linestyle="--")
    for motion, entity in ((scenario.target, "target"), *((ghost, "mle") for ghost in ghosts)):
        ax.plot(*motion.position_at(turn) / 1e3, "o", color=figures.colour(entity), markersize=4)
        _arrowhead(ax, motion, times[-1], entity)
    _arrowhead(ax, scenario.platform, times[-1], "platform")
    figures.map_axes(ax)
    ax.xaxis.set_major_locator(plt.MaxNLocator(4))


def _arrowhead(ax, motion, time, entity):
    """Where a motion goes; nothing at rest."""
    tail, tip = motion.position_at(np.array([0.98, 1.0]) * time) / 1e3
    if np.hypot(*(tip - tail)) > 1e-6:
        head = dict(arrowstyle="-|>", color=figures.colour(entity), mutation_scale=11, shrinkA=0, shrinkB=0)
        ax.annotate("", tip, tail, arrowprops=head)


def _beside_the_array(ax):
    ax.axhline(0, color=GREY, linewidth=1)
    ax.plot(0, scenes.ARRAY_DEPTH, "s", color=figures.colour("platform"), label="array")
    ax.set_xlabel("Horizontal distance (km)")


def depth_mirror(ax, distance, target, ghost):
    """Section along the array's axis: target and ghost at the same distance, above and below the array."""
    for motion, entity, label in ((target, "target", "target"), (ghost, "mle", "ghost")):
        colour = figures.colour(entity)
        ax.plot([0, distance / 1e3], [scenes.ARRAY_DEPTH, motion.depth], ":", color=colour, linewidth=1)
        ax.plot(distance / 1e3, motion.depth, "o", color=colour, label=label)
    _beside_the_array(ax)
    ax.set_ylabel("Depth (m)")
    ax.set_ylim(560, -160)


def ring_of_ghosts(ax, target, ghosts, in_water):
    """Section along the legs of a U-turn: the ring of ghosts at the turn, solid where it is in the water."""
    across = np.array([ghost.position_at(scenes.TURN)[0] / 1e3 for ghost in ghosts])
    depths = np.array([ghost.depth for ghost in ghosts])
    colour = figures.colour("mle")
    ax.plot(across, depths, ":", color=colour, linewidth=1)
    ax.plot(across, np.where(in_water, depths, np.nan), color=colour, label="ghosts")
    place = target.position_at(scenes.TURN)[0] / 1e3
    ax.plot(place, target.depth, "o", color=figures.colour("target"), label="target")
    _beside_the_array(ax)
