"""`robustness`: what a development to first order leaves, its size and the order in which it falls.

An error in a differential shows as a remainder that falls with the first power of the perturbation, where a
right one leaves the second.
"""

from __future__ import annotations

import numpy as np


def bearing_change(shift, information):
    """``sqrt(<I d, d>)``: to first order the root of the sum of squared changes of the bearings.

    Parameters
    ----------
    shift : array_like, shape (..., n)
        ``d``, of the state.
    information : array_like, shape (n, n)
        Without sigma and with the weights of the sum, as `theory.information` returns it.

    Returns
    -------
    ndarray, shape (...)
        In radians.
    """
    return np.sqrt(np.einsum("...i,ij,...j->...", shift, information, shift))


def measured_order(sizes, remainders, first=4):
    """Power of its size with which a remainder grows: slope of a line through logarithms of both.

    Parameters
    ----------
    sizes, remainders : array_like, shape (K,)
        Positive.
    first : int
        So many of them are used, counted from the first.
    """
    return np.polyfit(np.log(sizes[:first]), np.log(remainders[:first]), 1)[0]
