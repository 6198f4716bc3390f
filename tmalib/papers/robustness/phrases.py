"""`robustness`: the phrases of the text as measures with limits, judged over plausible scenarios.

One yardstick serves for most: *a tenth*. An estimate is bad when it ends a tenth of the final range or
more from the target, and good below that; an approximation is good when it leaves a tenth, at most, of what
it approximates; a filter performs better when it takes a tenth, at least, off the error.

Not every scenario counts for every phrase (`counted`). Section IV asks what other algorithms produce "for
such cases", those in which the BLS is bad: there the filters are held against it. And a degenerate cloud
of particles shows the collapse of our filter, not what a filter believes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...judging import Ours, judge, within
from ...particles import FEW_FAMILIES
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
OVER_BLS = "error of the filter at the end over that of the BLS"
CASES = ("circular target", "worst perturbation")
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
        "Figure 8", "density halfway from the BLS to the target over the largest", at_least=TENTH
    ),
    "BLS, periodic perturbation": Phrase(
        "Figure 9",
        "distance of estimate and target over the final range, for a cosine of any phase",
        at_most=TENTH,
    ),
    "manoeuvre": Phrase(
        "Section V",
        "worst first-order error over the final range, for the best of nine weaves",
        at_most=TENTH,
    ),
    **{
        f"{who} against BLS, {case}": Phrase("Section I", OVER_BLS, at_least=1 - TENTH)
        for who in ("EKF", "particles")
        for case in CASES
    },
}


def case_of(name):
    """The target that a phrase is about, one of `CASES`; empty for others."""
    return next((case for case in CASES if case in name), "")


def sound(name, runs):
    """Where the cloud that a phrase speaks of is not degenerate, ``(runs,)``; all for other phrases."""
    if not name.startswith("particles"):
        return np.ones(len(runs["form"]), dtype=bool)
    return runs[f"families, {case_of(name)}"] >= FEW_FAMILIES


def meant(name, runs):
    """Where a phrase is said, ``(runs,)``: of filters, "for such cases" in which the BLS is bad."""
    if not name.startswith(("EKF", "particles", "bearings")):
        return np.ones(len(runs["form"]), dtype=bool)
    return runs[f"BLS, {case_of(name)}"] >= TENTH


def counted(name, runs):
    """Which scenarios count for a phrase, ``(runs,)``: those it means, degenerate clouds left out."""
    return meant(name, runs) & sound(name, runs)


def shares(runs, where=True):
    """Phrase to a pair: scenarios ``where`` it holds, and scenarios that count."""
    among = {name: counted(name, runs) & where for name in PHRASES}
    return {
        name: (int(phrase.holds(runs[name][among[name]]).sum()), int(among[name].sum()))
        for name, phrase in PHRASES.items()
    }


def middle(name, values):
    """Median of a measure; one that is NaN counts as on the wrong side of the limit."""
    wrong = np.inf if PHRASES[name].at_least is None else -np.inf
    return float(np.median(np.nan_to_num(values, nan=wrong, posinf=np.inf, neginf=-np.inf)))


def judge_phrases(runs):
    """Judge the phrases by the share of plausible scenarios in which they hold; ours is the median.

    ``runs`` are those of `plausible.measure_all`.
    """
    ours = {}
    for name, (held, scenarios) in shares(runs).items():
        phrase, left_out = PHRASES[name], int((meant(name, runs) & ~sound(name, runs)).sum())
        note = f"{phrase.measure} ({phrase.where})"
        note += f"; {left_out} degenerate clouds are left out" if left_out else ""
        ours[name, "claim"] = Ours(
            middle(name, runs[name][counted(name, runs)]), at_least=phrase.at_least, at_most=phrase.at_most,
            among=(held, scenarios), note=note,
        )  # fmt: skip
    return judge(PAPER, TABLE, ours, made_from=[runs])
