"""`emw-acoustic`: the judgement of Tables I-VI."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...bounds import crlb_sigma
from ...judging import CORRECTED, INCONCLUSIVE, NOT_REPRODUCED, REPRODUCED, Ours, judge, of_statistics
from ...montecarlo import CHUNK, statistics
from . import scenarios as emw
from .paper import PAPER

PRINTED_RUNS = 500  # runs behind every Monte-Carlo number of the tables
TABLES = {1: "Table I", 2: "Table II", 3: "Table III", 4: "Table IV", 5: "Table V", 6: "Table VI"}
ROWS = ("xT", "yT", "vxT", "vyT")
HEAVY = 10.0  # kurtosis above which a few runs decide a standard deviation


def judge_scenario(number, results, notes=None):
    """Judge all rows of the scenario's table.

    Parameters
    ----------
    number : int
    results : Runs
        Of `experiments.both_estimators`: errors ``mle`` and ``ekf``.
    notes : dict, optional
        ``(row, column)`` to a remark that goes with the verdict: what was tried, for instance.

    Returns
    -------
    Verdicts
    """
    now = emw.scenario(number)
    bound, botma = crlb_sigma(now), crlb_sigma(emw.botma_scenario(now))
    ours = {}
    for i, row in enumerate(ROWS):
        ours[row, "true"] = Ours(now.state[i])
        ours |= unsigned_bias_and_std(row, i, results["mle"], "mle", "emw-1")
        ours |= unsigned_bias_and_std(row, i, results["ekf"], "ekf", filter_errata(number))
        ours[row, "std_crlb"] = Ours(bound[i], erratum="emw-1")
        ours[row, "std_crlb_botma"] = Ours(botma[i], erratum="emw-1, emw-4")
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


def judge_filter(number, errors, made_from=()):
    """Judge the eight EKF numbers of a table alone, for a variant of the filter.

    ``errors`` is ``(runs, 4)``, and ``made_from`` as in `judge`. For comparing variants: the chapter's own
    claims come from `judge_scenario`.
    """
    ours = {}
    for i, row in enumerate(ROWS):
        ours |= unsigned_bias_and_std(row, i, errors, "ekf")
    return judge(PAPER, TABLES[number], ours, made_from=made_from)


def largest_agreeing_z(table):
    """Largest deviation, in standard errors, of the Monte-Carlo rows of `Verdicts` that are not rejected."""
    return max(claim.z for claim in table if claim.z is not None and claim.verdict != NOT_REPRODUCED)


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


def unsigned_bias_and_std(row, i, errors, estimator, erratum=""):
    """Bias and standard deviation of component ``i`` as `Ours`, against 500 printed runs.

    The paper prints biases without a sign, so ours is compared by its magnitude. Where a few stray runs
    decide a standard deviation, the note says what experiments of 500 of our own runs give.
    """
    found = statistics(errors)
    bias, std = of_statistics(found, i, PRINTED_RUNS)
    note = ""
    if found.kurtosis[i] > HEAVY and len(errors) >= CHUNK:
        experiments = errors[: len(errors) // CHUNK * CHUNK, i].reshape(-1, CHUNK)
        low, high = np.quantile(experiments.std(axis=1, ddof=1), [0.05, 0.95])
        note = f"stray runs: 90 % of our own experiments of {CHUNK} runs give {low:.3g} to {high:.3g}"
    return {
        (row, f"bias_{estimator}"): replace(bias, value=abs(bias.value), erratum=erratum),
        (row, f"std_{estimator}"): replace(std, erratum=erratum, note=note),
    }
