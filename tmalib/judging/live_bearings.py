"""The analyst's view of a run: drag a solution, and see its bearing lines and its stacked dots change.

The browser computes the residuals, with the formulas of `tmalib.bearings`, from what the output brings:
times, measured bearings, standard deviations and places of the platform, each as the library has them.
"""

import numpy as np

from ..bearings import Bearing, DelayedBearing
from ..figures import colour
from .live import Axis, Curve, Panel, Slider, fixed, live

EDGE = 8.0  # standard deviations: a dot beyond lies there
SENSORS = ("mle", "ekf")  # colours, as in the figures of the mishaps
MARKS = ("circle", "square")
LINES = 16  # bearing lines on the map


def stacked_dots(fit, *, ranges, speeds, start, instead):
    """Show the analyst's view of one run, with a button that goes to its fit.

    Parameters
    ----------
    fit : Fit
        Converged, of the state ``x, y, vx, vy``, with bearings that arrive at once or late from one platform.
    ranges, speeds : array_like
        Values of two of the sliders, in m and m/s; courses and bearings go round in degrees.
    start : sequence of float
        What is shown at first: range (m), course (degrees), speed (m/s); the bearing is that of the fit.
    instead : str
        As for `tmalib.judging.live.live`.
    """
    sensors, best = sensors_of(fit), solution(fit)
    sliders = [
        _slider("Range", ranges, "m", 0, start[0]),
        _slider("Course", np.arange(360.0), "°", 1, start[1]),
        _slider("Speed", speeds, "m/s", 1, start[2]),
        _slider("Bearing", np.arange(720) / 2, "°", 1, best[3]),
    ]
    data = {"sensors": sensors, "here": fit.scenario.platform.position_at(fit.scenario.reference_time)}
    data |= {
        "criterion": fit.cost,
        "freedom": fit.freedom,
        "edge": EDGE,
        "names": [s["name"] for s in sensors],
    }
    live(
        "The analyst's view: a solution and its stacked dots",
        sliders,
        [_dots(sensors), _map(fit)],
        None,
        instead,
        name="bearings",
        buttons=[("Go to the fit", best)],
        data=data,
        digits=10,
    )


def solution(fit):
    """Range (m), course (degrees), speed (m/s) and bearing (degrees) of an estimate."""
    away = fit.state[:2] - fit.scenario.platform.position_at(fit.scenario.reference_time)
    course, bearing = (np.degrees(np.arctan2(*pair)) % 360 for pair in (fit.state[2:], away))
    return [float(part) for part in (np.hypot(*away), course, np.hypot(*fit.state[2:]), bearing)]


def sensors_of(fit):
    """What the browser needs of each sensor: times, bearings in degrees, the platform's places, sound speed.

    Raises
    ------
    ValueError
        For a state, a sensor or a run that the view does not know.
    """
    scenario = fit.scenario
    if (
        tuple(scenario.coordinates) != ("x", "y", "vx", "vy")
        or not np.all(fit.converged)
        or fit.state.ndim > 1
    ):
        raise ValueError("fit must be one converged run with the state x, y, vx, vy")
    found = []
    for block in scenario.blocks:
        sensor, model = block.sensor, block.sensor.model
        if type(model) not in (Bearing, DelayedBearing) or sensor.platform is not None:
            raise ValueError(f"every sensor must take bearings from the platform, got {model!r}")
        places = scenario.platform.position_at(sensor.times)
        found.append(
            {
                "name": sensor.name,
                "c": getattr(model, "c", None),
                "elapsed": sensor.times - scenario.reference_time,
                "minutes": sensor.times / 60,
                "bearing": np.degrees(fit.measured[block.columns]),
                "sigma": np.degrees(np.broadcast_to(sensor.sigma, sensor.times.shape)),
                "x": places[:, 0],
                "y": places[:, 1],
            }
        )
    return found


def _slider(label, values, unit, digits, start):
    values = np.asarray(values, dtype=float)
    return Slider(label, tuple(values), unit, digits, int(np.argmin(np.abs(values - start))))


def _map(fit):
    """The ship's track, some bearing lines, and the track of the solution."""
    scenario = fit.scenario
    times = np.linspace(scenario.times.min(), scenario.times.max(), 49)
    ship = scenario.platform.position_at(times) / 1e3
    track = (fit.state[:2] + np.outer(times - scenario.reference_time, fit.state[2:])) / 1e3
    corners = np.concatenate([ship, track])
    low, high = corners.min(axis=0) - 2, corners.max(axis=0) + 2
    heard = np.flatnonzero(np.isfinite(fit.measured))
    some = heard[np.linspace(0, len(heard) - 1, LINES).astype(int)]
    origin = scenario.platform.position_at(scenario.times[some]) / 1e3
    along = np.stack([np.sin(fit.measured[some]), np.cos(fit.measured[some])], axis=-1)
    lines = np.stack(
        [origin, origin + 2 * np.hypot(*(high - low)) * along, np.full_like(along, np.nan)], axis=1
    )
    curves = (
        Curve("measured bearings, some", "thin", None, fixed(*lines.reshape(-1, 2).T)),
        Curve("own ship", "line", colour("platform"), fixed(*ship.T)),
        Curve("solution", "line", colour("target")),
        Curve("solution at the last bearing", "circle", colour("target")),
    )
    alt = "Map: the own ship's track with one bend, bearing lines from it, and the track of the solution."
    return Panel(
        alt, Axis("East (km)", (low[0], high[0])), Axis("North (km)", (low[1], high[1])), curves, True
    )


def _dots(sensors):
    """Residuals of all bearings over time."""
    last = max(np.max(sensor["minutes"]) for sensor in sensors)
    dots = [
        Curve(sensor["name"], mark, colour(entity))
        for sensor, mark, entity in zip(sensors, MARKS, SENSORS, strict=False)
    ]
    sides = np.array([0, last, np.nan, 0, last]), np.array([2, 2, np.nan, -2, -2])
    curves = (
        Curve("", "thin", None, fixed([0, last], [0, 0])),
        Curve("two standard deviations", "dashed", None, fixed(*sides)),
        *dots,
    )
    limit = EDGE + 0.5
    alt = "Residuals of the bearings in standard deviations against time, with lines at plus and minus two."
    time = Axis("Time (min)", (-0.02 * last, 1.02 * last))
    return Panel(alt, time, Axis("Residual (σ)", (-limit, limit)), curves)
