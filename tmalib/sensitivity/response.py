"""First-order response of the batch estimate to a displacement of the target.

Measurement k sees the position of the target at one instant. Let ``g_k`` (n components) be its gradient with
respect to the state, ``p_k`` (two components) that with respect to the position, and ``sigma_k`` its
standard deviation. The least-squares estimate from noise-free measurements of ``X_theta + H`` is::

    theta + D(H) + o(|H|),   D(H) = F^-1 sum_k g_k <p_k, H_k> / sigma_k^2,   F = sum_k g_k g_k' / sigma_k^2

(`robustness`, Proposition 2). Only the component ``v_k = <H_k, U_k>`` along the unit vector
``U_k = p_k / |p_k|`` matters: across the line of sight, for a bearing. So ``D(H) = A v`` with the matrix
``A`` of columns ``F^-1 g_k |p_k| / sigma_k^2``. What is wanted of the estimate, its final position for
instance, is a linear *criterion* ``C theta``; ``C A = sum_i sqrt(mu_i) d_i f_i'`` is its singular value
decomposition, and ``mu_i`` are the eigenvalues of the paper's operator ``K = (C A)'(C A)`` (Theorem 1, with
``C`` the identity).

For a model with a propagation delay, H_k is the displacement at the time of emission.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..bounds import crlb, whitened_jacobian
from ..checks import as_numbers, check_array, check_is, check_scalar
from ..losses import influence_and_slope
from ..scenario import Scenario
from ..types import FloatArray
from ..uniform import transition


@dataclass(frozen=True, eq=False)
class Response:
    """The linear map from displacements to shifts of the estimate.

    Attributes
    ----------
    direction : ndarray, shape (N, 2)
        ``U_k``: the only direction in which measurement k feels a displacement.
    gain : ndarray, shape (n, N)
        ``A``: shift of the state for a displacement of one metre along ``U_k``.
    """

    direction: FloatArray
    gain: FloatArray

    def along(self, displacement: ArrayLike) -> FloatArray:
        """``v_k = <H_k, U_k>`` of displacements ``(..., N, 2)``, shape ``(..., N)``, in metres."""
        displacement = as_numbers("displacement", displacement)
        if displacement.shape[-2:] != self.direction.shape:
            wanted = ", ".join(map(str, self.direction.shape))
            raise ValueError(f"displacement must have shape (..., {wanted}), got {displacement.shape}")
        return np.vecdot(displacement, self.direction)

    def displacement(self, along: ArrayLike) -> FloatArray:
        """The shortest displacement ``(..., N, 2)`` with given ``v_k``, shape ``(..., N)``."""
        return as_numbers("along", along)[..., None] * self.direction


def position_places(scenario: Scenario) -> list[int]:
    """Places of x and y in the state; `ValueError` where it has none."""
    if not {"x", "y"} <= set(scenario.coordinates):
        raise ValueError(f"a displacement needs a state with x and y, got {scenario.coordinates}")
    return [scenario.coordinates.index(name) for name in ("x", "y")]


def check_one_state(scenario: Scenario, state: ArrayLike | None) -> FloatArray:
    """The state about which to linearise: one, not a batch."""
    check_is("scenario", scenario, Scenario)
    state = scenario.check_state(scenario.state if state is None else state)
    if state.ndim != 1:
        raise ValueError(f"one state is needed here, got an array of shape {state.shape}")
    return state


def response(scenario: Scenario, state: ArrayLike | None = None) -> Response:
    """The `Response` of the batch estimate about a motion of the model.

    Parameters
    ----------
    scenario : Scenario
        Any measurement models of a state with a horizontal position.
    state : array_like, shape (n,), optional
        ``theta``; the scenario's target by default.

    Raises
    ------
    ValueError
        When the state is not observable, or some measurement does not feel the target's position.

    Notes
    -----
    Source: `robustness`, Proposition 2 (discrete) and 6 (the sum in place of the integral).
    """
    state = check_one_state(scenario, state)
    jacobian = whitened_jacobian(scenario, state)
    position = jacobian[:, position_places(scenario)]
    length = np.hypot(*position.T)
    if not np.all(length > 0):
        raise ValueError(f"measurement {np.argmin(length)} does not depend on the target's position")
    return Response(position / length[:, None], crlb(scenario, state) @ jacobian.T * length)


def differential(scenario: Scenario, displacement: ArrayLike, state: ArrayLike | None = None) -> FloatArray:
    """First-order shift of the batch estimate for a displacement of the target.

    Parameters
    ----------
    scenario : Scenario
    displacement : array_like, shape (..., N, 2)
        In metres, one vector a measurement, in the scenario's order.
    state : array_like, shape (n,), optional

    Returns
    -------
    ndarray, shape (..., n)
        ``D(H)``, at the reference time.

    Notes
    -----
    Source: `robustness`, Proposition 2.
    """
    map_ = response(scenario, state)
    return map_.along(displacement) @ map_.gain.T


def displaced_measurements(
    scenario: Scenario, displacement: ArrayLike, state: ArrayLike | None = None
) -> FloatArray:
    """Noise-free measurements of ``X_theta + H``, shape ``(..., N)``; exact, not a development."""
    return displaced(scenario, displacement, check_one_state(scenario, state))[0]


def displaced(
    scenario: Scenario, displacement: ArrayLike, state: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Measurements of ``X_theta + H`` and their gradient ``p_k`` there, ``(..., N)`` and ``(..., N, 2)``."""
    displacement = as_numbers("displacement", displacement)
    count = len(scenario.times)
    if displacement.shape[-2:] != (count, 2):
        raise ValueError(f"displacement must have shape (..., {count}, 2), got {displacement.shape}")
    values, gradients = [], []
    places = position_places(scenario)
    for block in scenario.blocks:
        moved = displacement[..., block.columns, :]
        rows = np.array([np.full(moved.shape[:-1], part) for part in state])
        rows[places] += np.moveaxis(moved, -1, 0)
        value, gradient = block.predict(rows, block.observer, block.elapsed)
        values.append(value)
        gradients.append(np.moveaxis(gradient[places], 0, -1))
    return np.concatenate(values, axis=-1), np.concatenate(gradients, axis=-2)


