"""`emw-acoustic`: what the chapters draw more than once.

Figures 2-7 of the paper and two of our own are shared by the six scenarios; the axis with a place for each
component of each scenario by the figures of the bounds.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ... import figures
from . import experiments
from . import scenarios as emw

ESTIMATORS = ("mle", "ekf")
COMPONENTS = ("$x_T$", "$y_T$", r"$\dot x_T$", r"$\dot y_T$")


def clouds(number, positions):
    """Figures 2-7: (a) and (b) courses, ellipses and the clouds of MLE and EKF; (c) and (d) their ends.

    ``positions`` is what `experiments.positions_at_instants` gives.
    """
    scenario, shapes = emw.scenario(number), experiments.ellipses(number)
    times = scenario.sensors[1].times
    courses = {"observer": scenario.platform.position_at(times), "target": scenario.target.position_at(times)}
    outlines = [shape.boundary() for shape in shapes]
    ends = [np.quantile(positions[name][:, -1], [0.03, 0.97], axis=0) for name in ESTIMATORS]
    boxes = (_box([*courses.values(), *outlines]), _box([outlines[-1], *ends], margin=0.25))
    figure, axes = plt.subplots(2, 2, figsize=(7.2, 7.4))
    for column, name in enumerate(ESTIMATORS):
        for row, ax in enumerate(axes[:, column]):
            for k, shape in enumerate(shapes):
                label = (name.upper(), "90 % ellipse") if k == 0 else (None, None)
                figures.cloud(ax, positions[name][:, k], name, label=label[0], size=6)
                figures.ellipse(ax, shape, label=label[1], linewidth=0.6 + 0.7 * row)
            marks = "OT" if row == 0 else ("", "")
            figures.path(ax, courses["observer"], "platform", label="observer", mark=marks[0])
            figures.path(ax, courses["target"], "target", label="target", mark=marks[1])
            figures.map_axes(ax)
            ax.set_title(
                f"({'abcd'[2 * row + column]}) {name.upper()}{', the end' * row}", loc="left", fontsize=10
            )
            ax.set(xlim=boxes[row][0], ylim=boxes[row][1], aspect="equal", adjustable="box")
    entries = [dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True)) for ax in axes[0]]
    entries = entries[0] | entries[1]
    names = ("MLE", "EKF", "90 % ellipse", "observer", "target")
    handles = [entries[label] for label in names]
    figure.legend(handles, names, loc="outside upper center", ncols=5, fontsize=9, markerscale=4)
    return figure


def _box(paths, margin=0.08):
    """Limits in kilometres of a square around all points of the paths."""
    points = np.concatenate(paths) / 1e3
    low, high = points.min(axis=0), points.max(axis=0)
    half = (0.5 + margin) * np.max(high - low)
    return [(m - half, m + half) for m in (low + high) / 2]


def histograms(number, errors):
    """Histograms of the `line_of_sight.errors` at the three instants, with the bound's Gaussian.

    The axes hold at least 98 % of the errors, and those outside are counted at the edge; the scale of the
    density is that of its square root, so that a spike leaves the bound visible.
    """
    figure, axes = plt.subplots(1, 3, figsize=(7.2, 3.1), sharey=True)
    for k, (ax, time) in enumerate(zip(axes, emw.instants(number), strict=True)):
        every = np.concatenate([errors[name][:, k] for name in ESTIMATORS])
        low, high = np.quantile(every, [0.01, 0.99])
        bins = np.arange(min(np.floor(low), -4), max(np.ceil(high), 4) + 0.25, 0.25)
        for name, fill, alpha in (("ekf", True, 0.55), ("mle", False, 1.0)):
            density = np.histogram(errors[name][:, k], bins)[0] / (0.25 * len(errors[name]))
            look = dict(fill=fill, alpha=alpha, linewidth=1.6, color=figures.colour(name), label=name.upper())
            ax.stairs(density, bins, **look)
        for side, at, outside in (
            ("left", 0.02, {name: np.sum(errors[name][:, k] < bins[0]) for name in ESTIMATORS}),
            ("right", 0.98, {name: np.sum(errors[name][:, k] > bins[-1]) for name in ESTIMATORS}),
        ):
            beyond = [f"{name.upper()}: {runs}" for name, runs in outside.items() if runs]
            if beyond:
                text = "\n".join(["◂ beyond" if side == "left" else "beyond ▸", *beyond])
                ax.annotate(text, (at, 0.97), xycoords="axes fraction", ha=side, va="top", fontsize=8)
        fine = np.linspace(-4, 4, 161)
        ax.plot(fine, np.exp(-(fine**2) / 2) / np.sqrt(2 * np.pi), color="black", linewidth=1, label="bound")
        ax.set_xlabel(f"Error at {time:.0f} s (σ)")
        ax.set_yscale("function", functions=(lambda y: np.sqrt(np.maximum(y, 0)), np.square))
    axes[0].set(ylabel="Density", ylim=0)
    axes[0].set_yticks([0, 0.1, 0.4, 1, 2, 3], ["0", "0.1", "0.4", "1", "2", "3"])
    axes[0].set_ylim(0, 1.15 * max(ax.dataLim.ymax for ax in axes))
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, fontsize=9)
    return figure


def shares_over_time(number, clouds, found):
    """Two shares against time: the clouds in the ellipse of the bound, the truth in that of the filter.

    Left, ``clouds`` as `against_bound` gives them: does the estimator reach the bound? Right, ``found`` as
    `experiments.consistency_of_both` gives it: does the filter know how good it is? The grey band is where
    90 % lies with 90 % probability.
    """
    from scipy.stats import binom

    times = experiments.check_times(number)
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.0), sharey=True)
    for name, marker, style in zip(ESTIMATORS, "o^", ("-", "--"), strict=True):
        look = {"color": figures.colour(name), "marker": marker, "markersize": 4, "label": name.upper()}
        look["linestyle"] = style
        left.plot(times, 100 * clouds[f"{name}_inside"].mean(axis=0), **look)
    right.plot(times, 100 * found["ekf_inside"].mean(axis=0), **look)
    for ax, runs in ((left, len(clouds["mle_inside"])), (right, len(found["ekf_inside"]))):
        band = 100 * binom.ppf([0.05, 0.95], runs, 0.9) / runs
        ax.axhspan(*band, color="#D8D8D8", label="90 %")
        ax.set(xlabel="Time (s)", ylim=(-2, 102))
    left.set(ylabel="Share of the runs (%)", title="Estimate in the bound's ellipse")
    right.set_title("Truth in the filter's own ellipse")
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, fontsize=8)
    return figure


def by_component(ax, numbers=range(1, 7)):
    """Give an axis four places a scenario, one a component; returns the places, ``(scenarios, 4)``."""
    places = 5.0 * np.arange(len(numbers))[:, None] + np.arange(4)
    ax.set_xticks(places.ravel(), COMPONENTS * len(numbers), fontsize=8)
    for k, where in zip(numbers, places, strict=True):
        ax.annotate(
            f"scenario {k}", (where.mean(), 0), xycoords=("data", "axes fraction"), xytext=(0, -30),
            textcoords="offset points", ha="center", fontsize=9,
        )  # fmt: skip
    ax.grid(axis="x", visible=False)
    return places
