"""Bearings from a file, a scenario without a target and what was measured; and bearings to a file."""

from __future__ import annotations

import csv
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..bearings import Bearing, DelayedBearing, wrap
from ..checks import check_scalar
from ..scenario import Scenario
from ..sensors import Sensor
from ..types import FilePath, FloatArray, Motion
from . import debrief
from .clock import date_time_of, unix_seconds
from .tables import ANGLE_OR_NONE, SIGMA_OR_NONE, SOUND_SPEED_OR_NONE, TIME, Table, name_cell, read_csv
from .text import format_of, refuse
from .tracks import PLAIN, RecordedCourse, seconds_in

COLUMNS = {
    "time": TIME, "bearing": ANGLE_OR_NONE, "relative_bearing": ANGLE_OR_NONE, "sigma": SIGMA_OR_NONE,
    "sensor": name_cell, "sound_speed": SOUND_SPEED_OR_NONE,
}  # fmt: skip


def read_bearings(
    path: FilePath,
    platform: Motion,
    *,
    sigma: float | None = None,
    sound_speed: float | None = None,
    format: str | None = None,
    name: str | None = None,
) -> tuple[Scenario, FloatArray]:
    """Scenario and measured bearings of a file.

    Parameters
    ----------
    path : str or path
    platform : motion
        The own ship, as a rule from `read_track`; its `Frame` says what the times of the file mean and where
        true north is. With any other motion times are plain seconds and bearings are from its y axis.
    sigma : float, optional
        Standard deviation in radians of the bearings for which the file has none. Without it that of a sensor
        for which the file has none at all is not known, and `fit` estimates it.
    sound_speed : float, optional
        In m/s, for sensors for which the file has none: their bearings are delayed. Without it, and without
        one in the file, bearings are instantaneous.
    format : {"csv", "rep"}, optional
        As in `read_track`.
    name : str, optional
        The ship whose sensors are wanted, where a REP file has those of several.

    Returns
    -------
    scenario : Scenario
        The platform, one `Sensor` for each name in the order of its first row, a reference time at the last
        row, and no target.
    angles : ndarray, shape (N,)
        The bearings in the scenario's order, in radians from the y axis of the plane, in [-pi, pi]; NaN where
        nothing was heard.

    Raises
    ------
    ValueError
        For a file that is not as `tmalib.files` says; a time outside the platform's track; times of a sensor
        that go backwards or repeat, equal rows included: a bearing that is counted twice weighs too much.

    Notes
    -----
    Rows of several sensors may be mixed in any way. Where nothing was heard a missing sigma is the sensor's
    first. A sensor whose REP lines have positions is carried by a `RecordedCourse` through these.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import tmalib as tma
    >>> ship = tma.RecordedCourse([0, 60], [(0, 0), (0, 300)], headings=np.radians([350, 370]))
    >>> path = pathlib.Path(tempfile.mkdtemp(), "bearings.csv")
    >>> _ = path.write_text('''time,relative_bearing,sensor,sigma
    ... 0,10,bow,1
    ... 30,,bow,1
    ... 30,-45,flank,2
    ... 60,0,bow,1
    ... ''')
    >>> scenario, angles = tma.read_bearings(path, ship)
    >>> [sensor.name for sensor in scenario.sensors], np.degrees(angles).round(6)
    (['bow', 'flank'], array([  0.,  nan,  10., -45.]))
    """
    sigma = None if sigma is None else check_scalar("sigma", sigma, above=0.0)
    sound_speed = None if sound_speed is None else check_scalar("sound_speed", sound_speed, above=0.0)
    if format_of(path, format) == "rep":
        table = debrief.read_contacts(path, name)
    elif name is not None:
        refuse(f"a table has the sensors of one ship, and no name to be given; got name={name!r}", path)
    else:
        table = read_csv(path, COLUMNS, ["time"], [("bearing",), ("relative_bearing",)])
    frame = getattr(platform, "frame", PLAIN)
    times = seconds_in(frame, table)
    sensors, angles = [], []
    for own, rows in _by_sensor(table, times):
        own_times = times[rows]
        _check_times(own, own_times, platform)
        carrier = _own_platform(own, own_times, frame)
        heard = _angles(own, own_times, platform, carrier or platform, frame)
        noise = _sigmas(own, np.isfinite(heard), sigma)
        model = _model(own, sound_speed)
        sensors.append(Sensor(model, own_times, noise, own.columns.get("sensor", [""])[0], carrier))
        angles.append(heard)
    return Scenario(platform, sensors, reference_time=times.max()), np.concatenate(angles)


def _by_sensor(table, times):
    """A table for every sensor, with the rows it has of the whole."""
    names = table.columns.get("sensor", [""] * len(times))
    groups = {}
    for row, name in enumerate(names):
        groups.setdefault(name, []).append(row)
    for rows in groups.values():
        columns = {name: [column[row] for row in rows] for name, column in table.columns.items()}
        yield Table(table.path, [table.lines[row] for row in rows], columns), rows


def _check_times(table, times, platform):
    step = np.diff(times, prepend=-np.inf)
    if (row := table.row_where(step <= 0)) is not None:
        fault = "is there twice for this sensor" if step[row] == 0 else "goes backwards for this sensor"
        table.refuse(f"the time {fault}", row, "time")
    try:
        platform.position_at(times)
    except ValueError:
        for row, time in enumerate(times):
            try:
                platform.position_at(time)
            except ValueError as error:
                epoch = getattr(getattr(platform, "frame", None), "epoch", None)
                since = "" if epoch is None else f" after {epoch:%Y-%m-%dT%H:%M:%S}"
                table.refuse(
                    f"{time:.6f} s{since} cannot be placed on the platform's track: {error}", row, "time"
                )
        raise


