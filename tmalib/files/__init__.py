"""Files: an own ship's track and bearings from tables and from Debrief's REP files; saving and loading.

*Own ship*, for `read_track`: one row a fix, in order of time.

=========================  ==========================================================================
``time``                   seconds, Unix times, or ISO 8601 date-times (`tmalib.files.clock`)
``x``, ``y``               metres east and north, or instead of them
``latitude, longitude``    degrees, WGS84, south and west negative
``heading``, optional      degrees clockwise from true north (from the y axis where there are x and y)
=========================  ==========================================================================

*Bearings*, for `read_bearings` and from `write_bearings`: one row a bearing, in order of time for each
sensor.

=========================  ==========================================================================
``time``                   as the own ship's
``bearing``                degrees clockwise from true north (from the y axis where there are x and y);
                           empty where nothing was heard. Or instead of it
``relative_bearing``       degrees clockwise from the bow
``sigma``, optional        standard deviation in degrees; `fit` estimates what is not known
``sensor``, optional       name of the sensor; without it all rows are of one
``sound_speed``, optional  m/s, one a sensor: its bearings are delayed by the way of the sound
=========================  ==========================================================================

A table is comma-separated text in UTF-8 (a byte order mark and CRLF do no harm) whose first line names the
columns, in any order. Numbers have a decimal point. Angles are from -180 to 360 degrees. What is not as
stated here is refused by a `ValueError` that names file, line and column; nothing is guessed.
A file has at most 200 MB (`MAX_BYTES`) and a million rows (`MAX_ROWS`). `tmalib.files.debrief` says what is
read of REP files.

The geographic columns need `pyproj`: ``pip install "tmalib[geo]"``.
"""

from .contacts import read_bearings, write_bearings
from .frame import Frame
from .saved import load, save
from .text import MAX_BYTES, MAX_ROWS
from .tracks import RecordedCourse, read_track

__all__ = [
    "MAX_BYTES", "MAX_ROWS", "Frame", "RecordedCourse", "load", "read_bearings", "read_track", "save",
    "write_bearings",
]  # fmt: skip
