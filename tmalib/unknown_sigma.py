"""Standard deviations that are not known, estimated from the residuals of one run.

With the whitened Jacobian ``J`` of all measurements at the estimate, and ``J_s`` its rows of sensor s, the
estimate takes ``h_s = tr(J_s (J'J)^-1 J_s')`` of the N_s degrees of freedom of that sensor; over all sensors
they add up to n. The variance of its noise is then estimated by::

    sigma_s^2 = sum of squared residuals of s / (N_s - h_s),

which does not change the state if there is one sensor, and otherwise its weight beside the others. Both are
repeated until sigmas settle (variance component estimation, Förstner 1979).

The first sigma comes from the measurements alone: what is left of each after linear interpolation between its
two neighbours in time (Gasser, Sroka and Jennen-Steinmetz, 1986).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from .bounds import whitened_jacobian
from .scenario import Scenario
from .sensors import Sensor
from .types import FloatArray

ROUNDS, SETTLED = 30, 1e-4  # of sigma, relative
LEAST = 1e-12  # of a sigma: residuals may all be zero


def roughness(sensor: Sensor, measured: FloatArray) -> float:
    """Standard deviation of what linear interpolation between neighbours leaves, of one sensor ``(N,)``."""
    if len(measured) < 3:
        raise ValueError(f"an unknown sigma needs three measurements of {sensor.name}, got {len(measured)}")
    first, here, last = measured[:-2], measured[1:-1], measured[2:]
    gap = np.diff(sensor.times)
    share = gap[:-1] / np.where(gap[:-1] + gap[1:] > 0, gap[:-1] + gap[1:], 1.0)
    residual = sensor.model.residual
    off = residual(here, first) - share * residual(last, first)
    return max(LEAST, float(np.sqrt(np.mean(off**2 / (1 + share**2 + (1 - share) ** 2)))))


def with_estimated_sigmas(
    scenario: Scenario, measured: FloatArray, fit: Callable[[Scenario], Any]
) -> Scenario:
    """The scenario with the sigmas that its unknown ones are found to have, from one run.

    Parameters
    ----------
    scenario : Scenario
        With sensors whose ``sigma`` is `None`.
    measured : ndarray, shape (N,)
        NaN where there is none.
    fit : callable
        What fits the run to a scenario.

    Raises
    ------
    ValueError
        For more than one run, and for too few measurements.
    """
    if measured.ndim != 1:
        raise ValueError(
            f"the sigma of {scenario.unknown_sigmas} is not known: fit one run, measurements of shape (N,), "
            f"got {measured.shape}"
        )
    there = ~np.isnan(measured)
    sigmas = {
        k: roughness(block.sensor.keep(there[block.columns]), measured[block.columns][there[block.columns]])
        for k, block in enumerate(scenario.blocks)
        if block.sensor.sigma is None
    }
    for _ in range(ROUNDS):
        found = fit(_with(scenario, sigmas))
        if not np.isfinite(found.state).all():
            break
        ratios = _ratios(found, there, sigmas)
        sigmas = {k: max(LEAST, ratio * sigmas[k]) for k, ratio in ratios.items()}
        if all(abs(ratio - 1) < SETTLED for ratio in ratios.values()):
            break
    return _with(scenario, sigmas)


def _with(scenario, sigmas):
    sensors = [replace(s, sigma=sigmas[k]) if k in sigmas else s for k, s in enumerate(scenario.sensors)]
    return replace(scenario, sensors=sensors)


def _ratios(found, there, which):
    """By what factor the residuals of each sensor are larger than its sigma says."""
    jacobian = whitened_jacobian(found.scenario.keep(there), found.state)
    length = np.sqrt(np.vecdot(jacobian.mT, jacobian.mT))
    basis = np.linalg.qr(jacobian / np.where(length == 0, 1.0, length))[0]
    leverage, ratios = np.zeros(len(there)), {}
    leverage[there] = np.vecdot(basis, basis)
    for k in which:
        block = found.scenario.blocks[k]
        freedom = there[block.columns].sum() - leverage[block.columns].sum()
        if not freedom > 0.5:
            raise ValueError(f"{block.sensor.name} has too few measurements to estimate its sigma")
        ratios[k] = float(np.sqrt(np.nansum(found.residuals[block.columns] ** 2) / freedom))
    return ratios
