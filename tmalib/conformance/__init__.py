"""Forty problems for estimators of target motion, with the best answers that are known.

Each problem is a file of the library's own format (`tmalib.load`): a scenario without a target, and one run
of measurements. ``answers.json`` holds, by name, the lowest criterion that is known, where it is, how many
of the searches ended there, the bound there in fifty digits, and the rank of the information. A library
that wants to be trusted with angles can be tested by them: `judge_estimator` takes any function of scenario
and measurements.

Problems and answers are made by ``tests/conformance/make_problems.py``. What estimators made of them (`make
conformance`) is in ``results.json``, and on a page of the book.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..files import load
from ..scenario import Scenario

FOLDER = Path(__file__).parent
SOLVED, NEAR, WRONG, NONE = "solved", "near", "wrong", "no answer"
EQUAL = 1e-2  # criteria that differ by less are one minimum
NEARBY = 13.28  # as unlikely as one in a hundred for four unknowns: chi-square


class Problem(NamedTuple):
    """A scenario without a target, one run of measurements ``(N,)``, and what is known of its answer."""

    name: str
    scenario: Scenario
    angles: np.ndarray
    answer: dict[str, Any]


def problems() -> Iterator[Problem]:
    """All problems, in order of their names."""
    known = json.loads((FOLDER / "answers.json").read_text(encoding="utf-8"))
    for name, answer in known.items():
        content = load(FOLDER / "problems" / f"{name}.json")
        yield Problem(name, content["scenario"], content["angles"], answer)


def results() -> dict[str, Any]:
    """What estimators made of the problems: `make conformance`."""
    return json.loads((FOLDER / "results.json").read_text(encoding="utf-8"))


def criterion(problem: Problem, state: Any) -> float:
    """Sum of the squared residuals over sigma at a state; infinite where there is none."""
    state = np.asarray(state, dtype=float)
    if state.shape != (len(problem.scenario.coordinates),) or not np.isfinite(state).all():
        return np.inf
    with np.errstate(all="ignore"):
        predicted = problem.scenario.linearise(state)[0]
        off = problem.scenario.residual(problem.angles, predicted) / problem.scenario.sigma
    value = float(off @ off)
    return value if np.isfinite(value) else np.inf


def judge_answer(problem: Problem, state: Any) -> str:
    """The verdict on an answer, a state at the reference time, or `None` for none.

    *Solved*: as low as the best known, or lower. *Near*: not distinguishable from it by the measurements,
    as may be said of a good filter. *Wrong*: elsewhere. Where no answer is right, because nothing tells it,
    every answer is wrong and none is right.
    """
    if problem.answer["criterion"] is None:
        return SOLVED if state is None else WRONG
    if state is None:
        return NONE
    above = criterion(problem, state) - problem.answer["criterion"]
    return SOLVED if above <= EQUAL else NEAR if above <= NEARBY else WRONG


def judge_estimator(estimate: Callable[[Scenario, np.ndarray], Any]) -> dict[str, str]:
    """Verdicts on an estimator by name of the problem.

    Parameters
    ----------
    estimate : callable
        ``estimate(scenario, angles)`` returns a state, or `None` where it has no answer; what it raises
        counts as no answer.

    Examples
    --------
    >>> import tmalib as tma
    >>> def ours(scenario, angles):
    ...     found = tma.fit(scenario, angles)
    ...     return found.state if found.converged else None
    >>> verdicts = judge_estimator(ours)
    >>> list(verdicts.values()).count("solved") == len(verdicts)
    True
    """
    found = {}
    for problem in problems():
        try:
            state = estimate(problem.scenario, problem.angles)
        except Exception:  # of somebody else's code, anything
            state = None
        found[problem.name] = judge_answer(problem, state)
    return found