def position_criterion(scenario: Scenario, time: float) -> FloatArray:
    """The criterion "position at a time": the matrix ``C``, shape ``(2, n)``, in metres."""
    elapsed = check_scalar("time", time) - check_is("scenario", scenario, Scenario).reference_time
    return transition(elapsed, scenario.coordinates)[position_places(scenario)]


def check_criterion(scenario: Scenario, criterion: ArrayLike | None) -> FloatArray:
    """``C`` as a float matrix ``(m, n)``; the identity, the paper's parameter norm, for None."""
    n = len(check_is("scenario", scenario, Scenario).coordinates)
    criterion = np.eye(n) if criterion is None else as_numbers("criterion", criterion)
    if criterion.ndim != 2 or criterion.shape[1] != n or not np.all(np.isfinite(criterion)):
        raise ValueError(f"criterion must be a finite matrix of shape (m, {n}), got {criterion.shape}")
    return criterion


@dataclass(frozen=True, eq=False)
class Modes:
    """Singular structure of the response; the strongest mode first.

    Attributes
    ----------
    mu : ndarray, shape (m,)
        Eigenvalues of K; ``sqrt(mu_i)`` is the shift for a displacement of unit Euclidean norm.
    f : ndarray, shape (m, N)
        Orthonormal displacements along ``U_k``.
    d : ndarray, shape (m, m)
        Rows: the shifts ``D_i = C A f_i``; orthogonal, of length ``sqrt(mu_i)``.
    """

    mu: FloatArray
    f: FloatArray
    d: FloatArray


def modes(scenario: Scenario, state: ArrayLike | None = None, criterion: ArrayLike | None = None) -> Modes:
    """The displacements to which a criterion of the batch estimate responds, and how much.

    Parameters
    ----------
    scenario : Scenario
    state : array_like, shape (n,), optional
    criterion : array_like, shape (m, n), optional
        ``C``, for instance `position_criterion`. The default is the identity: the norm of the parameter as
        in the paper, which adds metres to metres per second.

    Returns
    -------
    Modes

    Notes
    -----
    Source: `robustness`, Proposition 3 and Theorem 1. The displayed ``|D_i| = mu_i`` should read
    ``sqrt(mu_i)``.
    """
    return modes_of(check_criterion(scenario, criterion) @ response(scenario, state).gain)


def modes_of(gain: FloatArray) -> Modes:
    """`Modes` of a criterion's gain ``C A``, shape ``(m, N)``."""
    left, singular, right = np.linalg.svd(gain, full_matrices=False)
    return Modes(singular**2, right, (left * singular).T)


def sandwich_covariance(
    scenario: Scenario,
    measured: ArrayLike,
    state: ArrayLike,
    step: float = 1e-4,
    spread: ArrayLike | None = None,
) -> FloatArray:
    """Covariance of the batch estimate when the model may be wrong.

    With ``J`` half the Hessian of the criterion, second derivatives of the model included, and the Fisher
    information ``F``::

        cov = J^-1 F J^-1,   J = F - sum_k (measured_k - m_k) m_k'' / sigma_k^2,

    which is ``F^-1``, the Cramér-Rao bound, when the residuals vanish. For the robust criterion of
    `tmalib.losses`, with standardised residuals ``e_k`` and the standard deviations ``s_k`` of ``psi(e_k)``::

        cov = J^-1 (sum_k s_k^2 g_k g_k') J^-1,   J = - sum_k d/dX psi(e_k) g_k,   g_k = m_k' / sigma_k.

    Parameters
    ----------
    scenario : Scenario
    measured : array_like, shape (N,)
        Noise-free measurements of the trajectory, on the model or off it.
    state : array_like, shape (n,)
        The estimate from them, ``theta_bar(X)``.
    step : float
        Step of the central differences of the gradient, in standard deviations of the state.
    spread : array_like, shape (N,), optional
        The ``s_k``: makes it the covariance of a robust estimate. `Fit.sandwich` takes those of each sensor.

    Returns
    -------
    ndarray, shape (n, n)

    Notes
    -----
    Source: `robustness`, Propositions 4 and 9 and Theorem 3, as corrected. The error of the differences is of
    relative order ``step^2``.
    """
    state = check_one_state(scenario, state)
    measured = scenario.check_measurements(measured)
    bound = crlb(scenario, state)
    steps = check_scalar("step", step, above=0.0) * np.sqrt(np.diagonal(bound))
    around = state + np.concatenate([np.diag(steps), -np.diag(steps)])
    value, gradient = scenario.linearise(around)
    weighted = scenario.residual(measured, value) / scenario.sigma**2
    jacobian = whitened_jacobian(scenario, state)
    if spread is not None:
        spread = check_array("spread", spread, scenario.times.shape)
        weighted = influence_and_slope(weighted * scenario.sigma)[0] / scenario.sigma
        jacobian = jacobian * spread[:, None]
    slope = np.einsum("sk,skn->sn", weighted, gradient)  # minus half the gradient of the criterion
    n = len(state)
    hessian = -(slope[:n] - slope[n:]) / (2 * steps[:, None])
    hessian = (hessian + hessian.T) / 2
    root = np.linalg.solve(hessian, jacobian.T)
    return root @ root.T
