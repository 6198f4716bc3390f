"""`conical-angles`: the Monte-Carlo rows of its tables as `Ours`, and the judgement of Tables 3 and 4."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...judging import Ours, judge, of_statistics
from ...montecarlo import statistics
from .paper import PAPER
from .turning import estimators

PRINTED_RUNS = 500
ROWS = ("xT", "yT", "vxT", "vyT")
ROWS_WITH_DEPTH = ("xT", "yT", "zT", "vxT", "vyT")
ERRATA = "conical-19, conical-20"  # on which Tables 3 and 4 rest


def signed_bias_and_std(row, i, errors, erratum="", bias_erratum="", sign=1):
    """Bias and standard deviation of component ``i`` as `Ours`, against 500 printed runs.

    ``errors``, ``(runs, n)``, are estimate minus truth. The paper's bias is truth minus mean estimate, and so
    is ours here; ``sign=-1`` turns it where the printed sign is an erratum. ``erratum`` and ``bias_erratum``
    name the corrections applied, to both numbers and to the bias only.
    """
    bias, std = of_statistics(statistics(errors), i, PRINTED_RUNS)
    errata = ", ".join(filter(None, [erratum, bias_erratum]))
    return {
        (row, "bias"): replace(bias, value=-sign * bias.value, erratum=errata),
        (row, "std_sample"): replace(std, erratum=erratum),
    }


def judge_turning(table, errors, bound, made_from, erratum_bound=ERRATA):
    """Judge all rows of Table 3 or 4: errors ``(runs, n)`` of the text as printed, and bound ``(n, n)``."""
    plain = len(bound) == 5
    rows = ROWS_WITH_DEPTH if plain else ROWS
    truth = estimators()["plain" if plain else "reduced"].state
    ours = {}
    for i, row in enumerate(rows):
        ours[row, "true"] = Ours(truth[i])
        ours |= signed_bias_and_std(row, i, errors)
        ours[row, "std_crlb"] = Ours(float(np.sqrt(bound[i, i])), erratum=erratum_bound)
    return judge(PAPER, table, ours, made_from=made_from)


def mean_nees(values, erratum=""):
    """Mean NEES as `Ours`, against 500 printed runs."""
    std = float(np.std(values, ddof=1))
    return Ours(float(np.mean(values)), std / np.sqrt(len(values)), std / np.sqrt(PRINTED_RUNS), std, erratum)


def bounds_agree(table, sigma):
    """Which standard deviations of a bound, ``(4,)`` or with the depth ``(5,)``, agree with the printed."""
    rows = ROWS_WITH_DEPTH if len(sigma) == 5 else ROWS
    printed = (PAPER.printed(table, row, "std_crlb") for row in rows)
    return np.array([p.agrees(value) for p, value in zip(printed, sigma, strict=True)])


def joint_chi_square(table, errors, columns=("std_sample",), sample=None):
    """Chi-square of a table's printed biases and spreads *together*, and its degrees of freedom.

    The deviations of the sample statistics are correlated as the errors of the components are::

        chi^2 = d^T C^-1 d,   C = cov(influence) (1 / 500 + 1 / runs) + unit^2 / 12

    with the influence of one run ``-e`` on a bias and ``(e^2 - s^2) / (2 s)`` on a standard deviation ``s``,
    and the rounding of the printed digits.

    Parameters
    ----------
    table : str
    errors : ndarray, shape (runs, 4) or (runs, 5)
        Estimate minus truth.
    columns : sequence of str
        ``"bias"``, ``"std_sample"`` or both.
    sample : ndarray, shape (500, n), optional
        Errors whose statistics take the place of the printed ones: what chi-square a table that is right has.

    Returns
    -------
    chi_square : float
    degrees : int
    """
    rows = ROWS_WITH_DEPTH if errors.shape[-1] == 5 else ROWS
    printed = [PAPER.printed(table, row, column) for column in columns for row in rows]
    std, each = errors.std(axis=0, ddof=1), errors - errors.mean(axis=0)
    influence = {"bias": -each, "std_sample": (each**2 - std**2) / (2 * std)}
    covariance = np.cov(np.concatenate([influence[column] for column in columns], axis=1).T)
    covariance *= 1 / PRINTED_RUNS + 1 / len(errors)
    covariance += np.diag(np.square([p.last_digit for p in printed])) / 12
    theirs = [p.value for p in printed] if sample is None else _bias_and_std(sample, columns)
    deviation = _bias_and_std(errors, columns) - theirs
    return float(deviation @ np.linalg.solve(covariance, deviation)), len(printed)


def _bias_and_std(errors, columns):
    found = {"bias": -errors.mean(axis=0), "std_sample": errors.std(axis=0, ddof=1)}
    return np.concatenate([found[column] for column in columns])


def by_row(values):
    """Four values, one a component of the state, under the names of their rows."""
    return dict(zip(ROWS, values, strict=True))


def worst_z(verdicts):
    """The largest deviation among the Monte-Carlo rows of a judged table, in standard errors."""
    return max(claim.z for claim in verdicts if claim.z is not None)
