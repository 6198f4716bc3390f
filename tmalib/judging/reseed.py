"""The verdicts under other seeds: chapters executed again, and what changes.

The environment variable ``TMALIB_SEED`` takes the place of the seed of every stream (`tmalib.montecarlo`).
Sentences are about the runs of the book, so that with others their assertions may fail: they are left out. A
cell that fails all the same does not keep the later ones from being executed.
"""

import csv
import os
from pathlib import Path

from .chapters import read, write
from .collect import claims_in

COLUMNS = ("seed", "on", "chapters", "verdicts", "changed", "which")


def random_chapters(claims):
    """Names of the notebooks whose claims rest on random numbers, in order."""
    return sorted({claim.notebook for claim in claims if claim.sources})


def claims_with_seed(path, name, seed, executed):
    """The claims of a notebook with another seed; the executed notebook goes to the file ``executed``."""
    from nbclient import NotebookClient  # imported here: only this needs it

    notebook = read(path)
    before, here = dict(os.environ), {"TMALIB_SEED": str(seed), "PYTHONOPTIMIZE": "1"}  # for the kernel
    os.environ.update(here)
    try:
        NotebookClient(notebook, timeout=1800, allow_errors=True).execute()
    finally:
        for variable in here.keys() - before.keys():
            del os.environ[variable]
        os.environ.update(before)
    write(notebook, Path(executed))
    return claims_in(name, notebook)


def changes(before, after):
    """In words, claims whose verdict is another, or that are missing."""
    found, words = {claim.key: claim for claim in after}, []
    for old in before:
        new = found.get(old.key)
        if new is None or new.verdict != old.verdict:
            now = "missing" if new is None else new.verdict
            words.append(f"{' '.join(old.key[1:])}: {old.verdict}, here {now}")
    return words


def add_seed(path, row):
    """Write a row of `COLUMNS` into a CSV file; one with the same seed makes room for it."""
    path, kept = Path(path), []
    if path.is_file():
        with path.open(newline="", encoding="utf-8") as file:
            kept = [old for old in list(csv.reader(file))[1:] if old[0] != str(row[0])]
    rows = sorted([*kept, list(map(str, row))], key=lambda row: int(row[0]))
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])
