"""The uniform motion that is nearest to a trajectory, in three senses of "nearest"."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import check_array, check_scalar
from ..types import FloatArray
from ..uniform import propagate

NORMS = ("sum", "squares", "largest")


def nearest_motion(
    times: ArrayLike, positions: ArrayLike, reference_time: float = 0.0, norm: str = "sum"
) -> FloatArray:
    """State of the constant velocity motion nearest to a trajectory.

    With the distances ``d_k = |X_k - X_theta(t_k)|`` it minimises

    - ``norm="sum"``: ``sum_k d_k``, the distances not squared;
    - ``norm="squares"``: ``sum_k d_k^2``, linear least squares;
    - ``norm="largest"``: ``max_k d_k``.

    Parameters
    ----------
    times : array_like, shape (N,)
    positions : array_like, shape (N, 2)
        In metres.
    reference_time : float

    Returns
    -------
    ndarray, shape (4,)
        ``(x, y, vx, vy)`` at the reference time.

    Notes
    -----
    Source: `robustness`, Section IV, which chooses ``theta*`` as "minimizing the euclidian norm for the
    distance between the target and a uniform linear motion". All three problems are convex.
    """
    times = check_array("times", times, (None,))
    positions = check_array("positions", positions, (len(times), 2))
    elapsed = times - check_scalar("reference_time", reference_time)
    if norm not in NORMS:
        raise ValueError(f"norm must be one of {NORMS}, got {norm!r}")
    if len(times) == 0 or np.ptp(times) == 0:
        raise ValueError("times must not be empty or all the same: they leave the velocity open")
    centre, scale = elapsed.mean(), np.ptp(elapsed)
    basis = np.stack([np.ones_like(elapsed), (elapsed - centre) / scale], axis=-1)
    fitted = np.linalg.lstsq(basis, positions)[0]
    if norm != "squares":
        unit = np.hypot(*(positions - basis @ fitted).T).max()
        if unit > 1e-9 * (1 + np.abs(positions).max()):  # else the trajectory is such a motion
            fitted = fitted + unit * _refine(basis, (positions - basis @ fitted) / unit, norm)
    there = np.concatenate([fitted[0], fitted[1] / scale])
    return propagate(there, -centre)


def _refine(basis, positions, norm):
    """Minimise the sum or the largest of the distances; ``(2, 2)`` coefficients from zero."""
    from scipy.optimize import minimize  # imported here: it costs half a second

    def gap(x):
        return positions - basis @ x[:4].reshape(2, 2)

    if norm == "sum":

        def cost(x):
            distance = np.hypot(*gap(x).T)
            pull = gap(x) / np.maximum(distance, 1e-12)[:, None]
            return distance.mean(), -(basis.T @ pull).ravel() / len(basis)

        return minimize(cost, np.zeros(4), jac=True, method="BFGS", options={"gtol": 1e-8}).x.reshape(2, 2)

    def slack(x):
        return x[4] - np.sum(gap(x) ** 2, axis=-1)

    def slope(x):
        return np.column_stack(
            [2 * np.einsum("kc,ki->kic", gap(x), basis).reshape(-1, 4), np.ones(len(basis))]
        )

    found = minimize(
        lambda x: x[4], np.array([0, 0, 0, 0, 1.0]), jac=lambda x: np.eye(5)[4], method="SLSQP",
        constraints={"type": "ineq", "fun": slack, "jac": slope}, options={"ftol": 1e-14, "maxiter": 300},
    )  # fmt: skip
    return found.x[:4].reshape(2, 2)