def _own_platform(table, times, frame):
    """A `RecordedCourse` through the positions of a sensor's rows, `None` where they have none."""
    latitude, longitude = table.array("latitude"), table.array("longitude")
    missing = np.isnan(latitude)
    if missing.all():
        return None
    if (row := table.row_where(missing)) is not None:
        table.refuse("no position, but other lines of this sensor have one", row, "latitude")
    if not frame.is_geographic:
        table.refuse("a position on the Earth, but the platform's track has none", 0, "latitude")
    return RecordedCourse(times, frame.to_plane(latitude, longitude), None, frame)


def _angles(table, times, platform, carrier, frame):
    if "bearing" in table:
        north = frame.true_north(carrier.position_at(times))
        return wrap(np.radians(table.array("bearing")) + north)
    try:
        bow = platform.heading_at(times)
    except (ValueError, AttributeError) as error:
        message = f"bearings from the bow need the platform's heading: {error}"
        table.refuse(message, 0, "relative_bearing")
    return wrap(np.radians(table.array("relative_bearing")) + bow)


def _sigmas(table, heard, given):
    """Standard deviations in radians: a number where all are equal, else an array; `None` if not known."""
    sigma = np.radians(table.array("sigma"))
    known = np.isfinite(sigma)
    if given is not None:
        sigma = np.where(known, sigma, given)
    elif not known.any():
        return None
    else:
        sigma = np.where(known | heard, sigma, sigma[known][0])
        if (row := table.row_where(np.isnan(sigma))) is not None:
            table.refuse("no standard deviation; give it here, or one sigma for all", row, "sigma")
    return float(sigma[0]) if np.all(sigma == sigma[0]) else sigma


def _model(table, given):
    speed = table.array("sound_speed")
    known = speed[np.isfinite(speed)]
    if not len(known):
        return Bearing() if given is None else DelayedBearing(given)
    if (row := table.row_where(np.isfinite(speed) & (speed != known[0]))) is not None:
        table.refuse(f"a sensor has one sound speed, and had {known[0]} m/s before", row, "sound_speed")
    return DelayedBearing(float(known[0]))


def write_bearings(path: FilePath, scenario: Scenario, angles: ArrayLike) -> None:
    """Write the bearings of one run to a table that `read_bearings` reads.

    Parameters
    ----------
    path : str or path
        Is overwritten.
    scenario : Scenario
        Of sensors with `Bearing` or `DelayedBearing`, each with its own name, all on the platform.
    angles : array_like, shape (N,)
        In radians, in the scenario's order; NaN where nothing was heard.

    Raises
    ------
    ValueError
        For another shape, and for sensors that a table cannot hold; no file is written then.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import tmalib as tma
    >>> ship = tma.RecordedCourse([0, 60], [(0, 0), (0, 300)])
    >>> ear = tma.Sensor(tma.Bearing(), [0.0, 30.0], sigma=np.radians(1), name="bow")
    >>> path = pathlib.Path(tempfile.mkdtemp(), "bearings.csv")
    >>> write_bearings(path, tma.Scenario(ship, [ear], 60), np.radians([10.0, -10.0]))
    >>> print(path.read_text(encoding="utf-8"), end="")
    time,bearing,sigma,sensor,sound_speed
    0.0,10.0,1.0,bow,
    30.0,350.0,1.0,bow,
    """
    angles = scenario.check_measurements(angles)
    if angles.ndim != 1:
        raise ValueError(f"angles must be of one run, shape ({len(scenario.times)},), got {angles.shape}")
    names = [sensor.name for sensor in scenario.sensors]
    if len(set(names)) < len(names):
        raise ValueError(f"sensors must have different names to be written to a table, got {names}")
    rows = [row for block in scenario.blocks for row in _rows(scenario, block, angles[block.columns])]
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["time", "bearing", "sigma", "sensor", "sound_speed"])
        table.writerows(rows)


def _rows(scenario, block, angles):
    """Cells of a sensor's rows."""
    sensor, platform = block.sensor, scenario.platform
    if type(sensor.model) not in (Bearing, DelayedBearing) or scenario.platform_of(sensor) is not platform:
        raise ValueError(
            f"a table holds bearings of one platform, and {sensor.name} is a {type(sensor.model).__name__}"
            f"{'' if sensor.platform is None else ' with a platform of its own'}"
        )
    frame = getattr(platform, "frame", PLAIN)
    speed = getattr(sensor.model, "c", "")
    degrees = np.degrees(angles - frame.true_north(platform.position_at(sensor.times))) % 360
    sigmas = np.broadcast_to(np.nan if sensor.sigma is None else np.degrees(sensor.sigma), degrees.shape)
    for time, *numbers in zip(sensor.times.tolist(), degrees.tolist(), sigmas.tolist(), strict=True):
        if frame.epoch is not None:
            time = date_time_of(unix_seconds(frame.epoch) + Decimal(repr(time)))
        bearing, sigma = ("" if np.isnan(number) else number for number in numbers)
        yield time, bearing, sigma, sensor.name, speed
