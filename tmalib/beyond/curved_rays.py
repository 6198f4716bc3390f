"""Curved rays: what the straight rays of `conical-angles` cost in sound-speed profiles of the ocean.

The profiles are computed by the package ``gsw`` (TEOS-10), which the book needs and the library does not,
from temperatures and salinities at six places that come with its tests.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..batch import fit
from ..bounds import crlb, nees
from ..cones import DIRECT, image_depth
from ..layered_water import LayeredWater
from ..montecarlo import Stream
from ..papers.conical_angles import scenarios as conical
from ..ray_tracing import effective_speed, eigenrays
from ..sound_profile import SoundSpeedProfile

STREAM = Stream("beyond/curved_rays")
START = (8000.0, 8000.0, 0.0, 0.0)  # m and m/s: that of the paper
ARCTIC = ("latitude_Arctic", "longitude_Arctic")  # names in the file, where those of the others follow a rule
FINE = 400  # rays of a fan that neither turns nor bounces


def profiles():
    """Sound speed at the six places, from place to `SoundSpeedProfile`.

    Salinity, temperature and pressure are those of the check values of ``gsw``: three casts with practical
    salinity, and three of the Arctic with absolute salinity.
    """
    import gsw

    data = np.load(Path(gsw.__file__).parent / "tests" / "gsw_cv_v3_0.npz")
    found = {}
    for end, where in (("chck_cast", ("lat_chck_cast", "long_chck_cast")), ("Arctic", ARCTIC)):
        for i, (latitude, longitude) in enumerate(zip(*(data[name] for name in where), strict=True)):
            latitude, longitude = float(latitude), float(longitude)
            pressure, temperature = (data[f"{name}_{end}"][:, i].astype(float) for name in "pt")
            there = np.isfinite(pressure)
            pressure, temperature = pressure[there], temperature[there]
            if end == "Arctic":
                salinity = data["SA_Arctic"][there, i]
            else:
                practical = data["SP_chck_cast"][there, i]
                salinity = gsw.SA_from_SP(practical, pressure, longitude, latitude)
            speed = gsw.sound_speed(salinity, gsw.CT_from_t(salinity, temperature, pressure), pressure)
            east = longitude if longitude <= 180 else longitude - 360
            name = f"{round(latitude, 1):g}° N {round(abs(east), 1):g}° {'E' if east >= 0 else 'W'}"
            found[name] = SoundSpeedProfile(-gsw.z_from_p(pressure, latitude), speed)
    return found


def at_depth(scenario, bottom_depth):
    """A scenario of the paper with another bottom."""
    return replace(
        scenario,
        sensors=[replace(s, model=replace(s.model, bottom_depth=bottom_depth)) for s in scenario.sensors],
    )


def at_ranges(scenario, ranges):
    """States ``(runs, n)`` of the scenario's target at other ranges, on the same bearing, as fast."""
    state = scenario.state
    states = np.tile(state, (len(ranges), 1))
    states[:, :2] = np.asarray(ranges)[:, None] * state[:2] / np.hypot(*state[:2])
    return states


def geometry(scenario, sensor, states):
    """Horizontal distances, and cosines of the bearing relative to the array, both ``(runs, N)``."""
    elapsed = sensor.times - scenario.reference_time
    keep = [scenario.coordinates.index(name) for name in ("x", "y", "vx", "vy")]
    x, y, vx, vy = states[:, keep].T[..., None]
    here = sensor.model.observer_state(scenario.platform, sensor.times)
    dx, dy = x + vx * elapsed - here[0], y + vy * elapsed - here[1]
    distance = np.hypot(dx, dy)
    return distance, (dx * here[2] + dy * here[3]) / distance


def first_slowness(profile, model, distance):
    """Horizontal slowness of the ray that arrives first along a model's path, straight on or turned once."""
    depths = (conical.TARGET_DEPTH, model.array_depth, model.bottom_depth)
    found = np.full(distance.shape, np.nan)
    for turns in (0, 1) if model.path.is_direct else (0,):
        rays = eigenrays(profile, model.path, *depths, distance, turns)
        if rays.slowness.shape[-1]:
            found = np.where(np.isnan(found), rays.slowness[..., 0], found)
    return found


def traced(scenario, states, profile, steered):
    """Cosines along traced rays without noise, ``(runs, N)``, NaN where there is no ray.

    Parameters
    ----------
    scenario : Scenario
        With conical angles; the target is at the paper's depth.
    states : ndarray, shape (runs, n)
    profile : SoundSpeedProfile
    steered : {"array", "effective"} or float
        The sound speed that the array is steered with: that at its own depth, the mean along each path
        (`tmalib.ray_tracing.effective_speed`), or a number in m/s.
    """
    found = []
    for sensor in scenario.sensors:
        distance, cosine = geometry(scenario, sensor, states)
        speed = steering_speed(profile, sensor.model, steered)
        found.append(speed * first_slowness(profile, sensor.model, distance) * cosine)
    return np.concatenate(found, axis=-1)


