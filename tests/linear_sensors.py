"""A measurement that is linear in a state with a further unknown: filters have exact answers."""

import numpy as np

NAMES = ("x", "y", "vx", "vy", "bias")


class LinearWithBias:
    """A fixed mix of the position relative to the platform, plus some of a bias."""

    coordinates = NAMES

    def __init__(self, a, b, share):
        self.weights = a, b, share

    def observer_state(self, platform, times):
        return platform.position_at(times).T

    def value_and_gradient(self, state, site, lag):
        x, y, vx, vy, bias = state
        a, b, share = self.weights
        value = a * (x + lag * vx - site[0]) + b * (y + lag * vy - site[1]) + share * bias
        one = np.ones_like(value)
        return value, np.stack([a * one, b * one, a * lag * one, b * lag * one, share * one])

    def residual(self, measured, predicted):
        return measured - predicted

    def row(self):
        """The gradient by the state at the time itself."""
        a, b, share = self.weights
        return np.array([a, b, 0.0, 0.0, share])
