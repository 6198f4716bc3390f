"""What a chapter calls: numbers for its sentences, figures that say where they come from, stored runs.

Runs are computed once, and used by every chapter that needs them. An entry of the store is a file named by a
hash of the task, its arguments, the stream, the seed, the number of runs, the versions of Python and NumPy,
and all code that the task uses (`tmalib.judging.code`): a stale one is never found. Writing is atomic, and
two chapters that want the same runs at the same time make them once. Until all are there, the finished chunks
are in a folder of the same name: a chapter that was interrupted goes on with them.
"""

from __future__ import annotations

import fcntl
import os
import platform
import shutil
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..chunks import write_whole
from ..montecarlo import SEED, Runs, Source, Stream, exact_task_name, monte_carlo, task_name
from .code import code_of_modules, hash_of

SOURCES = "tmalib_sources"  # in the metadata of an output: what made the figure


def numbers(prefix: str, **values: Any) -> Any:
    """Make numbers known to the sentences of the book, which show them by the role ``glue:text``.

    A number is PREFIX-NAME, where ``_`` becomes ``-``. Several under one name: a dict gives PREFIX-NAME-KEY,
    a sequence PREFIX-NAME-0, -1 and so on, also one within the other. Returns a table, for who opens the
    chapter in Jupyter, where the sentences have holes.
    """
    from IPython.display import HTML
    from myst_nb import glue

    found = dict(_flat(prefix, values))
    for key, value in found.items():
        glue(key, value, display=False)
    rows = [f"<tr><td>{key}</td><td>{value:.6g}</td></tr>" for key, value in found.items()]
    return HTML(f"<table>{''.join(rows)}</table>")


def _flat(key, value):
    if isinstance(value, Mapping) or np.ndim(value):
        parts = value.items() if isinstance(value, Mapping) else enumerate(value)
        for name, part in parts:
            yield from _flat(f"{key}-{name}".replace("_", "-"), part)
    else:
        number = float(value)
        yield key, int(number) if number.is_integer() else number


def show(*made_from: Runs | Stream) -> None:
    """Show the figure of a cell, and say from which `Runs` or `Stream` the random numbers in it are."""
    import matplotlib.pyplot as plt
    from IPython.display import display

    for number in plt.get_fignums():
        display(plt.figure(number), metadata={SOURCES: [asdict(found.source) for found in made_from]})
    plt.close("all")


def stored_runs(
    task: Callable[..., Mapping[str, Any]], runs: int, stream: Stream | str, *, seed: int = SEED
) -> Runs:
    """`tmalib.monte_carlo`, from the store if the same code has made these runs before.

    The store is the folder that the environment names in ``TMALIB_RUNS``, as the Makefile does; without it
    nothing is stored. `ValueError` for a task whose code cannot be read.
    """
    stream = stream if isinstance(stream, Stream) else Stream(stream)
    if not (folder := os.environ.get("TMALIB_RUNS")):
        return monte_carlo(task, runs, stream, seed=seed)
    source = Source(task_name(task), stream.name, seed, runs)
    path = Path(folder) / f"{_name_of(task, stream, source)}.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # given back when the process ends, however it ends
        if not path.is_file():
            chunks = path.with_suffix("")  # of runs that were interrupted before
            write_whole(path, monte_carlo(task, runs, stream, seed=seed, keep=chunks))
            shutil.rmtree(chunks)
        with np.load(path, allow_pickle=False) as stored:
            return Runs(stored, source)


def _name_of(task, stream, source):
    function = task.func if isinstance(task, partial) else task
    if not (files := code_of_modules(function.__module__)):
        raise ValueError(f"only a task of a module of this project can be stored, got {source.task}")
    return hash_of(
        files, exact_task_name(task), repr(source), repr(stream), platform.python_version(), np.__version__
    )
