"""`emw-acoustic`: sentences of the text as measures with limits."""

from __future__ import annotations

from ...judging import Ours, judge
from .paper import PAPER

WITHIN = 0.85  # share of a cloud in a 90 % ellipse from which on it is "within"
ERRATA = "emw-1, emw-2, emw-3"  # on which the simulated filter rests

# by table and row: what is measured, the limits within which the sentence holds, and the errata needed
PHRASES = {
    "Section V.A": {
        "MLE, after 7 minutes": (
            "smallest share of the MLE's cloud in the bound's ellipse from 420 s on",
            {"at_least": WITHIN, "erratum": "emw-1"},
        ),
        "EKF, after 7 minutes": (
            "share of the EKF's cloud in the bound's ellipse at 420 s",
            {"at_most": WITHIN, "erratum": ERRATA},
        ),
        "EKF, bias": (
            "mean error of the EKF along the line of sight at 420 s, without sign, over the bound",
            {"at_least": 0.5, "erratum": ERRATA},
        ),
        "EKF, after 13 minutes": (
            "smallest share of the EKF's cloud in the bound's ellipse from 780 s on",
            {"at_least": WITHIN, "erratum": ERRATA},
        ),
        "EKF, efficiency": (
            "smallest root mean square error of a component at the end over the bound",
            {"at_least": 1.05, "erratum": ERRATA},
        ),
    },
    "Conclusion": {
        "MLE, efficiency": (
            "largest mean normalised error squared of the six scenarios; the limit is what 500 runs of an "
            "efficient estimator stay below in 95 of 100 cases",
            {"at_most": 4.21, "erratum": "emw-1"},
        ),
        "EKF, second manoeuvre": (
            "largest factor by which the second turn, at the same duration, lowers the EKF's median error in "
            "a component",
            {"at_most": 1.1, "erratum": ERRATA},
        ),
    },
}


def judge_phrases(table, values, made_from):
    """Judge the sentences of a table of the ledger.

    Parameters
    ----------
    table : str
        Of `PHRASES`.
    values : dict
        Row to what was measured; each row of the table once.
    made_from : sequence of Runs

    Returns
    -------
    Verdicts

    Raises
    ------
    ValueError
        For other rows than those of the table.
    """
    if set(values) != set(phrases := PHRASES[table]):
        raise ValueError(f"values must be of the rows {list(phrases)}, got {list(values)}")
    ours = {
        (row, "claim"): Ours(values[row], note=measure, **limits)
        for row, (measure, limits) in phrases.items()
    }
    return judge(PAPER, table, ours, made_from=made_from)
