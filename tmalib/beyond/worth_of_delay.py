"""What the delay of sound is worth, against a manoeuvre: settings, bounds, the two laws.

Targets are given by what they do half way through the listening: they are then at ``(0, range)`` from the
observer, and that is the position whose bound is looked at.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from ..bearings import Bearing, DelayedBearing
from ..bounds import crlb
from ..montecarlo import Stream
from ..motion import Course, Straight
from ..scenario import Scenario
from ..sensors import Sensor

STREAM = Stream("beyond/worth_of_delay")
COUNT = 61  # bearings of each kind
HEADINGS = np.radians(np.arange(0, 360, 30))
TURNS = (0.3, 0.4, 0.5, 0.6, 0.7)  # share of the time after which a manoeuvre turns


@dataclass(frozen=True)
class Setting:
    """A medium and a patience: seconds of listening, m/s of sound and of the observer, limits of the map."""

    name: str
    duration: float
    sound_speed: float
    own_speed: float
    ranges: tuple
    speeds: tuple
    sigma_light: float = np.radians(1.0)
    sigma_sound: float = np.radians(1.0)

    @property
    def times(self):
        """Of the bearings of either kind, ``(COUNT,)``."""
        return np.linspace(0, self.duration, COUNT)

    @property
    def way(self):
        """How far the observer can go meanwhile, in metres."""
        return self.own_speed * self.duration


SEA = Setting("at sea", 1200.0, 1500.0, 7.0, (5e3, 100e3), (2.0, 30.0))
AIR = Setting("in the air", 60.0, 340.0, 15.0, (0.5e3, 10e3), (10.0, 238.0))


def halfway_state(place, speed, course):
    """State ``(..., 4)`` half way: at ``(0, place)`` metres, with a speed in m/s and a course in radians."""
    place, speed, course = np.broadcast_arrays(place, speed, course)
    return np.stack([0 * place, place, speed * np.sin(course), speed * np.cos(course)], axis=-1)


def random_states(setting, rng, count):
    """States half way, ``(count, 4)``: log-uniform in range and speed within the limits, any course."""
    place, speed = (np.exp(rng.uniform(*np.log(ends), count)) for ends in (setting.ranges, setting.speeds))
    return halfway_state(place, speed, rng.uniform(0, 2 * np.pi, count))


def straight(setting, velocity):
    """An observer with a constant velocity ``(2,)``, at the origin half way."""
    speed, heading = np.hypot(*velocity), np.arctan2(*velocity)
    start = -setting.duration / 2 * np.asarray(velocity)
    return Course(start, speed, heading, [Straight(np.inf)])


def two_legs(setting, first, second, turn):
    """An observer from the origin, at full speed, that turns on the spot after a share of the time."""
    legs = [Straight(turn * setting.duration), Straight(np.inf, heading=second)]
    return Course((0, 0), setting.own_speed, first, legs)


def watch(setting, platform, delayed=True):
    """The scenario half way: as many bearings of light as of sound, which is late or, if not, is not."""
    sound = DelayedBearing(setting.sound_speed) if delayed else Bearing()
    sensors = [
        Sensor(Bearing(), setting.times, setting.sigma_light, "light"),
        Sensor(sound, setting.times, setting.sigma_sound, "sound"),
    ]
    return Scenario(platform, sensors, setting.duration / 2)


def relative_bound(scenario, states, later=0.0):
    """Bound on the position over the range from the origin, ``later`` seconds after half way, ``(...)``."""
    bound, places = crlb(scenario, states), states[..., :2] + later * states[..., 2:]
    moved = np.eye(4)[:2] + later * np.eye(4)[2:]
    variance = np.trace(moved @ bound @ moved.T, axis1=-2, axis2=-1)
    return np.sqrt(variance) / np.hypot(places[..., 0], places[..., 1])


def best_manoeuvre(setting, states, later=0.0):
    """Least relative bound over all courses of `two_legs`, with bearings that are not late, ``(...)``."""
    best = np.full(states.shape[:-1], np.inf)
    for first, second, turn in product(HEADINGS, HEADINGS, TURNS):
        if first != second:
            scenario = watch(setting, two_legs(setting, first, second, turn), delayed=False)
            best = np.fmin(best, relative_bound(scenario, states, later))
    return best


def by_delay(setting, states, velocity=(0.0, 0.0), later=0.0):
    """Relative bound of an observer `straight` or, by default, at rest, with late sound, ``(...)``."""
    return relative_bound(watch(setting, straight(setting, velocity)), states, later)


# -- the laws -----------------------------------------------------------------------------------------


def of_means(setting):
    """Standard deviations of the mean bearing of light and of sound, in radians."""
    return setting.sigma_light / np.sqrt(COUNT), setting.sigma_sound / np.sqrt(COUNT)


def imbalance(setting):
    """By how much worse a difference of the two kinds is known than their weighted mean: 2 at least."""
    light, sound = of_means(setting)
    return light / sound + sound / light


def shift_and_arc(setting, states, velocity=(0.0, 0.0)):
    """Root mean square derivative D along the lost direction, and arc swept, for an observer `straight`."""
    w = states[..., 2:] - np.asarray(velocity)
    lag = (setting.times - setting.duration / 2)[:, None]
    d = states[..., None, :2] + lag * w[..., None, :]
    turning = _cross(states[..., :2], w)
    q = setting.sound_speed**2 * np.sum(d * d, axis=-1) - _cross(states[..., None, 2:], d) ** 2
    angle = np.unwrap(np.arctan2(d[..., 0], d[..., 1]), axis=-1)
    shift = np.sqrt(np.mean(turning[..., None] ** 2 / q, axis=-1))
    return shift, np.abs(angle[..., -1] - angle[..., 0])


def law_of_delay(setting, states, velocity=(0.0, 0.0)):
    """Relative bound without a manoeuvre by the law of the chapter: its two terms, each ``(...)``."""
    shift, arc = shift_and_arc(setting, states, velocity)
    light, sound = of_means(setting)
    both = 1 / np.sqrt(light**-2 + sound**-2)
    return np.hypot(light, sound) / shift, np.sqrt(12) * both / arc


def baseline(ratio):
    """Largest effective baseline of two legs at full speed, over the way of the observer, ``(...)``.

    Parameters
    ----------
    ratio : array_like, shape (...)
        The target's speed across the line of sight over the observer's.

    Returns
    -------
    ndarray
        What is left of the bends of the apparent track when all that a target may do in first order is
        taken out of it, root mean square, at the best instant of turning.
    """
    ratios, values = _baselines()
    return np.interp(ratio, ratios, values)


@cache
def _baselines():
    turns, t = np.linspace(-0.46, 0.46, 47), np.linspace(-0.5, 0.5, 401)
    own = np.abs(t - turns[:, None])  # across the line of sight, there and back
    ratios, values = np.array([0.0, *np.geomspace(0.05, 500, 80)]), []
    for ratio in ratios:
        apparent = ratio * t - own
        span = np.stack(np.broadcast_arrays(np.ones_like(t), t, t * apparent), axis=-1)
        basis, _ = np.linalg.qr(span)
        rest = apparent - np.squeeze(basis @ (basis.mT @ apparent[..., None]), axis=-1)
        values.append(np.sqrt(np.mean(rest**2, axis=-1)).max())
    return ratios, np.array(values)


def law_of_manoeuvre(setting, states):
    """Relative bound of the best of two legs by the law of the chapter, ``(...)``."""
    place = np.hypot(states[..., 0], states[..., 1])
    across = np.abs(_cross(states[..., :2], states[..., 2:])) / place
    light, sound = of_means(setting)
    both = 1 / np.sqrt(light**-2 + sound**-2)
    return both * place / (baseline(across / setting.own_speed) * setting.way)


def worth(setting, states):
    """Law of the manoeuvre over law of the delay, ``(...)``: above one the delay tells the range better."""
    return law_of_manoeuvre(setting, states) / np.hypot(*law_of_delay(setting, states))


def even_speed(setting, place):
    """Speed in m/s of a crossing target at ``place`` metres for which the two laws are even, ``(...)``.

    NaN where it is beyond nine tenths of the speed of sound, or below a hundredth of the observer's.
    """
    speeds = np.geomspace(0.01 * setting.own_speed, 0.9 * setting.sound_speed, 600)
    place = np.asarray(place, dtype=float)
    value = worth(setting, halfway_state(place[..., None], speeds, np.pi / 2))
    first = np.argmax(value > 1, axis=-1)
    return np.where((first > 0) & (value > 1).any(axis=-1), speeds[first], np.nan)


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
