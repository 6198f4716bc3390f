"""Shares with their intervals, of what was counted over many encounters; and what theory expects of them."""

from __future__ import annotations

import math

import numpy as np

from .trials import LEVELS


def expected_refusals(misfit, freedom, level=LEVELS[1]):
    """Chance that a straight line is refused at a level, of the misfit of exact bearings.

    The criterion of noisy bearings is then noncentral chi-square with noncentrality ``misfit``, to first
    order in what the straight line does not explain.

    Examples
    --------
    >>> expected_refusals(np.array([0.0, 80.0]), freedom=117).round(2)
    array([0.01, 0.97])
    """
    from scipy.stats import chi2, ncx2  # imported here: it costs half a second

    return ncx2.sf(chi2.isf(level, freedom), freedom, misfit)


def share(counts, draws):
    """A share in per cent with its interval of Clopper and Pearson: three numbers by name.

    Examples
    --------
    >>> [round(value, 1) for value in share([1, 0], [10, 10]).values()]
    [5.0, 0.1, 24.9]
    """
    from ..judging.verdict import share_interval

    held, of = int(np.sum(counts)), int(np.sum(draws))
    low, high = share_interval(held, of) if of else (math.nan, math.nan)
    return {"share": 100 * held / max(of, 1), "low": 100 * low, "high": 100 * high}


def counted(rows, chosen=slice(None), line=""):
    """What a case counted over some of its encounters: shares in per cent as `share` has them, and a median.

    ``rows`` are those of `read_rows`, ``chosen`` a mask of encounters; ``line="line_"`` asks for the targets
    on their straight lines. ``lost`` and ``none`` are of all draws, ``inside_accepted`` of those that are not
    refused, the others of those that converged; ``ratio`` is the median of error over bound.
    """
    part = {name: column[chosen] for name, column in rows.items()}
    converged, refused = part[f"{line}converged"], part[f"{line}refused_1"]
    ratio = part[f"{line}rms_error"] / part["bound"]
    return {
        "encounters": len(ratio),
        "draws": int(part["draws"].sum()),
        "lost": share(part[f"{line}lost"], part["draws"]),
        "none": share(part[f"{line}none"], part["draws"]),
        "refused": share(refused, converged),
        "inside": share(part[f"{line}inside"], converged),
        "inside_accepted": share(part[f"{line}inside_accepted"], converged - refused),
        "ratio": float(np.nanmedian(ratio)) if np.isfinite(ratio).any() else math.nan,
    }
