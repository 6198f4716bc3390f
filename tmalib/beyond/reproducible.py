"""What the three papers leave out, and what their own digits say of it.

An `Omission` is something that the text leaves open and a bound or another deterministic number depends on.
Its *readings* are the ways in which it was read or might be; each gives the numbers again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from ..bearings import Bearing, DelayedBearing
from ..bounds import crlb_sigma
from ..cones import ConicalAngle
from ..judging.paper import Paper
from ..papers.conical_angles import scenarios as conical
from ..papers.conical_angles import turning
from ..papers.conical_angles.paper import PAPER as CONICAL
from ..papers.emw_acoustic import scenarios as emw
from ..papers.emw_acoustic.paper import PAPER as EMW
from ..papers.emw_acoustic.tables import ROWS, TABLES
from ..papers.robustness import scenarios as robustness
from ..papers.robustness.paper import PAPER as ROBUSTNESS
from ..sensitivity import nearest_motion
from ..sensors import Sensor
from ..uniform import propagate

DEPTH_TOO = ("xT", "yT", "zT", "vxT", "vyT")
SAME = 1e-9  # relative: readings that no digits tell apart
MOST_DIGITS = 12

POWER = 2.8  # standard errors: seen at a level of 5 % in four experiments of five


@dataclass(frozen=True, eq=False)
class Omission:
    """Something left open, with the printed numbers that depend on it.

    Parameters
    ----------
    name : str
    paper : Paper
    erratum : str
    keys : tuple
        Of the rows in the ledger: table, row and column.
    readings : dict from str to ndarray
        What each gives for these rows.
    used : str
        The reading that the book's chapters use.
    simulated : bool
        Whether the Monte-Carlo numbers beside these rows depend on it as well.
    """

    name: str
    paper: Paper
    erratum: str
    keys: tuple
    readings: dict[str, np.ndarray]
    used: str
    simulated: bool = False

    @property
    def printed(self):
        """The rows of the ledger."""
        return [self.paper.printed(*key) for key in self.keys]

    @property
    def twins(self):
        """Readings that give the same numbers as the one in use, itself included."""
        best = self.readings[self.used]
        return [name for name, now in self.readings.items() if np.allclose(now, best, rtol=SAME, atol=0)]

    def agreeing(self):
        """How many rows each reading gives to within a unit of the last printed digit."""
        return {
            name: sum(p.agrees(value) for p, value in zip(self.printed, values, strict=True))
            for name, values in self.readings.items()
        }

    def distances(self):
        """Largest relative difference of a number between each reading and the one in use."""
        best = self.readings[self.used]
        return {name: np.abs(values / best - 1).max() for name, values in self.readings.items()}

    def depending(self):
        """How many rows some reading moves by more than a unit, and Monte-Carlo rows that depend on it."""
        best = self.readings[self.used]
        moved = np.max([np.abs(values - best) for values in self.readings.values()], axis=0)
        digits = [p.last_digit for p in self.printed]
        tables = {table for table, _, _ in self.keys if self.simulated}
        of_runs = [p for p in self.paper.ledger.values() if p.table in tables and p.kind == "monte-carlo"]
        return int(np.sum(moved > digits)), len(of_runs)

    def fitting_if_rounded(self, digits):
        """How many readings would give all numbers to within a unit, were these printed to so many digits."""
        best = self.readings[self.used]
        unit = _unit(best, digits)
        fits = [np.all(np.abs(now - unit * np.round(best / unit)) <= unit) for now in self.readings.values()]
        return int(np.sum(fits))

    def digits_needed(self):
        """Significant digits with which each number alone would have told the reading, ``(rows,)``.

        The fewest such that, of all readings, only the one in use and its twins are within a unit of the
        last digit; infinity where `MOST_DIGITS` do not.
        """
        others = np.array([values for name, values in self.readings.items() if name not in self.twins])
        best, found = self.readings[self.used], []
        for i, value in enumerate(best):
            enough = np.inf
            for digits in range(MOST_DIGITS, 0, -1):
                unit = _unit(value, digits)
                if np.any(np.abs(others[:, i] - unit * np.round(value / unit)) <= unit):
                    break
                enough = digits
            found.append(enough)
        return np.array(found)


def _unit(value, digits):
    """One unit of the last of so many significant digits."""
    return 10.0 ** (np.floor(np.log10(np.abs(value))) - digits + 1)


def runs_needed(difference):
    """Monte-Carlo runs whose standard deviation would tell such a relative difference of a bound.

    That of n runs has the relative standard error ``1 / sqrt(2 n)``; `POWER` of them are asked for.
    """
    return (POWER / np.asarray(difference)) ** 2 / 2


def seen_by(runs):
    """Relative difference of a bound that the standard deviation of so many runs tells."""
    return POWER / np.sqrt(2 * runs)


def omissions():
    """All of them, in the order of the papers."""
    return [course(), classical_bound(), samples(), depth_of_the_bound(), turn(), depths(), nearest()]


def course():
    """The observer of the first paper: its turns, the headings of its legs, where a leg begins."""
    radii = {"7 m/s": emw.OBSERVER_SPEED / emw.TURN_RATE, "200 m": emw.TURN_RADIUS}
    headings = {"135°": np.radians([90, -45, 90]), "133.3°": np.radians([90, -130 / 3, 90])}
    found = {}
    for radius, metres in radii.items():
        for angle, legs in headings.items():
            for repeat in (True, False):
                setting = {"radius": metres, "headings": legs, "repeat": repeat}
                name = f"{radius}, {angle}, {'repeated' if repeat else 'continued'}"
                found[name] = np.concatenate([_both_bounds(n, **setting) for n in TABLES])
    keys = [(TABLES[n], row, c) for n in TABLES for c in ("std_crlb", "std_crlb_botma") for row in ROWS]
    return Omission("observer's course", EMW, "emw-1", tuple(keys), found, "200 m, 135°, repeated", True)


def radii_left_open(digits):
    """Least and greatest radius of the turn, in metres, that so many digits of the bounds of Table I allow.

    Were all else of the course known; the bounds are those of 200 m, rounded, each to within a unit. Between
    radii that are computed the bounds are interpolated, with an error below the last of six digits.
    """
    some = np.geomspace(50, 2000, 120)
    bounds = CubicSpline(np.log(some), np.log([_both_bounds(1, radius=r) for r in some]))
    best = _both_bounds(1)
    unit = _unit(best, digits)
    radii = np.union1d(np.geomspace(50, 2000, 20_001), emw.TURN_RADIUS + np.linspace(-3, 3, 60_001))
    found = np.exp(bounds(np.log(radii)))
    fits = np.all(np.abs(found - unit * np.round(best / unit)) <= unit, axis=1)
    return radii[fits].min(), radii[fits].max()


def _both_bounds(number, **setting):
    now = replace(emw.scenario(number), platform=emw.course_as_computed(number, **setting))
    return np.concatenate([crlb_sigma(now), crlb_sigma(emw.botma_scenario(now))])


def classical_bound():
    """The bound from the sonar alone in the first paper, which is named and not defined."""
    models = {
        "classical gradient": emw.ConventionalBearing(emw.SOUND_SPEED),
        "full gradient": DelayedBearing(emw.SOUND_SPEED),
        "no delay": Bearing(),
    }
    found = {}
    for name, model in models.items():
        scenarios = [emw.scenario(n) for n in TABLES]
        sonars = [replace(s, sensors=[replace(s.sensors[1], model=model)]) for s in scenarios]
        found[name] = np.concatenate([crlb_sigma(s) for s in sonars])
    keys = tuple((TABLES[n], row, "std_crlb_botma") for n in TABLES for row in ROWS)
    return Omission("definition of a bound", EMW, "emw-4", keys, found, "classical gradient")


def _four_tables(depth_3_2=None, depth_5_2=None):
    """Scenarios of Tables 1, 2, 5 and 6 of the second paper, with an assumed depth."""
    first, second = (conical.TARGET_DEPTH if d is None else d for d in (depth_3_2, depth_5_2))
    pair = [conical.section_3_2(sigma, first) for sigma in (conical.SIGMA, conical.SIGMA / 100)]
    return pair + [conical.section_5_2(bottom, second) for bottom in (2000.0, 4000.0)]


FOUR = tuple((f"Table {n}", row, "std_crlb") for n in (1, 2, 5, 6) for row in ROWS)


def samples():
    """Whether the first and the last instant of a duration are both sampled."""
    whole = _four_tables()
    ends = [(s.times.min(), s.times.max()) for s in whole]
    spans = {
        "both ends": ends,
        "not the last": [(low, high - conical.PERIOD) for low, high in ends],
        "not the first": [(low + conical.PERIOD, high) for low, high in ends],
    }
    found = {
        name: np.concatenate(
            [
                crlb_sigma(replace(s.between(*span), reference_time=0.0), s.state)
                for s, span in zip(whole, pairs, strict=True)
            ]
        )
        for name, pairs in spans.items()
    }
    return Omission("number of samples", CONICAL, "conical-14", FOUR, found, "both ends", True)


def depth_of_the_bound():
    """Whether a bound is that at the true depth or at the one that the estimator assumes."""
    scenarios = {"true": _four_tables(), "assumed": _four_tables(200.0, 300.0)}
    found = {name: np.concatenate([crlb_sigma(s, s.state) for s in four]) for name, four in scenarios.items()}
    return Omission("depth of a bound", CONICAL, "conical-15", FOUR, found, "true")


def turn():
    """Duration of the array's turn, end of the measurements, and the heading that they use (Section 4.2)."""
    printed = CONICAL.printed("Section 4.2", "turn duration", "value").value
    courses = {
        "404 s, to 804 s": {"turn": printed, "duration": 804.0},
        "404 s, to 800 s": {"turn": printed},
        "405 s, to 800 s": {"turn": (270 - 135) / (20 / 60)},
    }
    found = {"north": _nine_bounds(north=True, lag=0.0, **courses["405 s, to 800 s"])}
    for name, setting in courses.items():
        for lag in (0.0, 2.0, 4.0):
            found[f"{name}, heading {lag:.0f} s old"] = _nine_bounds(lag=lag, **setting)
    keys = [("Table 3", row, "std_crlb") for row in DEPTH_TOO] + [("Table 4", r, "std_crlb") for r in ROWS]
    used = "405 s, to 800 s, heading 2 s old"
    return Omission("turn and its heading", CONICAL, "conical-20", tuple(keys), found, used, True)


