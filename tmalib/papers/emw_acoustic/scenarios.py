"""`emw-acoustic`: the six scenarios of Section V, as printed and as computed.

The printed observer turns at 7 m/s with 20 deg/min. The bounds of Tables I-VI do not follow from that
path. They follow, all but three to the last printed digit and these to within one unit of it, from another
one, which was recovered by fitting the tables:
a list of samples in which each leg starts by repeating the last position of the leg before, straight
legs at 7 m/s with headings of exactly 90, -45 and 90 degrees, and turns on a circle of 200 m radius
whose heading advances by a third of a degree a second. "As computed" means that path.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...batch import along_first_bearing
from ...bearings import Bearing, DelayedBearing, delay_of
from ...motion import Course, SampledCourse, Straight, Target, Turn, unit
from ...priors import Prior
from ...scenario import Scenario, Sensor

SOUND_SPEED = 1500.0  # m/s
OBSERVER_SPEED = 7.0  # m/s
TURN_RADIUS = 200.0  # m, recovered, not printed
TURN_RATE = np.radians(20) / 60  # rad/s
EAST, NORTH_WEST = np.radians(90), np.radians(-45)
PRIOR_VARIANCE = (20000**2 / 12, 20000**2 / 12, 10 / 12, 10 / 12)  # P_0/0: m^2, m^2/s^2


@dataclass(frozen=True)
class _Setting:
    """One scenario of Section V: where the target is and how long the observer's legs last."""

    target: tuple  # position at t = 0 in metres, heading in degrees
    legs: tuple  # seconds, straight and turn in turns
    samples: tuple  # samples of each leg in the path as computed
    period: float  # of the samples, seconds
    long_range: bool
    first_range: float  # r_init in metres
    instants: tuple  # of the confidence ellipses, seconds


_LONG, _SHORT = (200, 400, 600), (100, 400, 100)
_SETTINGS = {
    1: _Setting(((15e3, 18e3), 150), _LONG, _LONG, 1.0, True, 10e3, (400, 800, 1200)),
    2: _Setting(((4e3, 6e3), 150), _SHORT, (25, 100, 25), 4.0, False, 10e3, (200, 400, 600)),
    3: _Setting(((15e3, 18e3), -90), _LONG, _LONG, 1.0, True, 30e3, (400, 800, 1200)),
    4: _Setting(((4e3, 6e3), -90), _SHORT, (25, 100, 25), 4.0, False, 10e3, (200, 400, 600)),
    5: _Setting(
        ((15e3, 18e3), 150), (*_LONG, 400, 200), (*_LONG, 400, 200), 1.0, True, 10e3, (600, 1200, 1800)
    ),
    6: _Setting(
        ((4e3, 6e3), 150), (*_SHORT, 400, 200), (25, 100, 25, 101, 49), 4.0, False, 10e3, (400, 800, 1200)
    ),
}


def _setting(number):
    if number not in _SETTINGS:
        raise ValueError(f"scenario must be one of {sorted(_SETTINGS)}, got {number!r}")
    return _SETTINGS[number]


