"""`conical-angles`: the Monte-Carlo rows of its tables as `Ours`, and the judgement of Tables 3 and 4."""

from __future__ import annotations

import numpy as np

from ...judging import Ours, judge, of_runs
from .paper import PAPER
from .turning import estimators

PRINTED_RUNS = 500
ROWS = ("xT", "yT", "vxT", "vyT")
ROWS_WITH_DEPTH = ("xT", "yT", "zT", "vxT", "vyT")
ERRATA = "conical-19, conical-20"  # on which Tables 3 and 4 rest


def signed_bias_and_std(row, i, errors, erratum="", bias_erratum="", sign=1):
    """Bias and standard deviation of component ``i`` as `Ours`.

    ``errors``, ``(runs, n)``, are estimate minus truth. The paper's bias is truth minus mean estimate, and so
    is ours here; ``sign=-1`` turns it where the printed sign is an erratum. ``erratum`` and ``bias_erratum``
    name the corrections applied, to both numbers and to the bias only.
    """
    errata = ", ".join(filter(None, [erratum, bias_erratum]))
    return {
        (row, "bias"): of_runs(-sign * errors[:, i], "mean", erratum=errata),
        (row, "std_sample"): of_runs(errors[:, i], "std", erratum=erratum),
    }


def biases_and_spreads(errors):
    """`signed_bias_and_std` of all components of errors, ``(runs, 4)`` or with the depth ``(runs, 5)``."""
    rows, found = ROWS_WITH_DEPTH if errors.shape[1] == 5 else ROWS, {}
    for i, row in enumerate(rows):
        found |= signed_bias_and_std(row, i, errors)
    return found


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


def bounds_agree(table, sigma):
    """Which standard deviations of a bound, ``(4,)`` or with the depth ``(5,)``, agree with the printed."""
    rows = ROWS_WITH_DEPTH if len(sigma) == 5 else ROWS
    printed = (PAPER.printed(table, row, "std_crlb") for row in rows)
    return np.array([p.agrees(value) for p, value in zip(printed, sigma, strict=True)])


def by_row(values):
    """Four values, one a component of the state, under the names of their rows."""
    return dict(zip(ROWS, values, strict=True))


def largest_deviation(verdicts):
    """The largest deviation among the Monte-Carlo rows of a judged table, in standard errors."""
    return max(claim.deviation for claim in verdicts if claim.probability is not None)
