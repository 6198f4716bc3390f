"""Who watches whom, and when: windows of recorded tracks, chosen by `Rules` that know no result.

Every window has its plane, about the first fix of the own ship in it. A track takes part in a window if it
has no gap there; as own ship if it leaves its best straight line far enough, as target if its line is fast
enough and it keeps within some distances. Whether a target manoeuvres is not asked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..files.frame import Frame
from ..motion import SampledCourse, Target


@dataclass(frozen=True)
class Rules:
    """What a window, an own ship and a target must be; metres, seconds, radians.

    Attributes
    ----------
    length, step : float
        Of a window, and from the start of one to that of the next.
    every, sigma : float
        Time from bearing to bearing, and their standard deviation.
    lead : float
        How long before the first bearing the target's track begins: its sound is under way.
    gap : float
        Longest time between two fixes; between them a track is straight.
    fastest : float
        A fix that needs more from the last is left out (`tmalib.study.records.without_jumps`).
    bend : float
        How far an own ship must somewhere be from its best straight line.
    slowest : float
        Least speed of a target's best straight line.
    nearest, farthest : float
        Distances of a target, at all bearings.
    targets : int
        How many targets of an own ship in a window, drawn where there are more.
    draws : int
        How often the noise of an encounter is drawn.
    """

    length: float
    step: float
    every: float
    sigma: float
    lead: float
    gap: float
    fastest: float
    bend: float
    slowest: float
    nearest: float
    farthest: float
    targets: int
    draws: int

    @property
    def times(self):
        """Of the bearings, in seconds from the start of the window."""
        return np.arange(0.0, self.length + self.every / 2, self.every)


@dataclass(frozen=True, eq=False)
class Encounter:
    """A window in which one track watches another; motions in its plane, names as in the records."""

    start: float
    own: str
    target: str
    platform: SampledCourse
    motion: SampledCourse


def best_line(motion, times):
    """The straight line of constant velocity nearest to a motion, by least squares at ``times``: a `Target`.

    Examples
    --------
    >>> bent = SampledCourse([0.0, 10.0, 20.0], [(0, 0), (45, 100), (30, 200)])
    >>> line = best_line(bent, bent.times)
    >>> line.velocity.round(6), line.position_at(10.0).round(6)
    (array([ 1.5, 10. ]), array([ 25., 100.]))
    """
    slope, start = np.polyfit(times, motion.position_at(times), 1)
    return Target.from_velocity(start, slope)


def largest_departure(motion, times):
    """Largest distance of a motion from its best line, in metres."""
    off = motion.position_at(times) - best_line(motion, times).position_at(times)
    return float(np.hypot(*off.T).max())


def covering(track, first, last, gap):
    """The fixes of a track ``(N, 3)`` that cover a time without a gap longer than ``gap``; None without."""
    begin = np.searchsorted(track[:, 0], first, side="right") - 1
    end = np.searchsorted(track[:, 0], last, side="left") + 1
    if begin < 0 or end > len(track):
        return None
    part = track[begin:end]
    return part if np.diff(part[:, 0]).max(initial=0.0) <= gap else None


def window_starts(tracks, rules):
    """Starts of all windows, from the first fix of all tracks on; the lead lies before them."""
    first = min(track[0, 0] for track in tracks.values()) + rules.lead
    last = max(track[-1, 0] for track in tracks.values()) - rules.length
    return first + rules.step * np.arange(int((last - first) // rules.step) + 1)


def _in_plane(part, frame, start):
    return SampledCourse(part[:, 0] - start, frame.to_plane(part[:, 1], part[:, 2]))


def is_target(motion, platform, rules):
    """Whether a motion may be a target of a platform."""
    places = motion.position_at(rules.times)
    distance = np.hypot(*(places - platform.position_at(rules.times)).T)
    inside = rules.nearest <= distance.min() and distance.max() <= rules.farthest
    return bool(inside and best_line(motion, rules.times).speed >= rules.slowest)


def encounters(tracks, rules, rng):
    """All encounters of recorded tracks, in order of time and names.

    Parameters
    ----------
    tracks : dict
        Of arrays ``(N, 3)``: time, latitude, longitude.
    rules : Rules
    rng : numpy.random.Generator
        Draws targets where an own ship has more than ``rules.targets``.

    Returns
    -------
    list of Encounter
    """
    found = []
    for start in window_starts(tracks, rules):
        parts = {
            name: part
            for name, track in tracks.items()
            if (part := covering(track, start - rules.lead, start + rules.length, rules.gap)) is not None
        }
        for own, fixes in parts.items():
            frame = Frame(latitude=fixes[0, 1], longitude=fixes[0, 2])
            platform = _in_plane(fixes, frame, start)
            if largest_departure(platform, rules.times) < rules.bend:
                continue
            motions = {name: _in_plane(part, frame, start) for name, part in parts.items() if name != own}
            names = [name for name, motion in motions.items() if is_target(motion, platform, rules)]
            chosen = sorted(rng.permutation(len(names))[: rules.targets])
            found += [Encounter(start, own, names[k], platform, motions[names[k]]) for k in chosen]
    return found
