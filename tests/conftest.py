"""Scenarios that several tests share."""

import shutil
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import tmalib as tma

# Peers are in a lock of their own: `make peers`.
collect_ignore_glob = [] if find_spec("distributed") and find_spec("stonesoup") else ["peers/*"]


@pytest.fixture(scope="session")
def scenario():
    """A small scenario with both kinds of bearings and one turn: 61 + 16 measurements."""
    platform = tma.Course(
        (0, 0), 8.0, np.pi / 2, [tma.Straight(200), tma.Turn(200, -0.01), tma.Straight(200)]
    )
    target = tma.Target((4e3, 5e3), speed=6.0, heading=2.5)
    radar = tma.Sensor(tma.Bearing(), np.arange(0, 601, 10.0), np.radians(0.5), "radar")
    sonar = tma.Sensor(tma.DelayedBearing(1500.0), np.arange(0, 601, 40.0), np.radians(0.7), "sonar")
    return tma.Scenario(platform, [radar, sonar], reference_time=600.0, target=target)


@pytest.fixture
def copy_of_library(tmp_path):
    """A copy of the package alone, to be changed and imported by another process."""
    copy = tmp_path / "copy"
    source = Path(tma.__file__).parent
    shutil.copytree(source, copy / "tmalib", ignore=shutil.ignore_patterns("__pycache__"))
    return copy
