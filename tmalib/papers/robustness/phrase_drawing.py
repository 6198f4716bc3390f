"""`robustness`: drawing in which plausible scenarios the phrases hold."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ... import figures
from ...judging import share_interval
from ...judging.verdict import FEW, MOST

MARGINS = 0.05, 50.0  # edges of the drawing of all scenarios
MARKS = "os^vP"  # of the forms of the manoeuvre
ENTITIES = ("mle", "platform", "target", "light", "null")


def in_scenarios(phrases, reference, values):
    """Figure: all phrases in all scenarios, a row each, by how many times better than the limit they are.

    Parameters
    ----------
    phrases : dict
        Name to `judging.Phrase`.
    reference : dict
        Name to number, in the reference scenario: a diamond.
    values : dict
        Name to numbers ``(n,)``, in the scenarios that count: dots; how many hold stands at the right.
    """
    fig, ax = plt.subplots(figsize=(7.2, 7.2))
    low, high = MARGINS
    ax.axvspan(1, high, color="#F0F0F0", zorder=0)
    ax.axvline(1, color="black", linewidth=1)
    rng = np.random.default_rng(0)
    for place, (name, phrase) in enumerate(phrases.items()):
        holds, margins = phrase.holds(values[name]), phrase.margin(values[name])
        _margins(ax, margins, place + rng.uniform(-0.24, 0.24, len(margins)), holds)
        here = np.clip(phrase.margin(reference[name]), low, high)
        ax.plot(here, place, "D", color="black", markersize=6, markerfacecolor="white")
        at = {"xy": (1.01, place), "xycoords": ("axes fraction", "data")}
        ax.annotate(f"{holds.sum()} of {len(holds)}", **at, va="center", fontsize=8)
    ax.set_xscale("log")
    ax.set_xlim(low * 0.9, high * 1.1)
    ax.set_yticks(range(len(phrases)), phrases)
    ax.invert_yaxis()
    ax.set_xlabel("Times better than the limit")
    ax.annotate("holds", (1.1, 1.01), xycoords=("data", "axes fraction"), fontsize=9)
    ax.annotate("does not hold", (0.9, 1.01), xycoords=("data", "axes fraction"), fontsize=9, ha="right")
    return fig


def _margins(ax, margins, heights, holds):
    """Dots at margins ``(n,)``, green where the phrase ``holds``; triangles for those beyond the edges."""
    low, high = MARGINS
    x = np.clip(np.nan_to_num(margins, nan=0.0), low, high)
    inside = (x > low) & (x < high)
    for good, entity in ((True, "mle"), (False, "target")):
        style = {"color": figures.colour(entity), "markersize": 3, "alpha": 0.5, "markeredgewidth": 0}
        for there, marker in ((x == low, "<"), (x == high, ">"), (inside, "o")):
            some = there & (holds == good)
            ax.plot(x[some], heights[some], marker, clip_on=False, **style)


def shares_by_form(overall, by_form):
    """Figure: share of scenarios in which each phrase holds, with its interval, a row a phrase.

    Parameters
    ----------
    overall : dict
        Phrase to a pair, held and scenarios: black, the interval as a bar.
    by_form : dict
        Form of the manoeuvre to such a dict: a mark each, with its interval.
    """
    fig, ax = plt.subplots(figsize=(7.2, 7.6))
    ax.axvspan(FEW, MOST, color="#F0F0F0", zorder=0)
    looks = zip(by_form.items(), MARKS, ENTITIES, strict=False)
    for row, ((form, shares), mark, entity) in enumerate(looks):
        look = {"color": figures.colour(entity), "marker": mark, "markersize": 4, "label": form}
        _intervals(ax, shares, (row + 1) * 0.64 / len(by_form) - 0.32, linewidth=0.8, **look)
    _intervals(ax, overall, -0.32, color="black", marker="D", markersize=5, linewidth=2, label="all")
    ax.set_yticks(range(len(overall)), overall)
    ax.invert_yaxis()
    ax.set(xlim=(-0.01, 1.01), xlabel="Share of plausible scenarios in which the phrase holds")
    ax.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=len(by_form) + 1, fontsize=8)
    return fig


def _intervals(ax, shares, shift, **look):
    """Shares and their intervals, one below the other; none where no scenario counts."""
    found = [(place, *pair) for place, pair in enumerate(shares.values()) if pair[1]]
    places, held, scenarios = np.array(found).T
    bars = np.array([share_interval(*map(int, pair)) for pair in zip(held, scenarios, strict=True)]).T
    ax.hlines(places + shift, *bars, color=look["color"], linewidth=look.pop("linewidth"))
    ax.plot(held / scenarios, places + shift, linestyle="none", **look)


def shares_against_limits(phrases, values, names):
    """Figure: share of scenarios in which a phrase would hold, against the limit asked of its measure.

    Parameters
    ----------
    phrases, values : dict
        As in `in_scenarios`.
    names : sequence of str
        The phrases to draw, those with a single limit.
    """
    columns = 3
    rows = -(-len(names) // columns)
    fig, axes = plt.subplots(rows, columns, figsize=(7.6, 2.3 * rows), sharey=True, squeeze=False)
    for ax, name in zip(axes.ravel(), names, strict=False):
        least, most = phrases[name].at_least, phrases[name].at_most
        asked = most if least is None else least
        limits = asked * np.geomspace(0.2, 5, 61)
        value = values[name][:, None]
        held = np.sum(value <= limits if least is None else value >= limits, axis=0)
        bars = np.array([share_interval(int(each), len(value)) for each in held]).T
        ax.fill_between(limits, *bars, color=figures.colour("null"), alpha=0.35, lw=0)
        ax.semilogx(limits, held / len(value), color="black")
        ax.axvline(asked, color=figures.colour("target"), linestyle="--", linewidth=1)
        ticks = asked * np.array([0.2, 0.5, 1, 2, 5])
        ax.set_xticks(ticks, [f"{tick:.2g}" for tick in ticks])
        ax.minorticks_off()
        ax.set(ylim=(0, 1), xlim=limits[[0, -1]])
        ax.set_title(name, fontsize=9)
    for ax in axes.ravel()[len(names) :]:
        ax.remove()
    for ax in axes[:, 0]:
        ax.set_ylabel("Share that holds")
    for ax in axes[-1]:
        ax.set_xlabel("Limit")
    return fig
