"""`robustness`: the phrases of the text as measures with limits, judged over geometries.

One yardstick serves for most: *a tenth*. An estimate is bad when it ends a tenth of the final range or
more from the target, and good below that; an approximation is good when it leaves a tenth, at most, of what
it approximates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...judging import Ours, judge, within
from . import filters, measures
from .measures import TENTH
from .paper import PAPER

TABLE = "Text"


@dataclass(frozen=True)
class Phrase:
    """A phrase of the text: where it stands, what measures it, and the limits within which it holds."""

    where: str
    measure: str
    at_least: float | None = None
    at_most: float | None = None

    def holds(self, value):
        """Whether it holds, for one value or an array of them; a value that is NaN does not."""
        return within(value, self.at_least, self.at_most)

    def margin(self, value):
        """How many times better than the limit a value is; below one it does not hold."""
        value = np.asarray(value, dtype=float)
        with np.errstate(divide="ignore"):
            return value / self.at_least if self.at_most is None else self.at_most / np.abs(value)


ERROR = "distance of estimate and target over the final range"
DEPARTURE = "distance of filter and BLS over that of BLS and target"
PHRASES = {
    "BLS, circular target": Phrase("Section I", ERROR, at_least=TENTH),
    "first order, circular target": Phrase(
        "Figure 2", "distance of development and estimate over the estimate's shift", at_most=TENTH
    ),
    "information": Phrase(
        "Section IV", "largest standard deviation of the bound over the final range", at_most=TENTH
    ),
    "local minimum": Phrase(
        "Section II.A", "share of small perturbations without a lower minimum elsewhere", at_least=0.95
    ),
    "BLS, worst perturbation": Phrase("Figure 3", ERROR, at_least=TENTH),
    "speeds, worst perturbation": Phrase("Figure 4", "largest deviation of the speed over it", at_most=TENTH),
    "other models": Phrase(
        "Section IV", "worst first-order error of two other models over the final range", at_least=TENTH
    ),
    "EKF, circular target, early": Phrase(
        "Figure 5", "length of the track's first half over that of its second", at_least=2.0
    ),
    "EKF, circular target, end": Phrase("Figure 5", DEPARTURE, at_most=TENTH),
    "particles, circular target": Phrase(
        "Figure 6", "semi-axis of the cloud's 90 % ellipse over the range", at_least=TENTH
    ),
    "EKF, worst perturbation": Phrase("Figure 7", DEPARTURE, at_most=TENTH),
    "bearings, worst perturbation": Phrase(
        "Section IV", "rms difference of the bearings of BLS and target in sigma", at_most=1.0
    ),
    "particles, worst perturbation, maximum": Phrase(
        "Figure 8", "place of the densest point, 0 at the BLS, 1 at the target", at_least=-0.5, at_most=0.5
    ),
    "particles, worst perturbation, spread": Phrase(
        "Figure 8", "twice the share of the cloud beyond the target", at_least=0.01
    ),
    "BLS, periodic perturbation": Phrase(
        "Figure 9",
        "worst first-order error of a cosine of 15 m and about 1 s, over the final range",
        at_most=TENTH,
    ),
    "manoeuvre": Phrase(
        "Section V",
        "worst first-order error over the final range, for the best of nine weaves",
        at_most=TENTH,
    ),
}


def measure_phrases(geometry, seed, **options):
    """All measures in one geometry, two dicts from phrase to number: the value and its standard error.

    Parameters
    ----------
    geometry : scenarios.Geometry
    seed : SeedSequence
        Of the bearings and the particle filter, and of the small perturbations.
    **options
        Handed to `filters.measure_filters`.
    """
    value = {
        "BLS, circular target": measures.circular_error(geometry),
        "first order, circular target": measures.development_error(geometry),
        "information": measures.final_sigma(geometry),
        "local minimum": measures.share_of_global_minima(geometry, seed),
        "BLS, worst perturbation": measures.worst_error(geometry),
        "speeds, worst perturbation": measures.worst_speed(geometry),
        "other models": measures.error_of_other_models(geometry),
        "BLS, periodic perturbation": measures.periodic_error(geometry),
        "manoeuvre": measures.error_of_the_best_weave(geometry),
    }
    filtered, error = filters.measure_filters(geometry, seed, **options)
    return value | filtered, dict.fromkeys(value, 0.0) | error


def judge_phrases(here, error, elsewhere, made_from):
    """Judge the phrases: in the reference geometry, with the share of random ones in which they hold.

    Parameters
    ----------
    here : dict
        Phrase to number, in the reference geometry.
    error : dict
        Phrase to the standard error of that number.
    elsewhere : dict
        Phrase to numbers ``(G,)``, in random geometries.
    made_from : sequence of Runs or Stream
        The random numbers behind them.
    """
    ours = {}
    for name, phrase in PHRASES.items():
        among = phrase.holds(elsewhere[name])
        assumption = f"geometry assumed; holds in {among.sum()} of {len(among)} random ones"
        ours[name, "claim"] = Ours(
            here[name], error[name], assumption=assumption, note=f"{phrase.measure} ({phrase.where})",
            at_least=phrase.at_least, at_most=phrase.at_most,
        )  # fmt: skip
    return judge(PAPER, TABLE, ours, made_from=made_from)
