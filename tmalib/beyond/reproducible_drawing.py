"""Drawing of the chapter on what makes a paper reproducible."""

import matplotlib.pyplot as plt

from .. import figures
from .reproducible import seen_by

LEAST = 3e-7  # relative difference at the left end, where those stand that are not different at all
COLUMNS = ("tried", "fit", "rows", "digits")


def readings(omissions, runs):
    """How far each reading's numbers are from those in use, with what digits and runs can see.

    Parameters
    ----------
    omissions : sequence of Omission
    runs : int
        Of the papers' Monte-Carlo experiments.
    """
    fig, (ax, beside) = plt.subplots(1, 2, figsize=(7.0, 4.4), sharey=True, width_ratios=(2.2, 1))
    beside.axis("off")
    ax.axvspan(seen_by(runs), 30, color=figures.colour("printed"), alpha=0.35, linewidth=0)
    for digits in range(1, 7):
        ax.axvline(10.0 ** (1 - digits), color="0.6", linewidth=0.8, linestyle=":")
        ax.annotate(
            f"{digits}", (10.0 ** (1 - digits), 1.0), xycoords=("data", "axes fraction"), xytext=(0, 3),
            textcoords="offset points", ha="center", color="0.3",
        )  # fmt: skip
    for row, now in enumerate(omissions):
        agreeing, most = now.agreeing(), max(now.agreeing().values())
        far = {name: value for name, value in now.distances().items() if name != now.used}
        for name, value in far.items():
            fits = agreeing[name] == most
            face = "white" if fits else figures.colour("target")
            ax.plot(
                max(value, LEAST), row, "o", markersize=8, markerfacecolor=face,
                markeredgecolor=figures.colour("target"), markeredgewidth=1.6, clip_on=False,
            )  # fmt: skip
        _columns(beside, row, now, sum(count == most for count in agreeing.values()))
        ax.axhline(row, color="0.9", linewidth=0.6, zorder=0)
    for place, title in enumerate(COLUMNS):
        beside.annotate(title, (place, 1.02), xycoords=("data", "axes fraction"), ha="center", fontsize=8.5)
    ax.annotate(
        f"seen by the\nspread of\n{runs} runs", (0.985, 0.64), xycoords="axes fraction", ha="right",
        va="center", color=figures.colour("platform"), fontsize=8.5,
    )  # fmt: skip
    ax.set_xscale("log")
    ax.set(xlim=(LEAST, 30), ylim=(len(omissions) - 0.4, -0.6))
    ax.set_xlabel("Largest relative difference of a printed number from the reading in use")
    ax.set_title("digits that see it", fontsize=9, pad=16)
    ax.set_yticks(range(len(omissions)), [now.name for now in omissions])
    ax.grid(False)
    return fig


def _columns(ax, row, now, fitting):
    """Counts beside a row: readings, those that fit best, rows that depend on it, digits needed."""
    digits = now.digits_needed()
    least, most = (f"{value:.0f}" for value in (digits.min(), digits.max()))
    values = (
        len(now.readings),
        fitting,
        sum(now.depending()),
        least if least == most else f"{least} to {most}",
    )
    for place, value in enumerate(values):
        ax.annotate(value, (place, row), ha="center", va="center", fontsize=9)
    ax.set_xlim(-0.5, len(COLUMNS) - 0.5)
