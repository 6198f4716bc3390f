"""`robustness`, Section III: drawing periodic and random displacements, and what they do to the estimate."""

from __future__ import annotations

import numpy as np

from ... import figures
from .periodic import worst_phase

BEYOND = 500.0  # metres a metre: where a period stands at which not every phase has an estimate


def fitted_errors(ax, periods, errors, settled, amplitude, marker, *, filled):
    """Errors of fitted estimates per metre of amplitude, the worst over the phases, against the period.

    ``errors`` and ``settled``, ``(P, phases)``, are those of `periodic.fitted_phases`. A triangle at the
    upper edge stands for a period at which not every phase has an estimate.
    """
    colour, good = figures.colour("mle"), settled.all(axis=1)
    worst, face = errors.max(axis=1) / amplitude, colour if filled else "none"
    label = f"fitted, {amplitude:.0f} m"
    ax.plot(
        periods[good], worst[good], marker, color=colour, markerfacecolor=face, markersize=4.5, label=label
    )
    ax.plot(periods[~good], np.full(np.sum(~good), BEYOND), "^", color=colour, markersize=6)


def marked_period(ax, period, text):
    """A dashed vertical line at a period, with its name along it."""
    ax.axvline(period, color=figures.colour("platform"), linestyle="--", linewidth=1)
    look = {"color": figures.colour("platform"), "fontsize": 9, "va": "bottom", "ha": "right"}
    ax.text(period / 1.05, 0.08, text, **look)


def inset_near_one_sample(ax, scenario):
    """Inset at the upper left: error per metre, first order, for periods near one sample (40 ms)."""
    inset = ax.inset_axes([0.1, 0.66, 0.24, 0.32])
    near = np.linspace(0.0393, 0.0407, 3000)
    inset.semilogy(near * 1e3, worst_phase(scenario, near), color="black", linewidth=0.9)
    inset.set_xlabel("ms", fontsize=8, labelpad=1)
    inset.tick_params(labelsize=8)


def displaced_courses(ax, scenario, displacement, state):
    """Map of displaced target, platform and estimated uniform motion, ends of target and estimate circled.

    ``displacement``, ``(N, 2)``, is that of the scenario's uniform motion in metres; ``state``, ``(4,)``,
    the estimate at time 0.
    """
    times = scenario.times
    tracks = {
        "target": (scenario.target.position_at(times) + displacement, "target", 1.8, 10),
        "platform": (scenario.platform.position_at(times), "platform", 1.2, None),
        "BLS estimate": (state[:2] + times[:, None] * state[2:], "mle", 1.2, 6),
    }
    for label, (positions, entity, width, circle) in tracks.items():
        style = "--" if entity == "mle" else "-"
        figures.path(ax, positions, entity, label=label, linewidth=width, linestyle=style)
        if circle:
            mark = {"markerfacecolor": "none", "markersize": circle, "markeredgewidth": 1.5}
            ax.plot(*positions[-1] / 1e3, "o", color=figures.colour(entity), **mark)
    figures.map_axes(ax)
    ax.set(xlim=(-6.6, 1.8), ylim=(-2.4, 6.4), aspect="equal", adjustable="box")


def tenth_and_full_size(ax, places, tenth, full):
    """Root mean square errors of fits at a tenth of the size, times ten (dots), and at full size (squares).

    ``places`` are correlation times or periods in seconds, ``tenth`` and ``full`` metres, all ``(K,)``.
    """
    colour = figures.colour("mle")
    ax.plot(places, tenth, "o", color=colour, label="fitted, 1.5 m, ×10")
    ax.plot(places, full, "s", color=colour, markerfacecolor="none", markersize=8, label="fitted, 15 m")


def levels(ax, *, noise, independent):
    """Horizontal lines: what the noise of the bearings does, and independent perturbations, in metres."""
    ax.axhline(noise, color=figures.colour("target"), linewidth=1, label="noise of the bearings")
    ax.axhline(independent, color=figures.colour("null"), ls="-.", linewidth=1, label="independent, 15 m")


def against_gaussian(ax, errors, deviation):
    """Histogram of errors, in metres, and the Gaussian of a standard deviation; kilometres on the axis."""
    sd = deviation / 1e3
    reach, bins = np.linspace(-4 * sd, 4 * sd, 201), np.linspace(-4 * sd, 4 * sd, 33)
    ax.hist(errors / 1e3, bins, density=True, color=figures.colour("mle"), alpha=0.5)
    ax.plot(reach, np.exp(-0.5 * (reach / sd) ** 2) / (sd * np.sqrt(2 * np.pi)), color="black", linewidth=1.2)
    ax.set(xlabel="Error (km)", yticks=[])


def panel(ax, letter):
    """The letter of a panel in its upper left corner."""
    ax.text(0.03, 0.97, f"({letter})", transform=ax.transAxes, va="top", fontweight="bold")
