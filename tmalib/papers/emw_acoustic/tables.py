"""`emw-acoustic`: the judgement of Tables I-VI."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...bounds import crlb_sigma
from ...judging import CORRECTED, INCONCLUSIVE, NOT_REPRODUCED, REPRODUCED, Ours, judge, of_runs
from . import scenarios as emw
from .paper import PAPER

PRINTED_RUNS = 500  # runs behind every Monte-Carlo number of the tables
TABLES = {1: "Table I", 2: "Table II", 3: "Table III", 4: "Table IV", 5: "Table V", 6: "Table VI"}
ROWS = ("xT", "yT", "vxT", "vyT")


@dataclass(frozen=True, eq=False)
class RareRuns:
    """Runs of a rare kind, looked for among ``searched`` runs: errors ``mle`` and ``ekf``, ``(k, 4)``.

    Of this kind is a run whose error of the EKF in x is larger than ``beyond``, in metres.
    """

    mle: np.ndarray
    ekf: np.ndarray
    searched: int
    beyond: float

    def among(self, results):
        """Errors of both estimators in ``results`` and in these runs, and the probability of each run.

        A run of the kind in ``results`` makes room for these, which say better how often it is.
        """
        usual = np.abs(results["ekf"][:, 0]) <= self.beyond
        share = len(self.ekf) / self.searched
        numbers = [usual.sum(), len(self.ekf)]
        weights = np.repeat([(1 - share) / usual.sum(), 1 / self.searched], numbers)
        pairs = ((results[name][usual], getattr(self, name)) for name in ("mle", "ekf"))
        return *map(np.concatenate, pairs), weights


def ours_of_scenario(number, results, rare=None):
    """Our values for all rows of the scenario's table: ``(row, column)`` to `Ours`.

    ``results`` and ``rare`` as in `judge_scenario`.
    """
    now = emw.scenario(number)
    bound, botma = crlb_sigma(now), crlb_sigma(emw.botma_scenario(now))
    mle, ekf, weights = (results["mle"], results["ekf"], None) if rare is None else rare.among(results)
    ours = {}
    for i, row in enumerate(ROWS):
        ours[row, "true"] = Ours(now.state[i])
        ours |= unsigned_bias_and_std(row, i, mle, "mle", "emw-1", weights)
        ours |= unsigned_bias_and_std(row, i, ekf, "ekf", filter_errata(number), weights)
        ours[row, "std_crlb"] = Ours(bound[i], erratum="emw-1")
        ours[row, "std_crlb_botma"] = Ours(botma[i], erratum="emw-1, emw-4")
    return ours


def judge_scenario(number, results, notes=None, *, rare=None):
    """Judge all rows of the scenario's table.

    Parameters
    ----------
    number : int
    results : Runs
        Of `experiments.both_estimators`: errors ``mle`` and ``ekf``.
    notes : dict, optional
        ``(row, column)`` to a remark that goes with the verdict: what was tried, for instance.
    rare : RareRuns, optional
        Runs of a kind that ``results`` have none of.

    Returns
    -------
    Verdicts
    """
    ours = ours_of_scenario(number, results, rare)
    for key, note in (notes or {}).items():
        ours[key] = replace(ours[key], note="; ".join(filter(None, [ours[key].note, note])))
    return judge(PAPER, TABLES[number], ours, made_from=[results])


def shortcomings(number, table, results):
    """What is not as it should be in a judged scenario: a list of words, empty where all is well.

    True state and bounds agree within a unit of the last digit, the MLE's columns agree, every fit converges
    and the filter ends at a finite state in every run. What is said of the EKF's columns differs from
    scenario to scenario and is not looked at.

    Parameters
    ----------
    number : int
    table : Verdicts
        Of `judge_scenario`.
    results : Runs
        Of `experiments.both_estimators`.
    """
    wanted = {
        "true": (REPRODUCED,),
        "std_crlb": (CORRECTED,),
        "std_crlb_botma": (CORRECTED,),
        "bias_mle": (CORRECTED,),
        "std_mle": (CORRECTED,),
    }
    found = [] if len(table) == 28 else [f"{len(table)} rows instead of 28"]
    for claim in table:
        if claim.verdict not in wanted.get(claim.column, (CORRECTED, INCONCLUSIVE, NOT_REPRODUCED)):
            found.append(str(claim))
    for column in ("std_crlb", "std_crlb_botma"):
        off = units_off(number, column, [table.of(row, column).ours for row in ROWS])
        found += [f"{column} is {worst:.1f} units off" for worst in off if worst > 1]
    if lost := int(np.sum(~results["mle_converged"])):
        found.append(f"{lost} fits have not converged")
    if lost := int(np.sum(~np.isfinite(results["ekf"]).all(axis=1))):
        found.append(f"{lost} runs of the filter are not finite")
    return found


def ours_of_filter(errors):
    """Our values for the eight EKF numbers of a table, from errors ``(runs, 4)``: keys to `Ours`."""
    ours = {}
    for i, row in enumerate(ROWS):
        ours |= unsigned_bias_and_std(row, i, errors, "ekf")
    return ours


def judge_filter(number, errors, made_from=()):
    """Judge the eight EKF numbers of a table alone, for a variant of the filter.

    ``errors`` is ``(runs, 4)``, and ``made_from`` as in `judge`. For comparing variants: the chapter's own
    claims come from `judge_scenario`.
    """
    return judge(PAPER, TABLES[number], ours_of_filter(errors), made_from=made_from)


def least_probability(table):
    """The least probability of a Monte-Carlo row of `Verdicts` that is not questioned, nor at the limit."""
    found = table.found
    return float(found.probability[~(found.questioned | found.at_limit)].min())


def printed_rows(number, column):
    """The four `Printed` of a column of a scenario's table, in the order of `ROWS`."""
    return [PAPER.printed(TABLES[number], row, column) for row in ROWS]


def printed_values(number, column):
    """The four printed numbers of a column of a scenario's table, an array in the order of `ROWS`."""
    return np.array([printed.value for printed in printed_rows(number, column)])


def units_off(number, column, values):
    """Distance of four values from those of a column, in units of the last printed digit of each."""
    rows = printed_rows(number, column)
    return np.array([printed.units_off(value) for printed, value in zip(rows, values, strict=True)])


def filter_errata(number):
    """Errata on which the EKF columns of a table rest (see the book's errata page)."""
    radar_only = ["emw-2"] if number in (1, 3, 5) else []
    first_range = ["emw-5"] if number in (5, 6) else []
    return ", ".join(["emw-1", *radar_only, "emw-3", *first_range])


def unsigned_bias_and_std(row, i, errors, estimator, erratum="", weights=None):
    """Bias and standard deviation of component ``i`` as `Ours`; the paper prints biases without a sign.

    ``weights`` of the runs as in `judging.vector.draw_tables`.
    """
    common = dict(erratum=erratum, weights=weights)
    return {
        (row, f"bias_{estimator}"): of_runs(errors[:, i], "magnitude", **common),
        (row, f"std_{estimator}"): of_runs(errors[:, i], "std", **common),
    }
