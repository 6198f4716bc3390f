"""Files that are refused: what the message says, and that it names file, line and column."""

import re

import numpy as np
import pytest

import tmalib as tma
from tmalib.files import tables, text

SHIP = tma.RecordedCourse([0, 100], [(0, 0), (0, 300)])
HEADING = tma.RecordedCourse([0, 100], [(0, 0), (0, 300)], [0, 0])
TRACK = "time,x,y\n0,0,0\n60,0,300\n"

TRACKS = {  # content of the file, place, message
    "empty": ("", "", "the file is empty"),
    "blank": (" \n\n", "", "the file is empty"),
    "only commas": (",,\n,,\n", ", line 2, column ''", "unknown column"),
    "quotes only": ('""\n', "", "unknown column"),
    "header only": ("time,x,y\n", "", "the file has no rows"),
    "no header": ("0,0,0\n60,0,300\n", ", line 1", "the first line must name the columns"),
    "binary": (b"\x89PNG\r\n\x1a\n\0\0\0", ", line 3", "not a text in UTF-8: a zero byte"),
    "UTF-16": (TRACK.encode("utf-16"), ", line 1", "UTF-16?"),
    "Latin-1": (
        "time,x,y\n0,0,0\n60,0,3\xb5\n".encode("latin-1"),
        ", line 3",
        "not a text in UTF-8: byte 0xb5",
    ),
    "half a sign": ("time,x,y\n0,0,0\n1,1,é".encode()[:-1], ", line 3", "not a text in UTF-8"),
    "semicolons": ("time;x;y\n0;0;0\n", ", line 1", "columns are separated by commas"),
    "tabs": ("time\tx\ty\n0\t0\t0\n", ", line 1", "columns are separated by commas"),
    "unknown column": ("time,x,y,z\n0,0,0,0\n", ", line 1, column 'z'", "accepted are time, x, y, latitude"),
    "unit in the header": ("time,x (m),y\n0,0,0\n", ", line 1, column 'x (m)'", "unknown column"),
    "column twice": ("time,x,y,x\n0,0,0,0\n", ", line 1, column 'x'", "twice"),
    "no time": ("x,y\n0,0\n", ", line 1", "no column 'time'"),
    "no y": (
        "time,x\n0,0\n",
        ", line 1",
        "exactly one of these is wanted: x and y or latitude and longitude",
    ),
    "no position": ("time,heading\n0,0\n", ", line 1", "exactly one of these is wanted"),
    "both positions": ("time,x,y,latitude,longitude\n0,0,0,0,0\n", ", line 1", "exactly one of these"),
    "short row": (TRACK + "90,0\n", ", line 4", "2 cells where the header has 3"),
    "long row": (TRACK + "90,0,0,0\n", ", line 4", "4 cells where the header has 3"),
    "decimal commas": (TRACK + "90,0,5,1,5\n", ", line 4", "decimal commas?"),
    "quoted decimal comma": (TRACK + '90,"0,5",1\n', ", line 4, column 'x'", "decimals follow a point"),
    "after a blank line": (TRACK + "\n90,a,1\n", ", line 5, column 'x'", "a number is wanted, got 'a'"),
    "open quote": (TRACK + '90,"0,1\n', "", "not a comma-separated table"),
    "stray quote": (TRACK + '90,"0"1,1\n', ", line 4", "not a comma-separated table"),
    "huge cell": (TRACK + "90,0," + "1" * 200_000 + "\n", ", line 4", "not a comma-separated table"),
    "empty x": (TRACK + "90,,1\n", ", line 4, column 'x'", "a number is wanted, got ''"),
    "empty time": (TRACK + ",1,1\n", ", line 4, column 'time'", "a time is a number or a date-time"),
    "nan": (TRACK + "90,nan,1\n", ", line 4, column 'x'", "a number is wanted"),
    "inf": (TRACK + "90,inf,1\n", ", line 4, column 'x'", "a number is wanted"),
    "too large for a float": (
        TRACK + "90,1e999,1\n",
        ", line 4, column 'x'",
        "1e999 is not from -1e+08 to 1e+08 m",
    ),
    "underscore": (TRACK + "90,1_0,1\n", ", line 4, column 'x'", "a number is wanted"),
    "other digits": (TRACK + "90,٣,1\n", ", line 4, column 'x'", "a number is wanted"),
    "hexadecimal": (TRACK + "90,0x10,1\n", ", line 4, column 'x'", "a number is wanted"),
    "two signs": (TRACK + "90,--1,1\n", ", line 4, column 'x'", "a number is wanted"),
    "time backwards": (TRACK + "59,0,0\n", ", line 4, column 'time'", "times must increase"),
    "time twice": (TRACK + "60,0,300\n", ", line 4, column 'time'", "times must increase"),
    "milliseconds": ("time,x,y\n1714564800000,0,0\n", ", line 2, column 'time'", "milliseconds since 1970?"),
    "month 13": ("time,x,y\n2024-13-01T00:00:00Z,0,0\n", ", line 2, column 'time'", "is no date-time"),
    "30 February": ("time,x,y\n2024-02-30T00:00:00Z,0,0\n", ", line 2, column 'time'", "is no date-time"),
    "hour 25": ("time,x,y\n2024-02-03T25:00:00Z,0,0\n", ", line 2, column 'time'", "is no date-time"),
    "a day only": ("time,x,y\n2024-02-03,0,0\n", ", line 2, column 'time'", "a time is a number or"),
    "date the other way": (
        "time,x,y\n03.02.2024 10:00,0,0\n",
        ", line 2, column 'time'",
        "a time is a number or",
    ),
    "dates, then numbers": (
        "time,x,y\n2024-02-03T10:00Z,0,0\n1714564800,0,0\n",
        ", line 3, column 'time'",
        "a number, but the rows before it have a date-time with a zone",
    ),
    "zones, then none": (
        "time,x,y\n2024-02-03T10:00Z,0,0\n2024-02-03T11:00,0,0\n",
        ", line 3, column 'time'",
        "a date-time without a zone, but",
    ),
    "dates backwards": (
        "time,x,y\n2024-02-03T10:00Z,0,0\n2024-02-03T11:30+02:00,0,0\n",
        ", line 3, column 'time'",
        "times must increase",
    ),
    "latitude 95": (
        "time,latitude,longitude\n0,95,0\n",
        ", line 2, column 'latitude'",
        "95 is not from -90 to 90 degrees",
    ),
    "longitude 400": (
        "time,latitude,longitude\n0,9,400\n",
        ", line 2, column 'longitude'",
        "400 is not from -180 to 360 degrees",
    ),
    "minutes": (
        "time,latitude,longitude\n0,50 30.5 N,0\n",
        ", line 2, column 'latitude'",
        "a number is wanted",
    ),
    "heading 361": (
        "time,x,y,heading\n0,0,0,361\n",
        ", line 2, column 'heading'",
        "361 is not from -180 to 360",
    ),
    "empty heading": ("time,x,y,heading\n0,0,0,\n", ", line 2, column 'heading'", "a number is wanted"),
    "kilometres of light years": ("time,x,y\n0,1e12,0\n", ", line 2, column 'x'", "1e12 is not from"),
}

