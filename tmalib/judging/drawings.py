"""The drawings that no chapter makes: the probabilities of all Monte-Carlo numbers, and the house.

If every printed number were right, a probability (`tmalib.judging.vector`) would be as often in one tenth of
its range as in another, or larger, because rounding is allowed for.
"""

import tomllib
from itertools import groupby
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from .. import figures
from .verdict import CORRECTED, INCONCLUSIVE, NOT_REPRODUCED, REPRODUCED, UNSPECIFIED

LOOKS = {  # marker, entity whose colour it has, filled or not, label
    REPRODUCED: ("o", "mle", "full", REPRODUCED),
    CORRECTED: ("o", "mle", "full", "reproduced, also after correction"),
    INCONCLUSIVE: ("D", "light", "full", INCONCLUSIVE),
    NOT_REPRODUCED: ("X", "target", "full", NOT_REPRODUCED),
    UNSPECIFIED: ("s", "null", "none", UNSPECIFIED),
}
TENTHS = np.linspace(0, 1, 11)
RARE = 2e-5  # the right end of the axis of probabilities; experiments end a little before
ROOMS = 6  # in a line of a floor of the house


def counts(claims):
    """What the text says about the figure; ``claims`` are all of the book."""
    tested = [c for c in claims if c.probability is not None]
    judged = [c for c in tested if c.verdict != UNSPECIFIED]
    far = [c for c in judged if c.verdict == NOT_REPRODUCED]
    near = [c for c in judged if c.verdict in (REPRODUCED, CORRECTED)]
    together = {c.key[:2]: c.together <= c.level_together for c in judged}
    return {
        "rows": len(judged),
        "tables": len(together),
        "assumed": len(tested) - len(judged),
        "far": len(far),
        "far-tables": len({c.key[:2] for c in far}),
        "largest": max((c.deviation for c in judged), default=0.0),
        "unsure": len(judged) - len(far) - len(near),
        "together": sum(together.values()),
        "near": len(near),
        "below": sum(c.probability < 0.05 for c in near),
        "below-expected": 0.05 * len(near),
        "above-half": sum(c.probability > 0.5 for c in near),
        "above-half-expected": 0.5 * len(near),
    }


def draw_tables(ax, claims, papers):
    """A line of points a table, its level, the table as a whole, and the names of the cells that fail."""
    place, ticks, shown = 0, {}, {}
    for key, found in groupby((c for c in claims if c.probability is not None), key=lambda c: c.paper):
        paper, look = papers[key], dict(va="center", fontsize=9)
        ax.annotate(paper.title, (1, place), (4, 0), textcoords="offset points", fontweight="bold", **look)
        for table, rows in groupby(found, key=lambda c: c.table):
            place, family = place + 1, sorted(rows, key=lambda c: c.probability)
            ticks[place] = paper.tables[table]
            ax.plot([family[0].level] * 2, [place - 0.4, place + 0.4], color="black", linewidth=1.2)
            for c in family:
                marker, entity, fill, label = LOOKS[c.verdict]
                look = dict(color=figures.colour(entity), fillstyle=fill, markersize=5, markeredgewidth=0.8)
                (shown[marker],) = ax.plot(c.probability, place, marker, label=label, alpha=0.8, **look)
            look = dict(color="black", fillstyle="none", markersize=8)
            (shown["H"],) = ax.plot(family[0].together, place, "H", label="the table together", **look)
            far = [c for c in family if c.verdict == NOT_REPRODUCED]
            names = ", ".join(f"{paper.columns[c.column]} {paper.rows[c.row]}" for c in far)
            ax.annotate(names, (1.01, place), xycoords=("axes fraction", "data"), va="center", fontsize=7.5)
        place += 1
    ax.set_yticks([*ticks], ticks.values())
    ax.set_xscale("log")
    ax.set(xlim=(1.3, RARE), ylim=(place - 0.3, -0.7))
    ax.set_xlabel("Two-sided probability of the printed value")
    ax.legend(handles=shown.values(), loc="lower left", bbox_to_anchor=(1.0, -0.02), fontsize=8)


def draw_counts(ax, claims):
    """The probabilities counted, and as many in each tenth as if every printed number were right."""
    judged = [c.probability for c in claims if c.probability is not None and c.verdict != UNSPECIFIED]
    expected = len(judged) / (len(TENTHS) - 1)
    look = dict(color=figures.colour("mle"), alpha=0.55)
    ax.stairs(np.histogram(judged, TENTHS)[0], TENTHS, fill=True, label="counted", **look)
    ax.axhline(expected, color="black", linewidth=1.4, label="expected if every number were right")
    ax.set(xlim=(1, 0), xlabel="Two-sided probability of the printed value", ylabel="Numbers")
    ax.legend(loc="upper center", fontsize=8)


def draw_probabilities(claims, papers):
    """The figure: every probability, table by table, and all of them counted."""
    figures.use_style()
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(7.2, 7.4), height_ratios=(2.6, 1))
    draw_tables(top, claims, papers)
    draw_counts(bottom, claims)
    return figure


def draw_house(pyproject):
    """The house, from the import contract in pyproject.toml: a floor a layer, a room a module."""
    figures.use_style()
    found = tomllib.loads(Path(pyproject).read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in found if contract["id"] == "house")
    figure, ax = plt.subplots(figsize=(7.4, 6.6))
    colours = {"beyond": "#E0EDF6", "papers": "#E0EDF6", "judging": "#FDF0D5"}  # the others are the library
    box = dict(boxstyle="round,pad=0.35", facecolor="white", edgecolor="#555555", linewidth=0.8)
    top = 0.0
    for layer in layers:
        names = layer.replace("|", ":").replace(" ", "").split(":")
        lines = [names[k : k + ROOMS] for k in range(0, len(names), ROOMS)]
        ax.axhspan(top, top - len(lines) + 0.15, color=colours.get(names[0], "#EEF5F0"), linewidth=0)
        for row in lines:
            top -= 1.0
            for k, name in enumerate(row):
                place = ((k + 0.5) / len(row), top + 0.575)
                ax.annotate(name, place, ha="center", va="center", fontsize=8.5, bbox=box)
    down = dict(arrowstyle="-|>", color="#555555", linewidth=1.4)
    ax.annotate("", (-0.04, top), (-0.04, 0), arrowprops=down, annotation_clip=False)
    ax.annotate("imports", (-0.06, top / 2), rotation=90, ha="right", va="center", fontsize=9)
    ax.set(xlim=(-0.1, 1), ylim=(top, 0.15))
    ax.axis("off")
    return figure
