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
    figure, axes = plt.subplots(2, 2, figsize=(7.6, 7.2))
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
            letter = f"({'abcd'[2 * row + column]})"
            ax.annotate(letter, (0.03, 0.93), xycoords="axes fraction", fontweight="bold")
            ax.set(xlim=boxes[row][0], ylim=boxes[row][1], aspect="equal", adjustable="box")
    for ax in axes[0]:
        ax.legend(loc="best", fontsize=8)
    return figure


def _box(paths, margin=0.08):
    """Limits in kilometres of a square around all points of the paths."""
    points = np.concatenate(paths) / 1e3
    low, high = points.min(axis=0), points.max(axis=0)
    half = (0.5 + margin) * np.max(high - low)
    return [(m - half, m + half) for m in (low + high) / 2]


def histograms(number, errors):
    """Histograms of the `line_of_sight.errors` at the three instants, with the bound's Gaussian."""
    figure, axes = plt.subplots(1, 3, figsize=(7.6, 2.8), sharey=True)
    bins = np.linspace(-4, 4, 33)
    for k, (ax, time) in enumerate(zip(axes, emw.instants(number), strict=True)):
        for name in ESTIMATORS:
            look = dict(histtype="step", linewidth=1.6, color=figures.colour(name), label=name.upper())
            runs = len(errors[name])
            density = np.full(runs, 4 / runs)  # over all runs, those outside the bins too
            ax.hist(errors[name][:, k], bins, weights=density, **look)
        ax.plot(bins, np.exp(-(bins**2) / 2) / np.sqrt(2 * np.pi), color="black", linewidth=1, label="bound")
        ax.set_xlabel(f"Error at {time:.0f} s (σ)")
    axes[0].set_ylabel("Density")
    axes[0].legend(fontsize=8)
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
    for name, marker in zip(ESTIMATORS, "o^", strict=True):
        look = {"color": figures.colour(name), "marker": marker, "markersize": 4, "label": name.upper()}
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
