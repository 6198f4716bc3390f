"""`robustness`, Section II: information, Hessian and operator K for any times and weights.

A sum over measurements and an integral over the interval are one thing here: nodes ``t_k`` with weights
``w_k``, in the paper's units, without sigma. With ``g_k`` the gradient of ``m(theta, t_k)`` and ``p_k`` that
of ``Psi(x, t_k)``::

    I = sum_k w_k g_k g_k',   J = I + sum_k w_k (m_k - Psi_k) m_k'',   D(H) = I^-1 sum_k w_k g_k <p_k, H_k>.

- ``w_k = 1``: the discrete problem of Sections II.A and II.B, ``I_n``, ``K_n``;
- ``w_k = 1/n``: the normalised one of Section II.D;
- Gauss-Legendre nodes and weights: the integrals of Section II.C, to rounding error.

The paper's interval [0, 1] is the time of observation in units of its length: ``t_k = k T / n``, and weights
that add up to 1. The state stays in m and m/s.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...bearings import Bearing
from ...checks import check_count
from ...minima import distinct_minima
from ...scenario import Sensor
from ...sensitivity import displaced_measurements
from .scenarios import DURATION, SIGMA

NEWTON_STEPS = 60
FLAT = 1e-12  # curvature, relative to the other directions, below which there is no minimum


def equal_steps(count):
    """Times ``k T / n`` and weights ``1/n``, each ``(n,)``: `robustness`, Section II.D."""
    count = check_count("count", count)
    return DURATION * np.arange(1, count + 1) / count, np.full(count, 1 / count)


def midpoints(count):
    """Times ``(k - 1/2) T / n`` and weights ``1/n``, each ``(n,)``."""
    times, weights = equal_steps(count)
    return times - DURATION / (2 * count), weights


def gauss(platform, order=12):
    """Gauss-Legendre nodes in every leg of a course, and weights that add up to 1.

    The bearings are analytic within a leg; where two legs meet their second derivative jumps.
    """
    ends = np.concatenate([[0.0], np.cumsum([leg.duration for leg in platform.legs])])
    ends = np.append(ends[ends < DURATION], DURATION)
    node, weight = np.polynomial.legendre.leggauss(check_count("order", order))
    length = np.diff(ends)[:, None]
    times = ends[:-1, None] + length * (1 + node) / 2
    return times.ravel(), (length * weight / (2 * DURATION)).ravel()


def at_times(scenario, times):
    """The scenario with its bearings taken at other times."""
    return replace(scenario, sensors=[Sensor(Bearing(), times, SIGMA, "camera")])


def second_derivatives(scenario, state):
    """Second derivative of every bearing with respect to the state, shape ``(N, 4, 4)``.

    With ``m = arctan(dx/dy)``, range r and s the time of the measurement since t_ref::

        d2m/dx2 = -d2m/dy2 = -sin(2 m)/r^2,   d2m/dxdy = -cos(2 m)/r^2,

    once more times s for each velocity.
    """
    value, gradient = scenario.linearise(state)
    elapsed = scenario.times - scenario.reference_time
    sin, cos = np.sin(2 * value), np.cos(2 * value)
    block = np.array([[-sin, -cos], [-cos, sin]]) * np.sum(gradient[:, :2] ** 2, axis=-1)
    power = np.array([[np.ones_like(elapsed), elapsed], [elapsed, elapsed**2]])
    return np.einsum("abk,ijk->kaibj", power, block).reshape(-1, 4, 4)


def information(scenario, weights, state=None):
    """``I = sum_k w_k g_k g_k'``, shape ``(4, 4)``; without sigma."""
    _, gradient = scenario.linearise(scenario.state if state is None else state)
    return np.einsum("k,ki,kj->ij", weights, gradient, gradient)


def half_hessian(scenario, weights, measured, state):
    """``J``, half the second differential of the criterion in theta, shape ``(4, 4)``."""
    value, _ = scenario.linearise(state)
    residual = -scenario.residual(measured, value)  # m - Psi, the paper's sign
    curved = np.einsum("k,kij->ij", weights * residual, second_derivatives(scenario, state))
    return information(scenario, weights, state) + curved


def weighted_differential(scenario, weights, displacement, state=None):
    """``D(H)``, shape ``(4,)``: Proposition 2 as a sum, Proposition 6 as an integral."""
    _, gradient = scenario.linearise(scenario.state if state is None else state)
    felt = np.vecdot(gradient[:, :2], displacement)
    return np.linalg.solve(information(scenario, weights, state), gradient.T @ (weights * felt))


def newton_estimate(scenario, weights, measured, start):
    """The stationary point of ``sum_k w_k (m_k - measured_k)^2`` next to ``start``, by Newton's method.

    `tmalib.fit` stops when the criterion falls no more; this one goes on to the rounding error of the
    gradient, which limits of first and second order need.

    Returns
    -------
    ndarray, shape (4,)

    Raises
    ------
    ValueError
        When Newton's method does not come to rest, or rests on a point that is no minimum.
    """
    state = scenario.check_state(start)

    def cost(trial):
        return weights @ scenario.residual(measured, scenario.linearise(trial)[0]) ** 2

    with np.errstate(all="ignore"):
        for _ in range(NEWTON_STEPS):
            value, gradient = scenario.linearise(state)
            slope = gradient.T @ (weights * scenario.residual(measured, value))
            hessian = half_hessian(scenario, weights, measured, state)
            scale = 1 / np.sqrt(np.diagonal(information(scenario, weights, state)))
            if not np.all(np.isfinite(hessian)):
                break
            convex = np.linalg.eigvalsh(hessian * np.outer(scale, scale))[0] > FLAT
            matrix = hessian if convex else information(scenario, weights, state)
            step = scale * np.linalg.lstsq(matrix * np.outer(scale, scale), scale * slope)[0]
            decrement = np.sqrt(step @ matrix @ step)
            if convex and decrement <= 1e-13 * np.sqrt(weights.sum()):  # radians, over the measurements
                return state + step
            while decrement > 1e-7 * np.sqrt(weights.sum()) and not cost(state + step) < cost(state):
                step, decrement = step / 2, decrement / 2
            state = state + step
    raise ValueError(f"Newton's method found no minimum next to {start}: it stopped at {state}")


