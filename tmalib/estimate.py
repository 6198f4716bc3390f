"""What a batch fit gives: states with their status, and what they are worth.

An estimate ``X`` comes with the bound at X as its covariance, ``F(X)^-1``, and a criterion that is chi-square
with N - n degrees of freedom if model and sigmas are right. Its state at another time t is ``Phi X``, and its
covariance the bound there, ``Phi F^-1 Phi'``. With a robust loss the covariance is that of `tmalib.losses`,
and the criterion has no known distribution.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from . import status as words
from .bounds import factor, in_words, inverse_information, weakest_direction
from .checks import check_scalar
from .ellipse import Ellipse, confidence_ellipse
from .losses import SQUARES, influence_and_slope, value_and_weight
from .scenario import Scenario
from .sensitivity.response import sandwich_covariance
from .types import BoolArray, FloatArray, IntArray, TextArray
from .uniform import propagate


@dataclass(frozen=True, eq=False)
class Estimate:
    """An estimate at a time: ``state (..., n)``, ``covariance (..., n, n)``; see `Fit.at`."""

    time: float
    coordinates: tuple[str, ...]
    state: FloatArray
    covariance: FloatArray

    def ellipse(self, probability: float = 0.9) -> Ellipse:
        """The confidence `Ellipse` of the position; `ValueError` for many runs or without a covariance."""
        if self.state.ndim != 1:
            raise ValueError(f"an ellipse is of one run, and these are {self.state.shape[:-1]}; take one")
        if not np.isfinite(self.covariance).all():
            raise ValueError("there is no ellipse: the run has no covariance; Fit.explain() says why")
        places = [self.coordinates.index(name) for name in ("x", "y")]
        return confidence_ellipse(self.state[places], self.covariance[np.ix_(places, places)], probability)


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of `fit`; every array has the batch shape of the measurements.

    Attributes
    ----------
    state : ndarray, shape (..., n)
        Estimate at the reference time; where it has not converged, where the steps ended, or NaN.
    status : ndarray of str, shape (...)
        A word of `tmalib.status`; ``explain`` says what it means and what to do.
    iterations : ndarray of int, shape (...)
        Evaluations of the model, the one at the start included.
    cost : ndarray, shape (...)
        Criterion C at the last evaluation; about N - n for a good model.
    scenario : Scenario
        What was assumed; with the estimated sigmas, where some were not known.
    measured : ndarray, shape (..., N)
        NaN where there was no measurement.
    estimated : tuple of str
        Names of the sensors whose sigma was estimated.
    loss : str
        What was minimised: ``"squares"``, or a robust loss; see `tmalib.losses`.

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

    state: FloatArray
    status: TextArray
    iterations: IntArray
    cost: FloatArray
    scenario: Scenario = field(repr=False)
    measured: FloatArray = field(repr=False)
    estimated: tuple[str, ...] = ()
    loss: str = SQUARES

    def __repr__(self) -> str:
        runs, names = self.status.size, ", ".join(self.scenario.coordinates)
        loss = f"; loss: {self.loss}" if self.robust else ""
        return (
            f"Fit({runs} run{'s' * (runs != 1)}, {self.converged.sum()} converged; {names} at "
            f"{self.scenario.reference_time:g} s{loss})"
        )

    def __str__(self) -> str:
        from .summary import as_text, summarise  # imported here: it lies above

        return as_text(summarise(self))

    def _repr_html_(self):
        from .summary import as_html, summarise

        return as_html(summarise(self))

    @property
    def converged(self) -> BoolArray:
        """Which runs ended at a minimum, ``(...)``: observable, at a finite range, the lowest found."""
        return self.status == words.CONVERGED

    @property
    def robust(self) -> bool:
        """Whether the loss was another one than squares."""
        return self.loss != SQUARES

    @cached_property
    def weights(self) -> FloatArray:
        """How far each measurement was trusted, ``(..., N)``: 0 to 1, all 1 with squares, NaN for none."""
        square = self.residuals**2
        return np.where(np.isnan(square), np.nan, value_and_weight(square)[1] if self.robust else 1.0)

    @property
    def freedom(self) -> IntArray:
        """Degrees of freedom of the criterion, ``(...)``: measurements less unknowns."""
        return np.sum(~np.isnan(self.measured), axis=-1) - len(self.scenario.coordinates)

    @cached_property
    def p_value(self) -> FloatArray:
        """Chance of so large a criterion if model and sigmas are right, ``(...)``.

        Small where the target turns, a bearing is wild or a unit is wrong; near one where sigma is too large.
        NaN without freedom, and where a sigma was estimated: the criterion then says nothing. NaN with a
        robust loss, whose criterion has no known distribution.
        """
        from scipy.stats import chi2  # imported here: it costs half a second

        known = (self.freedom > 0) & (len(self.estimated) == 0) & (not self.robust)
        return np.where(known, chi2.sf(self.cost, np.where(known, self.freedom, 1)), np.nan)[()]

    @cached_property
    def _factors(self):
        return self._factored(self.scenario, self.state)

    def _factored(self, scenario, state):
        return factor(scenario, state, self._jacobian(scenario, state) * self._scales[0])

    def _jacobian(self, scenario, state):
        with np.errstate(all="ignore"):  # what is not finite is found below
            gradient = scenario.linearise(state)[1] / scenario.sigma[:, None]
        jacobian = np.where(np.isnan(self.measured)[..., None], 0.0, gradient)
        jacobian[~np.isfinite(jacobian).all(axis=(-1, -2))] = np.nan
        return jacobian

    @cached_property
    def _scales(self):
        """Roots of ``a_s`` and ``b_s`` of `tmalib.losses` for every measurement, ``(..., N, 1)``."""
        return sensor_scales(self) if self.robust else (1.0, 1.0)

    def _covariance(self, scenario, state, factors):
        bound = inverse_information(factors)
        if self.robust:  # A^-1 B A^-1
            root = (self._jacobian(scenario, state) * self._scales[1]) @ bound
            bound = root.mT @ root
        return np.where(self.converged[..., None, None], bound, np.nan)

    @property
    def rank(self) -> IntArray:
        """How many directions of the state are observable there, ``(...)``; -1 where there is no state."""
        return self._factors.rank

    @property
    def condition(self) -> FloatArray:
        """Condition number of the scaled Jacobian, ``(...)``: what is known best over what is known least."""
        singular = self._factors.singular
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = singular[..., 0] / singular[..., -1]
        return np.where(self.rank == len(self.scenario.coordinates), ratio, np.inf)[()]

    @property
    def weakest(self) -> FloatArray:
        """The direction of the state that is known least, ``(..., n)``, its largest component one."""
        return weakest_direction(self._factors)

    @cached_property
    def covariance(self) -> FloatArray:
        """The bound at the estimate, ``(..., n, n)``; NaN where a run has not converged.

        With a robust loss ``A^-1 B A^-1`` of `tmalib.losses`.
        """
        return self._covariance(self.scenario, self.state, self._factors)

    @cached_property
    def residuals(self) -> FloatArray:
        """Measured minus predicted, in standard deviations, ``(..., N)``, in the scenario's order."""
        predicted, _ = self.scenario.linearise(self.state)
        return self.scenario.residual(self.measured, predicted) / self.scenario.sigma

    @cached_property
    def sandwich(self) -> FloatArray:
        """Covariance when the model may be wrong, ``(n, n)``, of one run; see `tmalib.sensitivity`.

        With a robust loss, that of an M-estimate with the Hessian as it is, where `covariance` has its mean.
        """
        self._one_run("the sandwich")
        there = ~np.isnan(self.measured)
        spread = self._scales[1][there, 0] if self.robust else None
        return sandwich_covariance(self.scenario.keep(there), self.measured[there], self.state, spread=spread)

    @property
    def sigma(self) -> FloatArray:
        """Standard deviations of the state, ``(..., n)``: square roots of the covariance's diagonal."""
        return np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))

    def at(self, time: float) -> Estimate:
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
        then = replace(self.scenario, reference_time=check_scalar("time", time), target=None)
        elapsed = then.reference_time - self.scenario.reference_time
        state = propagate(self.state, elapsed, then.coordinates)
        covariance = self._covariance(then, state, self._factored(then, state))
        return Estimate(float(time), then.coordinates, state, covariance)

    def explain(self) -> str:
        """What became of the runs, and what to do next, in words; a line for each status.

        Examples
        --------
        >>> import numpy as np, tmalib as tma
        >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(600)])  # it never turns
        >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 600, 5.0), sigma=0.01)
        >>> truth = tma.Target((2e3, 4e3), speed=6, heading=1.5)
        >>> straight = tma.Scenario(ship, [ear], reference_time=595, target=truth)
        >>> print(tma.fit(straight, straight.simulate(runs=1, seed=1)[0]).explain()[:44])
        not observable: rank 3 of 4, nothing changes
        """
        lines = []
        for word in words.ADVICE:
            runs = np.argwhere(self.status == word)
            if len(runs):
                count = "" if self.status.ndim == 0 else f"{len(runs)} of {self.status.size} runs "
                lines.append(f"{count}{word}{self._details(word, tuple(runs[0]))}".strip())
        return "\n".join(lines)

    def _details(self, word, run):
        """What is said of a status, with the numbers of the first run that has it."""
        if word != words.NOT_OBSERVABLE:
            return f": {words.ADVICE[word]}" if words.ADVICE[word] else ""
        if not np.isfinite(self.state[run]).all():
            return f": nothing is left that tells some unknown. {words.ADVICE[word]}"
        direction = in_words(self.scenario.coordinates, self.weakest[run])
        rank, n = np.asarray(self.rank)[run], len(self.scenario.coordinates)
        return f": rank {rank} of {n}, nothing changes along {direction}. {words.ADVICE[word]}"

    def _one_run(self, what):
        if self.state.ndim != 1:
            raise ValueError(f"{what} is of one run, and these are {self.state.shape[:-1]}; fit one")


def sensor_scales(fit: Fit) -> tuple[FloatArray, FloatArray]:
    """Roots of ``a_s`` and ``b_s`` for every measurement, ``(..., N, 1)``: means over its sensor."""
    influence, slope = influence_and_slope(fit.residuals)
    there = np.isfinite(influence)
    count = np.maximum(there.sum(axis=-1), len(fit.scenario.coordinates) + 1)
    more = count / (count - len(fit.scenario.coordinates))
    scales = np.zeros((2, *influence.shape))
    for block in fit.scenario.blocks:
        columns = block.columns
        here = np.maximum(there[..., columns].sum(axis=-1), 1)
        for scale, part in zip(scales, (slope, influence**2), strict=True):
            mean = np.sum(part[..., columns], axis=-1, where=there[..., columns]) / here
            scale[..., columns] = np.sqrt(np.maximum(mean, 0.0))[..., None]
    return scales[0][..., None], scales[1][..., None] * np.sqrt(more)[..., None, None]
