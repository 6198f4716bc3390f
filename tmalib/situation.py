"""One run in one figure: the map of what it says, beside the residuals that tell whether to believe it.

The colours of own ship and target are those of `tmalib.figures`; sensors have colours of their own, the same
for the bearing lines of the map and for the dots.
"""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from .estimate import Fit
from .figures import STYLE, colour, map_axes, path
from .region import confidence_region
from .seen import is_hardly_known
from .summary import at_reference, describe, frame_of, summarise
from .uniform import POSITION, is_uniform, propagate

SENSOR_COLOURS = ("#009E73", "#E69F00", "#56B4E9", "#CC79A7", "#5F5F5F")
SENSOR_MARKS = "o^sDv"
WILD, EDGE = 4.0, 6.0  # standard deviations: a residual beyond is marked; the widest axis of residuals
LINES = 24  # most bearing lines on a map


def situation(fit: Fit, frame: Any = None) -> Figure:
    """One run in one figure: the map at the left, the residuals ("stacked dots") at the right.

    The map has the track of the platform, some of the measured bearings, the target's track over the measured
    time and its position at the reference time with the ellipse of 90 per cent, or with the likelihood region
    where the range is known to no better than a third. A run that has not converged has no target there, only
    the region of what the measurements allow. At the right are the residuals in standard deviations with
    lines at two, a colour and a mark a sensor; those beyond four are ringed, at the edge if beyond six.

    Parameters
    ----------
    fit : Fit
        Of one run.
    frame : Frame, optional
        Names origin and time zero at the axes; by default that of the platform, if it was read from a file.

    Returns
    -------
    matplotlib.figure.Figure
        On white ground, for pages light and dark, whatever style is set.

    Raises
    ------
    ValueError
        For more than one run.
    """
    if fit.state.ndim != 1:
        raise ValueError(f"a situation is of one run, and these are {fit.state.shape[:-1]}; fit one")
    frame = frame_of(fit.scenario, frame)
    with plt.style.context(["default", STYLE]):
        figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 4.6), width_ratios=(1.15, 1))
        _draw_map(left, fit, frame)
        _draw_residuals(right, fit, frame)
        entries = dict(zip(*reversed(left.get_legend_handles_labels()), strict=True))
        entries |= dict(zip(*reversed(right.get_legend_handles_labels()), strict=True))
        figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=4, fontsize=9)
        figure.suptitle(_finding(fit, frame), x=0.01, ha="left", fontsize=10)
    return figure


def _finding(fit, frame):
    """What the figure shows, in two lines at most."""
    if not fit.converged:
        return f"No estimate: {fit.status}"
    rows = {row.name: row.text.split(";")[0] for row in describe(at_reference(fit), fit.scenario, frame)}
    wanted = [f"{name} {rows[name]}" for name in ("range", "bearing", "course", "speed") if name in rows]
    return f"At {rows['reference time']}:\n" + ", ".join(wanted)


def _plain(name):
    """A sensor's name as a label: without mathematics, and never hidden."""
    return " " * name.startswith("_") + name.replace("$", r"\$")


def _track(fit, times):
    """Where the estimated target is at the times, ``(N, 2)`` in metres; `None` for an unknown motion."""
    names, elapsed = fit.scenario.coordinates, times - fit.scenario.reference_time
    if is_uniform(names):
        return propagate(fit.state, elapsed, names)[:, [names.index(name) for name in POSITION]]
    for sensor in fit.scenario.sensors:
        if hasattr(sensor.model, "motion") and tuple(sensor.model.coordinates) == names:
            return sensor.model.motion(fit.state[:, None], elapsed)[0].T
    return None


def _draw_map(ax, fit, frame):
    scenario, converged = fit.scenario, bool(fit.converged)
    times = np.linspace(scenario.times.min(), scenario.times.max(), 241)
    own = scenario.platform.position_at(times)
    shown = [own]
    track = _track(fit, times) if converged else None
    _with_arrow(ax, own, "platform", "own ship")
    for sensor in scenario.sensors:
        if sensor.platform is not None and sensor.platform is not scenario.platform:
            shown.append(sensor.platform.position_at(times))
            _with_arrow(ax, shown[-1], "printed", f"carrier of {_plain(sensor.name)}")
    shape, label, reach = _where(fit, own)
    if track is not None:
        shown.append(track)
        _with_arrow(ax, track, "target", "target, estimated")
    if converged and set(POSITION) <= set(scenario.coordinates):
        place = fit.state[[scenario.coordinates.index(name) for name in POSITION]]
        shown.append(place[None])
        ax.plot(*place / 1e3, "o", color=colour("target"), markersize=6, label="at the reference time")
    for line in shape:
        ax.fill(*line.T / 1e3, facecolor="#00000018", edgecolor="black", linewidth=1.2, label=label)
        near = np.hypot(*(line - own[-1]).T) <= 1.05 * reach
        shown.append(line[near])
    shown += _draw_bearings(ax, fit, reach)
    map_axes(ax)
    ax.dataLim.update_from_data_xy(np.concatenate(shown) / 1e3, ignore=True)  # a region may go on for ever
    ax.autoscale_view()
    if frame is not None and frame.is_geographic:
        origin = f" of {frame.latitude:.4f}, {frame.longitude:.4f}"
        ax.set(xlabel=f"East{origin} (km)", ylabel="North (km)")


