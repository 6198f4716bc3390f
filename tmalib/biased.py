"""Measurements with a constant unknown bias.

A compass or an array that is not aligned, a range counted from the wrong end of the ship: every value of the
sensor is off by the same ``b``, which becomes a component of the state::

    value = h(X) + b,      gradient = [grad h, 1].

What else the model is, an angle or a bearing from which to start, stays. Sensors with the same bias share a
name; sensors with biases of their own have names of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .checks import check_has, check_scalar
from .models import MeasurementModel
from .types import FloatArray, Motion, StateRows
from .uniform import BENDING, KINEMATIC


@dataclass(frozen=True)
class Biased:
    """Any measurement model with a constant unknown bias added to its value.

    Parameters
    ----------
    model : measurement model
    name : str
        Name of the bias in the state, in the model's unit. It comes last: ``(*model.coordinates, name)``.
    true_bias : float
        The true bias, which `observe` (simulation) alone reads.

    Raises
    ------
    ValueError
        For a name that the model or the motion of a target uses already.

    Notes
    -----
    Derived at the top of this file. A biased angle is not brought into [-pi, pi]; residuals are.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> still = tma.Course((0, 0), speed=0, heading=0.0, legs=[tma.Straight(60)])
    >>> model = Biased(tma.Bearing(), name="compass", true_bias=0.02)
    >>> model.coordinates
    ('x', 'y', 'vx', 'vy', 'compass')
    >>> model.observe(tma.Target((0, 5000), speed=5, heading=0.0), still, np.array([0.0, 60.0]))
    array([0.02, 0.02])
    """

    model: MeasurementModel
    name: str = "bias"
    true_bias: float = 0.0

    def __post_init__(self) -> None:
        check_has("model", self.model, "coordinates", "observer_state", "value_and_gradient", "residual")
        taken = {*self.model.coordinates, *KINEMATIC, *BENDING}
        if not isinstance(self.name, str) or not self.name or self.name in taken:
            raise ValueError(f"name must be a text and none of {sorted(taken)}, got {self.name!r}")
        check_scalar("true_bias", self.true_bias)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Those of the model, then the bias."""
        return (*self.model.coordinates, self.name)

    @property
    def is_bearing(self) -> bool:
        """As the model: a first guess may start along a biased bearing."""
        return getattr(self.model, "is_bearing", False)

    @property
    def guess(self) -> dict[str, float]:
        """No bias, and what the model guesses."""
        return {**getattr(self.model, "guess", {}), self.name: 0.0}

    @property
    def truth(self) -> dict[str, float]:
        """The bias in simulation, and what the model says is true."""
        return {**getattr(self.model, "truth", {}), self.name: self.true_bias}

    def observer_state(self, platform: Motion, times: FloatArray) -> FloatArray:
        """As the model."""
        return self.model.observer_state(platform, times)

    def value_and_gradient(
        self, state: StateRows, observer: FloatArray, elapsed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        *own, bias = state
        value, gradient = self.model.value_and_gradient(own, observer, elapsed)
        return value + bias, np.concatenate([gradient, np.ones((1, *value.shape))])

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        """As the model: wrapped for an angle."""
        return self.model.residual(measured, predicted)

    def observe(self, target: Motion, platform: Motion, times: FloatArray) -> FloatArray:
        """What the model would measure plus the true bias, shape ``(N,)``."""
        model: Any = self.model  # `observe` is optional
        return model.observe(target, platform, times) + self.true_bias
