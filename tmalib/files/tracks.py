"""The own ship's track from a file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion import SampledCourse
from ..types import FilePath, FloatArray
from . import debrief
from .clock import LEAST_UNIX_TIME, moment_of, unix_seconds
from .frame import Frame
from .tables import ANGLE, LATITUDE, LONGITUDE, METRES, TIME, Table, read_csv
from .text import format_of, refuse

PLAIN = Frame()  # metres from somewhere, seconds since some time
COLUMNS = {
    "time": TIME, "x": METRES, "y": METRES, "latitude": LATITUDE, "longitude": LONGITUDE, "heading": ANGLE,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class RecordedCourse(SampledCourse):
    """A `SampledCourse` that knows its `Frame`: which moment is time zero, which point is the origin.

    Examples
    --------
    >>> RecordedCourse(times=[0, 60], positions=[(0, 0), (0, 300)]).frame
    Frame(epoch=None, latitude=None, longitude=None)
    """

    frame: Frame = PLAIN

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.frame, Frame):
            raise ValueError(f"frame must be a Frame, got {self.frame!r}")


def read_track(path: FilePath, *, format: str | None = None, name: str | None = None) -> RecordedCourse:
    """The own ship's track of a file, for a `Scenario` and for `read_bearings`.

    Parameters
    ----------
    path : str or path
    format : {"csv", "rep"}, optional
        A table, or a file of Debrief; by default the suffix decides (``.csv``, ``.txt``; ``.rep``, ``.dsf``).
    name : str, optional
        Which ship, where a REP file has tracks of several.

    Returns
    -------
    RecordedCourse
        A `SampledCourse` in metres, seconds and radians: straight lines between the fixes, headings (if there
        are any) unwrapped through 360 degrees. Its ``frame`` turns answers back: ``frame.to_geographic(xy)``,
        ``frame.to_datetime(seconds)``, ``frame.true_north(xy)``. Headings are those of the plane, from its
        y axis: true headings plus ``frame.true_north``.

    Raises
    ------
    ValueError
        For a file that is not as `tmalib.files` says; times that repeat or go backwards.
    ImportError
        For latitudes and longitudes without pyproj.

    Notes
    -----
    Headings turn the shorter way from fix to fix: a ship that turns by more than half a circle between two
    fixes is read as one that turns the other way.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import tmalib as tma
    >>> path = pathlib.Path(tempfile.mkdtemp(), "ship.csv")
    >>> _ = path.write_text('''time,x,y,heading
    ... 2024-05-01T12:00:00Z,0,0,350
    ... 2024-05-01T12:01:00Z,-50,300,10
    ... ''')
    >>> ship = tma.read_track(path)
    >>> ship.times, np.degrees(ship.headings).round(6), ship.position_at(30.0)
    (array([ 0., 60.]), array([350., 370.]), array([-25., 150.]))
    >>> print(ship.frame.to_datetime(30.0))
    2024-05-01T12:00:30.000000
    """
    if format_of(path, format) == "rep":
        table = debrief.read_fixes(path, name)
    elif name is not None:
        refuse(f"a table has one track, and no name to be given; got name={name!r}", path)
    else:
        table = read_csv(path, COLUMNS, ["time"], [("x", "y"), ("latitude", "longitude")])
    epoch = _epoch_of(table)
    times = seconds_in(Frame(epoch=epoch), table)
    if (row := table.row_where(np.diff(times, prepend=-np.inf) <= 0)) is not None:
        table.refuse("times must increase from row to row", row, "time")
    if "x" in table:
        frame = Frame(epoch=epoch)
        positions = np.stack([table.array("x"), table.array("y")], axis=-1)
    else:
        latitude, longitude = table.array("latitude"), table.array("longitude")
        frame = Frame(epoch, latitude[0], longitude[0])
        positions = frame.to_plane(latitude, longitude)
    headings = None
    if "heading" in table:
        headings = np.unwrap(np.radians(table.array("heading")) + frame.true_north(positions))
    return RecordedCourse(times, positions, headings, frame)


def _epoch_of(table):
    first = table.columns["time"][0]
    return None if first.kind == "number" and first.seconds < LEAST_UNIX_TIME else moment_of(first.seconds)


def seconds_in(frame: Frame, table: Table) -> FloatArray:
    """Times of a table in a frame, shape ``(N,)``, exact until each is rounded to a float."""
    times = table.columns["time"]
    kinds = [time.kind for time in times]
    if len(set(kinds)) > 1:
        row = next(i for i, kind in enumerate(kinds) if kind != kinds[0])
        table.refuse(f"a {kinds[row]}, but the rows before it have a {kinds[0]}", row, "time")
    if frame.epoch is None and kinds[0] != "number":
        table.refuse(f"a {kinds[0]}, but the platform's times are plain seconds", 0, "time")
    zero = 0 if frame.epoch is None else unix_seconds(frame.epoch)
    return np.array([float(time.seconds - zero) for time in times])
