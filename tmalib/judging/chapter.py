"""What a chapter calls: numbers for its sentences, figures that say where they come from, stored runs."""

import os
from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from ..montecarlo import SEED, monte_carlo
from .store import RunStore

SOURCES = "tmalib_sources"  # in the metadata of an output: what made the figure
RUNS = "TMALIB_RUNS"  # variable of the environment: folder of the run store; without it nothing is stored


def numbers(prefix, **values):
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


def show(*made_from):
    """Show the figure of a cell, and say from which `Runs` or `Stream` the random numbers in it are."""
    import matplotlib.pyplot as plt
    from IPython.display import display

    for number in plt.get_fignums():
        display(plt.figure(number), metadata={SOURCES: [asdict(found.source) for found in made_from]})
    plt.close("all")


def stored_runs(task, runs, stream, *, seed=SEED):
    """`tmalib.monte_carlo`, taken from the run store where the same code has already made them.

    The store is the folder that the environment names in ``TMALIB_RUNS``, as the Makefile does.
    """
    folder = os.environ.get(RUNS)
    return (RunStore(folder).monte_carlo if folder else monte_carlo)(task, runs, stream, seed=seed)