@dataclass(frozen=True, eq=False)
class Operator:
    """The paper's construction of K, step by step; ``f`` are functions at the nodes, ``sum_k w_k f_k^2 = 1``.

    Attributes
    ----------
    e : ndarray, shape (d, d)
        Rows: eigenvectors of I.
    alpha : ndarray, shape (d, N)
    mu : ndarray, shape (d,)
        The largest d eigenvalues of K; the others are zero.
    f : ndarray, shape (d, N)
        Its eigenvectors.
    d : ndarray, shape (d, d)
        Rows: ``D_i = sum_j <alpha_j, f_i> e_j``.
    """

    e: np.ndarray
    alpha: np.ndarray
    mu: np.ndarray
    f: np.ndarray
    d: np.ndarray


def operator(scenario, weights, state=None):
    """``K v = sum_i <alpha_i, v> alpha_i`` by its N x N matrix: Propositions 3 and 8, Theorems 1 and 2."""
    _, gradient = scenario.linearise(scenario.state if state is None else state)
    eigenvalues, vectors = np.linalg.eigh(information(scenario, weights, state))
    length = np.linalg.norm(gradient[:, :2], axis=-1)
    alpha = (gradient @ vectors).T / eigenvalues[:, None] * length
    root = np.sqrt(weights)
    found, left = np.linalg.eigh((alpha * root).T @ (alpha * root))
    largest = slice(None, -len(vectors) - 1, -1)
    f = left.T[largest] / root
    return Operator(vectors.T, alpha, found[largest], f, (f * weights) @ alpha.T @ vectors.T)


def follow(scenario, displacement, steps=20):
    """The local minimum ``theta_bar(X_theta + s H)`` for s = 0, 1/steps, ..., 1: Proposition 1.

    Each is sought next to the one before. Where there is none, the row and all after it are NaN.

    Parameters
    ----------
    scenario : Scenario
    displacement : array_like, shape (N, 2)
        ``H``, in metres.

    Returns
    -------
    ndarray, shape (steps + 1, 4)
    """
    steps = check_count("steps", steps)
    states = np.full((steps + 1, len(scenario.state)), np.nan)
    states[0] = scenario.state
    ones = np.ones(len(scenario.times))
    for k in range(1, steps + 1):
        measured = displaced_measurements(scenario, displacement * (k / steps))
        try:
            states[k] = newton_estimate(scenario, ones, measured, states[k - 1])
        except ValueError:
            break
    return states


def smooth_displacement(scenario, bound, rng):
    """A random shift and three harmonics, shape ``(N, 2)``; the largest length is ``bound``."""
    phase = 2 * np.pi * np.arange(4)[:, None] * scenario.times / DURATION
    waves = np.concatenate([np.cos(phase), np.sin(phase)])
    found = (rng.standard_normal((2, len(waves))) @ waves).T
    return bound * found / np.hypot(*found.T).max()


def scattered_starts(scenario, measured, rng, count):
    """Random first guesses ``(count, 4)``: near the first bearing, from 100 m to 60 km, up to 1000 m/s."""
    here = scenario.platform.position_at(scenario.times[0])
    distance = np.exp(rng.uniform(np.log(100), np.log(60e3), count))
    direction = measured[0] + rng.normal(0, 0.5, count)
    speed, course = rng.uniform(0, 1000, count), rng.uniform(0, 2 * np.pi, count)
    velocity = speed[:, None] * np.column_stack([np.sin(course), np.cos(course)])
    place = here + distance[:, None] * np.column_stack([np.sin(direction), np.cos(direction)])
    return np.hstack([place, velocity])


def local_and_best(scenario, displacement, rng, starts=20, steps=20):
    """The local minimum of Proposition 1, and the best that random starts find.

    Returns
    -------
    local, best : ndarray, shape (4,)
        ``local`` is NaN where the minimum has ceased to exist on the way from the line (see `follow`).
    costs : ndarray, shape (2,)
        Their criteria, in units of sigma squared.
    """
    local = follow(scenario, displacement, steps)[-1]
    measured = displaced_measurements(scenario, displacement)
    guesses = scattered_starts(scenario, measured, rng, starts)
    known = scenario.state[None] if np.isnan(local[0]) else local[None]
    states, _, _ = distinct_minima(scenario, measured, np.vstack([known, guesses]), max_iterations=200)
    best = states[0] if len(states) else np.full(4, np.nan)
    values = scenario.linearise(np.stack([local, best]))[0]
    return local, best, np.sum((scenario.residual(measured, values) / scenario.sigma) ** 2, axis=-1)


def deviation_ratios(scenario, weights, measured, state):
    """Standard deviations of the estimate over those of ``I^-1``: least and greatest over all directions.

    The covariance is ``J^-1 I J^-1``, so the ratios are the inverse eigenvalues of J relative to I.

    Returns
    -------
    ndarray, shape (2,)
    """
    from scipy.linalg import eigh  # imported here: it costs half a second

    relative = eigh(
        half_hessian(scenario, weights, measured, state),
        information(scenario, weights, state),
        eigvals_only=True,
    )
    return np.sort(1 / np.abs(relative))[[0, -1]]
