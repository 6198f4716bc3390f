"""Judging: from a printed value and ours to a verdict, from executed notebooks to the book's tables.

`paper` reads manifests and ledgers, `verdict` judges, `chapter` is what notebooks call; `store` keeps long
runs, `code` says which files they and the chapters depend on; `chapters` executes what must be, `collect`
reads what came out, `prose` checks the sentences, `export` and `deviations` write figures and tables, and
`book` has the book's directives and roles. Nothing here knows a particular paper.
"""

# ruff: noqa: F401  these are the names for notebooks and papers
from .chapter import numbers, show, stored_runs
from .paper import Paper, Printed, read_paper, read_papers
from .verdict import (
    ALPHA,
    CORRECTED,
    INCONCLUSIVE,
    NOT_REPRODUCED,
    REPRODUCED,
    UNSPECIFIED,
    Claim,
    Ours,
    Verdicts,
    judge,
    judge_rows,
    of_statistics,
    same_digits,
    sidak_limit,
    within,
    z_score,
)
