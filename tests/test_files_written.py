"""Bearings that are written are read as they were."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

import tmalib as tma

TRACK = [0, 60.5, 120], [(0, 0), (20e3, 300), (40e3, 300)]
FRAMES = {
    "plain": tma.Frame(),
    "dates": tma.Frame(datetime(2024, 2, 28, 23, 59, 58, 250_000, tzinfo=UTC)),
    "places": tma.Frame(datetime(1969, 1, 1, tzinfo=UTC), 60.0, 5.0),
}


@pytest.mark.parametrize("frame", FRAMES)
def test_there_and_back(frame, tmp_path):
    rng = np.random.default_rng(1)
    ship = tma.RecordedCourse(*TRACK, None, FRAMES[frame])
    times = np.sort(rng.uniform(0, 120, 50))
    sensors = [
        tma.Sensor(tma.Bearing(), times, np.radians(rng.uniform(0.1, 2, 50)), 'a "b", c'),
        tma.Sensor(tma.DelayedBearing(1480.0), np.r_[0, times[::2], 120], 0.01, "Echolot ä"),
    ]
    scenario = tma.Scenario(ship, sensors, 120)
    angles = rng.uniform(-np.pi, np.pi, 77)
    angles[[3, 60]] = np.nan
    tma.write_bearings(tmp_path / "a.csv", scenario, angles)
    again, read = tma.read_bearings(tmp_path / "a.csv", ship)
    assert np.array_equal(np.isnan(read), np.isnan(angles))
    there = ~np.isnan(angles)
    assert np.abs(tma.wrap(read - angles)[there]).max() < 1e-14
    assert again.times.tolist() == scenario.times.tolist()
    assert again.sigma[there] == pytest.approx(scenario.sigma[there], rel=1e-14)
    assert [sensor.name for sensor in again.sensors] == [sensor.name for sensor in sensors]
    assert [sensor.model for sensor in again.sensors] == [sensor.model for sensor in sensors]


def test_what_a_table_cannot_hold(tmp_path):
    ship = tma.RecordedCourse(*TRACK)
    ear = tma.Sensor(tma.Bearing(), [0.0, 60.0], 0.01)
    for sensors, angles, message in (
        ([ear], np.zeros((2, 2)), "angles must be of one run"),
        ([ear, ear], np.zeros(4), "different names"),
        ([tma.Sensor(tma.Range(), [0.0], 1.0)], np.zeros(1), "Range is a Range"),
        ([replace(ear, platform=tma.RecordedCourse(*TRACK))], np.zeros(2), "a platform of its own"),
    ):
        with pytest.raises(ValueError, match=message):
            tma.write_bearings(tmp_path / "no.csv", tma.Scenario(ship, sensors, 60), angles)
        assert not (tmp_path / "no.csv").exists()
