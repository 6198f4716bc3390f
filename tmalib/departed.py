"""Motions between a uniform motion and others, and how measurements change on the way; see `departures`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .scenario import Scenario
from .types import FloatArray, Motion

STEP = 1e-4  # of the derivative by an amount: largest displacement over least distance


@dataclass(frozen=True, eq=False)
class Departed:
    """The motion ``X + sum_i a_i (Y_i - X)``: amounts ``a_i`` of the ways from X to other motions ``Y_i``.

    Examples
    --------
    >>> import tmalib as tma
    >>> straight, other = tma.Target((0, 1000), 5, 0.0), tma.Target((0, 1000), 7, 0.0)
    >>> Departed(straight, (other,), (0.5,)).position_at(10.0)
    array([   0., 1060.])
    """

    uniform: Motion
    others: tuple[Motion, ...]
    amounts: tuple[float, ...]

    def position_at(self, t: ArrayLike) -> FloatArray:
        """Position at the times ``t``, shape ``t.shape + (2,)``, in metres."""
        start = self.uniform.position_at(t)
        ways = (
            a * (other.position_at(t) - start) for a, other in zip(self.amounts, self.others, strict=True)
        )
        return start + sum(ways)


def ways(uniform: Motion, others: Sequence[Motion], times: ArrayLike) -> FloatArray:
    """From a motion to others at times ``(...)``, shape ``(K, ..., 2)``, in metres."""
    return np.stack([other.position_at(times) - uniform.position_at(times) for other in others])


def slopes(scenario: Scenario, others: Sequence[Motion]) -> FloatArray:
    """Derivatives of the measurements by the amounts of the ways to others, at zero, shape ``(N, K)``.

    By central differences, with a relative error of the square of `STEP`.
    """
    uniform, columns = scenario.target, []
    assert uniform is not None
    gaps = [
        uniform.position_at(s.times) - scenario.platform_of(s).position_at(s.times) for s in scenario.sensors
    ]
    nearest = min(np.hypot(*gap.T).min() for gap in gaps)
    for other, way in zip(others, ways(uniform, others, scenario.times), strict=True):
        largest = np.hypot(*way.T).max()
        step = STEP * nearest / largest if largest > 0 else 1.0
        ahead, behind = (
            scenario.with_target(Departed(uniform, (other,), (amount,))).measure() for amount in (step, -step)
        )
        columns.append(scenario.residual(ahead, behind) / (2 * step))
    return np.stack(columns, axis=-1)
