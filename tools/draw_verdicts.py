"""Draw the deviations of all Monte-Carlo numbers against what they would be if every number were right.

Used by export_figures.py. The null of a row is that of `tmalib.claims.z_score`: ``max(0, |N| - r)`` with a
standard normal N and r half a unit of the last printed digit in standard errors.
"""

import csv
from itertools import groupby
from pathlib import Path
from statistics import NormalDist

import matplotlib.pyplot as plt
import numpy as np

from tmalib import claims, figures

NAME = "fig-verdicts-z"
PAPERS = {
    "emw-acoustic": "Electromagnetic and acoustic waves",
    "conical-angles": "Cosines of conical angles",
    "robustness": "Robustness",
}
ROWS = {"xT": "x", "yT": "y", "zT": "z", "vxT": "ẋ", "vyT": "ẏ"}
COLUMNS = {"bias_mle": "bias MLE", "bias_ekf": "bias EKF", "std_mle": "σ MLE", "std_ekf": "σ EKF",
           "std_sample": "σ", "mean": "", "bias": "bias"}  # fmt: skip
MARKERS = {
    claims.REPRODUCED: ("o", "mle", True),
    claims.CORRECTED: ("o", "mle", True),
    claims.INCONCLUSIVE: ("D", "light", True),
    claims.NOT_REPRODUCED: ("X", "target", True),
    claims.UNSPECIFIED: ("s", "null", False),
}
LABELS = {claims.CORRECTED: "reproduced, also after correction"}
NORMAL = NormalDist()
TWO_SIDED = NORMAL.inv_cdf(0.975)
EDGES = np.arange(0, 4.01, 0.25)


def tables(rows):
    """Monte-Carlo claims by ``(paper, table)``, in the order of the ledger, each with its limit."""
    monte_carlo = [row for row in rows if row["z"] is not None]
    for name, family in groupby(monte_carlo, key=lambda row: (row["paper"], row["table"])):
        family = list(family)
        yield name, family, claims.sidak_limit(len(family))


def rounding(row, limit):
    """Half a unit of the last printed digit in standard errors, from the detectable deviation."""
    half = claims.printed(*(row[k] for k in ("paper", "table", "row", "column"))).last_digit / 2
    return half * (limit + NORMAL.inv_cdf(claims.POWER)) / (row["detectable"] - half)


def beyond(z, r):
    """Probability under the null of a deviation above ``z``."""
    return 2 * NORMAL.cdf(-(z + r))


def numbers(rows):
    """What the text says about the figure."""
    found = list(tables(rows))
    judged = [(row, limit) for _, family, limit in found for row in family
              if row["verdict"] != claims.UNSPECIFIED]  # fmt: skip
    far = [row for row, limit in judged if row["z"] > limit]
    near = [(row, limit) for row, limit in judged if row["z"] <= limit]
    return {
        "rows": len(judged),
        "tables": len({(row["paper"], row["table"]) for row, _ in judged}),
        "assumed": sum(len(family) for _, family, _ in found) - len(judged),
        "far": len(far),
        "far-tables": len({(row["paper"], row["table"]) for row in far}),
        "near": len(near),
        "above": sum(row["z"] > TWO_SIDED for row, _ in near),
        "above-expected": sum(beyond(TWO_SIDED, rounding(*r)) - beyond(r[1], rounding(*r)) for r in near),
        "below-one": sum(row["z"] < 1 for row, _ in near),
        "below-one-expected": sum(1 - beyond(1, rounding(*r)) for r in near),
        "largest": max(row["z"] for row, _ in judged),
    }


def names(family, limit):
    """The cells that stand out, the farthest first."""
    far = sorted((row for row in family if row["z"] > limit), key=lambda row: -row["z"])
    far = [row for row in far if row["verdict"] != claims.UNSPECIFIED]
    text = [f"{COLUMNS.get(r['column'], r['column'])} {ROWS.get(r['row'], r['row'])}".strip() for r in far]
    return ", ".join(text)


def strips(ax, rows):
    """A line of points a table, its limit, and the names of the cells beyond."""
    place, ticks, labels, shown = 0, [], [], {}
    for paper, found in groupby(tables(rows), key=lambda entry: entry[0][0]):
        ax.annotate(PAPERS[paper], (0, place), xytext=(4, 0), textcoords="offset points",
                    va="center", fontweight="bold", fontsize=9)  # fmt: skip
        for (_, table), family, limit in found:
            place += 1
            ticks.append(place)
            labels.append(table)
            ax.plot([limit, limit], [place - 0.4, place + 0.4], color="black", linewidth=1.2)
            for row in family:
                marker, entity, filled = MARKERS[row["verdict"]]
                colour = figures.colour(entity)
                (shown[marker],) = ax.plot(
                    row["z"], place, marker, color=colour, markersize=5, alpha=0.8, markeredgewidth=0.8,
                    markerfacecolor=colour if filled else "none", linestyle="none",
                    label=LABELS.get(row["verdict"], row["verdict"]),
                )  # fmt: skip
            ax.annotate(names(family, limit), (1.01, place), xycoords=("axes fraction", "data"),
                        va="center", fontsize=7.5)  # fmt: skip
        place += 1
    ax.set_yticks(ticks, labels)
    ax.set_ylim(place - 0.3, -0.7)
    ax.set_xscale("symlog", linthresh=4, linscale=2)
    ax.set_xticks([0, 1, 2, 3, 4, 10, 30, 100], ["0", "1", "2", "3", "4", "10", "30", "100"])
    ax.minorticks_off()
    ax.set_xlim(-0.1, 100)
    ax.set_xlabel("Deviation from the printed value (standard errors)")
    ax.legend(handles=shown.values(), loc="lower right", fontsize=8, frameon=True)


def histogram(ax, rows):
    """The deviations counted, and the counts to be expected if every printed number were right."""
    judged = [(row["z"], rounding(row, limit)) for _, family, limit in tables(rows) for row in family
              if row["verdict"] != claims.UNSPECIFIED]  # fmt: skip
    z, r = np.array(judged).T
    counts = [*np.histogram(z, EDGES)[0], np.sum(z > EDGES[-1])]
    above = np.array([[beyond(edge, one) if edge else 1.0 for edge in EDGES] + [0.0] for one in r])
    expected = -np.diff(above.sum(axis=0))
    places = np.append(EDGES, EDGES[-1] + 0.5)
    ax.stairs(counts, places, fill=True, color=figures.colour("mle"), alpha=0.55, label="counted")
    ax.stairs(expected, places, color="black", linewidth=1.4, label="expected if every number were right")
    ax.set_xticks([0, 1, 2, 3, 4, 4.25], ["0", "1", "2", "3", "", "more"])
    ax.set(xlim=(0, places[-1]), xlabel="Deviation (standard errors)", ylabel="Numbers")
    ax.legend(loc="upper right", fontsize=8)


def draw(rows, folder):
    """Write the figure, SVG and PDF, and its `numbers`, CSV, to ``folder``; returns its name."""
    figures.use_style()
    fig, (top, bottom) = plt.subplots(2, 1, figsize=(7.2, 7.4), height_ratios=(2.6, 1))
    strips(top, rows)
    histogram(bottom, rows)
    figures.save(fig, Path(folder) / NAME)
    with (Path(folder) / f"{NAME}.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([("name", "value"), *numbers(rows).items()])
    return NAME
