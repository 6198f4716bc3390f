"""Debrief's REP files: samples written by hand from the description of the format."""

import re

import numpy as np
import pytest
from pyproj import Geod

import tmalib as tma

EARTH = Geod(ellps="WGS84")
SAMPLE = """\
;; a comment
;NARRATIVE: 240501 120030 HERON first detection
240501 120000.000 HERON @C 60 30 0.00 N 5 15 36.00 W 358.0 10.0 0
240501 120000.000 "Grey Seal" @A 60 40 0 N 5 0 0 W 90.0 4.0 30 a label of words
240501 120100 HERON @C 60.505 0 0 N 5 15.6 0 W 2.0 10.0 NaN
20240501 120200.500 HERON @C 60 30 36.00 N005 15 36.00 W 10 10.0 0
;SENSORARC 240501 120000 240501 120100 HERON @@ -45 45 0 1000 "bow"

;SENSOR: 240501 120000.000 HERON @B NULL 45.0 NULL bow held
;SENSOR2: 240501 120000 HERON @B NULL NULL NULL 149.6 NULL tone
;SENSOR:\t240501\t120100\tHERON\t@B\tNULL\t-10\t0000\tbow
;SENSOR3: 240501 120030 HERON @B 60 30 0 N 5 16 0 W 200.0 0.5 NULL NULL 5000 "towed array" held on it
;SENSOR2: 240501 120200 HERON @B NULL NaN NULL 151.2 NULL bow
;SENSOR3: 240501 120130.25 HERON @B 60 30 18 N 5 16 0 W 201.0 0.5 150.1 0.2 NULL "towed array"
;SENSOR: 240501 120000 "Grey Seal" @B NULL 1.0 NULL ear
"""


@pytest.fixture
def sample(tmp_path):
    path = tmp_path / "sample.rep"
    path.write_text(SAMPLE)
    return path


def test_a_track(sample):
    """Positions by hand: 60.5, 60.505 and 60.51 degrees north, all 5.26 degrees west."""
    ship = tma.read_track(sample, name="HERON")
    assert ship.times.tolist() == [0, 60, 120.5]
    assert ship.frame.epoch.isoformat() == "2024-05-01T12:00:00+00:00"
    wanted = np.array([[60.5, -5.26], [60.505, -5.26], [60.51, -5.26]])
    assert ship.frame.to_geographic(ship.positions) == pytest.approx(wanted, abs=1e-10)
    north = [EARTH.inv(-5.26, 60.5, -5.26, latitude)[2] for latitude in wanted[:, 0]]
    assert ship.positions == pytest.approx(np.stack([np.zeros(3), north], -1), abs=1e-6)
    assert np.degrees(ship.headings) == pytest.approx([358, 362, 370])


def test_the_other_ship(sample):
    seal = tma.read_track(sample, name="Grey Seal")
    assert seal.times.tolist() == [0]
    assert seal.frame.latitude == pytest.approx(60 + 2 / 3)
    assert np.degrees(seal.headings) == pytest.approx(90)


def test_contacts(sample):
    """Two sensors: one on the ship, one with positions of its own; the tone tracker has no bearings."""
    ship = tma.read_track(sample, name="HERON")
    scenario, angles = tma.read_bearings(sample, ship, name="HERON", sigma=0.02, sound_speed=1500)
    bow, towed = scenario.sensors
    assert (bow.name, towed.name) == ("bow", "towed array")
    assert bow.times.tolist() == [0, 60, 120]
    assert towed.times.tolist() == [30, 90.25]
    assert (bow.sigma, towed.sigma) == (0.02, np.radians(0.5))
    assert bow.model == towed.model == tma.DelayedBearing(1500)
    assert bow.platform is None
    west = towed.platform.position_at([30.0, 90.25])
    wanted = np.array([[60.5, -5 - 16 / 60], [60.505, -5 - 16 / 60]])
    assert ship.frame.to_geographic(west) == pytest.approx(wanted, abs=1e-10)
    assert np.isnan(angles).tolist() == [False, False, True, False, False]
    assert np.degrees(angles[:2]) == pytest.approx([45, -10], abs=1e-6)  # on the first meridian
    turned = np.degrees(ship.frame.true_north(west))
    assert np.degrees(angles[3:]) == pytest.approx(np.array([-160, -159]) + turned)
    assert (np.abs(turned) > 0.004).all()


@pytest.mark.parametrize(
    ("day", "year"), [("240501", 2024), ("19951212", 1995), ("951212", 1995), ("80101", 2008)]
)
def test_years(tmp_path, day, year):
    path = tmp_path / "year.rep"
    path.write_text(f"{day} 200 HERON @C 0 0 0 N 0 0 0 E 0 0 0\n")
    epoch = tma.read_track(path).frame.epoch
    assert epoch.year == year
    assert (epoch.hour, epoch.minute, epoch.second) == (0, 2, 0), "leading zeros are left out"


def test_hemispheres_and_the_date_line(tmp_path):
    path = tmp_path / "south.rep"
    path.write_text("240501 120000 HERON @C 12 30 0 S 179 59 0 E 0 0 0\n"
                    "240501 120100 HERON @C 12 30 60 s 179 59 0 w 0 0 0\n")  # fmt: skip
    ship = tma.read_track(path)
    distance = EARTH.inv(179 + 59 / 60, -12.5, -179 - 59 / 60, -12 - 31 / 60)[2]
    assert np.hypot(*ship.positions[1]) == pytest.approx(distance)
    assert distance < 5e3


