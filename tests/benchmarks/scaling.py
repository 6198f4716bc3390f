"""How the cost of a fit grows: seconds a run, as series ``{name: {"x": [...], "y": [...]}}``."""

import numpy as np
from measure import interleaved

import tmalib as tma
from tmalib.papers.emw_acoustic import scenarios as emw

RUNS = (1, 10, 100, 500, 1000, 5000, 10_000, 50_000)
MEASUREMENTS = (75, 150, 300, 600, 1200, 2400, 4800)
SENSORS = (1, 2, 4, 8)
FLAT = (100, 50_000)  # from here to there the time a run is to stay


def watch(measurements=1500, sensors=1):
    """An own ship with a turn, so many bearings of so many sensors, all in half an hour."""
    ship = tma.Course((0, 0), 8.0, 0.0, [tma.Straight(900), tma.Turn(60, np.radians(1.5)), tma.Straight(840)])
    times = np.linspace(0, 1800, measurements // sensors)
    listeners = [tma.Sensor(tma.Bearing(), times, 0.01, f"sensor {k}") for k in range(sensors)]
    return tma.Scenario(ship, listeners, 1800, tma.Target((6e3, 9e3), speed=6.0, heading=2.5))


def median_times(cases, rounds=3):
    """Seconds of a fit without a start for each of ``{x: (scenario, angles)}``."""
    tasks = {x: (lambda c=case: tma.fit(*c)) for x, case in cases.items()}
    return {x: float(np.median(took)) for x, took in interleaved(tasks, rounds).items()}


def series():
    """All series, and the row for the time a run."""
    scenario = emw.scenario(1)
    angles = scenario.simulate(max(RUNS), seed=2)
    fits = median_times({n: (scenario, angles[:n]) for n in RUNS})
    cases = {n: watch(n) for n in MEASUREMENTS}
    long = median_times({n: (case, case.simulate(200, seed=1)) for n, case in cases.items()})
    cases = {n: watch(1200, n) for n in SENSORS}
    wide = median_times({n: (case, case.simulate(200, seed=1)) for n, case in cases.items()})
    found = {
        "runs": {"x": [*fits], "y": [t / n for n, t in fits.items()]},
        "measurements": {"x": [*long], "y": [t / 200 for t in long.values()]},
        "sensors": {"x": [*wide], "y": [t / 200 for t in wide.values()]},
    }
    flat = [y for x, y in zip(*found["runs"].values(), strict=True) if FLAT[0] <= x <= FLAT[1]]
    value, of = max(flat) / min(flat), f"longest over shortest time a run, {FLAT[0]} to {FLAT[1]} runs"
    row = {"what": "time a run", "peer": "itself", "of": of, "ratio": value, "low": value, "high": value,
           "goal": ["<=", 1.25]}  # fmt: skip
    return found, row
