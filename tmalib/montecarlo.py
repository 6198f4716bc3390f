"""Monte-Carlo experiments: named random streams, chunks of runs over an executor, statistics with errors.

An experiment is a *task*, a function of a seed and a number of runs that returns named arrays with one
row a run. `monte_carlo` calls it for chunks of 500 runs. Chunk k of a stream always gets the seed
``SeedSequence(entropy=seed, spawn_key=(number, k))``, so the first 500 runs of a long experiment are
the short experiment, and the result does not depend on who computes which chunk. A chunk can be kept in a
folder (see `tmalib.chunks`), where a rerun finds it.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_count, check_scalar, set_fields, short
from .chunks import Rows, folder_of, kept_chunk, run_chunk
from .types import FilePath, FloatArray

SEED = int(os.environ.get("TMALIB_SEED", "2016"))  # of every stream; another one only for `make reseed`
CHUNK = 500
TAKES = {"task": "a seed and a number of runs", "progress": "two numbers of runs"}
LARGEST = 1e70  # of an error whose fourth power still has a sum
NAMED = 1 << 32  # streams that a name numbers come after this; lower numbers are given by hand


@dataclass(frozen=True)
class Stream:
    """A named stream of random numbers; the same name gives the same numbers for ever.

    Parameters
    ----------
    name : str
    number : int, optional
        What goes into the seeds. By default it is made from the name.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(Stream("my study").chunk())
    """

    name: str
    number: int = -1

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise ValueError(f"the name of a stream must be a text that is not empty, got {self.name!r}")
        if self.number != int(check_scalar("number", self.number)):
            raise ValueError(f"number must be an integer, got {self.number!r}")
        if self.number < 0:
            digest = hashlib.sha256(self.name.encode()).digest()
            set_fields(self, number=NAMED + int.from_bytes(digest[:4]))

    def chunk(self, k: int = 0, seed: int = SEED) -> np.random.SeedSequence:
        """Seed of a chunk, a `numpy.random.SeedSequence`."""
        return np.random.SeedSequence(entropy=seed, spawn_key=(self.number, k))

    @property
    def source(self) -> Source:
        """The `Source` of numbers that are drawn from the stream without a task."""
        return Source("", self.name, SEED, 0)


@dataclass(frozen=True)
class Source:
    """Where runs come from: task, stream, seed and number of runs.

    Numbers drawn from a stream without a task have an empty one, and 0 runs.
    """

    task: str
    stream: str
    seed: int
    runs: int

    def __str__(self) -> str:
        made = f"{self.task}, {self.runs} runs, " if self.task else ""
        return f"{made}stream {self.stream}, seed {self.seed}"


class Runs(Mapping):
    """Named arrays with one row a run, and their `Source`."""

    def __init__(self, arrays: Mapping[str, Any], source: Source) -> None:
        self._arrays, self.source = dict(arrays), source

    def __getitem__(self, key: str) -> Any:
        return self._arrays[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        return f"Runs({', '.join(self)}; {self.source})"


def task_name(task: Callable[..., Any]) -> str:
    """A task in words: ``module.function(argument=value)``, also of a `functools.partial`."""
    settings: list[str] = []
    while isinstance(task, partial):
        settings = [*map(repr, task.args), *(f"{k}={v!r}" for k, v in task.keywords.items()), *settings]
        task = task.func
    name = f"{task.__module__}.{task.__qualname__}" if hasattr(task, "__qualname__") else repr(task)
    return f"{name}({', '.join(settings)})" if settings else name


def exact_task_name(task: Callable[..., Any]) -> str:
    """`task_name` with all numbers of its arrays, to the last digit: other arguments have another name."""
    with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
        return task_name(task)


def monte_carlo(
    task: Callable[..., Mapping[str, Any]],
    runs: int,
    stream: Stream | str,
    *,
    seed: int = SEED,
    executor: Executor | None = None,
    progress: Callable[[int, int], object] | None = None,
    keep: FilePath | None = None,
) -> Runs:
    """Run a task ``runs`` times and return its arrays, one row a run.

    Parameters
    ----------
    task : callable
        ``task(seed, runs)`` returns a dict of arrays with leading axis ``runs``. With a process pool it
        must be picklable: a function of a module, or a `functools.partial` of one.
    runs : int
        Of none the task is asked once, for arrays without rows.
    stream : Stream or str
        Where the random numbers come from; any name will do.
    seed : int
    executor : concurrent.futures.Executor, optional
        Anything with an ordered ``map``: a process pool, ``Client.get_executor()`` of dask.distributed,
        mpi4py's executor. Serial by default.
    progress : callable, optional
        ``progress(finished, total)`` is called with numbers of runs after every chunk of 500, in order;
        `ProgressLine` shows them with the time that is left.
    keep : str or path, optional
        A folder into which every chunk is written when it is finished. After an interrupt or an exception
        the same call goes on with what is missing. Runs of another task, stream or seed are refused; take
        another folder when the code of the task has changed.

    Returns
    -------
    Runs
        The arrays by name, bit-identical for every executor and number of workers, kept or not, and their
        ``source``.

    Raises
    ------
    ValueError
        For a number of runs that is none, a task that returns other things, a folder of another experiment.
        Whatever the task raises is passed on, and names the chunk.

    Examples
    --------
    >>> import numpy as np
    >>> def toss(seed, runs):
    ...     return {"heads": np.random.default_rng(seed).random(runs) < 0.5}
    >>> found = monte_carlo(toss, 1200, "coins", progress=lambda finished, total: print(finished, total))
    500 1200
    1000 1200
    1200 1200
    >>> found["heads"].shape, found.source.runs
    ((1200,), 1200)
    """
    runs = check_count("runs", runs, least=0)
    for name, value in (("task", task), ("progress", progress)):
        if not callable(value) and not (name == "progress" and value is None):
            raise ValueError(f"{name} must be a function of {TAKES[name]}, got {short(value)}")
    stream = stream if isinstance(stream, Stream) else Stream(stream)
    source = Source(task_name(task), stream.name, seed, runs)
    compute = partial(run_chunk, task)
    if keep is not None:
        digest = hashlib.sha256(exact_task_name(task).encode()).hexdigest()[:16]
        experiment = f"{short(source.task)} ({digest}), {stream}, seed {seed}"
        compute = partial(kept_chunk, task, folder_of(keep, experiment))
    counts = [min(CHUNK, runs - first) for first in range(0, runs, CHUNK)] or [0]
    seeds = [stream.chunk(k, seed) for k in range(len(counts))]
    parts: list[Rows] = []
    for part in (executor.map if executor else map)(compute, range(len(counts)), seeds, counts):
        parts.append(part)
        if progress is not None:
            progress(min(len(parts) * CHUNK, runs), runs)
    arrays = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    return Runs(arrays, source)


@dataclass(frozen=True)
class Statistics:
    """Mean and spread of an error over runs; arrays of shape ``(n,)``.

    Attributes
    ----------
    runs, used : int
        Runs made, and runs that went into the statistics.
    bias, std : ndarray
        Mean, and standard deviation with ``used - 1`` in the denominator.
    kurtosis : ndarray
        ``m4 / m2^2``, 3 for a Gaussian.
    left_out : dict
        How many runs did not go in, by reason: ``"not finite"`` and, of the others, ``"failed"``.
    """

    runs: int
    used: int
    bias: FloatArray
    std: FloatArray
    kurtosis: FloatArray
    left_out: dict[str, int]

    def bias_se(self, runs: int | None = None) -> FloatArray:
        """Standard error ``s / sqrt(n)`` of a bias from ``runs`` runs (default: those used)."""
        return self.std / np.sqrt(self.used if runs is None else runs)

    def std_se(self, runs: int | None = None) -> FloatArray:
        """Standard error of a standard deviation from ``runs`` runs (default: those used).

        ``s / 2 sqrt((kurtosis - (n - 3) / (n - 1)) / n)``; for a Gaussian ``s / sqrt(2 (n - 1))``.
        """
        n = self.used if runs is None else runs
        return self.std / 2 * np.sqrt((self.kurtosis - (n - 3) / (n - 1)) / n)


def statistics(errors: ArrayLike, used: ArrayLike | None = None) -> Statistics:
    """`Statistics` of errors over runs; a run that is left out is counted.

    Parameters
    ----------
    errors : array_like, shape (runs, n)
        A row with a component that is not finite, or beyond 1e70, is left out.
    used : array_like of bool, shape (runs,), optional
        `False` leaves out a run that failed by the estimator's own account: the ``converged`` of a fit, the
        ``finite`` of a track. By default every finite row is used, a runaway of 1e10 m included.

    Returns
    -------
    Statistics

    Raises
    ------
    ValueError
        For wrong shapes, a mask that is not boolean, or fewer than four runs left.

    Examples
    --------
    >>> found = statistics([[1.0], [2.0], [3.0], [2.0], [1e10], [np.nan]], used=[True] * 4 + [False] * 2)
    >>> found.bias, found.used, found.left_out
    (array([2.]), 4, {'not finite': 1, 'failed': 1})
    """
    errors = as_numbers("errors", errors)
    if errors.ndim != 2:
        raise ValueError(f"errors must have shape (runs, n), got {errors.shape}")
    runs = len(errors)
    mask = np.ones(runs, dtype=bool) if used is None else np.asarray(used)
    if mask.dtype != bool or mask.shape != (runs,):
        raise ValueError(f"used must be bool of shape ({runs},), got {mask.dtype} of shape {mask.shape}")
    finite = (np.abs(errors) <= LARGEST).all(axis=1)
    good = errors[finite & mask]
    left_out = {"not finite": int(np.sum(~finite)), "failed": int(np.sum(finite & ~mask))}
    if len(good) < 4:
        reasons = ", ".join(f"{count} {reason}" for reason, count in left_out.items())
        raise ValueError(f"statistics need at least 4 runs, got {len(good)} of {runs}: {reasons}")
    bias = good.mean(axis=0)
    centred = good - bias
    m2, m4 = np.mean(centred**2, axis=0), np.mean(centred**4, axis=0)
    with np.errstate(invalid="ignore"):  # without any spread there is no kurtosis: NaN
        return Statistics(runs, len(good), bias, good.std(axis=0, ddof=1), m4 / m2**2, left_out)
