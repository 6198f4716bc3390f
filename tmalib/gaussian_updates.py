"""Updates of a mean and a covariance by one nonlinear measurement, over many runs at once.

A measurement ``z = h(X) + noise`` of standard deviation sigma, with gradient ``g`` and Hessian ``H``, takes
mean ``X`` and covariance ``P`` to ``X + K nu`` and ``P - K s K'``. The updates differ in the predicted
measurement, in its variance ``s`` and in the gain ``K``:

*Extended*: everything at the mean; ``nu = z - h(X)``, ``s = g' P g + sigma^2``, ``K = P g / s``.

*Iterated*: the same equations with ``h`` and ``g`` at the updated mean ``X_i``, until it stays: Gauss-Newton
for the most probable state. The *prior's* mean and covariance stay in every pass::

    X_{i+1} = X + K_i (z - h(X_i) - g_i' (X - X_i)),    K_i = P g_i / (g_i' P g_i + sigma^2).

*Second order* (truncated): with ``M = L' H L`` and ``P = L L'``::

    nu = z - h(X) - tr M / 2,    s = g' P g + tr(M^2) / 2 + sigma^2,    K = P g / s.

*Cubature*: means over the 2n points ``X_i = X +- sqrt(n) L_i``, exact for polynomials of degree three::

    nu = z - mean h(X_i),    s = var h(X_i) + sigma^2,    K = cov(X_i, h(X_i)) / s.

This is the unscented update with kappa = 0. Sources: Jazwinski (1970); Bell and Cathey (1993) for the
iterated one; Arasaratnam and Haykin (2009).

Arrays have the runs last. Angles are taken as differences from the one at the mean, so that none wraps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .types import FloatArray

PASSES = 10  # of the iterated update, at most
STAYS = 1e-6  # standard deviations by which a mean that stays moves
STEP = 1e-4  # standard deviations, of the differences that give the Hessian


class Update(NamedTuple):
    """Mean, covariance, innovation and its variance."""

    mean: FloatArray
    covariance: FloatArray
    innovation: FloatArray
    variance: FloatArray


def _moved(x, p, gain, innovation, variance):
    return Update(
        x + gain * innovation, p - gain[:, None] * (gain * variance), innovation, variance + 0 * innovation
    )


def extended(x: FloatArray, p: FloatArray, predict: Callable[..., Any], offset: Any, sigma: float) -> Update:
    """The extended update of means ``(n, runs)`` and covariances ``(n, n, runs)``.

    Parameters
    ----------
    x, p : ndarray, shapes (n, runs) and (n, n, runs)
    predict : callable
        Rows of a state, ``(n, ...)``, to value ``(...)`` and gradient ``(n, ...)``.
    offset : callable
        The measurement less a predicted value, ``(runs,)``, and of two values ``offset(a, b)``.
    sigma : float

    Returns
    -------
    Update
    """
    value, g = predict(x)
    ph = np.sum(p * g, axis=1)
    variance = np.sum(g * ph, axis=0) + sigma**2
    return _moved(x, p, ph / variance, offset(value), variance)


def iterated(x: FloatArray, p: FloatArray, predict: Callable[..., Any], offset: Any, sigma: float) -> Update:
    """The iterated update; arguments as those of `extended`."""
    at, going = x, np.ones(x.shape[1:], dtype=bool)
    kept: list[FloatArray] = []
    scale = np.sqrt(np.diagonal(p, axis1=0, axis2=1).T)
    for _ in range(PASSES):
        value, g = predict(at)
        ph = np.sum(p * g, axis=1)
        variance = np.sum(g * ph, axis=0) + sigma**2
        gain, innovation = ph / variance, offset(value) - np.sum(g * (x - at), axis=0)
        moved = x + gain * innovation
        stays = ~(np.abs(moved - at) > STAYS * scale).any(axis=0)
        last = [gain, innovation, variance]
        kept = [np.where(going, *pair) for pair in zip(last, kept or last, strict=True)]
        at, going = np.where(going, moved, at), going & ~stays
        if not going.any():
            break
    gain, innovation, variance = kept
    return _moved(x, p, gain, innovation, variance)


def second_order(
    x: FloatArray, p: FloatArray, predict: Callable[..., Any], offset: Any, sigma: float
) -> Update:
    """The truncated second-order update; arguments as those of `extended`."""
    value, g = predict(x)
    root = cholesky(p)
    n, steps = len(x), STEP * np.concatenate([root, -root], axis=1)
    slopes = predict(x[:, None] + steps)[1]  # (component, point, run)
    along = (slopes[:, :n] - slopes[:, n:]) / (2 * STEP)  # H L
    bend = np.einsum("ijr,ikr->jkr", root, along)  # L' H L
    ph = np.sum(p * g, axis=1)
    variance = np.sum(g * ph, axis=0) + np.sum(bend * bend.swapaxes(0, 1), axis=(0, 1)) / 2 + sigma**2
    innovation = offset(value) - np.trace(bend) / 2
    return _moved(x, p, ph / variance, innovation, variance)


def cubature(x: FloatArray, p: FloatArray, predict: Callable[..., Any], offset: Any, sigma: float) -> Update:
    """The cubature update; arguments as those of `extended`."""
    n = len(x)
    steps = np.sqrt(n) * cholesky(p)
    steps = np.concatenate([steps, -steps], axis=1)  # (component, point, run)
    centre = predict(x)[0]
    values = offset(predict(x[:, None] + steps)[0], centre)
    mean = values.mean(axis=0)
    away = values - mean
    variance = np.mean(away**2, axis=0) + sigma**2
    gain = np.mean(steps * away, axis=1) / variance
    return _moved(x, p, gain, offset(centre) - mean, variance)


def cholesky(p: FloatArray) -> FloatArray:
    """Lower triangles ``L`` with ``L L' = P``, ``(n, n, runs)``; NaN where P is not positive definite.

    Examples
    --------
    >>> import numpy as np
    >>> root = cholesky(np.array([[4.0, 2.0], [2.0, 5.0]])[..., None])
    >>> root[..., 0].tolist()
    [[2.0, 0.0], [1.0, 2.0]]
    """
    root = np.zeros_like(p)
    for j in range(len(p)):
        rest = p[j:, j] - np.sum(root[j:, :j] * root[j, :j], axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            root[j:, j] = rest / np.sqrt(np.where(rest[0] > 0, rest[0], np.nan))
    return root


UPDATES = {
    "extended": extended,
    "iterated": iterated,
    "second-order": second_order,
    "cubature": cubature,
}
