"""Times and memory, measured so that a busy machine spoils all that is compared alike."""

import os
import subprocess
import sys
import time

import numpy as np

ROUNDS = 7


def pin():
    """Stay on one processor, where the system can be told so; returns which, or None."""
    if not hasattr(os, "sched_setaffinity"):
        return None
    chosen = max(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {chosen})
    return chosen


def interleaved(tasks, rounds=ROUNDS):
    """Seconds of each task, ``{name: ndarray (rounds,)}``: in every round each task once, in turns.

    A task is a function without arguments, or ``(function, repeats)``: then the time of one repeat.
    """
    took = {name: np.empty(rounds) for name in tasks}
    for k in range(rounds):
        for name, task in tasks.items():
            function, repeats = task if isinstance(task, tuple) else (task, 1)
            begin = time.perf_counter()
            for _ in range(repeats):
                function()
            took[name][k] = (time.perf_counter() - begin) / repeats
    return took


def ratio(slow, fast):
    """Median of the ratios of two times, round by round, and the range of their middle half."""
    low, middle, high = np.quantile(slow / fast, [0.25, 0.5, 0.75])
    return float(middle), float(low), float(high)


def in_a_process(program, *arguments):
    """The number that a program prints, run by this interpreter in a process of its own."""
    command = [sys.executable, "-c", program, *map(str, arguments)]
    return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