def _with_arrow(ax, positions, entity, label):
    """A path with an arrow at its end."""
    path(ax, positions, entity, label)
    x, y = positions.T / 1e3
    moved = np.flatnonzero(np.hypot(x - x[-1], y - y[-1]) > 0)
    if len(moved):
        arrow = dict(arrowstyle="-|>", color=colour(entity), mutation_scale=16, shrinkA=0, shrinkB=0)
        ax.annotate("", (x[-1], y[-1]), (x[moved[-1]], y[moved[-1]]), arrowprops=arrow)


def _where(fit, own):
    """Lines round where the target may be at the reference time, their label, how far the map goes (m)."""
    extent = np.ptp(own, axis=0).max()
    estimate, positioned = at_reference(fit), set(POSITION) <= set(fit.scenario.coordinates)
    if fit.converged and positioned and not is_hardly_known(estimate, fit.scenario):
        shape = estimate.ellipse(0.9)
        return [shape.boundary()], "90 % ellipse", np.hypot(*(shape.centre - own[-1])) + shape.semi_axes[0]
    try:
        region = confidence_region(fit, 0.9)
    except ValueError:  # no state, or one without such a region
        return [], "", max(5 * extent, 1e3)
    far = 3 * region.ranges[:, 0].min() if fit.converged else 0
    away = max(5 * extent, far, 1e3) if not region.bounded else 1.05 * region.ranges.max()
    return region.boundary, "90 % region" if region.bounded else "90 % region, without end", away


def _draw_bearings(ax, fit, reach):
    """Some lines of the measured bearings, to the target or as far as the map goes; gives their ends."""
    scenario, ends = fit.scenario, []
    heard = [b for b in scenario.blocks if getattr(b.sensor.model, "is_bearing", False)]
    for block in heard:
        angles, sensor = fit.measured[block.columns], block.sensor
        there = np.flatnonzero(np.isfinite(angles))
        some = there[np.unique(np.linspace(0, len(there) - 1, LINES // len(heard) + 1).astype(int))]
        here = scenario.platform_of(sensor).position_at(sensor.times[some])
        track = _track(fit, sensor.times[some]) if fit.converged else None
        length = reach if track is None else 1.06 * np.hypot(*(track - here).T)
        along = np.stack([np.sin(angles[some]), np.cos(angles[some])], axis=-1)
        end = here + np.broadcast_to(length, len(some))[:, None] * along
        hue = _sensor_colour(scenario.sensors.index(sensor))
        ax.plot(
            *np.stack([here, end]).transpose(2, 0, 1) / 1e3, color=hue, linewidth=0.7, alpha=0.7, zorder=1
        )
        ends.append(end)
    return ends


def _sensor_colour(k):
    return SENSOR_COLOURS[k % len(SENSOR_COLOURS)]


def _draw_residuals(ax, fit, frame):
    """Standardised residuals over time."""
    first, last = fit.scenario.times.min(), fit.scenario.times.max()
    unit, name = (60.0, "min") if last - first > 1200 else (1.0, "s")
    ax.plot(np.array([first, last]) / unit, [0, 0], linestyle="none")  # missing ones have their place
    for level in (-2, 0, 2):
        ax.axhline(level, color="#555555", linewidth=1.0, linestyle="-" if level == 0 else "--", zorder=1)
    residuals, wild = fit.residuals, np.abs(fit.residuals) > WILD
    for k, block in enumerate(fit.scenario.blocks):
        own, time = residuals[block.columns], block.sensor.times / unit
        label = _plain(block.sensor.name)
        mark = SENSOR_MARKS[k % len(SENSOR_MARKS)]
        ax.plot(time, np.clip(own, -EDGE, EDGE), mark, color=_sensor_colour(k), markersize=3.6, label=label)
    if wild.any():
        place = fit.scenario.times[wild] / unit, np.clip(residuals[wild], -EDGE, EDGE)
        label = f"more than {WILD:g} standard deviations"
        ax.plot(*place, "o", color="#D00000", markerfacecolor="none", markersize=9, label=label)
    if not np.isfinite(residuals).any():
        ax.text(0.5, 0.5, "no residuals", transform=ax.transAxes, ha="center", backgroundcolor="white")
    largest = np.nanmax(np.abs(residuals), initial=0.0)
    limit = min(max(3.4, 1.1 * largest), EDGE + 0.4)
    ax.set(ylim=(-limit, limit), ylabel="Residual (standard deviations)", xlabel=f"Time ({name})")
    if frame is not None and frame.epoch is not None:
        ax.set_xlabel(f"Time ({name}) since {frame.epoch:%Y-%m-%d %H:%M:%S} UTC")
    goodness = [row.text for row in summarise(fit) if row.name == "criterion"]
    ax.set_title("Residuals:\ncriterion " + goodness[0] if goodness else "Residuals", fontsize=9, loc="left")
