"""The frame of a recorded track: which moment is time zero, which point of the Earth is the origin.

The plane is the azimuthal equidistant projection of the WGS84 ellipsoid, centred on the own ship's first fix:
a point at the geodesic distance d and azimuth a from the centre is at ``(d sin a, d cos a)``. What leaves the
centre, distances and bearings, is exact. At a distance r from it a length across is too long by the factor
``1 + r^2 / (6 R^2)``; true north is not parallel to the y axis but turned by about ``x tan(latitude) / R``.

Within 100 km of the centre

- distances are wrong by less than 5e-5 of themselves, 4 m in 100 km;
- true north is turned by up to 0.9 degrees at a latitude of 45 degrees, 1.6 at 60, 5.1 at 80;
  `Frame.true_north` has this angle, and the readers add it to bearings and headings;
- a bearing that is corrected so is wrong by less than 0.005 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..bearings import wrap
from ..checks import check_scalar, set_fields
from ..types import FloatArray

LONGEST_TIME = 9e12  # seconds that a datetime64 in microseconds can hold


def geodesics() -> Any:
    """The geodesics of WGS84; `ImportError` that says what to install where there is no pyproj."""
    try:
        from pyproj import Geod  # imported here: an extra, and only geographic positions need it
    except ImportError:
        raise ImportError('latitude and longitude need pyproj: pip install "tmalib[geo]"') from None
    return Geod(ellps="WGS84")


def _at_each(method, *arguments):
    """A method of pyproj on arrays of any shape, broadcast; NaN where an argument is not finite."""
    arrays = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in arguments))
    shape, flat = arrays[0].shape, [np.ravel(a) for a in arrays]
    finite = np.all(np.isfinite(flat), axis=0)
    found = method(*(np.where(finite, a, 0.0) for a in flat))
    return [np.where(finite, part, np.nan).reshape(shape) for part in found]


@dataclass(frozen=True)
class Frame:
    """Where time zero and the origin of the plane are.

    Parameters
    ----------
    epoch : datetime, optional
        The moment of time zero, with a time zone; kept in UTC. Without it times are plain seconds.
    latitude, longitude : float, optional
        The origin in degrees, both or none. Without it positions are metres from somewhere.

    Raises
    ------
    ValueError
        For an epoch without time zone, half a position, or one off the Earth; and where a conversion
        is asked for that the frame has no epoch or no origin for.
    ImportError
        Where a conversion needs `pyproj` and it is not installed.

    Notes
    -----
    C. F. F. Karney, *Algorithms for geodesics*, Journal of Geodesy 87 (2013), which pyproj computes.

    Examples
    --------
    >>> from datetime import UTC, datetime
    >>> frame = Frame(epoch=datetime(2024, 5, 1, 12, tzinfo=UTC))
    >>> frame.to_datetime([0.0, 90.25])
    array(['2024-05-01T12:00:00.000000', '2024-05-01T12:01:30.250000'],
          dtype='datetime64[us]')
    >>> float(frame.to_seconds("2024-05-01T12:01:30.25"))
    90.25
    """

    epoch: datetime | None = None
    latitude: float | None = None
    longitude: float | None = None

    def __post_init__(self) -> None:
        if self.epoch is not None:
            if not isinstance(self.epoch, datetime) or self.epoch.utcoffset() is None:
                raise ValueError(f"epoch must be a datetime with a time zone, got {self.epoch!r}")
            set_fields(self, epoch=self.epoch.astimezone(UTC))
        if (self.latitude is None) != (self.longitude is None):
            raise ValueError(f"give latitude and longitude or none, got {self.latitude}, {self.longitude}")
        if self.is_geographic:
            for name, limit in (("latitude", 90.0), ("longitude", 360.0)):
                value = check_scalar(name, getattr(self, name))
                if abs(value) > limit:
                    raise ValueError(f"{name} must be between -{limit} and {limit} degrees, got {value}")
                set_fields(self, **{name: value})

    @property
    def is_geographic(self) -> bool:
        """Whether the plane has an origin on the Earth."""
        return self.latitude is not None

    def _needs_origin(self):
        if not self.is_geographic:
            raise ValueError("the frame has no origin on the Earth; its track was given in metres")

    def _needs_epoch(self):
        if self.epoch is None:
            raise ValueError("the frame has no epoch; its track was given in plain seconds")
        return np.datetime64(self.epoch.replace(tzinfo=None), "us")

    def to_plane(self, latitude: ArrayLike, longitude: ArrayLike) -> FloatArray:
        """Position in the plane, shape ``(..., 2)``, of degrees that broadcast against each other.

        NaN where a coordinate is not finite; `ValueError` for a latitude beyond 90 degrees.

        Examples
        --------
        One minute of latitude north of the origin, then one of longitude west:

        >>> Frame(latitude=50.0, longitude=-5.0).to_plane([50 + 1 / 60, 50.0], [-5.0, -5 - 1 / 60]).round()
        array([[    0.,  1854.],
               [-1195.,     0.]])
        """
        self._needs_origin()
        latitude = np.asarray(latitude, dtype=float)
        if np.any(np.abs(latitude) > 90):
            raise ValueError(f"latitude must be between -90 and 90 degrees, got {latitude}")
        azimuth, _, distance = self._from_origin(latitude, longitude)
        azimuth = np.radians(azimuth)
        return np.stack([distance * np.sin(azimuth), distance * np.cos(azimuth)], axis=-1)

    def _from_origin(self, latitude, longitude):
        return _at_each(geodesics().inv, self.longitude, self.latitude, longitude, latitude)

    def to_geographic(self, xy: ArrayLike) -> FloatArray:
        """Latitude and longitude in degrees, shape ``(..., 2)``, of positions ``(..., 2)`` in the plane.

        Longitudes are from -180 to 180; a position that is not finite gives NaN.

        Examples
        --------
        >>> Frame(latitude=50.0, longitude=-5.0).to_geographic([0.0, 1853.75]).round(4)
        array([50.0167, -5.    ])
        """
        self._needs_origin()
        x, y = np.moveaxis(np.asarray(xy, dtype=float), -1, 0)
        azimuth, distance = np.degrees(np.arctan2(x, y)), np.hypot(x, y)
        longitude, latitude, _ = _at_each(geodesics().fwd, self.longitude, self.latitude, azimuth, distance)
        return np.stack([latitude, longitude], axis=-1)

    def true_north(self, xy: ArrayLike) -> FloatArray:
        """Angle in radians, clockwise from the y axis, at which true north lies at positions ``(..., 2)``.

        A true bearing ``b`` taken at ``xy`` is ``b + true_north(xy)`` in the plane; a course ``h`` in the
        plane of a target at ``xy`` is ``h - true_north(xy)`` from true north. Zero without an origin.

        Examples
        --------
        At 60 degrees north meridians close in: 10 km east of the origin north leans to the left.

        >>> round(float(np.degrees(Frame(latitude=60.0, longitude=0.0).true_north([10e3, 0.0]))), 3)
        -0.155
        """
        xy = np.asarray(xy, dtype=float)
        if not self.is_geographic:
            return np.zeros(xy.shape[:-1])
        latitude, longitude = np.moveaxis(self.to_geographic(xy), -1, 0)
        outwards, back, _ = self._from_origin(latitude, longitude)
        return wrap(np.radians(outwards - (back + 180.0)))

    def to_datetime(self, seconds: ArrayLike) -> NDArray[np.datetime64]:
        """UTC as ``datetime64[us]``, shape as ``seconds``; NaT where these are not finite."""
        epoch, seconds = self._needs_epoch(), np.asarray(seconds, dtype=float)
        finite = np.abs(seconds) < LONGEST_TIME
        whole = np.rint(np.where(finite, seconds, 0.0) * 1e6).astype("timedelta64[us]")
        return np.where(finite, epoch + whole, np.datetime64("NaT", "us"))[()]

    def to_seconds(self, moment: ArrayLike) -> FloatArray:
        """Seconds since the epoch of a `datetime`, ``datetime64`` or ISO texts in UTC, shape as these."""
        epoch = self._needs_epoch()
        if isinstance(moment, datetime) and moment.utcoffset() is not None:
            moment = moment.astimezone(UTC).replace(tzinfo=None)
        return (np.asarray(moment, dtype="datetime64[us]") - epoch) / np.timedelta64(1_000_000, "us")
