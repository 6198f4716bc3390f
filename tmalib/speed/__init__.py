"""How fast the library is: what `make bench` and `make million` have written, and the book reads.

A file with a date is one run of `make bench`: all ratios, those with a goal, series of times, processor and
versions. ``million.json`` is what `make million` counted.
"""

import json
import operator
import platform
from html import escape
from pathlib import Path

FOLDER = Path(__file__).parent
MEETS = {">=": operator.ge, "<=": operator.le}


def newest() -> dict:
    """The last run of `make bench`."""
    return json.loads(max(FOLDER.glob("2*.json")).read_text(encoding="utf-8"))


def million() -> dict:
    """What the million runs gave, and what they took."""
    return json.loads((FOLDER / "million.json").read_text(encoding="utf-8"))


def chapters() -> dict:
    """How long every chapter took from nothing: `make times`."""
    return json.loads((FOLDER / "chapters.json").read_text(encoding="utf-8"))


def processor() -> str:
    """The processor of this machine in words."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text(encoding="utf-8").splitlines() if about.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def is_met(row: dict) -> bool:
    """Whether a ratio meets its goal; true without one."""
    return row["goal"] is None or MEETS[row["goal"][0]](row["ratio"], row["goal"][1])


class Ratios:
    """The ratios of a run of `make bench` as a table, in text and on a page."""

    HEAD = ("What", "against", "ratio", "middle half", "of what", "goal")

    def __init__(self, rows: list[dict]) -> None:
        self.rows = [self._line(row) for row in rows]

    @staticmethod
    def _line(row):
        goal = "" if row["goal"] is None else " ".join(map(str, row["goal"]))
        word = "" if is_met(row) else " MISS"
        between = f"{row['low']:.3g} to {row['high']:.3g}" if row["low"] < row["high"] else ""
        return row["what"], row["peer"], f"{row['ratio']:.3g}", between, row["of"], goal + word

    def __repr__(self) -> str:
        lines = [self.HEAD, *self.rows]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join(
            "  ".join(f"{c:{w}}" for c, w in zip(line, widths, strict=True)).rstrip() for line in lines
        )

    def _repr_html_(self) -> str:
        head = "".join(f"<th scope='col'>{escape(cell)}</th>" for cell in self.HEAD)
        body = "".join(
            f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in line)}</tr>" for line in self.rows
        )
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
