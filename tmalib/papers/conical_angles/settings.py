"""The settings of a scenario as the paper's text prints them: speeds, headings, depths, times, noise."""

import numpy as np


def settings(scenario):
    """Settings of a `Scenario` with conical angles, by the names of the ledger's rows.

    Speeds (m/s) and headings (degrees) are taken from the positions in time; a turn rate is in degrees a
    minute, the duration in minutes, the period in seconds, depths are in metres. An array at rest has neither
    speed nor heading.

    >>> from tmalib.papers.conical_angles.scenarios import section_3_2
    >>> found = settings(section_3_2())
    >>> round(float(found["array speed"]), 9), float(found["bottom depth"])
    (5.0, 4000.0)
    """
    sensor, target, platform = scenario.sensors[0], scenario.target, scenario.platform
    found = {f"target {name}": value for name, value in _motion(target, sensor.times[:2]).items()}
    found |= {f"array {name}": value for name, value in _motion(platform, sensor.times[:2]).items()}
    found |= {
        "array depth": sensor.model.array_depth,
        "target depth": target.depth,
        "bottom depth": sensor.model.bottom_depth,
        "sampling period": np.diff(sensor.times)[0],
        "duration": np.ptp(sensor.times) / 60,
        "sigma": sensor.sigma,
    }
    if len(platform.legs) > 1:
        found |= {"turn rate": 60 * np.degrees(platform.legs[1].rate)}
        found |= {"second heading": np.degrees(platform.heading_at(sensor.times[-1])) % 360}
    return found


def _motion(moving, times):
    """Speed and heading between two times; nothing for what is at rest."""
    east, north = np.diff(moving.position_at(times), axis=0)[0] / np.diff(times)
    if not (east or north):
        return {}
    return {"speed": np.hypot(east, north), "heading": np.degrees(np.arctan2(east, north)) % 360}
