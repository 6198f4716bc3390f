"""`conical-angles`, Section 5.2: variants of its experiment, tried because Tables 5 and 6 do not come out.

Each changes one thing that the paper may have done differently: the assumed depth, the number of pairs of
measurements, whose depth is whose, or when the iteration stops.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...batch import fit
from ...charts import Cartesian
from . import scenarios as conical

START = (8000.0, 8000.0, 0.0, 0.0)  # m and m/s: that of the paper
FACTORS = 10_000  # a chunk of the stream that no runs use


def attempt(seed, runs, bottom_depth, assumed_depth=300.0, pairs=None, exchanged=(False, False), steps=None):
    """Section 5.2 with something changed: errors of the initial state, ``{"errors": (runs, 4)}``.

    Parameters
    ----------
    seed, runs
        As of any task for `tmalib.monte_carlo`.
    bottom_depth, assumed_depth : float
        In metres.
    pairs : int, optional
        How many pairs of measurements the estimator uses, the first ones; by default all.
    exchanged : pair of bool
        Whether the depths of array and target are exchanged in the estimator, and in what is simulated.
    steps : int, optional
        Stop after so many steps of Gauss-Newton; by default iterate until convergence.
    """
    assumed, real = (conical.section_5_2(bottom_depth, assumed_depth, each) for each in exchanged)
    measured = real.simulate(runs, seed)
    if pairs is not None:
        last = conical.PERIOD * (pairs - 1)
        measured = measured[:, assumed.columns_until(last)]
        assumed = replace(assumed.until(last), reference_time=assumed.reference_time)
    settings = {}
    if steps is not None:  # the first evaluation is that of the start
        settings = {"chart": Cartesian, "safeguard": False, "max_iterations": steps + 1}
    return {"errors": fit(assumed, measured, np.array(START), **settings).state - real.state}


def random_factors(stream, runs, mean, std):
    """Gaussian factors, one a run, ``(runs, 1)``; drawn apart from the noise of the stream's runs."""
    return np.random.default_rng(stream.chunk(FACTORS)).normal(mean, std, (runs, 1))