def steering_speed(profile, model, steered):
    """The speed of `traced` in m/s, for one sensor."""
    if steered == "array":
        return float(profile.speed_at(model.array_depth))
    if steered == "effective":
        depths = (conical.TARGET_DEPTH, model.array_depth, model.bottom_depth)
        return effective_speed(profile, model.path, *depths)
    return steered


def biases(scenario, measured, states):
    """Estimates minus states, ``(runs, n)``, and their size in the metric of the bound, ``(runs,)``.

    The size is ``sqrt(e' F e)``: the error of the component, or combination of components, that is most of
    all off, in units of its bound. NaN where a measurement is missing or the fit did not converge.
    """
    whole = np.isfinite(measured).all(axis=1)
    errors, sizes = np.full(states.shape, np.nan), np.full(len(states), np.nan)
    if whole.any():
        found = fit(scenario, measured[whole], states[whole])
        errors[whole] = np.where(found.converged[:, None], found.state - states[whole], np.nan)
        sizes[whole] = np.sqrt(
            nees(states[whole] + errors[whole], states[whole], crlb(scenario, states[whole]))
        )
    return errors, sizes


def factors(scenario, states, profile):
    """Traced cosine over straight cosine of each measurement, ``(runs, N)``: free of the bearing."""
    found = []
    for sensor in scenario.sensors:
        distance, _ = geometry(scenario, sensor, states)
        below = image_depth(
            sensor.model.path, conical.TARGET_DEPTH, sensor.model.array_depth, sensor.model.bottom_depth
        )
        flat = distance / np.hypot(distance, below)
        speed = float(profile.speed_at(sensor.model.array_depth))
        found.append(speed * first_slowness(profile, sensor.model, distance) / flat)
    return np.concatenate(found, axis=-1)


def trace_and_fit(scenario, measured, profile, states, rounds):
    """Estimates ``(rounds + 1, runs, n)``: by straight rays, then with their `factors` divided out."""
    found = [fit(scenario, measured, states).state]
    for _ in range(rounds):
        straight = measured / factors(scenario, found[-1], profile)
        found.append(fit(scenario, straight, found[-1]).state)
    return np.stack(found)


def two_ray_runs(seed, runs, place, bottom_depth):
    """Section 5.2 along traced rays: errors ``(runs, 4)`` of the fits, the target's depth known.

    ``straight`` fits straight rays, ``traced`` goes on with one round of `trace_and_fit`; ``uniform`` is the
    straight fit with the same noise in water without layers. ``seed`` and ``runs`` as of any task for
    `tmalib.monte_carlo`.
    """
    scenario, profile = conical.section_5_2(bottom_depth, conical.TARGET_DEPTH), profiles()[place]
    clean = traced(scenario, scenario.state[None], profile, "array")
    uniform = scenario.simulate(runs, seed)
    measured = clean + uniform - scenario.measure()
    straight, once = trace_and_fit(scenario, measured, profile, np.array(START), rounds=1)
    found = {"straight": straight, "traced": once, "uniform": fit(scenario, uniform, np.array(START)).state}
    return {name: states - scenario.state for name, states in found.items()}


def direct_level(profile, bottom_depth, distances, target_depth=conical.TARGET_DEPTH):
    """Intensity of the direct sound at distances over that along a straight line, in decibels.

    Of all direct rays to the paper's array that turn once at most. A tube between two of them that leave at
    the angles e and ``e + de`` spreads what it has over the distances from x to ``x + dx``::

        R^2 cos(e) de / (x dx sin(e')),

    with the angle e' at the array and the length R of the straight line. Minus infinity in the shadow.
    """
    water = LayeredWater(profile, target_depth, conical.ARRAY_DEPTH, bottom_depth)
    total = np.zeros(np.shape(distances))
    for turns in (0, 1):
        for family, slowness in water.parts(DIRECT, turns):
            if not turns:
                slowness = np.sin(np.linspace(0, np.pi / 2, FINE)[1:]) * slowness[-1]
            far = water.advance(slowness, family)[0]
            slowness, far = slowness[np.isfinite(far)], far[np.isfinite(far)]
            leaves, arrives = (np.arccos(np.minimum(1, slowness * c)) for c in (water.target, water.array))
            for i in range(len(slowness) - 1):
                x, turned = np.mean(far[i : i + 2]), np.abs(leaves[i + 1] - leaves[i])
                inside = (min(far[i : i + 2]) <= distances) & (distances < max(far[i : i + 2]))
                straight = x**2 + (target_depth - conical.ARRAY_DEPTH) ** 2
                sine, wide = np.sin(np.mean(arrives[i : i + 2])), np.abs(far[i + 1] - far[i])
                share = straight * np.cos(np.mean(leaves[i : i + 2])) * turned / (x * wide * sine)
                total[inside] += share
    with np.errstate(divide="ignore"):
        return 10 * np.log10(total)
