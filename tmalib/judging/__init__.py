"""Judging: from a printed value and ours to a verdict, from executed notebooks to the book's tables.

Nothing here knows a particular paper. `tools/build.py` shows in which order the modules come.
"""

# ruff: noqa: F401  these are the names for notebooks and papers
from . import simulated
from .chapter import numbers, show, stored_runs
from .paper import Paper, Printed, read_paper, read_papers
from .phrases import Phrase, judge_phrases, phrases_of
from .statements import AMENDED, FALSE, HOLDS, OPEN, Marks, Statement, judge_statements
from .vector import EXPERIMENTS
from .verdict import (
    ALPHA,
    CORRECTED,
    DEPENDS,
    INCONCLUSIVE,
    MOSTLY,
    NOT_REPRODUCED,
    RARELY,
    REPRODUCED,
    UNSPECIFIED,
    Claim,
    Ours,
    Verdicts,
    judge,
    judge_rows,
    of_runs,
    same_digits,
    share_interval,
    share_word,
    within,
)
