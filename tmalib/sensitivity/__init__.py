"""Robustness: how the batch estimate responds when the target leaves the motion model.

The truth is a trajectory ``X_theta + H``: a motion of the model and a small *displacement* H, one vector of
two components for each measurement. `differential` is the estimate's first-order response, `modes` its
singular structure, `worst_energy`, `worst_sup`, `worst_flyable` and `worst_stealth` the displacements of a
given size that displace the estimate most, and `nearest_motion` the motion of the model that is nearest to
a trajectory.
"""

from .nearest import nearest_motion
from .response import (
    Modes,
    Response,
    differential,
    displaced_measurements,
    modes,
    position_criterion,
    response,
    sandwich_covariance,
)
from .worst import stealth, worst_energy, worst_flyable, worst_stealth, worst_sup

__all__ = [
    "Modes",
    "Response",
    "differential",
    "displaced_measurements",
    "modes",
    "nearest_motion",
    "position_criterion",
    "response",
    "sandwich_covariance",
    "stealth",
    "worst_energy",
    "worst_flyable",
    "worst_stealth",
    "worst_sup",
]
