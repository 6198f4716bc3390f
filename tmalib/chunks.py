"""Chunks of runs, computed or kept: what an interrupted experiment has finished, a rerun reads.

A folder holds the chunks of one experiment, a file each, written by who computes it as soon as it is finished
and moved to its name as a whole: a file that is there is complete. The file ``experiment.txt`` says which
experiment it is, so that runs of another one are never taken for its own. That the code of the task has
changed it cannot know.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .checks import check_is
from .types import FilePath

Rows = dict[str, np.ndarray[Any, Any]]  # arrays by name, one row a run
EXPERIMENT = "experiment.txt"


def run_chunk(
    task: Callable[..., Mapping[str, Any]], k: int, seed: np.random.SeedSequence, runs: int
) -> Rows:
    """The arrays of chunk k, checked; an exception of the task says in which chunk it was raised."""
    try:
        found = check_is("what the task returns", task(seed, runs), Mapping)
        rows = {key: np.asarray(values) for key, values in found.items()}
        for key, values in rows.items():
            if values.shape[:1] != (runs,):
                raise ValueError(f"the task must return {runs} rows of {key!r}, got shape {values.shape}")
    except Exception as error:
        error.add_note(f"in chunk {k} of the experiment, {runs} runs from the seed {seed}")
        raise
    return rows


def kept_chunk(
    task: Callable[..., Mapping[str, Any]], folder: Path, k: int, seed: np.random.SeedSequence, runs: int
) -> Rows:
    """Chunk k from the folder; computed, and written there, if it is not in it."""
    path = folder / f"chunk-{k:05d}-{runs}.npz"
    if not path.is_file():
        rows = run_chunk(task, k, seed, runs)
        if wrong := [key for key, values in rows.items() if values.dtype.hasobject]:
            raise ValueError(f"only arrays of numbers and texts can be kept, got objects in {wrong}")
        write_whole(path, rows)
    with np.load(path, allow_pickle=False) as stored:
        return dict(stored)


def write_whole(path: Path, rows: Mapping[str, Any]) -> None:
    """Write arrays to a file that is there as a whole or not at all."""
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as file:
        try:
            np.savez(file, **rows)
            file.close()
            os.replace(file.name, path)
        except BaseException:
            os.unlink(file.name)
            raise


def folder_of(keep: FilePath, experiment: str) -> Path:
    """The folder of an experiment, made if it is not there; `ValueError` if it is that of another one."""
    folder = Path(keep)
    folder.mkdir(parents=True, exist_ok=True)
    label = folder / EXPERIMENT
    if not label.is_file() and not any(folder.iterdir()):
        label.write_text(experiment + "\n", encoding="utf-8")
    found = label.read_text(encoding="utf-8").strip() if label.is_file() else "something else"
    if found != experiment:
        raise ValueError(f"keep must be a folder for the runs of {experiment}, got {folder}, with {found}")
    return folder
