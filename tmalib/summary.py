"""What a fit says, as a table of a few rows: for a terminal, a notebook, the command ``tmalib``.

No number stands where it would mislead: a run that has not converged has no state, a range that is known to a
third only no ellipse, a course whose sigma passes 60 degrees is none. The table says so instead.
"""

from __future__ import annotations

import html
import textwrap
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from .bounds import in_words
from .estimate import Estimate, Fit
from .residuals import residual_tests
from .scenario import Scenario
from .seen import is_hardly_known, place_at, seen_from
from .uniform import POSITION, VELOCITY

LARGEST_COURSE_SIGMA = np.radians(60)
UNITS = {"x": "m", "y": "m", "z": "m", "vx": "m/s", "vy": "m/s", "ax": "m/s^2", "ay": "m/s^2",
         "rate": "rad/s", "f0": "Hz", "c": "m/s"}  # fmt: skip
WIDTH = 100


class Row(NamedTuple):
    """A line of a summary: what, and what is said of it."""

    name: str
    text: str


def at_reference(fit: Fit) -> Estimate:
    """The `Estimate` of a fit at its reference time, for any model."""
    return Estimate(fit.scenario.reference_time, fit.scenario.coordinates, fit.state, fit.covariance)


def frame_of(scenario: Scenario, frame: Any = None) -> Any:
    """The frame that is given, or that of the recorded platform; `None` where there is none."""
    return getattr(scenario.platform, "frame", None) if frame is None else frame


# -- numbers as texts ----------------------------------------------------------------------------


def with_sigma(value: float, sigma: float, unit: str = "", turn: float | None = None) -> str:
    """``4510 ± 230 m``: sigma with two digits, the value to the same place; ``turn`` is that of an angle."""
    if not np.isfinite(sigma) or sigma <= 0:
        return f"{value:.6g} {unit}".strip()
    decimals = 1 - int(np.floor(np.log10(sigma)))
    value, sigma = round(float(value), decimals), round(float(sigma), decimals)
    value = value if turn is None else round(value % turn, decimals) % turn
    return f"{value + 0.0:.{max(decimals, 0)}f} ± {sigma:.{max(decimals, 0)}f} {unit}".strip()


def time_in_words(time: float, frame: Any) -> str:
    """``595 s``, or a date-time in UTC where the frame has an epoch."""
    if frame is None or frame.epoch is None:
        return f"{time:g} s"
    return f"{frame.to_datetime(time)}".rstrip("0").rstrip(".") + "Z"


def _angle(value, sigma, north):
    return with_sigma(np.degrees(value - north), np.degrees(sigma), "degrees", turn=360)


# -- rows ----------------------------------------------------------------------------------------


def describe(estimate: Estimate, scenario: Scenario, frame: Any = None) -> list[Row]:
    """Rows of an `Estimate` of one run: time, state, range, bearing, course, speed, ellipse, with sigmas."""
    frame = frame_of(scenario, frame)
    rows = [Row("reference time", time_in_words(estimate.time, frame))]
    sigma = np.sqrt(np.diagonal(estimate.covariance))
    for name, value, own in zip(estimate.coordinates, estimate.state, sigma, strict=True):
        rows.append(Row(name, _component(name, value, own, scenario)))
    if not set(POSITION) <= set(estimate.coordinates):
        return rows
    place = estimate.state[[estimate.coordinates.index(name) for name in POSITION]]
    if frame is not None and frame.is_geographic:
        latitude, longitude = frame.to_geographic(place)
        rows.append(Row("latitude, longitude", f"{latitude:.6f}, {longitude:.6f} degrees"))
    return rows + _seen(estimate, scenario, frame, place)


def _component(name, value, sigma, scenario):
    if name in UNITS:
        return with_sigma(value, sigma, UNITS[name])
    model = next(s.model for s in scenario.sensors if name in s.model.coordinates)
    if getattr(model, "is_bearing", False):
        return with_sigma(np.degrees(value), np.degrees(sigma), "degrees")
    return f"{with_sigma(value, sigma)} (in the unit of {type(getattr(model, 'model', model)).__name__})"


