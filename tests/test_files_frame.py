"""The frame of a recorded track: positions against geodesics and PROJ, times against exact arithmetic."""

import re
from datetime import UTC, datetime, timedelta, timezone
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod, Proj

import tmalib as tma
from tmalib.files.clock import moment_of, parse_time, unix_seconds

EARTH = Geod(ellps="WGS84")
NOON = datetime(2024, 5, 1, 12, tzinfo=UTC)


def within(frame, radius, count, seed):
    """Longitudes and latitudes of points spread evenly around the origin, by geodesics."""
    random = np.random.default_rng(seed)
    origin = np.full(count, frame.longitude), np.full(count, frame.latitude)
    distance = radius * np.sqrt(random.random(count))
    longitude, latitude, _ = EARTH.fwd(*origin, 360 * random.random(count), distance)
    return np.array(longitude), np.array(latitude)


FRAMES = [tma.Frame(latitude=a, longitude=o) for a, o in
          [(0, 0), (45, -5), (60, 20), (80, 100), (-60, 179.9), (-33, 181), (89.9, 0)]]  # fmt: skip


@pytest.mark.parametrize("frame", FRAMES, ids=lambda f: f"{f.latitude:g},{f.longitude:g}")
def test_the_plane_is_the_azimuthal_equidistant_projection_of_proj(frame):
    longitude, latitude = within(frame, 300e3, 200, 1)
    proj = Proj(proj="aeqd", lat_0=frame.latitude, lon_0=frame.longitude, ellps="WGS84")
    wanted = np.stack(proj(longitude, latitude), axis=-1)
    assert np.abs(frame.to_plane(latitude, longitude) - wanted).max() < 1e-5  # metres


@pytest.mark.parametrize("frame", FRAMES, ids=lambda f: f"{f.latitude:g},{f.longitude:g}")
def test_there_and_back(frame):
    longitude, latitude = within(frame, 300e3, 200, 2)
    xy = frame.to_plane(latitude, longitude)
    again = frame.to_geographic(xy)
    assert EARTH.inv(longitude, latitude, again[:, 1], again[:, 0])[2].max() < 1e-6
    assert np.abs(frame.to_plane(*again.T) - xy).max() < 1e-6
    assert np.abs(again[:, 1]).max() <= 180


@pytest.mark.parametrize("frame", FRAMES[:-1], ids=lambda f: f"{f.latitude:g},{f.longitude:g}")
def test_what_the_docstring_says_of_100_km(frame):
    """Distances to 5e-5, corrected bearings to 0.005 degrees, between any two points within 100 km."""
    (lon1, lat1), (lon2, lat2) = within(frame, 100e3, 20_000, 3), within(frame, 100e3, 20_000, 4)
    azimuth, _, distance = EARTH.inv(lon1, lat1, lon2, lat2)
    here, there = frame.to_plane(lat1, lon1), frame.to_plane(lat2, lon2)
    gap = there - here
    apart = distance > 10
    assert np.abs(np.hypot(*gap.T) / distance - 1)[apart].max() < 5e-5
    corrected = np.radians(azimuth) + frame.true_north(here)
    error = np.degrees(np.abs(tma.wrap(tma.bearing(gap) - corrected)))[apart]
    assert error.max() < 0.005
    uncorrected = np.degrees(np.abs(tma.wrap(tma.bearing(gap) - np.radians(azimuth))))[apart]
    if abs(frame.latitude) > 30:
        assert uncorrected.max() > 0.5, "north is turned by what the docstring says: the correction is needed"


def test_true_north_by_a_step_north():
    frame = tma.Frame(latitude=60, longitude=10)
    longitude, latitude = within(frame, 100e3, 100, 5)
    step = frame.to_plane(latitude + 1e-5, longitude) - frame.to_plane(latitude - 1e-5, longitude)
    error = tma.wrap(tma.bearing(step) - frame.true_north(frame.to_plane(latitude, longitude)))
    assert np.degrees(np.abs(error)).max() < 0.003  # of which the projection's own shear is 0.0024
    known = {45: 0.9, 60: 1.56, 80: 5.1}
    for latitude, turn in known.items():
        edge = tma.Frame(latitude=latitude, longitude=0).true_north([100e3, 0])
        assert np.degrees(edge) == pytest.approx(-turn, rel=0.01)


def test_true_north_at_the_origin_and_without_one():
    assert tma.Frame(latitude=60, longitude=10).true_north([0.0, 0.0]) == 0
    assert np.array_equal(tma.Frame().true_north(np.ones((3, 4, 2))), np.zeros((3, 4)))


