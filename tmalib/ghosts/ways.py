"""Whether two estimates are one: ways between them along which chi-square has no barrier.

Two targets are the same, as far as measurements can tell, if a way leads from one to the other on which
chi-square nowhere exceeds the higher end by ``UNSEEN``. Two ways are tried: a straight one, and one of
straight pieces between minima beside it, which follows a curved valley. To find a way shows that it is one
target; not to find one does not prove that there are two.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from ..types import BoolArray, FloatArray, IntArray

OfStates: TypeAlias = Callable[[FloatArray], FloatArray]

UNSEEN = 0.01  # a chi-square that nobody notices
NEIGHBOURS = 6
BLOCK = 100
SHARES = np.linspace(0, 1, 12)[1:-1, None]


def in_blocks(function: Callable[..., Any], *arrays: FloatArray) -> Any:
    """``function`` of the arrays' rows, some at a time, so that the gradients of all fit into memory."""
    blocks = [tuple(a[i : i + BLOCK] for a in arrays) for i in range(0, max(len(arrays[0]), 1), BLOCK)]
    return np.concatenate([function(*block) for block in blocks])


def straight(chi_square: OfStates, here: FloatArray, there: FloatArray) -> BoolArray:
    """Whether the straight ways from states to states, ``(S, 5)`` each, have no barrier; shape ``(S,)``."""

    def compare(here, there):
        way = chi_square(here[:, None] + SHARES * (there - here)[:, None]).max(axis=-1, initial=0.0)
        return way <= np.maximum(chi_square(here), chi_square(there)) + UNSEEN

    return in_blocks(compare, here, there)


def bent(chi_square: OfStates, relax: OfStates, here: FloatArray, there: FloatArray) -> bool:
    """Whether a way of straight pieces leads from one state to another, ``(5,)`` each, without a barrier."""
    nodes = np.concatenate([[here], relax(here + SHARES * (there - here)), [there]])
    limit = max(chi_square(nodes[[0, -1]])) + UNSEEN
    between = nodes[:-1, None] + SHARES * np.diff(nodes, axis=0)[:, None]
    return bool(
        np.all(np.isfinite(nodes)) and max(chi_square(nodes).max(), chi_square(between).max()) <= limit
    )


def thinned(chi_square: OfStates, unit: OfStates, states: FloatArray, fixed: BoolArray) -> IntArray:
    """Indices of states, ``(S, 5)``: the first of those that straight ways between neighbours connect.

    All that are ``fixed``, ``(S,)``, are kept.
    """
    from scipy.sparse import coo_array  # here: importing tmalib must stay light
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    if not len(states):
        return np.arange(0)
    size = unit(states)
    chart = np.concatenate([states / size, np.log(size[:, :1])], axis=1)
    neighbours = cKDTree(chart).query(chart, k=min(NEIGHBOURS + 1, len(states)))[1].reshape(len(states), -1)
    pairs = np.stack([np.repeat(np.arange(len(states)), neighbours.shape[1]), neighbours.ravel()])
    one = straight(chi_square, states[pairs[0]], states[pairs[1]])
    edges = coo_array((one[one], pairs[:, one]), shape=(len(states), len(states)))
    group = connected_components(edges, directed=False)[1]
    return np.union1d(np.unique(group, return_index=True)[1], np.flatnonzero(fixed))


def distinct(
    chi_square: OfStates, relax: OfStates, states: FloatArray, valley: BoolArray, known: int
) -> list[int]:
    """Indices of states, ``(S, 5)``, to which no way leads from a state before them.

    The first ``known`` are kept anyway. Only ways from or to a ``valley``, ``(S,)``, may be bent.
    """
    kept = list(range(known))
    for k in range(known, len(states)):
        before = states[kept]
        same = straight(chi_square, before, np.broadcast_to(states[k], before.shape)).any()
        others = [] if same else [other for other in kept if valley[other] or valley[k]]
        if not same and not any(bent(chi_square, relax, states[other], states[k]) for other in others):
            kept.append(k)
    return kept
