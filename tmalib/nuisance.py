"""One further unknown, a bias for instance: what it costs when estimated, and what it does when ignored.

Let ``J = [A, u]`` be the whitened Jacobian, ``u`` the column of the unknown, and let the unknown be off by
``b`` from what is assumed. Who ignores it sees residuals ``b u``, of which the state takes the part that it
can. With ``shift = (A'A)^-1 A'u`` and ``1 / sigma^2 = |u - A shift|^2``::

    error of the state, ignored        b shift                     (first order)
    noncentrality of the criterion     b^2 / sigma^2
    bound on the unknown, estimated    sigma
    bound on the state, estimated      (A'A)^-1 + sigma^2 shift shift'

so that one vector and one number answer all four questions. Mean square errors are ``(A'A)^-1 + b^2 shift
shift'`` when it is ignored: in every direction, to ignore is better than to estimate if ``|b| < sigma``, and
worse if it is larger.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .bounds import crlb, whitened_jacobian
from .checks import as_numbers, check_is, check_probability
from .scenario import Scenario
from .types import FloatArray


@dataclass(frozen=True, eq=False)
class Nuisance:
    """What `nuisance` finds of one unknown.

    Attributes
    ----------
    name : str
    coordinates : tuple of str
        The rest of the state, in the order of the scenario.
    sigma : float
        Bound on the unknown when it is estimated with the state: its smallest standard deviation.
    shift : ndarray, shape (n - 1,)
        First-order error of the rest for each unit of the unknown that is ignored.
    known : ndarray, shape (n - 1, n - 1)
        Bound on the rest when the unknown is known.
    freedom : int
        Degrees of freedom of the criterion when the unknown is ignored.
    """

    name: str
    coordinates: tuple[str, ...]
    sigma: float
    shift: FloatArray
    known: FloatArray
    freedom: int

    @property
    def estimated(self) -> FloatArray:
        """Bound on the rest when the unknown is estimated, ``(n - 1, n - 1)``."""
        return self.known + self.sigma**2 * np.outer(self.shift, self.shift)

    def ignored(self, size: float) -> FloatArray:
        """Mean square error of the rest when the unknown is off by ``size`` and ignored, to first order."""
        return self.known + size**2 * np.outer(self.shift, self.shift)

    @property
    def displaced(self) -> float:
        """Length of ``shift`` in standard deviations, in the metric of the bound ``known``."""
        return float(np.sqrt(self.shift @ np.linalg.solve(self.known, self.shift)))

    @property
    def price(self) -> float:
        """Largest ratio of standard deviations, estimated over known, that any direction of the rest has."""
        return float(np.hypot(1.0, self.sigma * self.displaced))

    def noticed(self, size: ArrayLike, false_alarms: float = 0.01) -> FloatArray:
        """Chance that the criterion of the fit that ignores the unknown is too large, ``(...)``.

        Parameters
        ----------
        size : array_like, shape (...)
            How far the unknown is off.
        false_alarms : float
            Chance to refuse a right model: the p-value below which a fit is refused.
        """
        from scipy.stats import chi2, ncx2  # imported here: it costs half a second

        limit = chi2.isf(check_probability(false_alarms), self.freedom)
        noncentral = (as_numbers("size", size) / self.sigma) ** 2
        return np.where(noncentral > 0, ncx2.sf(limit, self.freedom, noncentral), false_alarms)[()]


def nuisance(scenario: Scenario, name: str, state: ArrayLike | None = None) -> Nuisance:
    """What one component of the state costs and does, all else being estimated.

    Parameters
    ----------
    scenario : Scenario
        With the component among its ``coordinates``; see `Biased` for a bias.
    name : str
        Of the component.
    state : array_like, shape (n,), optional
        Where to linearise; the true state by default.

    Returns
    -------
    Nuisance

    Raises
    ------
    ValueError
        For a name that is not in the state or is all of it, for many states, and where the state is not
        observable.

    Notes
    -----
    Derived at the top of this file; in regression it is the theorem of Frisch, Waugh and Lovell.

    Examples
    --------
    A compass that is off, on a ship that turns once: within a fifth of a degree it is better ignored.

    >>> import numpy as np, tmalib as tma
    >>> from tmalib.nuisance import nuisance
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> times = np.arange(0, 600, 5.0)
    >>> eye = tma.Sensor(tma.Bearing(), times, np.radians(0.5), "periscope")
    >>> ear = tma.Sensor(tma.Biased(tma.Bearing(), "compass"), times, np.radians(2), "sonar")
    >>> truth = tma.Target((2e3, 4e3), speed=6, heading=1.5)
    >>> compass = nuisance(tma.Scenario(ship, [eye, ear], 595, truth), "compass")
    >>> round(float(np.degrees(compass.sigma)), 2), round(compass.price, 2)
    (0.19, 1.03)
    """
    names = check_is("scenario", scenario, Scenario).coordinates
    if name not in names or len(names) < 2:
        raise ValueError(f"name must be one of several unknowns {names}, got {name!r}")
    state = scenario.check_state(scenario.state if state is None else state)
    if state.ndim != 1:
        raise ValueError(f"one state is needed here, got an array of shape {state.shape}")
    crlb(scenario, state)  # refuses what is not observable
    place = names.index(name)
    rest = [other for other in range(len(names)) if other != place]
    jacobian = whitened_jacobian(scenario, state)[:, [*rest, place]]
    length = np.linalg.norm(jacobian, axis=0)
    triangle: Any = np.linalg.qr(jacobian / length, mode="r")  # an array
    root = np.linalg.solve(triangle[:-1, :-1], np.eye(len(rest))) / length[:-1, None]
    return Nuisance(
        name=name,
        coordinates=tuple(names[other] for other in rest),
        sigma=float(1 / abs(triangle[-1, -1] * length[-1])),
        shift=length[-1] * root @ triangle[:-1, -1],
        known=root @ root.T,
        freedom=len(jacobian) - len(rest),
    )
