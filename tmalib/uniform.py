"""Uniform motion of a state vector: how the state at one time becomes that at another.

``x(t + T) = x + T vx``, ``y(t + T) = y + T vy``; a depth and any further unknown (a bias, a base frequency)
do not change. Components are found by name, in any order.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_broadcast, short
from .types import FloatArray, IntArray

POSITION, VELOCITY = ("x", "y"), ("vx", "vy")
PLANE = (*POSITION, *VELOCITY)
KINEMATIC = ("x", "y", "z", "vx", "vy")
BENDING = ("ax", "ay", "rate")  # unknowns with which a motion is not uniform


def moving_pairs(coordinates: Sequence[str]) -> tuple[IntArray, IntArray]:
    """Indices of the positions and of the velocities that move them, each ``(2,)``.

    `ValueError` for a state without position and velocity, and for one whose motion is not uniform.
    """
    if isinstance(coordinates, str) or not all(isinstance(name, str) for name in coordinates):
        raise ValueError(f"coordinates must be a sequence of names, got {short(coordinates)}")
    missing = [name for name in PLANE if name not in coordinates]
    bending = [name for name in coordinates if name in BENDING]
    if missing or bending:
        raise ValueError(
            f"a uniform motion needs the components {PLANE} and none of {BENDING}, got {tuple(coordinates)}"
        )
    places, speeds = (np.array([coordinates.index(name) for name in names]) for names in (POSITION, VELOCITY))
    return places, speeds


def is_uniform(coordinates: Sequence[str]) -> bool:
    """Whether a state has position and velocity, and nothing that bends its motion."""
    return set(PLANE) <= set(coordinates) and not set(BENDING) & set(coordinates)


def transition(duration: ArrayLike, coordinates: Sequence[str] = PLANE) -> FloatArray:
    """Transition matrix ``Phi`` of a constant velocity state over ``duration`` seconds.

    Parameters
    ----------
    duration : array_like, shape (...)
    coordinates : sequence of str
        Names of the state's components, in order.

    Returns
    -------
    ndarray, shape (..., n, n)

    Notes
    -----
    Source: `emw-acoustic`, equation (1).

    Examples
    --------
    >>> transition(2.0, ("x", "y", "f0", "vx", "vy"))[0]
    array([1., 0., 0., 2., 0.])
    """
    places, speeds = moving_pairs(coordinates)
    duration, n = as_numbers("duration", duration), len(coordinates)
    phi = np.zeros((*duration.shape, n, n))
    phi[..., np.arange(n), np.arange(n)] = 1.0
    phi[..., places, speeds] = duration[..., None]
    return phi


def propagate(state: ArrayLike, duration: ArrayLike, coordinates: Sequence[str] = PLANE) -> FloatArray:
    """State ``(..., n)`` after ``duration`` seconds of constant velocity motion, ``Phi X``."""
    places, speeds = moving_pairs(coordinates)
    state, duration, n = as_numbers("state", state), as_numbers("duration", duration), len(coordinates)
    if state.ndim == 0 or state.shape[-1] != n:
        raise ValueError(f"state must have shape (..., {n}) for {tuple(coordinates)}, got {state.shape}")
    shape = (*check_broadcast(state=state[..., 0], duration=duration), n)
    moved = np.broadcast_to(state, shape).copy()
    with np.errstate(over="ignore", invalid="ignore"):  # a run that is lost stays so
        moved[..., places] += duration[..., None] * moved[..., speeds]
    return moved
