"""What a batch fit gives: states with their status, and what they are worth.

An estimate ``X`` comes with the bound at X as its covariance, ``F(X)^-1``, and a criterion that is chi-square
with N - n degrees of freedom if model and sigmas are right. Its state at another time t is ``Phi X`` with the
covariance ``Phi F^-1 Phi'``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .bounds import confidence_ellipse, crlb
from .checks import check_scalar
from .sensitivity.response import sandwich_covariance
from .uniform import propagate, transition


@dataclass(frozen=True, eq=False)
class Estimate:
    """An estimate at a time: ``state (..., n)``, ``covariance (..., n, n)``; see `Fit.at`."""

    time: float
    coordinates: tuple
    state: np.ndarray
    covariance: np.ndarray

    def ellipse(self, probability=0.9):
        """The confidence `Ellipse` of the position; `ValueError` for more than one run."""
        if self.state.ndim != 1:
            raise ValueError(f"an ellipse is of one run, and these are {self.state.shape[:-1]}; take one")
        places = [self.coordinates.index(name) for name in ("x", "y")]
        return confidence_ellipse(self.state[places], self.covariance[np.ix_(places, places)], probability)


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of `fit`; every array has the batch shape of the measurements.

    Attributes
    ----------
    state : ndarray, shape (..., n)
        Estimate at the reference time; NaN only where the input was not finite.
    converged : ndarray of bool
    reason : ndarray of str
        ``"converged"``, ``"iteration limit"``, ``"no step lowers the criterion"``, ``"no minimum at a
        finite range"`` (the estimate ran beyond 1e9 m) or ``"measurement or start not finite"``.
    iterations : ndarray of int
        Evaluations of the model, the one at the start included.
    cost : ndarray
        Criterion C at the last evaluation; about N - n for a good model.
    scenario : Scenario
        What was assumed.
    measured : ndarray, shape (..., N)

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 600, 5.0), sigma=0.01)
    >>> watch = tma.Scenario(ship, [ear], reference_time=595)
    >>> truth = tma.Target((2e3, 4e3), speed=6, heading=1.5)
    >>> found = tma.fit(watch, watch.with_target(truth).simulate(runs=1, seed=1)[0])  # no start, no target
    >>> found
    Fit(1 run, 1 converged; x, y, vx, vy at 595 s)
    >>> bool(0.01 < found.p_value < 0.99), found.covariance.shape
    (True, (4, 4))
    """

    state: np.ndarray
    converged: np.ndarray
    reason: np.ndarray
    iterations: np.ndarray
    cost: np.ndarray
    scenario: object = field(repr=False)
    measured: np.ndarray = field(repr=False)

    def __repr__(self):
        runs, names = self.converged.size, ", ".join(self.scenario.coordinates)
        return (
            f"Fit({runs} run{'s' * (runs != 1)}, {self.converged.sum()} converged; {names} at "
            f"{self.scenario.reference_time:g} s)"
        )

    @property
    def freedom(self):
        """Degrees of freedom of the criterion: measurements less unknowns."""
        return len(self.scenario.times) - len(self.scenario.coordinates)

    @cached_property
    def p_value(self):
        """Chance of so large a criterion if model and sigmas are right, ``(...)``; NaN without freedom.

        Small where the target turns, a bearing is wild or a unit is wrong; near one where sigma is too large.
        """
        from scipy.stats import chi2  # imported here: it costs half a second

        return chi2.sf(self.cost, self.freedom) if self.freedom > 0 else np.full(self.cost.shape, np.nan)

    @cached_property
    def covariance(self):
        """The bound at the estimate, ``(..., n, n)``; NaN where a run has not converged or has no bound."""
        state = np.where(self.converged[..., None], self.state, np.nan)
        if state.ndim == 1:
            return crlb(self.scenario, state[None])[0]
        return crlb(self.scenario, state)

    @cached_property
    def residuals(self):
        """Measured minus predicted, in standard deviations, ``(..., N)``, in the scenario's order."""
        predicted, _ = self.scenario.linearise(self.state)
        return self.scenario.residual(self.measured, predicted) / self.scenario.sigma

    @cached_property
    def sandwich(self):
        """Covariance when the model may be wrong, ``(n, n)``, of one run; see `tmalib.sensitivity`."""
        if self.state.ndim != 1:
            raise ValueError(f"the sandwich is of one run, and these are {self.state.shape[:-1]}; fit one")
        return sandwich_covariance(self.scenario, self.measured, self.state)

    @property
    def sigma(self):
        """Standard deviations of the state, ``(..., n)``: square roots of the covariance's diagonal."""
        return np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))

    def at(self, time):
        """The `Estimate` at another time, for a target that goes on straight.

        Parameters
        ----------
        time : float
            In seconds, before, within or after the measurements.

        Examples
        --------
        >>> import numpy as np, tmalib as tma
        >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
        >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 600, 5.0), sigma=0.01)
        >>> watch = tma.Scenario(ship, [ear], reference_time=595)
        >>> truth = watch.with_target(tma.Target((2e3, 4e3), speed=6, heading=1.5))
        >>> later = tma.fit(watch, truth.simulate(runs=1, seed=1)[0]).at(900)
        >>> later.ellipse(0.9).semi_axes.shape
        (2,)
        """
        elapsed = check_scalar("time", time) - self.scenario.reference_time
        phi = transition(elapsed, self.scenario.coordinates)
        state = propagate(self.state, elapsed, self.scenario.coordinates)
        return Estimate(float(time), self.scenario.coordinates, state, phi @ self.covariance @ phi.T)