def test_a_batch_keeps_its_shape_and_its_members():
    frame = tma.Frame(latitude=60, longitude=10)
    xy = np.random.default_rng(6).normal(scale=1e4, size=(2, 3, 2))
    alone = frame.to_geographic(xy)
    xy[0, 1, 0] = np.nan
    xy[1, 2, 1] = np.inf
    together, north = frame.to_geographic(xy), frame.true_north(xy)
    lost = ~np.isfinite(xy).all(axis=-1)
    assert np.isnan(together[lost]).all()
    assert np.isnan(north[lost]).all()
    assert np.array_equal(together[~lost], alone[~lost])
    assert frame.to_plane(60.1, [10.0, np.nan]).shape == (2, 2)
    assert np.isnan(frame.to_plane(60.1, [10.0, np.nan])[1]).all()


@given(st.integers(0, 4_000_000_000), st.integers(0, 999_999_999))
def test_differences_of_unix_times_are_exact(whole, billionths):
    """Seconds since the epoch are the float nearest to the exact difference; that of floats is not."""
    text = f"{whole}.{billionths:09d}"
    later = f"{whole + 7}.{billionths:09d}"
    epoch = moment_of(parse_time(text).seconds)
    found = float(parse_time(later).seconds - unix_seconds(epoch))
    exact = Fraction(later) - Fraction(
        int((epoch - datetime(1970, 1, 1, tzinfo=UTC)) / timedelta(microseconds=1)), 10**6
    )
    assert found == float(exact)
    assert abs(found - 7) < 1e-6


@pytest.mark.parametrize(("text", "seconds"), [
    ("2024-05-01T12:00:00Z", "1714564800"),
    ("2024-05-01 12:00", "1714564800"),
    ("2024-05-01T14:00:00+02:00", "1714564800"),
    ("2024-05-01T12:00:00.123456789Z", "1714564800.123456789"),
    ("1970-01-01T00:00:00.5", "0.5"),
    ("1969-12-31T23:59:59Z", "-1"),
    ("1714564800.000000001", "1714564800.000000001"),
    ("-2.5e2", "-250"),
    (".5", "0.5"),
])  # fmt: skip
def test_times(text, seconds):
    assert Fraction(parse_time(text).seconds) == Fraction(seconds)


@given(st.floats(-1e8, 1e8))
def test_datetimes_there_and_back(seconds):
    frame = tma.Frame(epoch=NOON)
    moment = frame.to_datetime(seconds)
    assert abs(frame.to_seconds(moment) - seconds) <= 0.51e-6
    python = frame.epoch + timedelta(microseconds=round(Fraction(seconds) * 10**6))
    assert abs(moment.item().replace(tzinfo=UTC) - python) <= timedelta(microseconds=1)
    assert frame.to_seconds(python) == (python - frame.epoch) / timedelta(seconds=1)


@pytest.mark.parametrize("hours", [-5, 0, 2])
def test_a_moment_is_the_same_in_every_zone(hours):
    """Noon in UTC, as a clock shows it that is so many hours ahead."""
    moment = datetime(2024, 5, 1, 12 + hours, 0, 1, tzinfo=timezone(timedelta(hours=hours)))
    assert tma.Frame(NOON).to_seconds(moment) == 1.0
    assert tma.Frame(moment).to_seconds(NOON) == -1.0


def test_moments_of_a_batch():
    frame = tma.Frame(epoch=NOON.astimezone(timezone(timedelta(hours=5))))
    assert frame.epoch.utcoffset() == timedelta(0)
    found = frame.to_datetime([[0.0, np.nan, np.inf]])
    assert found.shape == (1, 3)
    assert found[0, 0] == np.datetime64("2024-05-01T12:00:00")
    assert np.isnat(found[0, 1:]).all()
    assert frame.to_seconds(["2024-05-01T12:00:01", "2024-05-01"]).tolist() == [1.0, -43200.0]


@pytest.mark.parametrize(("make", "message"), [
    (lambda: tma.Frame(epoch=datetime(2024, 5, 1)), "epoch must be a datetime with a time zone"),
    (lambda: tma.Frame(epoch="2024-05-01"), "epoch must be a datetime"),
    (lambda: tma.Frame(latitude=50), "give latitude and longitude or none"),
    (lambda: tma.Frame(latitude=91, longitude=0), "latitude must be between"),
    (lambda: tma.Frame(latitude=0, longitude=400), "longitude must be between"),
    (lambda: tma.Frame(latitude=np.nan, longitude=0), "latitude must be finite"),
    (lambda: tma.Frame().to_geographic([0, 0]), "no origin on the Earth"),
    (lambda: tma.Frame().to_plane(0, 0), "no origin on the Earth"),
    (lambda: tma.Frame().to_datetime(0), "no epoch"),
    (lambda: tma.Frame().to_seconds("2024-05-01"), "no epoch"),
    (lambda: tma.Frame(latitude=0, longitude=0).to_plane([0, 95], 0), "latitude must be between -90 and 90"),
])  # fmt: skip
def test_refused(make, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make()


def test_without_pyproj_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyproj", None)
    with pytest.raises(ImportError, match=re.escape("tmalib[geo]")):
        tma.Frame(latitude=0, longitude=0).to_geographic([0, 0])