def _seen(estimate, scenario, frame, place):
    """Rows of range, bearing, course, speed and ellipse."""
    here, rows = place_at(scenario.platform, estimate.time), []
    (length, bearing, speed, course), sigma = seen_from(estimate, here)
    there = 0.0 if frame is None else frame.true_north(place)
    hardly = is_hardly_known(estimate, scenario)
    if np.isfinite(here).all():
        hint = "; too little is known for an ellipse: see confidence_region" if hardly else ""
        rows.append(Row("range", with_sigma(length, sigma[0], "m") + hint))
        rows.append(
            Row("bearing", _angle(bearing, sigma[1], 0.0 if frame is None else frame.true_north(here)))
        )
    else:
        rows.append(Row("range", "not known: the platform's track does not go to this time"))
    if set(VELOCITY) <= set(estimate.coordinates):
        known = sigma[3] < LARGEST_COURSE_SIGMA
        rows.append(
            Row("course", _angle(course, sigma[3], there) if known else "not known: it may lie still")
        )
        rows.append(Row("speed", with_sigma(speed, sigma[2], "m/s")))
    if not hardly:
        shape = estimate.ellipse(0.9)
        major, minor = (with_sigma(axis, 0, "m") for axis in shape.semi_axes.round(1))
        along = np.degrees(shape.heading - there) % 180
        rows.append(
            Row("90 % ellipse", f"semi-axes {major} and {minor}, the longer along {along:.1f} degrees")
        )
    return rows


def summarise(fit: Fit, frame: Any = None) -> list[Row]:
    """The rows of a table that says what became of a fit and what it is worth.

    Parameters
    ----------
    fit : Fit
    frame : Frame, optional
        Gives times as date-times, places as latitude and longitude, and angles from true north; by default
        that of the platform, if it was read from a file.

    Returns
    -------
    list of Row
        Of one run: status and what to do, state, range, bearing, course and speed with standard deviations,
        goodness of fit, what is known least, and warnings of `residual_tests`. A run that has not converged
        has no state here. Of many runs: how many have which status, and what to do.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 600, 5.0), sigma=0.01)
    >>> watch = tma.Scenario(ship, [ear], reference_time=595)
    >>> truth = tma.Target((2e3, 4e3), speed=6, heading=1.5)
    >>> found = tma.fit(watch, watch.with_target(truth).simulate(runs=1, seed=1)[0])
    >>> for row in tma.summarise(found)[6:10]:
    ...     print(row.name, "|", row.text)
    range | 4860 ± 270 m
    bearing | 56.05 ± 0.14 degrees
    course | 86.9 ± 1.9 degrees
    speed | 5.86 ± 0.39 m/s
    """
    if fit.status.ndim:
        lines = (line.partition(" runs ") for line in fit.explain().splitlines())
        return [Row(f"{count} runs", said) for count, _, said in lines]
    rows = [Row("status", fit.explain())]
    if fit.converged:
        rows += describe(at_reference(fit), fit.scenario, frame)
    rows += [*_measurements(fit), *_goodness(fit)]
    if fit.converged:
        least = in_words(fit.scenario.coordinates, fit.weakest)
        rows.append(Row("known least", f"the direction {least}; condition number {fit.condition:.2g}"))
        rows += [Row("warning", sentence) for sentence in residual_tests(fit).warnings()]
    return rows


def _measurements(fit):
    missing, sensors = int(np.isnan(fit.measured).sum()), len(fit.scenario.sensors)
    lost = f", {missing} missing" if missing else ""
    yield Row(
        "measurements", f"{fit.measured.size - missing} of {sensors} sensor{'s' * (sensors != 1)}{lost}"
    )
    for sensor in fit.scenario.sensors:
        if sensor.name in fit.estimated:
            angle = getattr(sensor.model, "is_bearing", False)
            sigma = f"{np.degrees(sensor.sigma):.3g} degrees" if angle else f"{sensor.sigma:.3g}"
            yield Row(f"sigma of {sensor.name}", f"{sigma}, estimated from the residuals")


def _goodness(fit):
    if not np.isfinite(fit.cost):
        return
    if fit.estimated:
        chance = "no test, for a sigma was estimated"
    elif fit.robust:
        chance = f"no test, for the loss is {fit.loss}"
    elif fit.freedom <= 0:
        chance = "no test without freedom"
    else:
        chance = f"p = {fit.p_value:.2g}"
    yield Row("criterion", f"{fit.cost:.4g} for {fit.freedom} degrees of freedom: {chance}")


# -- tables --------------------------------------------------------------------------------------


def as_text(rows: Iterable[Row], width: int = WIDTH) -> str:
    """Rows as lines of text, names to the left, long texts broken."""
    edge = max((len(row.name) for row in rows), default=0) + 2
    lines = []
    for row in rows:
        parts = textwrap.wrap(row.text, max(width - edge, 20)) or [""]
        lines += [
            f"{name:<{edge}}{part}" for name, part in zip([row.name, *[""] * len(parts)], parts, strict=False)
        ]
    return "\n".join(lines)


def as_html(rows: Iterable[Row]) -> str:
    """Rows as a table of HTML; all texts are escaped."""
    lines = (
        f'<tr><th style="text-align: left">{html.escape(row.name)}</th>'
        f'<td style="text-align: left">{html.escape(row.text)}</td></tr>'
        for row in rows
    )
    return "<table>\n" + "\n".join(lines) + "\n</table>"