def _nine_bounds(north=False, **setting):
    pair = [conical.turning_array(assumed_depth=d, **setting) for d in (None, conical.TARGET_DEPTH)]
    return np.concatenate([crlb_sigma(turning.held_north(s) if north else s) for s in pair])


@dataclass(frozen=True)
class WrongSign(ConicalAngle):
    """A conical angle whose derivative by the depth has the wrong sign."""

    def value_and_gradient(self, state, observer, elapsed):
        value, gradient = super().value_and_gradient(state, observer, elapsed)
        gradient[2] *= -1
        return value, gradient


def depths():
    """Whose depth is whose in the five-state bounds of Section 5.2.1, or a sign."""
    found = {}
    for name, exchanged in (("as printed", False), ("exchanged", True), ("wrong sign", False)):
        both = [conical.section_5_2(bottom, exchanged=exchanged) for bottom in (2000.0, 4000.0)]
        if name == "wrong sign":
            both = [_with_wrong_sign(s) for s in both]
        found[name] = np.concatenate([crlb_sigma(s) for s in both])
    keys = [(f"Section 5.2.1 scenario {n}", row, "std_crlb") for n in (1, 2) for row in DEPTH_TOO]
    return Omission("whose depth is whose", CONICAL, "conical-16", tuple(keys), found, "exchanged")


def _with_wrong_sign(scenario):
    direct, bounced = scenario.sensors
    model = WrongSign(*(getattr(direct.model, name) for name in ("path", "array_depth", "bottom_depth")))
    return replace(scenario, sensors=[Sensor(model, direct.times, direct.sigma, direct.name), bounced])


def nearest():
    """Which distance the uniform motion nearest to the third paper's target minimises."""
    times, track = _circle()
    found = {}
    for norm in ("sum", "squares", "largest"):
        gap = track - propagate(nearest_motion(times, track, norm=norm), times)[:, :2]
        found[norm] = np.array([np.hypot(*gap.T).max()])
    key = ("Section I", "max distance to a uniform linear trajectory", "value")
    return Omission("meaning of nearest", ROBUSTNESS, "robustness-16", (key,), found, "sum")


def _circle():
    circle = robustness.reference().circle
    return circle.times, circle.target.position_at(circle.times)
