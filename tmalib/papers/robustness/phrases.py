"""`robustness`: which plausible scenarios count for a phrase of the text, and in how many of them it holds.

What measures a phrase and within which limits it holds is in ``phrases.toml`` (`judging.phrases`). One
yardstick serves for most: *a tenth*. An estimate is bad when it ends a tenth of the final range or more from
the target, and good below that; an approximation is good when it leaves a tenth, at most, of what it
approximates; a filter performs better when it takes a tenth, at least, off the error.

Not every scenario counts for every phrase (`counted`). Section IV asks what other algorithms produce "for
such cases", those in which the BLS is bad: there the filters are held against it. And a degenerate cloud
of particles shows the collapse of our filter, not what a filter believes.
"""

from __future__ import annotations

import numpy as np

from ... import judging
from ...particles import FEW_FAMILIES
from .measures import TENTH
from .paper import PAPER

TABLE = "Text"
CASES = ("circular target", "worst perturbation")
PHRASES = judging.phrases_of(PAPER, TABLE)


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
    for name, among in shares(runs).items():
        left_out = int((meant(name, runs) & ~sound(name, runs)).sum())
        note = f"{left_out} degenerate clouds are left out" if left_out else ""
        value = middle(name, runs[name][counted(name, runs)])
        ours[name] = judging.Ours(value, among=among, note=note)
    return judging.judge_phrases(PAPER, TABLE, ours, made_from=[runs])
