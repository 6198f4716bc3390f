"""Figures: one style, one colour an entity, and the shapes that every chapter draws.

The colours are those of Okabe and Ito (`COLOURS`). Every pair of them can be told apart as a dot, also with
protanopia, deuteranopia or tritanopia; those of `ALIKE` not as thin lines, and therefore differ by dash,
marker or filling as well. Pink is the recursive filter and nothing else. Axes are in kilometres, east to the
right, north up. Text is at least 7 pt at the width of a page, `PAGE_WIDTH`.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from .ellipse import Ellipse
from .types import FilePath

COLOURS = {
    "platform": "#0072B2",
    "printed": "#56B4E9",
    "target": "#D55E00",
    "mle": "#009E73",
    "ekf": "#CC79A7",
    "ellipse": "#000000",
    "sound": "#0072B2",
    "light": "#E69F00",
    "null": "#5F5F5F",
}

# Not told apart by every reader as lines a tenth of a degree wide (tests/test_figure_style.py).
ALIKE = {
    ("platform", "mle"),
    ("printed", "mle"),
    ("platform", "ekf"),
    ("printed", "ekf"),
    ("mle", "ekf"),
    ("light", "ekf"),
}

PAGE_WIDTH = 7.0  # inches: the width to which a page shrinks a wider figure

STYLE: dict[Any, Any] = {
    "figure.figsize": (6.4, 4.2),
    "figure.constrained_layout.use": True,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "font.size": 10,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E0E0E0",
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "svg.hashsalt": "tmalib",
    "svg.fonttype": "path",
}


def use_style() -> None:
    """Set the style; in a notebook, also ask for SVG and PDF output. The first cell of a chapter."""
    os.environ.setdefault("SOURCE_DATE_EPOCH", "1451606400")  # a fixed date inside SVG and PDF files
    mpl.rcParams.update(STYLE)
    try:
        from matplotlib_inline.backend_inline import set_matplotlib_formats
    except ImportError:
        return
    set_matplotlib_formats("svg", "pdf", bbox_inches=None, dpi=150)


def colour(entity: str) -> str:
    """Colour of an entity; `ValueError` for one that has none."""
    if entity not in COLOURS:
        raise ValueError(f"entity must be one of {sorted(COLOURS)}, got {entity!r}")
    return COLOURS[entity]


def map_axes(ax: Axes, *, step: float | None = None) -> Axes:
    """Make ``ax`` a map: equal scales, kilometres east and north."""
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("East (km)")
    ax.set_ylabel("North (km)")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(mpl.ticker.MultipleLocator(step) if step else MaxNLocator(6))
    return ax


def path(
    ax: Axes,
    positions: ArrayLike,
    entity: str,
    label: str | None = None,
    mark: str | None = None,
    **line: Any,
) -> None:
    """A trajectory through ``positions`` (m, shape (N, 2)); ``mark`` is a letter at its start."""
    x, y = np.asarray(positions).T / 1e3
    ax.plot(x, y, color=colour(entity), label=label or entity, **line)
    if mark:
        ax.annotate(
            mark, (x[0], y[0]), xytext=(-5, 5), textcoords="offset points",
            ha="right", color=colour(entity), fontweight="bold",
        )  # fmt: skip


def cloud(ax: Axes, positions: ArrayLike, entity: str, label: str | None = None, size: float = 4.0) -> None:
    """Estimated positions (m, shape (runs, 2)), drawn as a bitmap inside the vector figure."""
    x, y = np.asarray(positions).T / 1e3
    ax.scatter(x, y, s=size, color=colour(entity), alpha=0.45, linewidths=0, rasterized=True, label=label)


def ellipse(ax: Axes, shape: Ellipse, label: str | None = None, linewidth: float = 1.3) -> None:
    """A confidence `Ellipse` with its centre."""
    x, y = shape.boundary().T / 1e3
    ax.plot(x, y, color=colour("ellipse"), linewidth=linewidth, label=label)
    ax.plot(
        *np.asarray(shape.centre) / 1e3, marker="+", color=colour("ellipse"), markersize=7, linestyle="none"
    )


def save_figure(figure: Figure, name: FilePath) -> None:
    """Write ``figure`` as ``name.svg`` and ``name.pdf``; the same figure gives the same bytes."""
    name = Path(name)
    name.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(name.with_suffix(".svg"), metadata={"Date": None}, dpi=150)
    figure.savefig(name.with_suffix(".pdf"), metadata={"CreationDate": None}, dpi=150)
    plt.close(figure)
