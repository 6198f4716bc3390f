"""What residual tests say, in words."""

from __future__ import annotations

from typing import Any

import numpy as np

from .checks import check_probability
from .status import CONVERGED


def sentences(tests: Any, level: float) -> list[str]:
    """The sentences of `ResidualTests.warnings`; `ValueError` for more than one run or a wrong level."""
    level = check_probability(level)
    if tests.status.ndim:
        raise ValueError(f"warnings are of one run, and these are {tests.status.shape}; fit one")
    if tests.status != CONVERGED:
        return [f"The fit has not converged ({tests.status}): its residuals say nothing. Try another start."]
    if np.isnan(tests.size.freedom[-1]):
        return ["There are no more measurements than unknowns: no test of the residuals is possible."]
    said = [write(tests, level) for write in (_largest, _size, _drift, _correlation)]
    return [text for texts in said for text in texts]


def _speaking(test, level):
    """Columns with a p-value below the level: of sensors, or else of all."""
    low = np.flatnonzero(test.p_value < level)
    return [i for i in low if i < len(test.p_value) - 1] or list(low)


def _whose(tests, column):
    return "all sensors" if column == len(tests.names) - 1 else tests.names[column]


def _chance(test, column):
    return f"p = {test.p_value[column]:.1g}"


def _size(tests, level):
    for i in _speaking(tests.size, level):
        ratio = np.sqrt(tests.size.statistic[i] / tests.size.freedom[i])
        if ratio > 1:
            advice = "sigma is too small, measurements are wild, or the target does not move as assumed"
        else:
            advice = "sigma is too large, or the measurements were smoothed before"
        yield (
            f"The residuals of {_whose(tests, i)} are {ratio:.2g} times as large as sigma says "
            f"({_chance(tests.size, i)}): {advice}."
        )


def _drift(tests, level):
    for i in _speaking(tests.drift, level):
        yield (
            f"The residuals of {_whose(tests, i)} drift slowly ({_chance(tests.drift, i)}): the target may "
            "have turned, a heading reference may be biased or drift, or a clock may be off. Fit a shorter "
            "window with `between`, or one sensor alone."
        )


def _correlation(tests, level):
    for i in _speaking(tests.correlation, level):
        yield (
            f"Successive residuals of {_whose(tests, i)} are correlated ({_chance(tests.correlation, i)}): "
            "the measurements are smoothed or closer in time than their noise allows, or the target does not "
            "move as assumed. The covariance is then too small: take fewer measurements or a larger sigma."
        )


def _largest(tests, level):
    for i in _speaking(tests.largest, level):
        yield (
            f"The measurement of {_whose(tests, i)} at {tests.when[i]:g} s is "
            f"{tests.largest.statistic[i]:.1f} standard deviations off ({_chance(tests.largest, i)}). If it "
            "is wild, leave it out and fit again: what else is said may come from it."
        )
