"""Drawings of the chapter on the best manoeuvre: maps, headings, and what rules of thumb cost."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from .. import figures
from ..bounds import crlb
from ..ellipse import confidence_ellipse

LINES = {  # colour and dash of a course, by what it is
    "paper": {"entity": "null", "linestyle": ":", "linewidth": 2.0},
    "best": {"entity": "platform", "linestyle": "-"},
    "rule": {"entity": "light", "linestyle": "--"},
    "away": {"entity": "mle", "linestyle": "-."},
}


def maps(left, right):
    """Two maps, the array's and the aircraft's.

    Parameters
    ----------
    left, right : (problem, {label: (kind, course)})
        Kinds are the keys of `LINES`. On the left the 90 % ellipses of the first position are drawn, too.
    """
    figure, axes = plt.subplots(1, 2, figsize=(7.0, 4.1))
    for ax, (problem, courses) in zip(axes, (left, right), strict=True):
        times = np.unique(problem.scenario.times)
        for label, (kind, course) in courses.items():
            line = dict(LINES[kind])
            figures.path(ax, course.position_at(times), line.pop("entity"), label, **line)
            ax.plot(
                *course.position_at(times[-1:]).T / 1e3,
                "s",
                color=figures.colour(LINES[kind]["entity"]),
                ms=4,
            )
        figures.path(ax, problem.scenario.target.position_at(times), "target", "target")
        ax.plot(
            *problem.scenario.target.position_at(times[-1:]).T / 1e3,
            "s",
            color=figures.colour("target"),
            ms=4,
        )
        figures.map_axes(ax, step=2)
    for kind, course in left[1].values():
        _ellipse(axes[0], left[0].scenario, course, LINES[kind])
    axes[0].set_title("Towed array, 800 s", fontsize=10)
    axes[1].set_title("Aircraft, 20 s", fontsize=10)
    for ax in axes:
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), fontsize=8, ncols=1)
    return figure, axes


def _ellipse(ax, scenario, course, line):
    from dataclasses import replace

    scenario = replace(scenario, platform=course)
    shape = confidence_ellipse(scenario.state, crlb(scenario))
    x, y = shape.boundary().T / 1e3
    ax.plot(x, y, color=figures.colour(line["entity"]), linestyle=line["linestyle"], linewidth=1.3)


def headings(lines):
    """Headings against the share of the time; ``{label: (kind, problem, course, first bearing)}``."""
    figure, ax = plt.subplots(figsize=(6.4, 3.6))
    for label, (kind, problem, course, toward) in lines.items():
        times = np.unique(problem.scenario.times)
        angle = np.degrees(course.heading_at(times) - toward)
        angle -= 360 * np.round((angle[0] - 90) / 360)
        line = dict(LINES[kind])
        share = (times - times[0]) / np.ptp(times)
        ax.plot(share, angle, color=figures.colour(line.pop("entity")), label=label, **line)
    ax.set_yticks(
        [-90, 0, 90, 180, 270], ["across, left", "towards", "across, right", "away", "across, left"]
    )
    ax.set(xlabel="Share of the time", ylabel="Heading", xlim=(0, 1), ylim=(-125, 300))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
    return figure, ax


def costs(panels):
    """What rules cost: a dot for the median of the ratio to the best, a bar from the 10 to the 90 % quantile.

    Parameters
    ----------
    panels : {title: {rule: (with, against)}}
        Ratios ``(runs,)``; `None` for a side, or a rule, that there is not.
    """
    figure, axes = plt.subplots(1, 2, figsize=(7.0, 3.6), sharey=True)
    names = list(next(iter(panels.values())))
    marks = {"with the target first": ("o", "platform", -0.13), "against it first": ("D", "light", 0.13)}
    for ax, (title, rules) in zip(axes, panels.items(), strict=True):
        for side, (label, (mark, entity, shift)) in enumerate(marks.items()):
            for row, name in enumerate(names):
                ratio = (rules[name] or (None, None))[side]
                if ratio is None:
                    continue
                low, middle, high = np.quantile(ratio, [0.1, 0.5, 0.9])
                colour = figures.colour(entity)
                ax.plot([low, high], [row + shift] * 2, color=colour, linewidth=1.6)
                filled = colour if side == 0 else "white"
                ax.plot(
                    middle, row + shift, mark, color=colour, markerfacecolor=filled, ms=6,
                    label=label if row == 0 else None,
                )  # fmt: skip
        ax.axvline(1.0, color="black", linewidth=0.8)
        ax.set_xscale("log")
        ax.set_xticks([1, 2, 5, 10, 20, 50], ["1", "2", "5", "10", "20", "50"])
        ax.minorticks_off()
        ax.set(xlim=(0.85, 80), title=title)
        ax.title.set_fontsize(10)
    axes[0].set_yticks(range(len(names)), names)
    axes[0].set_ylim(len(names) - 0.5, -0.5)
    figure.supxlabel("Times the best for the target", fontsize=10)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=8)
    return figure, axes