def course_as_printed(number):
    """The observer's course as Section V prints it: 7 m/s throughout, turns of 20 deg/min."""
    headings = (EAST, NORTH_WEST, EAST)
    rates = (-TURN_RATE, TURN_RATE)
    legs = []
    for i, duration in enumerate(_setting(number).legs):
        straight = Straight(duration, heading=headings[i // 2])
        legs.append(straight if i % 2 == 0 else Turn(duration, rates[i // 2]))
    return Course((0, 0), OBSERVER_SPEED, EAST, legs)


def course_as_computed(
    number, radius=TURN_RADIUS, speed=OBSERVER_SPEED, headings=(EAST, NORTH_WEST, EAST), repeat=True
):
    """The observer's path that reproduces the printed bounds, as a `SampledCourse`.

    What it is made of can be changed, so that its recovery from the tables can be shown.

    Parameters
    ----------
    number : int
    radius : float
        Of the turns, in metres.
    speed : float
        On the straight legs, in m/s.
    headings : sequence of float
        Of the straight legs, in radians.
    repeat : bool
        Whether a leg starts by repeating the last position of the leg before. If not, it starts one
        sampling period further on.
    """
    setting = _setting(number)
    period = setting.period
    position, heading = np.zeros(2), headings[0]
    positions, along_path = [], []
    for i, count in enumerate(setting.samples):
        step = np.arange(count) + (0 if repeat or i == 0 else 1)
        if i % 2 == 0:
            heading = headings[i // 2]
            there = position + (step * period * speed)[:, None] * unit(heading)
            along = np.full(count, heading)
        else:
            side = -1.0 if i // 2 == 0 else 1.0  # left in the first turn, right in the second
            along = heading + side * step * period * TURN_RATE
            centre = position + side * radius * np.array([np.cos(heading), -np.sin(heading)])
            there = centre + side * radius * np.stack([-np.cos(along), np.sin(along)], axis=-1)
        positions.append(there)
        along_path.append(along)
        position, heading = there[-1], along[-1]
    n = sum(setting.samples)
    return SampledCourse(period * np.arange(n), np.concatenate(positions), np.concatenate(along_path))


def scenario(number, path="computed"):
    """Scenario 1 to 6 of Section V.

    Parameters
    ----------
    number : int
    path : {"computed", "printed"}
        The observer's path: the one that gives the tables, or the one that the text describes.

    Returns
    -------
    Scenario
        Two sensors, radar or periscope first, then sonar; the state at the last measurement time t_M.
    """
    setting = _setting(number)
    if path not in ("computed", "printed"):
        raise ValueError(f"path must be 'computed' or 'printed', got {path!r}")
    position, heading = setting.target
    target = Target(position, speed=5.0, heading=np.radians(heading))
    platform = course_as_computed(number) if path == "computed" else course_as_printed(number)
    end = sum(setting.samples) * setting.period
    if setting.long_range:
        optical = Sensor(Bearing(), np.arange(0, end, 1.0), np.radians(1), "radar")
    else:
        optical = Sensor(Bearing(), np.arange(0, end, 120.0), np.radians(0.1), "periscope")
    sonar = Sensor(DelayedBearing(SOUND_SPEED), np.arange(0, end, 4.0), np.radians(1), "sonar")
    last = max(optical.times[-1], sonar.times[-1])
    return Scenario(platform, [optical, sonar], reference_time=last, target=target)


# -- what the tables' columns need beyond the text ----------------------------------------------------


@dataclass(frozen=True)
class RadarOfTheTables(Bearing):
    """The instantaneous bearing with the gradient that the EKF columns of the tables need.

    The printed filter does not give those columns where a radar bearing comes without a sonar bearing.
    They follow when, at these instants, the gradient is that of the *delayed* bearing while the
    innovation stays instantaneous. Inferred from the tables, not stated in the paper.
    """

    c: float = SOUND_SPEED
    sonar_period: float = 4.0

    def observer_state(self, platform, times):
        """Position of the platform and whether the bearing comes without a sonar bearing, ``(3, N)``."""
        alone = np.mod(times, self.sonar_period) > 0
        return np.vstack([super().observer_state(platform, times), alone])

    def value_and_gradient(self, state, observer, elapsed):
        value, gradient = super().value_and_gradient(state, observer, elapsed)
        _, delayed = DelayedBearing(self.c).value_and_gradient(state, observer, elapsed)
        return value, np.where(observer[2] > 0, delayed, gradient)


@dataclass(frozen=True)
class ConventionalBearing(DelayedBearing):
    """The delayed bearing with the classical gradient, as the bound of BOTMA in the tables has it.

    ``[cos, -sin, s cos, -s sin] / R`` at the retarded position: neither the drift of the delay nor the
    delay in the lever ``s`` is differentiated. The paper does not define this bound; this definition
    reproduces it.
    """

    def value_and_gradient(self, state, observer, elapsed):
        value, _ = super().value_and_gradient(state, observer, elapsed)
        x, y, vx, vy = state
        distance = self.c * delay_of(
            x + elapsed * vx - observer[0], y + elapsed * vy - observer[1], vx, vy, self.c
        )
        gradient = np.empty((4, *value.shape))
        gradient[0], gradient[1] = np.cos(value) / distance, -np.sin(value) / distance
        np.multiply(elapsed, gradient[:2], out=gradient[2:])
        return value, gradient


def filter_scenario(scenario, gradient="tables"):
    """The scenario that the EKF assumes: with the correct gradient, or with the one of the tables.

    Parameters
    ----------
    scenario : Scenario
    gradient : {"tables", "correct"}
    """
    if gradient not in ("tables", "correct"):
        raise ValueError(f"gradient must be 'tables' or 'correct', got {gradient!r}")
    if gradient == "correct":
        return scenario
    optical, sonar = scenario.sensors
    return replace(
        scenario, sensors=[Sensor(RadarOfTheTables(), optical.times, optical.sigma, optical.name), sonar]
    )


def botma_scenario(scenario):
    """The sonar alone, with the classical gradient: the scenario of the BOTMA bound."""
    _, sonar = scenario.sensors
    return replace(scenario, sensors=[Sensor(ConventionalBearing(), sonar.times, sonar.sigma, sonar.name)])


# -- where the estimators start -----------------------------------------------------------------------


def start(scenario, angles, number, first_range=None):
    """``X_init`` of both estimators: at rest, r_init along the first bearing (Section V), ``(..., 4)``.

    ``first_range`` in metres replaces the scenario's r_init.
    """
    first_range = _setting(number).first_range if first_range is None else first_range
    return along_first_bearing(scenario, angles, first_range)


def prior(start, first_again=False):
    """Prior of the EKF: ``X_init`` and ``P_0/0`` at t_1 = 0.

    The first bearing went into ``X_init``; the filter starts with the measurements after t_1. With
    ``first_again`` it processes those at t_1 as well.
    """
    return Prior(start, np.diag(PRIOR_VARIANCE), time=np.nextafter(0.0, -1.0) if first_again else 0.0)


def instants(number):
    """Times of the three confidence ellipses of the scenario's figure, in seconds; the last is t_M."""
    *early, _ = _setting(number).instants
    return np.array([*early, scenario(number).reference_time])
