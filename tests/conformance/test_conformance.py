"""The forty problems: their answers stand up to other searches, and verdicts are neither kind nor harsh."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

import tmalib as tma
from tmalib.conformance import (
    FOLDER,
    NEAR,
    NONE,
    SOLVED,
    WRONG,
    criterion,
    judge_answer,
    judge_estimator,
    problems,
)

ALL = list(problems())
with_answer = pytest.mark.parametrize(
    "problem", [p for p in ALL if p.answer["criterion"] is not None], ids=lambda p: p.name
)


def test_files_and_answers_are_of_the_same_problems():
    assert len(ALL) == 40
    assert {path.stem for path in (FOLDER / "problems").iterdir()} == {p.name for p in ALL}
    assert all(p.scenario.target is None for p in ALL), "the truth is not given away"


@with_answer
def test_scipy_finds_nothing_lower_nearby(problem):
    sigma, scenario = problem.scenario.sigma, problem.scenario
    state = np.array(problem.answer["state"])
    scale = 1 / np.linalg.norm(scenario.linearise(state)[1] / sigma[:, None], axis=0)

    def residuals(x):
        return scenario.residual(problem.angles, scenario.linearise(x * scale)[0]) / sigma

    found = least_squares(residuals, state / scale, x_scale=1.0, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    assert 2 * found.cost == pytest.approx(problem.answer["criterion"], rel=1e-9)
    assert criterion(problem, state) == pytest.approx(problem.answer["criterion"], rel=1e-10)


@with_answer
def test_the_bound_is_that_of_fifty_digits(problem):
    if problem.answer["bound"] is None:
        pytest.skip("cones have no bound of fifty digits yet")
    exact = np.array([float(digits) for digits in problem.answer["bound"]])
    np.testing.assert_allclose(tma.crlb_sigma(problem.scenario, problem.answer["state"]), exact, rtol=1e-9)


@with_answer
def test_an_answer_elsewhere_is_wrong(problem):
    state = np.array(problem.answer["state"])
    sigma = tma.crlb_sigma(problem.scenario, state)
    assert judge_answer(problem, state) == SOLVED
    assert judge_answer(problem, None) == NONE
    for k in range(len(state)):
        far = state.copy()
        conditional = 1 / np.linalg.norm(
            problem.scenario.linearise(state)[1][:, k] / problem.scenario.sigma, axis=0
        )
        far[k] += 6 * conditional
        assert judge_answer(problem, far) == WRONG
        far[k] = state[k] + conditional
        assert judge_answer(problem, far) == NEAR
    assert judge_answer(problem, state * np.nan) == WRONG
    assert np.all(sigma > 0)


def test_where_there_is_no_answer_every_answer_is_wrong():
    nothing = [p for p in ALL if p.answer["criterion"] is None]
    assert len(nothing) == 4
    for problem in nothing:
        assert problem.answer["rank"] < len(problem.answer["unknowns"])
        assert judge_answer(problem, None) == SOLVED
        assert judge_answer(problem, np.ones(len(problem.answer["unknowns"]))) == WRONG


def test_an_estimator_that_raises_or_gives_nonsense_is_judged():
    def raises(scenario, angles):
        raise ZeroDivisionError

    assert list(judge_estimator(raises).values()).count(NONE) == 36
    assert list(judge_estimator(lambda scenario, angles: [1.0]).values()).count(WRONG) == 40


def test_the_results_of_the_book_are_of_these_problems():
    stored = json.loads((Path(FOLDER) / "results.json").read_text(encoding="utf-8"))["estimators"]
    for result in stored.values():
        assert list(result["verdicts"]) == [p.name for p in ALL]
