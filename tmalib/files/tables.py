"""Rows of a file as columns of parsed cells, each with the line it comes from."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from ..types import FilePath, FloatArray
from .clock import NUMBER, parse_time
from .text import MAX_ROWS, check_rows, read_text, refuse

LONGEST_CELL = 200


@dataclass(frozen=True)
class Table:
    """Columns by name, all as long as ``lines``, the line in the file of each row."""

    path: FilePath
    lines: list[int]
    columns: dict[str, list[Any]]

    def __contains__(self, column: object) -> bool:
        return column in self.columns

    def array(self, column: str) -> FloatArray:
        """A column of numbers; NaN all along where the file has no such column."""
        return np.array(self.columns.get(column, [math.nan] * len(self.lines)), dtype=float)

    def refuse(self, message: object, row: int, column: str) -> NoReturn:
        """`ValueError` that names the file, the line of a row and the column."""
        refuse(message, self.path, self.lines[row], column)

    def row_where(self, wrong: ArrayLike) -> int | None:
        """Number of the first row of which an array says so, `None` if there is none."""
        found = np.flatnonzero(wrong)
        return int(found[0]) if len(found) else None


def number_cell(
    minimum: float = -1e300,
    maximum: float = 1e300,
    unit: str = "",
    above: float = -math.inf,
    may_be_empty: bool = False,
) -> Callable[[str], float]:
    """A parser of numbers in a range; NaN for an empty cell, if it may be empty."""

    def parse(text):
        if not text and may_be_empty:
            return math.nan
        if not NUMBER.fullmatch(text):
            empty = "; a cell without a number is left empty" if may_be_empty else ""
            hint = "; decimals follow a point" if "," in text else empty
            raise ValueError(f"a number is wanted, got {text[:LONGEST_CELL]!r}{hint}")
        value = float(text)
        if not (minimum <= value <= maximum and value > above):
            least = f"above {above:g}" if math.isfinite(above) else f"from {minimum:g}"
            raise ValueError(f"{text} is not {least} to {maximum:g}{unit}")
        return value

    return parse


def name_cell(text: str) -> str:
    """A name; never empty."""
    if not text or len(text) > LONGEST_CELL or not text.isprintable():
        raise ValueError(f"a name of at most {LONGEST_CELL} printable characters is wanted, got {text!r:.50}")
    return text


DEGREES = " degrees"
LATITUDE = number_cell(-90, 90, DEGREES)
LONGITUDE = number_cell(-180, 360, DEGREES)
ANGLE = number_cell(-180, 360, DEGREES)
ANGLE_OR_NONE = number_cell(-180, 360, DEGREES, may_be_empty=True)
SIGMA_OR_NONE = number_cell(above=0, maximum=180, unit=DEGREES, may_be_empty=True)
SOUND_SPEED_OR_NONE = number_cell(100, 10_000, " m/s", may_be_empty=True)
METRES = number_cell(-1e8, 1e8, " m")
TIME = parse_time


def read_csv(
    path: FilePath,
    parsers: Mapping[str, Callable[[str], Any]],
    required: Sequence[str],
    alternatives: Sequence[tuple[str, ...]],
) -> Table:
    """A `Table` of comma-separated text.

    Parameters
    ----------
    path : path of the file
    parsers : dict
        Name of every column that may be there to what parses its cells.
    required : sequence of str
        Columns that must be there.
    alternatives : sequence of tuples of str
        Groups of columns; exactly one group must be there, as a whole.

    Raises
    ------
    ValueError
        For anything else than such a table, naming line and column.
    """
    reader = csv.reader(io.StringIO(read_text(path), newline=""), strict=True)
    try:
        header = next((row for row in reader if any(cell.strip() for cell in row)), [""])
        names = _checked_header(header, path, reader.line_num, parsers, required, alternatives)
        used: list[tuple[str, Callable[[str], Any], list[Any]]] = [
            (name, parsers[name], []) for name in names
        ]
        lines = []
        for row in reader:
            if not any(cell.strip() for cell in row):
                continue
            if len(row) != len(names):
                hint = " (decimal commas?)" if len(row) > len(names) else ""
                refuse(f"{len(row)} cells where the header has {len(names)}{hint}", path, reader.line_num)
            for (name, parse, column), cell in zip(used, row, strict=True):
                try:
                    column.append(parse(cell.strip()))
                except ValueError as error:
                    refuse(error, path, reader.line_num, name)
            lines.append(reader.line_num)
            if len(lines) > MAX_ROWS:
                break
    except csv.Error as error:
        refuse(f"not a comma-separated table: {error}", path, reader.line_num)
    check_rows(len(lines), path)
    return Table(path, lines, {name: column for name, _, column in used})


def _checked_header(header, path, line, parsers, required, alternatives):
    names = [cell.strip().lower() for cell in header]
    accepted = f"accepted are {', '.join(parsers)}"
    if all(NUMBER.fullmatch(name) for name in names):
        refuse(f"the first line must name the columns, got numbers; {accepted}", path, line)
    if len(names) == 1 and any(sign in names[0] for sign in ";\t|"):
        refuse(f"columns are separated by commas, got {header[0][:LONGEST_CELL]!r}", path, line)
    for place, name in enumerate(names):
        if name not in parsers:
            refuse(f"unknown column; {accepted}", path, line, header[place][:LONGEST_CELL])
        if name in names[:place]:
            refuse("the column is there twice", path, line, name)
    for name in required:
        if name not in names:
            refuse(f"no column {name!r}; the columns are {', '.join(names)}", path, line)
    present = [group for group in alternatives if any(name in names for name in group)]
    if len(present) != 1 or not all(name in names for name in present[0]):
        wanted = " or ".join(" and ".join(group) for group in alternatives)
        refuse(f"exactly one of these is wanted: {wanted}; the columns are {', '.join(names)}", path, line)
    return names
