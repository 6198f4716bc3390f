"""The cases of the study: which recorded tracks, which rules, which sensor, which random numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..bearings import Bearing, DelayedBearing
from ..montecarlo import Stream
from .encounters import Rules
from .records import read_aircraft, read_ais


@dataclass(frozen=True)
class Sample:
    """A file in an archive of the package index, and what reads it."""

    archive: str  # how the name of the archive begins
    member: str  # how the name of the file in it ends
    read: object


@dataclass(frozen=True)
class Case:
    """Recorded tracks watched under `Rules` by a sensor, with the random numbers of a stream."""

    sample: Sample
    rules: Rules
    model: object
    stream: Stream


SOLENT = Sample("stonesoup-", "docs/demos/SolentAIS_20160112_130211.csv", read_ais)
FRANCE = Sample("traffic-", "traffic/data/samples/collections/quickstart.json.gz", read_aircraft)

SIGMA = float(np.radians(0.5))
AT_SEA = Rules(
    length=1200.0, step=600.0, every=10.0, sigma=SIGMA, lead=60.0, gap=60.0, fastest=40.0, bend=300.0,
    slowest=1.0, nearest=1e3, farthest=20e3, targets=5, draws=50,
)  # fmt: skip
IN_THE_AIR = Rules(
    length=600.0, step=600.0, every=5.0, sigma=SIGMA, lead=0.0, gap=30.0, fastest=400.0, bend=3e3,
    slowest=50.0, nearest=5e3, farthest=100e3, targets=2, draws=50,
)  # fmt: skip
SHIPS, AIRCRAFT = Stream("study/ships", 21), Stream("study/aircraft", 22)

CASES = {
    "ships": Case(SOLENT, AT_SEA, Bearing(), SHIPS),
    "ships_short": Case(SOLENT, replace(AT_SEA, length=600.0), Bearing(), SHIPS),
    "ships_sonar": Case(SOLENT, replace(AT_SEA, length=600.0), DelayedBearing(1500.0), SHIPS),
    "aircraft": Case(FRANCE, IN_THE_AIR, Bearing(), AIRCRAFT),
}
