"""The verdicts under other seeds: chapters executed again, and what changes.

The environment variable ``TMALIB_SEED`` takes the place of the seed of every stream (`tmalib.montecarlo`). A
closing assertion may then fail, because a sentence is about the runs of the book; a chapter is executed to
its end all the same.
"""

import csv
import os
from pathlib import Path

from .chapters import read, write
from .collect import claims_in

COLUMNS = ("seed", "paper", "table", "row", "column", "verdict", "with this seed", "probability")


def random_chapters(claims):
    """Names of the notebooks whose claims rest on random numbers, in order."""
    return sorted({claim.notebook for claim in claims if claim.sources})


def claims_with_seed(path, name, seed, executed):
    """The claims of a notebook with another seed; the executed notebook goes to the file ``executed``."""
    from nbclient import NotebookClient  # imported here: only this needs it

    notebook = read(path)
    os.environ["TMALIB_SEED"] = str(seed)  # for the kernel
    try:
        NotebookClient(notebook, timeout=1800, allow_errors=True).execute()
    finally:
        del os.environ["TMALIB_SEED"]
    write(notebook, Path(executed))
    return claims_in(name, notebook)


def changes(seed, before, after):
    """Rows of `COLUMNS`: claims whose verdict is another with the seed, or that are missing."""
    found, rows = {claim.key: claim for claim in after}, []
    for old in before:
        new = found.get(old.key)
        if new is None or new.verdict != old.verdict:
            verdict, probability = ("missing", None) if new is None else (new.verdict, new.probability)
            shown = "" if probability is None else f"{probability:.2g}"
            rows.append((seed, *old.key, old.verdict, verdict, shown))
    return rows


def write_changes(path, rows):
    """Write them as CSV."""
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])
