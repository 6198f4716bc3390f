"""Tracks and bearings from tables: what is read, checked by hand and against geodesics."""

import numpy as np
import pytest
from pyproj import Geod

import tmalib as tma

EARTH = Geod(ellps="WGS84")


@pytest.fixture
def write(tmp_path):
    """Write a file and give its path."""

    def write(text, name="file.csv", encoding="utf-8"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
        return path

    return write


SHIP = tma.RecordedCourse([0, 60, 120], [(0, 0), (0, 300), (300, 300)], np.radians([350, 370, 450]))


# -- own ship -----------------------------------------------------------------------------------


def test_a_track_in_metres(write):
    ship = tma.read_track(write("time,x,y\n10,0,0\n20,50,-1.5e1\n40.5,1,2\n"))
    assert isinstance(ship, tma.SampledCourse)
    assert ship.times.tolist() == [10, 20, 40.5]
    assert ship.positions.tolist() == [[0, 0], [50, -15], [1, 2]]
    assert ship.headings is None
    assert ship.frame == tma.Frame()


@pytest.mark.parametrize("text", [
    "time,x,y\n0,1,2\n60,3,4\n",
    "time,x,y\r\n0,1,2\r\n60,3,4\r\n",
    "\ufefftime,x,y\r\n0,1,2\r\n60,3,4",
    "\n\nY , TIME,X\n2,0,1\n\n 4, 60 ,3\n,,\n",
    '"time","x","y"\n"0","1","2"\n"60","3","4"\n',
    "time,x,y\r0,1,2\r60,3,4\r",
])  # fmt: skip
def test_spellings_of_the_same_table(write, text):
    ship = tma.read_track(write(text))
    assert ship.times.tolist() == [0, 60]
    assert ship.positions.tolist() == [[1, 2], [3, 4]]


def test_headings_are_unwrapped_through_360(write):
    rows = "".join(f"{i},0,0,{(340 + 15 * i) % 360}\n" for i in range(60))
    ship = tma.read_track(write("time,x,y,heading\n" + rows))
    assert np.degrees(ship.headings) == pytest.approx(340 + 15 * np.arange(60))
    left = "".join(f"{i},0,0,{(20 - 15 * i) % 360}\n" for i in range(60))
    ship = tma.read_track(write("time,x,y,heading\n" + left))
    assert np.degrees(ship.headings) == pytest.approx(20 - 15 * np.arange(60))
    assert np.degrees(ship.heading_at(1.5)) == pytest.approx(-2.5)


@pytest.mark.parametrize("times", [
    ("2024-05-01T12:00:00Z", "2024-05-01T12:00:00.25Z", "2024-05-01T12:01:00Z"),
    ("2024-05-01T12:00", "2024-05-01 12:00:00.25", "2024-05-01T12:01:00"),
    ("2024-05-01T14:00:00+02:00", "2024-05-01T12:00:00.25Z", "2024-05-01T05:01:00-07:00"),
    ("1714564800", "1714564800.25", "1714564860"),
])  # fmt: skip
def test_absolute_times(write, times):
    ship = tma.read_track(write("time,x,y\n" + "".join(f"{t},0,0\n" for t in times)))
    assert ship.times.tolist() == [0, 0.25, 60]
    assert ship.frame.epoch.isoformat() == "2024-05-01T12:00:00+00:00"
    assert str(ship.frame.to_datetime(60)) == "2024-05-01T12:01:00.000000"


def test_unix_times_lose_nothing(write):
    """Steps of 0.1 microseconds at 1.7e9 s, where floats have steps of 0.24."""
    rows = "".join(f"1700000000.{i:07d},0,0\n" for i in range(50))
    ship = tma.read_track(write("time,x,y\n" + rows))
    assert ship.times.tolist() == [i / 1e7 for i in range(50)]


def test_a_geographic_track(write):
    """Distances and azimuths from the first fix are geodesics; headings are of the plane."""
    random = np.random.default_rng(1)
    latitude, longitude = 60 + 0.2 * random.random(20), 179.9 + 0.2 * random.random(20)
    longitude = (longitude + 180) % 360 - 180  # across the date line
    rows = zip(np.arange(20) * 60, latitude, longitude, np.full(20, 30.0), strict=True)
    text = "time,latitude,longitude,heading\n" + "".join(
        "{},{!r},{!r},{}\n".format(*map(float, r)) for r in rows
    )
    ship = tma.read_track(write(text))
    origin = np.full(20, longitude[0]), np.full(20, latitude[0])
    azimuth, _, distance = EARTH.inv(*origin, longitude, latitude)
    assert np.hypot(*ship.positions.T) == pytest.approx(distance, abs=1e-6)
    assert np.abs(tma.wrap(tma.bearing(ship.positions) - np.radians(azimuth)))[1:].max() < 1e-9
    assert np.degrees(ship.headings - ship.frame.true_north(ship.positions)) == pytest.approx(30)
    assert ship.frame.to_geographic(ship.positions) == pytest.approx(
        np.stack([latitude, longitude], -1), abs=1e-9
    )


# -- bearings -----------------------------------------------------------------------------------


def test_bearings_of_one_sensor(write):
    scenario, angles = tma.read_bearings(
        write("time,bearing,sigma\n0,10,0.5\n60,350,0.5\n120,-170,0.5\n"), SHIP
    )
    (sensor,) = scenario.sensors
    assert sensor.model == tma.Bearing()
    assert sensor.times.tolist() == [0, 60, 120]
    assert sensor.sigma == np.radians(0.5)
    assert sensor.name == "Bearing"
    assert np.degrees(angles) == pytest.approx([10, -10, -170])
    assert scenario.platform is SHIP
    assert scenario.reference_time == 120
    assert scenario.target is None


def test_sensors_in_order_of_appearance_whatever_the_order_of_rows(write):
    rows = [
        ("60", "3", "b"),
        ("0", "1", "a"),
        ("30", "2", "a"),
        ("90", "4", "b"),
        ("45", "9", "c"),
        ("120", "5", "a"),
    ]
    text = "sensor,time,bearing,sigma\n" + "".join(
        f"{s},{t},{b},{1 + ord(s) - ord('a')}\n" for t, b, s in rows
    )
    scenario, angles = tma.read_bearings(write(text), SHIP)
    assert [s.name for s in scenario.sensors] == ["b", "a", "c"]
    assert scenario.times.tolist() == [60, 90, 0, 30, 120, 45]
    assert np.degrees(angles) == pytest.approx([3, 4, 1, 2, 5, 9])
    assert np.degrees(scenario.sigma) == pytest.approx([2, 2, 1, 1, 1, 3])


def test_nothing_heard_is_nan_and_needs_no_sigma(write):
    scenario, angles = tma.read_bearings(write("time,bearing,sigma\n0,,\n30,10,2\n60,,\n"), SHIP)
    assert np.isnan(angles).tolist() == [True, False, True]
    assert scenario.sensors[0].sigma == np.radians(2)


def test_relative_bearings_add_the_heading_through_360(write):
    """Headings 350, 360 (half-way) and 370 degrees; 20, 20 and -20 from the bow."""
    _, angles = tma.read_bearings(write("time,relative_bearing\n0,20\n30,20\n60,340\n"), SHIP, sigma=0.01)
    assert np.degrees(angles) == pytest.approx([10, 20, -10])


def test_sigma_and_sound_speed_from_the_call_or_the_file(write):
    table = write("time,bearing,sensor,sigma,sound_speed\n0,1,a,,\n0,1,b,2,1480\n60,1,b,2,\n")
    scenario, _ = tma.read_bearings(table, SHIP, sigma=0.0123, sound_speed=340)
    a, b = scenario.sensors
    assert a.sigma == 0.0123
    assert a.model == tma.DelayedBearing(340)
    assert b.sigma == np.radians(2)
    assert b.model == tma.DelayedBearing(1480)


def test_a_sigma_for_each_bearing(write):
    scenario, _ = tma.read_bearings(write("time,bearing,sigma\n0,1,0.5\n60,1,2\n"), SHIP)
    assert np.degrees(scenario.sigma) == pytest.approx([0.5, 2])


def test_times_of_bearings_are_in_the_frame_of_the_track(write):
    ship = tma.read_track(write("time,x,y\n2024-05-01T12:00:00Z,0,0\n2024-05-01T13:00:00Z,0,9\n", "ship.csv"))
    for times in (["2024-05-01T14:00:01.5+02:00", "2024-05-01T12:30:00Z"], ["1714564801.5", "1714566600"]):
        text = "time,bearing\n" + "".join(f"{t},0\n" for t in times)
        scenario, _ = tma.read_bearings(write(text), ship, sigma=0.01)
        assert scenario.times.tolist() == [1.5, 1800]


def test_any_motion_may_carry_the_sensors(write):
    course = tma.Course((0, 0), 5, np.pi / 2, [tma.Straight(100)])
    scenario, angles = tma.read_bearings(write("time,relative_bearing\n0,-90\n100,0\n"), course, sigma=0.01)
    assert np.degrees(angles) == pytest.approx([0, 90])
    assert scenario.platform is course


def sail(longitude, latitude, legs):
    """Positions every 30 s along geodesics of ``(azimuth, speed, seconds)``, shape ``(N, 2)``."""
    places = []
    for azimuth, speed, duration in legs:
        steps = speed * np.arange(0, duration, 30.0)
        start = (np.full(len(steps), v) for v in (longitude, latitude, azimuth))
        places += zip(*EARTH.fwd(*start, steps)[:2], strict=True)
        longitude, latitude, _ = EARTH.fwd(longitude, latitude, azimuth, speed * duration)
    return np.array([*places, (longitude, latitude)])


def test_from_a_file_to_a_track(write):
    """All on the ellipsoid, by geodesics: a ship at 62 degrees north, a target 20 km off; back as a position.

    What is left is the error of the plane. Bearings taken from the y axis instead of true north miss by 55 m.
    """
    ship = sail(5.0, 62.0, [(90, 15, 900), (0, 15, 900)])
    target = sail(*EARTH.fwd(5.0, 62.0, 45, 20e3)[:2], [(200, 6, 1800)])
    azimuth = EARTH.inv(*ship.T, *target.T)[0] % 360
    times = [f"{1714564800 + 30 * i}" for i in range(61)]
    fixes = "".join(f"{t},{lat:.9f},{lon:.9f}\n" for t, (lon, lat) in zip(times, ship, strict=True))
    seen = "".join(f"{t},{b:.9f},0.1\n" for t, b in zip(times, azimuth, strict=True))
    platform = tma.read_track(write("time,latitude,longitude\n" + fixes, "ship.csv"))
    scenario, angles = tma.read_bearings(write("time,bearing,sigma\n" + seen), platform)

    def metres_off(fit):
        latitude, longitude = platform.frame.to_geographic(fit.state[:2])
        return EARTH.inv(longitude, latitude, *target[-1])[2]

    fit = tma.fit(scenario, angles)
    assert fit.converged
    assert np.degrees(np.abs(fit.residuals * scenario.sigma)).max() < 0.002
    assert metres_off(fit) < 0.1 * np.hypot(*fit.sigma[:2])
    assert metres_off(tma.fit(scenario, np.radians(azimuth))) > 10 * metres_off(fit)
    course = np.degrees(np.arctan2(fit.state[2], fit.state[3]) - platform.frame.true_north(fit.state[:2]))
    came_from = EARTH.inv(*target[-1], *target[-2])[0]
    assert course % 360 == pytest.approx((came_from + 180) % 360, abs=0.1)


def test_a_sigma_that_nobody_knows(write):
    scenario, _ = tma.read_bearings(write("time,bearing\n0,1\n60,1\n"), SHIP)
    assert scenario.sensors[0].sigma is None
    (given,) = tma.read_bearings(write("time,bearing\n0,1\n60,1\n"), SHIP, sigma=0.01)[0].sensors
    assert given.sigma == 0.01