FIX = "240501 120000 HERON @C 60 30 0 N 5 15 36 W 358 10 0\n"
SECOND = "240501 120200 HERON @C 60 31 0 N 5 15 36 W 358 10 0\n"
CUT = ";SENSOR: 240501 120{} HERON @B {} {} NULL bow\n"
REFUSED = {
    "not REP": ("time,x,y\n0,0,0\n", ", line 1", "neither a fix nor a line that begins with a semicolon"),
    "no fix": (";; nothing\n", "", "the file has no rows"),
    "several ships": (FIX + FIX.replace("HERON", "SEAL"), "", "lines of HERON, SEAL; name=... says"),
    "short": (
        "240501 120000 HERON @C 60 30 0 N 5 15\n",
        ", line 1, column 'longitude'",
        "the line ends before",
    ),
    "no date": (
        "2405011 120000 HERON @C 60 30 0 N 5 15 36 W 358 10 0\n",
        ", line 1, column 'date'",
        "a date YYMMDD or YYYYMMDD",
    ),
    "month 13": (FIX.replace("240501", "241301"), ", line 1, column 'date'", "is no date and time"),
    "minute 60": (FIX.replace("120000", "126000"), ", line 1, column 'date'", "is no date and time"),
    "latitude 91": (
        FIX.replace("60 30 0 N", "91 0 0 N"),
        ", line 1, column 'latitude'",
        "91 is not from 0 to 90",
    ),
    "latitude 90 30": (FIX.replace("60 30 0 N", "90 30 0 N"), ", line 1, column 'latitude'", "more than 90"),
    "minutes 61": (
        FIX.replace("60 30 0 N", "60 61 0 N"),
        ", line 1, column 'latitude'",
        "61 is not from 0 to 60",
    ),
    "hemisphere": (
        FIX.replace("0 N 5", "0 E 5"),
        ", line 1, column 'latitude'",
        "a hemisphere, N or S, is wanted",
    ),
    "heading": (FIX.replace("358", "east"), ", line 1, column 'heading'", "a number is wanted, got 'east'"),
    "decimal comma": (FIX.replace("358", "358,5"), ", line 1, column 'heading'", "decimals follow a point"),
    "backwards": (SECOND + FIX, ", line 2, column 'time'", "times must increase"),
    "zero bytes": ("\0" + FIX, ", line 1", "not a text in UTF-8"),
}
REFUSED_CUTS = {
    "bearing 400": (
        CUT.format("000", "NULL", 400),
        ", line 3, column 'bearing'",
        "400 is not from -180 to 360",
    ),
    "no bearing at all": (CUT.format("000", "NULL", "NULL"), "", "no line of a sensor has a bearing"),
    "no cuts": (";; none\n", "", "the file has no rows"),
    "half a position": (
        CUT.format("000", "60 30 0 N", 4),
        ", line 3, column 'longitude'",
        "a number is wanted",
    ),
    "a position lost": (
        CUT.format("000", "60 30 0 N 5 15 36 W", 4) + CUT.format("100", "NULL", 4),
        ", line 4, column 'latitude'",
        "no position, but other lines of this sensor have one",
    ),
    "no sensor": (
        CUT.format("000", "NULL", 4).replace(" bow", ""),
        ", line 3, column 'sensor'",
        "the line ends",
    ),
    "other ship": (
        CUT.format("000", "NULL", 4) + CUT.format("000", "NULL", 4).replace("HERON", "SEAL"),
        "",
        "lines of HERON, SEAL",
    ),
    "outside the track": (CUT.format("300", "NULL", 4), ", line 3, column 'time'", "cannot be placed on"),
    "two bearings": (
        ";SENSOR2: 240501 120000 HERON @B NULL 10 340 NULL NULL array\n",
        ", line 3, column 'second bearing'",
        "two bearings; put NULL for the one that does not hold",
    ),
    "accuracy 0": (
        ";SENSOR3: 240501 120000 HERON @B NULL 10 0 NULL NULL NULL array\n",
        ", line 3, column 'sigma'",
        "0 is not above 0",
    ),
}


def refused(path, place, message, read):
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        read()
    assert str(caught.value).startswith(f"{path}{place}: "), str(caught.value)


@pytest.mark.parametrize(("content", "place", "message"), REFUSED.values(), ids=REFUSED)
def test_refused(tmp_path, content, place, message):
    path = tmp_path / "bad.rep"
    path.write_text(content)
    refused(path, place, message, lambda: tma.read_track(path))


@pytest.mark.parametrize(("content", "place", "message"), REFUSED_CUTS.values(), ids=REFUSED_CUTS)
def test_refused_cuts(tmp_path, content, place, message):
    path = tmp_path / "bad.rep"
    path.write_text(FIX + SECOND + content)
    ship = tma.read_track(path)
    refused(path, place, message, lambda: tma.read_bearings(path, ship, sigma=0.01))


def test_no_such_ship(sample):
    refused(sample, "", "no line of 'SEAL'; there are lines of HERON, Grey Seal",
            lambda: tma.read_track(sample, name="SEAL"))  # fmt: skip


def test_a_position_needs_a_geographic_track(sample):
    epoch = tma.read_track(sample, name="HERON").frame.epoch
    ship = tma.RecordedCourse([0, 200], [(0, 0), (0, 300)], frame=tma.Frame(epoch))
    refused(
        sample,
        ", line 12, column 'latitude'",
        "a position on the Earth, but the platform's track has none",
        lambda: tma.read_bearings(sample, ship, name="HERON", sigma=0.01),
    )