BEARINGS = {
    "bearing 400": (
        "time,bearing\n0,400\n",
        ", line 2, column 'bearing'",
        "400 is not from -180 to 360 degrees",
    ),
    "bearing -181": ("time,bearing\n0,-181\n", ", line 2, column 'bearing'", "-181 is not from"),
    "no bearing column": (
        "time,sigma\n0,1\n",
        ", line 1",
        "exactly one of these is wanted: bearing or relative",
    ),
    "both bearings": ("time,bearing,relative_bearing\n0,1,1\n", ", line 1", "exactly one of these is wanted"),
    "sigma 0": ("time,bearing,sigma\n0,1,0\n", ", line 2, column 'sigma'", "0 is not above 0 to 180 degrees"),
    "sigma -1": ("time,bearing,sigma\n0,1,-1\n", ", line 2, column 'sigma'", "-1 is not above 0"),
    "sigma 200": ("time,bearing,sigma\n0,1,200\n", ", line 2, column 'sigma'", "200 is not above 0 to 180"),
    "a sigma missing": (
        "time,bearing,sigma\n0,1,1\n10,1,\n",
        ", line 3, column 'sigma'",
        "no standard deviation",
    ),
    "no name": ("time,bearing,sensor\n0,1,\n", ", line 2, column 'sensor'", "a name of at most"),
    "unprintable name": (
        "time,bearing,sensor\n0,1,a\x07b\n",
        ", line 2, column 'sensor'",
        "a name of at most",
    ),
    "long name": (
        "time,bearing,sensor\n0,1," + "a" * 201 + "\n",
        ", line 2, column 'sensor'",
        "a name of at most",
    ),
    "kilometres a second": (
        "time,bearing,sigma,sound_speed\n0,1,1,1.5\n",
        ", line 2, column 'sound_speed'",
        "1.5 is not from 100 to 10000 m/s",
    ),
    "two sound speeds": (
        "time,bearing,sigma,sound_speed\n0,1,1,1500\n1,1,1,\n2,1,1,1480\n",
        ", line 4, column 'sound_speed'",
        "a sensor has one sound speed, and had 1500.0",
    ),
    "backwards": (
        "time,bearing,sigma\n10,1,1\n0,1,1\n",
        ", line 3, column 'time'",
        "goes backwards for this",
    ),
    "twice": (
        "sensor,time,bearing,sigma\na,0,1,1\nb,0,1,1\na,0,2,1\n",
        ", line 4, column 'time'",
        "is there twice for this sensor",
    ),
    "equal rows": ("time,bearing,sigma\n0,1,1\n0,1,1\n", ", line 3, column 'time'", "is there twice"),
    "before the track": (
        "time,bearing,sigma\n-1,1,1\n",
        ", line 2, column 'time'",
        "-1.000000 s cannot be placed on the platform's track",
    ),
    "after the track": ("time,bearing,sigma\n0,1,1\n100.5,1,1\n", ", line 3, column 'time'", "100.5"),
    "dates for seconds": (
        "time,bearing,sigma\n2024-02-03T10:00Z,1,1\n",
        ", line 2, column 'time'",
        "but the platform's times are plain seconds",
    ),
    "no heading": (
        "time,relative_bearing,sigma\n0,1,1\n",
        ", line 2, column 'relative_bearing'",
        "bearings from the bow need the platform's heading",
    ),
    "degrees and minutes": (
        "time,bearing,sigma\n0,10°30',1\n",
        ", line 2, column 'bearing'",
        "a number is wanted",
    ),
}


