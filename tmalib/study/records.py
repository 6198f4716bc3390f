"""Recorded tracks: latitudes and longitudes by ship or aircraft, from the formats of two public samples."""

from __future__ import annotations

import csv
import gzip
import io
import json
from datetime import UTC, datetime

import numpy as np

from ..files.frame import geodesics


def read_ais(data):
    """Tracks in a table of AIS reports, a dict from a ship's number to an array ``(N, 3)``.

    Columns of the arrays: seconds (Unix time), latitude and longitude in degrees. ``data`` are the bytes of a
    comma-separated table with the columns ``Time`` (ISO 8601, UTC), ``MMSI``, ``Latitude_degrees`` and
    ``Longitude_degrees``.

    Examples
    --------
    >>> table = b'''Time,MMSI,Latitude_degrees,Longitude_degrees
    ... 2016-01-12 13:00:10,7,50.1,-1.0
    ... 2016-01-12 13:00:00,7,50.0,-1.0
    ... '''
    >>> np.diff(read_ais(table)["7"], axis=0).round(3)
    array([[10. ,  0.1,  0. ]])
    """
    rows = csv.DictReader(io.StringIO(data.decode("utf-8")))
    return _by_name(
        (
            row["MMSI"],
            datetime.fromisoformat(row["Time"]).replace(tzinfo=UTC).timestamp(),
            float(row["Latitude_degrees"]),
            float(row["Longitude_degrees"]),
        )
        for row in rows
    )


def read_aircraft(data):
    """Tracks in a compressed list of aircraft positions, as `read_ais` gives them.

    ``data`` are the bytes of a gzipped JSON list of objects with ``icao24``, ``timestamp`` (milliseconds of
    Unix time), ``latitude`` and ``longitude``; objects without a position are left out.

    Examples
    --------
    >>> one = {"icao24": "a1", "timestamp": 5000, "latitude": 48.0, "longitude": 2.0}
    >>> read_aircraft(gzip.compress(json.dumps([one, one | {"latitude": None}]).encode()))
    {'a1': array([[ 5., 48.,  2.]])}
    """
    return _by_name(
        (row["icao24"], row["timestamp"] / 1e3, row["latitude"], row["longitude"])
        for row in json.loads(gzip.decompress(data))
        if row["latitude"] is not None and row["longitude"] is not None
    )


def _by_name(reports):
    found = {}
    for name, *report in reports:
        found.setdefault(name, []).append(report)
    return {name: np.unique(np.array(rows), axis=0) for name, rows in sorted(found.items())}


def without_jumps(track, fastest):
    """A track without fixes that would need more than ``fastest`` m/s from the last one that was kept.

    Of several fixes at one time the first is kept. The first fix of all is believed.

    Examples
    --------
    >>> track = np.array([[0, 50.0, 0.0], [10, 51.0, 0.0], [20, 50.001, 0.0]])
    >>> without_jumps(track, fastest=20.0)[:, 0]
    array([ 0., 20.])
    """
    line, kept = geodesics(), [track[0]]
    for fix in track[1:]:
        elapsed = fix[0] - kept[-1][0]
        if elapsed > 0:
            length = line.inv(kept[-1][2], kept[-1][1], fix[2], fix[1])[2]
            if length <= fastest * elapsed:
                kept.append(fix)
    return np.array(kept)
