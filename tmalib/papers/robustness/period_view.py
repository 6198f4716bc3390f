"""`robustness`, Section III: the live view of a perturbation's period and size against the track."""

from dataclasses import dataclass

import numpy as np

from ...batch import fit
from ...bearings import bearing, wrap
from ...figures import colour
from ...judging.live import Axis, Curve, Panel, Slider, fixed, frames, live
from ...sensitivity import displaced_measurements, position_criterion, response
from .periodic import TOLERANCE, end_gain, oscillation
from .scenarios import DURATION, SIGMA

BETWEEN = tuple(DURATION / (whole + 0.5) for whole in (19, 13, 9, 6, 5, 4, 3))  # the notches of the comb
PERIODS = (1, *BETWEEN, 6, 6.5, 7, 7.5, 8, 9, 12, 15, 20)  # s
AMPLITUDES = (5, 15, 30, 60, 100)  # m
POINTS = 31  # of a line, at least


def worst_phase_of(scenario, period, phases=360):
    """The phase of a cosine that moves the final position most to first order, away from the platform."""
    phase = 2 * np.pi * np.arange(phases) / phases
    shift = (np.exp(1j * phase)[:, None] * (end_gain(scenario) @ oscillation(scenario.times, period))).real
    away = scenario.target.position_at(DURATION) - scenario.platform.position_at(DURATION)
    return float(phase[np.argmax(np.linalg.norm(shift, axis=1) * np.sign(shift @ away))])


@dataclass(frozen=True, eq=False)
class Perturbed:
    """A uniform motion with a cosine across the line of sight, and the estimate from its exact bearings.

    Attributes
    ----------
    displacement : ndarray, shape (N, 2)
        In metres.
    state : ndarray, shape (4,)
        The estimate; NaN if the iteration did not converge.
    error : float
        Of the final position, in metres.
    seen, fitted : ndarray, shape (N,)
        Bearings of the perturbed motion and of the estimate minus those of the uniform motion, in rad.
    """

    displacement: np.ndarray
    state: np.ndarray
    error: float
    seen: np.ndarray
    fitted: np.ndarray


def perturbed(scenario, period, amplitude):
    """The `Perturbed` motion with a period (s) and an amplitude (m), at the worst phase to first order."""
    turn = np.exp(1j * worst_phase_of(scenario, period))
    wave = amplitude * (oscillation(scenario.times, period) * turn).real
    displacement = response(scenario).displacement(wave)
    measured = displaced_measurements(scenario, displacement)
    found = fit(scenario, measured, scenario.state, tolerance=TOLERANCE)
    state = found.state if found.converged else np.full(4, np.nan)
    off = position_criterion(scenario, DURATION) @ (state - scenario.state)
    undisturbed, here = scenario.measure(), scenario.platform.position_at(scenario.times)
    estimated = bearing(track(state, scenario.times) - here)
    fitted, seen = wrap(estimated - undisturbed), wrap(measured - undisturbed)
    return Perturbed(displacement, state, float(np.hypot(*off)), seen, fitted)


def track(state, times):
    """Positions ``(N, 2)`` of a uniform motion with a state at time zero."""
    return state[:2] + np.multiply.outer(times, state[2:])


def in_words(found):
    """What is to be seen: the error, and what the bearings tell of it."""
    if not np.isfinite(found.error):
        return "No estimate: the iteration does not converge, the range runs away."
    rms = 1e3 * np.sqrt(np.mean((found.seen - found.fitted) ** 2))
    error = f"{found.error / 1e3:.2f} km" if found.error > 1e3 else f"{found.error:.3g} m"
    return (
        f"The estimated final position is {error} off. The residuals have a root mean square of "
        f"{rms:.2g} mrad, where the standard deviation of a bearing is {1e3 * SIGMA:g} mrad."
    )


def period_view(scenario, instead):
    """Show the view; returns what it is made of, `Perturbed` motions by period and amplitude."""
    made = {(period, size): perturbed(scenario, period, size) for period in PERIODS for size in AMPLITUDES}
    sliders = [
        Slider("Period", PERIODS, "s", 2, PERIODS.index(BETWEEN[3])),
        Slider("Amplitude", AMPLITUDES, "m", 0, AMPLITUDES.index(15)),
    ]

    def curve(label, mark, hue, points):
        shown = frames(lambda *place: points(place[0], made[place]), sliders, (0, 1))
        return Curve(label, mark, hue, shown)

    def lasting(period):
        """Enough of the times of measurement for a line."""
        count = max(POINTS, int(6 * DURATION / period) + 1)
        return np.linspace(0, len(scenario.times) - 1, count).astype(int)

    live(
        "A perturbation across the line of sight, and the track that is estimated",
        sliders,
        [_map(scenario, curve, lasting), _bearings(scenario, curve, lasting)],
        frames(lambda *place: in_words(made[place]), sliders, (0, 1)),
        instead,
        buttons=[("Period of the weave", [7, 15]), ("As in our Figure 9", [1, 100])],
        digits=3,
    )
    return made


def _map(scenario, curve, lasting):
    times, ends = scenario.times, np.array([0, DURATION])
    platform = scenario.platform.position_at(times[:: len(times) // POINTS]) / 1e3

    def true_path(period, found):
        some = lasting(period)
        return tuple((scenario.target.position_at(times[some]) + found.displacement[some]).T / 1e3)

    curves = (
        Curve("platform", "line", colour("platform"), fixed(*platform.T)),
        curve("target", "line", colour("target"), true_path),
        curve("estimate", "dashed", None, lambda _, found: tuple(track(found.state, ends).T / 1e3)),
        curve("estimate, at the end", "cross", None, lambda _, found: track(found.state, ends[1:]).T / 1e3),
    )
    alt = "Map: the platform's weaving track, the target's perturbed track, and the straight estimated one."
    return Panel(alt, Axis("East (km)", (-7, 6)), Axis("North (km)", (-3, 10)), curves, equal=True)


def _bearings(scenario, curve, lasting):
    def line(angles, period):
        some = lasting(period)
        return scenario.times[some], 1e3 * angles[some]

    sides = 1e3 * SIGMA * np.array([1, 1, np.nan, -1, -1])
    curves = (
        Curve("one standard deviation", "thin", None, fixed([0, DURATION, np.nan, 0, DURATION], sides)),
        curve("target", "line", colour("target"), lambda period, found: line(found.seen, period)),
        curve("estimate", "dashed", None, lambda _, found: line(found.fitted, DURATION)),
    )
    alt = "Bearings of the perturbed target and of the estimate, both minus those of the uniform motion."
    return Panel(alt, Axis("Time (s)", (0, DURATION)), Axis("Change of bearing (mrad)", (-20, 20)), curves)