def refused(tmp_path, content, place, message, read):
    path = tmp_path / "some file.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        read(path)
    assert str(caught.value).startswith(f"{path}{place}"), str(caught.value)
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize(("content", "place", "message"), TRACKS.values(), ids=TRACKS)
def test_tracks(tmp_path, content, place, message):
    refused(tmp_path, content, place, message, tma.read_track)


@pytest.mark.parametrize(("content", "place", "message"), BEARINGS.values(), ids=BEARINGS)
def test_bearings(tmp_path, content, place, message):
    refused(tmp_path, content, place, message, lambda path: tma.read_bearings(path, SHIP))


def test_there_are_enough_cases():
    assert len(TRACKS) + len(BEARINGS) >= 60


def test_numbers_are_unix_times_where_the_track_has_an_epoch(tmp_path):
    ship = tmp_path / "ship.csv"
    ship.write_text("time,x,y\n2024-05-01T12:00Z,0,0\n2024-05-01T13:00Z,0,0\n")
    content = "time,bearing\n60,1\n"
    message = "cannot be placed on the platform's track"
    refused(tmp_path, content, ", line 2, column 'time'", message,
            lambda path: tma.read_bearings(path, tma.read_track(ship), sigma=0.01))  # fmt: skip


def test_files_that_are_too_large(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "MAX_BYTES", 20)
    refused(tmp_path, TRACK, "", "more than 20 bytes", tma.read_track)
    monkeypatch.undo()
    monkeypatch.setattr(text, "MAX_ROWS", 3)
    monkeypatch.setattr(tables, "MAX_ROWS", 3)
    refused(tmp_path, TRACK + "70,0,0\n80,0,0\n", "", "more than 3 rows", tma.read_track)
    assert len(tma.read_track(_written(tmp_path, TRACK + "70,0,0\n")).times) == 3


def _written(tmp_path, content):
    path = tmp_path / "track.csv"
    path.write_text(content)
    return path


def test_the_limits_are_what_the_documentation_says():
    assert (tma.files.MAX_BYTES, tma.files.MAX_ROWS) == (200e6, 1e6)


@pytest.mark.parametrize(("call", "message"), [
    (lambda path: tma.read_track(path.with_suffix(".xls")), "the suffix '.xls' says no format"),
    (lambda path: tma.read_track(path, format="xml"), "format must be 'csv' or 'rep', got 'xml'"),
    (lambda path: tma.read_track(path, name="NELSON"), "a table has one track"),
    (lambda path: tma.read_bearings(path, SHIP, name="NELSON"), "a table has the sensors of one ship"),
    (lambda path: tma.read_bearings(path, SHIP, sigma=0), "sigma must be greater than 0"),
    (lambda path: tma.RecordedCourse([0], [(0, 0)], frame=3), "frame must be a Frame, got 3"),
])  # fmt: skip
def test_arguments(tmp_path, call, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        call(_written(tmp_path, TRACK))


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(FileNotFoundError):
        tma.read_track(tmp_path / "none.csv")


def test_any_bytes_are_read_or_refused(tmp_path):
    """Random changes of a good file: a track, or a ValueError that names the file; nothing else."""
    random = np.random.default_rng(1)
    good = b"time,latitude,longitude,heading\n" + b"".join(
        b"2024-05-01T12:%02d:00Z,50.%02d,-5.1,359\n" % (i, i) for i in range(20)
    )
    path, read, named = tmp_path / "changed.csv", 0, 0
    for _ in range(300):
        data = bytearray(good)
        for place in random.integers(len(data), size=random.integers(1, 4)):
            data[place] = random.choice(list(b'0123456789,."\n-:TZ eE\0\xff'))
        path.write_bytes(data)
        try:
            positions = tma.read_track(path).positions
        except ValueError as error:
            named += str(error).startswith(str(path))
        else:
            read += bool(np.isfinite(positions).all())
    assert read + named == 300
    assert min(read, named) > 5
