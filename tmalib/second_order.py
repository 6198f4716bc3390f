"""What the bound does not say: the bias that curvature gives a least-squares estimate.

The batch estimate is unbiased, and its covariance the bound, to first order in sigma. To second order it
has a bias (Box, 1971). With the whitened Jacobian J, rows ``g_k' / sigma_k``, the Hessians ``H_k`` of the
measurements over sigma_k, and ``C = (J'J)^-1``::

    E(estimate) - truth = -1/2 C J' t,        t_k = trace(C H_k).

It grows with sigma squared, where the standard deviations grow with sigma.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .bounds import crlb, whitened_jacobian
from .checks import check_is
from .scenario import Scenario
from .types import FloatArray

STEP = 1e-2  # standard deviations, of differences of the gradient


def second_order_bias(scenario: Scenario, state: ArrayLike | None = None) -> FloatArray:
    """Bias of the batch estimate to second order in the noise.

    Parameters
    ----------
    scenario : Scenario
    state : array_like, shape (n,), optional
        Where the target is; the scenario's target by default.

    Returns
    -------
    ndarray, shape (n,)
        In the units of the state: to be compared with `crlb_sigma`. Where it is not small against that,
        neither this series nor the bound is to be trusted.

    Raises
    ------
    ValueError
        For more than one state, or one that is not observable.

    Notes
    -----
    Second derivatives are differences of the models' gradients along the axes of the bound's ellipsoid,
    with an error of about 1e-4 of their size.

    Source: Box, *Bias in nonlinear estimation*, Journal of the Royal Statistical Society B 33 (1971),
    171-201.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> hydrophone = tma.Sensor(tma.Bearing(), np.arange(0, 600, 5.0), sigma=0.01)
    >>> target = tma.Target((2e3, 4e3), speed=6, heading=1.5)
    >>> scenario = tma.Scenario(ship, [hydrophone], reference_time=595, target=target)
    >>> (tma.second_order_bias(scenario) / tma.crlb_sigma(scenario)).round(2)
    array([0.02, 0.02, 0.02, 0.01])
    """
    check_is("scenario", scenario, Scenario)
    state = scenario.check_state(scenario.state if state is None else state)
    if state.ndim != 1:
        raise ValueError(f"state must be one state, got an array of shape {state.shape}")
    covariance = crlb(scenario, state)
    root = np.linalg.cholesky(covariance)
    ahead, behind = (whitened_jacobian(scenario, state + sign * STEP * root.T) for sign in (1, -1))
    trace = np.einsum("mki,im->k", ahead - behind, root) / (2 * STEP)
    return -0.5 * covariance @ whitened_jacobian(scenario, state).T @ trace
