"""The drawings that no chapter makes: the deviations of all Monte-Carlo numbers, and the house.

If every printed number were right, the deviation of a row (`tmalib.judging.verdict.z_score`) would be
``max(0, |N| - r)`` with a standard normal N and the rounding r, half a unit of the last printed digit in
standard errors.
"""

import tomllib
from itertools import groupby
from pathlib import Path
from statistics import NormalDist

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
NORMAL = NormalDist()
TWO_SIDED = NORMAL.inv_cdf(0.975)
EDGES = np.arange(0, 4.01, 0.25)
ROOMS = 6  # in a line of a floor of the house


def beyond(z, r):
    """Probability under the null of a deviation above ``z``."""
    return 2 * NORMAL.cdf(-(z + r))


def counts(claims):
    """What the text says about the figure; ``claims`` are all of the book."""
    tested = [c for c in claims if c.z is not None]
    judged = [c for c in tested if c.verdict != UNSPECIFIED]
    far = [c for c in judged if c.z > c.limit]
    near = [c for c in judged if c.z <= c.limit]
    due = sum(beyond(TWO_SIDED, c.rounding) - beyond(c.limit, c.rounding) for c in near)
    return {
        "rows": len(judged),
        "tables": len({c.key[:2] for c in judged}),
        "assumed": len(tested) - len(judged),
        "far": len(far),
        "far-tables": len({c.key[:2] for c in far}),
        "near": len(near),
        "above": sum(c.z > TWO_SIDED for c in near),
        "above-expected": due,
        "below-one": sum(c.z < 1 for c in near),
        "below-one-expected": sum(1 - beyond(1, c.rounding) for c in near),
        "largest": max((c.z for c in judged), default=0.0),
    }


def draw_tables(ax, claims, papers):
    """A line of points a table, its limit, and the names of the cells beyond."""
    place, ticks, shown = 0, {}, {}
    for key, found in groupby((c for c in claims if c.z is not None), key=lambda c: c.paper):
        paper, look = papers[key], dict(va="center", fontsize=9)
        ax.annotate(paper.title, (0, place), (4, 0), textcoords="offset points", fontweight="bold", **look)
        for table, rows in groupby(found, key=lambda c: c.table):
            place, family = place + 1, sorted(rows, key=lambda c: -c.z)
            ticks[place] = paper.tables[table]
            ax.plot([family[0].limit] * 2, [place - 0.4, place + 0.4], color="black", linewidth=1.2)
            for c in family:
                marker, entity, fill, label = LOOKS[c.verdict]
                look = dict(color=figures.colour(entity), fillstyle=fill, markersize=5, markeredgewidth=0.8)
                (shown[marker],) = ax.plot(c.z, place, marker, label=label, alpha=0.8, **look)
            far = [c for c in family if c.z > c.limit and c.verdict != UNSPECIFIED]
            names = ", ".join(f"{paper.columns[c.column]} {paper.rows[c.row]}" for c in far)
            ax.annotate(names, (1.01, place), xycoords=("axes fraction", "data"), va="center", fontsize=7.5)
        place += 1
    ax.set_yticks([*ticks], ticks.values())
    ax.set_xscale("symlog", linthresh=4, linscale=2)
    places = (0, 1, 2, 3, 4, 10, 30, 100)
    ax.set_xticks(places, map(str, places))
    ax.minorticks_off()
    ax.set(xlim=(-0.1, 100), ylim=(place - 0.3, -0.7))
    ax.set_xlabel("Deviation from the printed value (standard errors)")
    ax.legend(handles=shown.values(), loc="lower right", fontsize=8, frameon=True)


def draw_counts(ax, claims):
    """The deviations counted, and the counts to be expected if every printed number were right."""
    judged = [c for c in claims if c.z is not None and c.verdict != UNSPECIFIED]
    z = np.array([c.z for c in judged])
    counted = [*np.histogram(z, EDGES)[0], np.sum(z > EDGES[-1])]
    above = [[beyond(edge, c.rounding) if edge else 1.0 for edge in EDGES] + [0.0] for c in judged]
    expected = -np.diff(np.sum(above, axis=0)) if judged else np.zeros(len(EDGES))
    places = np.append(EDGES, EDGES[-1] + 0.5)
    ax.stairs(counted, places, fill=True, color=figures.colour("mle"), alpha=0.55, label="counted")
    ax.stairs(expected, places, color="black", linewidth=1.4, label="expected if every number were right")
    ax.set_xticks([0, 1, 2, 3, 4, 4.25], ["0", "1", "2", "3", "", "more"])
    ax.set(xlim=(0, places[-1]), xlabel="Deviation (standard errors)", ylabel="Numbers")
    ax.legend(loc="upper right", fontsize=8)


def draw_deviations(claims, papers):
    """The figure: every deviation, table by table, and all of them counted."""
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
    colours = {"papers": "#E0EDF6", "judging": "#FDF0D5"}  # the others are the library
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
