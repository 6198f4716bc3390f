"""A store of Monte-Carlo runs: a long experiment is computed once, and used by every chapter that needs it.

An entry is a file named by a hash of the task, its arguments, the stream, the seed, the number of runs, the
versions of Python and NumPy, and the text of all code that the task uses (`tmalib.judging.code`). After any
change of these the name is another one: a stale entry is never found. Writing is atomic, and two chapters
that want the same runs at the same time make them once.
"""

import fcntl
import os
import platform
from functools import partial
from pathlib import Path

import numpy as np

from ..montecarlo import SEED, Runs, Source, Stream, monte_carlo, task_name
from .code import code_of_modules, hash_of


class RunStore:
    """Runs kept in a folder."""

    def __init__(self, folder):
        self.folder = Path(folder)

    def monte_carlo(self, task, runs, stream, *, seed=SEED):
        """`tmalib.monte_carlo`, from the store if the same code has made these runs before."""
        stream = stream if isinstance(stream, Stream) else Stream(stream)
        source = Source(task_name(task), stream.name, seed, runs)
        path = self.folder / f"{self.key(task, stream, source)}.npz"
        self.folder.mkdir(parents=True, exist_ok=True)
        with open(path.with_suffix(".lock"), "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)  # given back when the process ends, however it ends
            if path.is_file():
                with np.load(path, allow_pickle=False) as stored:
                    return Runs({name: stored[name] for name in stored.files}, source)
            found = monte_carlo(task, runs, stream, seed=seed)
            temporary = path.with_suffix(f".{os.getpid()}.tmp")
            with open(temporary, "wb") as file:
                np.savez(file, **found)
            temporary.replace(path)
        return found

    @staticmethod
    def key(task, stream, source):
        """Name of an entry; `ValueError` for a task whose code cannot be read."""
        function = task
        while isinstance(function, partial):
            function = function.func
        files = code_of_modules(function.__module__)
        if not files:
            raise ValueError(f"only a task of a module of this project can be stored, got {source.task}")
        return hash_of(files, repr(source), repr(stream), platform.python_version(), np.__version__)
