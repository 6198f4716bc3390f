"""How far a long experiment is: a line that is written over."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO

from .checks import check_count

EVERY = 0.5  # s between two lines


class ProgressLine:
    """A ``progress`` for `monte_carlo`: runs done, runs a second, and the time that is left.

    Parameters
    ----------
    file : text file, optional
        Where the line goes; standard error by default.
    clock : callable, optional
        Seconds, as of `time.monotonic`.

    Notes
    -----
    The rate is that since the first call, of which the first call's runs are no part: kept chunks that were
    only read do not count as fast ones. At most two lines a second are written, and always the last.

    Examples
    --------
    >>> import io, numpy as np, tmalib as tma
    >>> def toss(seed, runs):
    ...     return {"heads": np.random.default_rng(seed).random(runs) < 0.5}
    >>> seconds, shown = iter([0.0, 2.0, 4.0]), io.StringIO()
    >>> line = tma.ProgressLine(shown, clock=lambda: next(seconds))
    >>> found = tma.monte_carlo(toss, 1500, "coins", progress=line)
    >>> shown.getvalue().split("\\r")[2]
    '1000 of 1500 runs, 250 a second, 2 s left'
    """

    def __init__(self, file: TextIO | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self.file, self.clock = file, clock
        self._first: tuple[int, float] | None = None
        self._shown, self._width = -EVERY, 0

    def __call__(self, finished: int, total: int) -> None:
        """Write the line; `ValueError` for numbers of runs that are none."""
        finished, total = check_count("finished", finished, least=0), check_count("total", total, least=0)
        now = self.clock()
        if self._first is None:
            self._first = finished, now
        done, since = finished - self._first[0], now - self._first[1]
        text = f"{finished} of {total} runs"
        if done > 0 and since > 0:
            rate = done / since
            text += f", {rate:.0f} a second" if rate >= 10 else f", {rate:.2g} a second"
            text += f", {_duration((total - finished) / rate)} left" if finished < total else ""
        if now - self._shown >= EVERY or finished == total:
            self._shown = now
            end = "\n" if finished == total else ""
            print(f"\r{text:{self._width}}", end=end, file=self.file or sys.stderr, flush=True)
            self._width = len(text)
        if finished == total:  # the next call is of another experiment
            self._first, self._width = None, 0


def _duration(seconds):
    """A time in words: seconds, minutes, hours."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
