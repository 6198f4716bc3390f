"""What disturbs a target between two measurements, and what of its unknowns wanders.

*White acceleration* of spectral density q, in each component of the plane on its own. Over T seconds it adds
to position and velocity of a component (Bar-Shalom, Li and Kirubarajan, 2001, Section 6.2.2)::

    Q = q [[T^3/3, T^2/2], [T^2/2, T]].

Cut in two, the same interval gives the same: ``Q(S + T) = Phi(T) Q(S) Phi(T)' + Q(T)``. After T seconds a
velocity has wandered by ``sqrt(q T)`` and a position by ``sqrt(q T^3 / 3)``, one standard deviation.

*Random walk* of density d of any other component, a bias or a base frequency: its variance grows by ``d T``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .checks import check_is, check_scalar, set_fields
from .types import FloatArray
from .uniform import BENDING, PLANE, moving_pairs


@dataclass(frozen=True)
class ProcessNoise:
    """White acceleration, and random walks of further unknowns.

    Parameters
    ----------
    acceleration : float
        Spectral density q of each component of the acceleration, in m^2/s^3.
    walks : dict, optional
        Name of a component other than ``x, y, vx, vy`` to the density of its random walk, in its unit squared
        a second. What is not named stays constant.

    Raises
    ------
    ValueError
        For a density that is negative or no number, or a walk of what the acceleration moves.

    Examples
    --------
    A speed that wanders by 1 m/s in a minute, a compass that wanders by a degree in an hour:

    >>> import numpy as np
    >>> noise = ProcessNoise(1.0 / 60, {"compass": np.radians(1) ** 2 / 3600})
    >>> added = noise.covariance(60.0, ("x", "y", "vx", "vy", "compass"))
    >>> [round(float(variance) ** 0.5, 3) for variance in np.diag(added)]
    [34.641, 34.641, 1.0, 1.0, 0.002]
    """

    acceleration: float = 0.0
    walks: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_is("walks", self.walks, Mapping)
        wrong = [name for name in self.walks if name in (*PLANE, *BENDING)]
        if wrong:
            raise ValueError(f"walks must name components other than {(*PLANE, *BENDING)}, got {wrong}")
        set_fields(
            self,
            acceleration=check_scalar("acceleration", self.acceleration, minimum=0.0),
            walks={name: check_scalar(f"walks[{name!r}]", d, minimum=0.0) for name, d in self.walks.items()},
        )

    def covariance(self, duration: float, coordinates: Sequence[str] = PLANE) -> FloatArray:
        """What ``duration`` seconds add to the covariance of the state after them, shape ``(n, n)``.

        `ValueError` for a negative duration, or a walk of what is no component.
        """
        duration = check_scalar("duration", duration, minimum=0.0)
        places, speeds = moving_pairs(coordinates)
        added = np.zeros((len(coordinates), len(coordinates)))
        added[places, places] = self.acceleration * duration**3 / 3
        added[places, speeds] = added[speeds, places] = self.acceleration * duration**2 / 2
        added[speeds, speeds] = self.acceleration * duration
        for i, density in self.walking(coordinates).items():
            added[i, i] = density * duration
        return added

    def walking(self, coordinates: Sequence[str]) -> dict[int, float]:
        """Index of each component that wanders to its density; `ValueError` for what is no component."""
        unknown = [name for name in self.walks if name not in coordinates]
        if unknown:
            raise ValueError(f"walks must name components of the state {tuple(coordinates)}, got {unknown}")
        return {coordinates.index(name): density for name, density in self.walks.items()}
