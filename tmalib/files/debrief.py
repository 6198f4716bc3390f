"""The REP files of Debrief, the open-source tool for maritime analysis.

Fields are separated by blanks or tabs; a name of several words is in double quotes. Dates have six or eight
digits (two digits of a year are 1969 to 2068), times are in UTC; leading zeros may be missing. Read are

- fixes, which begin with a date::

      date time ship symbol  deg min sec N  deg min sec W  heading speed depth [label]

- contacts, with bearings in degrees. A position is eight fields as in a fix, or ``NULL``::

      ;SENSOR:  date time ship symbol position bearing range sensor [label]
      ;SENSOR2: date time ship symbol position bearing second_bearing frequency range sensor [label]
      ;SENSOR3: date time ship symbol position bearing accuracy frequency accuracy range sensor [label]

Of a fix time, position and heading are taken, of a contact time, position, bearings, sensor and, from
SENSOR3, the accuracy of the bearing, as its standard deviation. ``NULL`` or ``NaN`` is a bearing that is not
there; a sensor none of whose lines has a bearing (a frequency tracker) is no sensor of bearings and is left
out. A line with two bearings, one to each side of a line array, is refused: the side that holds changes with
the ship's course, so it must be chosen first, line by line, and the other be ``NULL``. Other lines that begin
with a semicolon (comments, narrative, shapes) are passed over; any other line is refused.

Source: the chapter "Debrief file formats" of Debrief's user guide; where it is silent, Debrief's importers.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable
from datetime import UTC, datetime
from decimal import Decimal
from typing import Any

import numpy as np

from ..types import FilePath
from .clock import FileTime, unix_seconds
from .tables import ANGLE, ANGLE_OR_NONE, SIGMA_OR_NONE, Table, name_cell, number_cell
from .text import check_rows, read_text, refuse

CONTACTS = {
    ";SENSOR:": ("bearing", "range"),
    ";SENSOR2:": ("bearing", "second bearing", "frequency", "range"),
    ";SENSOR3:": ("bearing", "sigma", "frequency", "frequency accuracy", "range"),
}
TAKEN = {"bearing": ANGLE_OR_NONE, "second bearing": ANGLE_OR_NONE, "sigma": SIGMA_OR_NONE}
CONTACT_COLUMNS = ("time", "ship", "latitude", "longitude", *TAKEN, "sensor")
FIX_COLUMNS = ("time", "ship", "latitude", "longitude", "heading")
FIELD = re.compile(r'"[^"]*"|\S+')
SIXTIETHS = number_cell(0, 60)  # 60 itself is written by programs that round
CLOCK = re.compile(r"(\d{1,6})(\.\d{1,9})?", re.ASCII)


class Fields:
    """The fields of a line, taken one after the other; what is wrong is refused by its name."""

    def __init__(self, path: FilePath, line: int, text: str) -> None:
        self.path, self.line = path, line
        self.left = FIELD.findall(text)[::-1]

    def take(self, column: str, parse: Callable[[str], Any] = name_cell) -> Any:
        """The next field, parsed."""
        if not self.left:
            refuse("the line ends before this field", self.path, self.line, column)
        try:
            return parse(self.left.pop().strip('"'))
        except ValueError as error:
            refuse(error, self.path, self.line, column)

    def take_time(self) -> FileTime:
        """The two fields of a time."""
        day, clock = self.take("date"), self.take("time")
        found = CLOCK.fullmatch(clock)
        if not (re.fullmatch(r"\d{5,6}|\d{8}", day, re.ASCII) and found):
            message = f"a date YYMMDD or YYYYMMDD and a time HHMMSS.SSS are wanted, got {day:.20} {clock:.20}"
            refuse(message, self.path, self.line, "date")
        form = "%Y%m%d %H%M%S" if len(day) > 6 else "%y%m%d %H%M%S"
        try:
            moment = datetime.strptime(f"{day:0>6} {found[1]:0>6}", form).replace(tzinfo=UTC)
        except ValueError:
            refuse(f"{day} {clock} is no date and time", self.path, self.line, "date")
        return FileTime("date-time with a zone", unix_seconds(moment) + Decimal(found[2] or 0))

    def take_angle(self, column: str, limit: float, hemispheres: str) -> float:
        """Degrees of the fields degrees, minutes, seconds, hemisphere; the next may stick to the last."""
        degrees = self.take(column, number_cell(0, limit, " degrees"))
        minutes, seconds = self.take(column, SIXTIETHS), self.take(column, SIXTIETHS)
        side = self.take(column)
        if len(side) > 1:
            self.left.append(side[1:])
        if side[0].upper() not in hemispheres:
            wanted = " or ".join(hemispheres)
            refuse(f"a hemisphere, {wanted}, is wanted, got {side:.20}", self.path, self.line, column)
        value = degrees + minutes / 60 + seconds / 3600
        if value > limit:
            refuse(f"{value:.6f} degrees is more than {limit}", self.path, self.line, column)
        return value if side[0].upper() == hemispheres[0] else -value

    def take_position(self) -> tuple[float, float]:
        return self.take_angle("latitude", 90, "NS"), self.take_angle("longitude", 180, "EW")

    def next_is_null(self) -> bool:
        """Whether the next field says that there is nothing."""
        return bool(self.left) and is_null(self.left[-1])


def is_null(text: str) -> bool:
    return text.upper() in ("NULL", "NAN")


def number_or_null(parse: Callable[[str], Any]) -> Callable[[str], Any]:
    """A parser that takes what says that there is nothing for an empty cell."""
    return lambda text: parse("" if is_null(text) else text)


def _fix(fields):
    """Cells of a fix, in the order of `FIX_COLUMNS`."""
    time, ship = fields.take_time(), fields.take("ship")
    fields.take("symbol")
    cells = (time, ship, *fields.take_position(), fields.take("heading", ANGLE))
    fields.take("speed", number_or_null(number_cell(may_be_empty=True)))
    fields.take("depth", number_or_null(number_cell(may_be_empty=True)))
    return cells


def _contact(fields):
    """Cells of a contact, in the order of `CONTACT_COLUMNS`."""
    kind = fields.take("kind").upper()
    time, ship = fields.take_time(), fields.take("ship")
    fields.take("symbol")
    if fields.next_is_null():
        fields.take("position")
        position = (math.nan, math.nan)
    else:
        position = fields.take_position()
    values = dict.fromkeys(TAKEN, math.nan)
    for column in CONTACTS[kind]:
        value = fields.take(column, number_or_null(TAKEN.get(column, number_cell(may_be_empty=True))))
        if column in TAKEN:
            values[column] = value
    return (time, ship, *position, *values.values(), fields.take("sensor"))


def _read(path, columns, wants, parse, ship):
    """A `Table` of the lines that are wanted, of one ship."""
    lines, rows = [], []
    for line, text in enumerate(io.StringIO(read_text(path), newline=None), start=1):
        first = text.split(maxsplit=1)[0].upper() if text.strip() else ";"
        if not first.startswith(";") and not first[0].isdigit():
            refuse(f"neither a fix nor a line that begins with a semicolon: {text:.40}", path, line)
        if wants(first):
            rows.append(parse(Fields(path, line, text)))
            lines.append(line)
    check_rows(len(rows), path)
    ships = list(dict.fromkeys(row[1] for row in rows))
    if ship is None and len(ships) > 1:
        refuse(f"lines of {', '.join(ships)}; name=... says whose are wanted", path)
    if ship is not None and ship not in ships:
        refuse(f"no line of {ship!r}; there are lines of {', '.join(ships)}", path)
    kept = [i for i, row in enumerate(rows) if row[1] == (ship or ships[0])]
    cells = zip(*(rows[i] for i in kept), strict=True)
    return Table(path, [lines[i] for i in kept], {n: list(c) for n, c in zip(columns, cells, strict=True)})


def read_fixes(path: FilePath, ship: str | None = None) -> Table:
    """`Table` of the fixes of a ship: time, latitude, longitude, heading."""
    return _read(path, FIX_COLUMNS, lambda first: not first.startswith(";"), _fix, ship)


def read_contacts(path: FilePath, ship: str | None = None) -> Table:
    """`Table` of the contacts of a ship's sensors that have bearings."""
    table = _read(path, CONTACT_COLUMNS, CONTACTS.__contains__, _contact, ship)
    if (row := table.row_where(~np.isnan(table.array("second bearing")))) is not None:
        table.refuse("two bearings; put NULL for the one that does not hold", row, "second bearing")
    sensors = table.columns["sensor"]
    cells = zip(sensors, table.columns["bearing"], strict=True)
    hears = {sensor for sensor, bearing in cells if not math.isnan(bearing)}
    kept = [i for i, sensor in enumerate(sensors) if sensor in hears]
    if not kept:
        refuse("no line of a sensor has a bearing", path)
    columns = {name: [cells[i] for i in kept] for name, cells in table.columns.items()}
    return Table(path, [table.lines[i] for i in kept], columns)
