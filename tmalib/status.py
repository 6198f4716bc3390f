"""What became of a run: one vocabulary for all estimators, and what to do next.

*Converged* is said only of a minimum that is one: observable, at a finite range, not above another that was
found. A filter has no minimum; a run that it took to the end is *filtered*.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .types import FloatArray, TextArray

CONVERGED = "converged"
FILTERED = "filtered"
NOT_FINITE = "not finite"
NOT_OBSERVABLE = "not observable"
NO_MINIMUM = "no minimum at a finite range"
RAN_AWAY = "ran away"
NO_DESCENT = "no step lowers the criterion"
ITERATION_LIMIT = "iteration limit"
NO_WEIGHT = "no particle explains a measurement"

ADVICE = {
    CONVERGED: "",
    FILTERED: "",
    NOT_FINITE: """\
A start, a prior or a measurement is not a finite number, or predicts none, as on the platform or faster than
sound. Leave a measurement out with NaN.""",
    NOT_OBSERVABLE: """\
The measurements are the same for a whole family of targets. A manoeuvre of the platform, a second platform or
another kind of measurement tells its members apart.""",
    NO_MINIMUM: """\
The criterion is lowest for a target at infinity: the measurements tell a direction, and no range. Measure
longer, or after a manoeuvre; an outlier or a wrong sigma can do this too.""",
    RAN_AWAY: "The steps from this start went beyond 1e9 m. Give another start, or none.",
    NO_DESCENT: """\
Rounding decides here: the criterion is flat, or huge because the model does not fit at all. Look at the
residuals and at the units.""",
    ITERATION_LIMIT: "Give more iterations, or another start, or none.",
    NO_WEIGHT: """\
All particles are so far from a measurement that none has a weight. Take more of them, a wider first cloud or
a larger sigma, or leave the measurement out.""",
}
ADVICE = {word: advice.replace("\n", " ") for word, advice in ADVICE.items()}
WIDTH = max(map(len, ADVICE))  # of an array of statuses


def status_of_filter(*estimates: FloatArray) -> TextArray:
    """`FILTERED`, or `NOT_FINITE` where an estimate is not a finite number; arrays with the runs' axes first.

    The arrays are ``(..., T, n)``, ``(..., T, n, n)`` and so on: the first has two axes after those of the
    runs, each further one axis more.
    """
    finite: Any = True
    for k, estimate in enumerate(estimates):
        finite = finite & np.isfinite(estimate).all(axis=tuple(range(-2 - k, 0)))
    return np.where(finite, FILTERED, NOT_FINITE)[()]
