"""Uniform motion of a state vector: how ``(x, y, vx, vy)`` at one time becomes that at another.

``Phi(T) = [[I, T I], [0, I]]`` with the 2x2 identity; a depth between position and velocity stays.
"""

from __future__ import annotations

import numpy as np


def transition(duration, n=4):
    """Transition matrix ``Phi`` of a constant velocity state over ``duration`` seconds.

    Shape ``duration.shape + (n, n)``; ``n`` is 4 for ``(x, y, vx, vy)`` and 5 with the depth.
    Source: `emw-acoustic`, equation (1).
    """
    if n not in (4, 5):
        raise ValueError(f"n must be 4 or 5, got {n}")
    duration = np.asarray(duration, dtype=float)
    phi = np.zeros((*duration.shape, n, n))
    phi[..., np.arange(n), np.arange(n)] = 1.0
    phi[..., 0, n - 2] = duration
    phi[..., 1, n - 1] = duration
    return phi


def propagate(state, duration):
    """State ``(..., n)`` after ``duration`` seconds of constant velocity motion, ``Phi X``."""
    state = np.array(state, dtype=float)
    duration = np.asarray(duration, dtype=float)
    moved = np.broadcast_to(
        state, (*np.broadcast_shapes(state.shape[:-1], duration.shape), state.shape[-1])
    ).copy()
    moved[..., :2] += duration[..., None] * moved[..., -2:]
    return moved
