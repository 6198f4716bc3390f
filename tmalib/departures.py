"""A target that leaves its uniform motion: what that does to the estimate, and who can notice it.

In place of its uniform motion X the target goes ``X + sum_i a_i H_i``: *amounts* ``a_i`` of some *kinds* of
departure, a turn for instance. With ``J`` the whitened Jacobian of the state and ``D`` that of the amounts,
both with a row a measurement, and ``H = J J^+`` the projector on the columns of J, to first order

- the estimate moves by ``J^+ D a``: of D a it feels the part in the columns of J, and no other;
- the residuals move by ``R a``, ``R = (I - H) D``: they feel the rest, and no other.

*Tests.* All that a test of residuals can notice is the *noncentrality* ``|R a|^2``, or the part of it that
lies where the test looks:

======== ============================================ ========================== =======================
test     is                                           looks at                   degrees of freedom
======== ============================================ ========================== =======================
size     the p-value of a `Fit`                       all residuals              N - n
drift    that of `residual_tests`, for all sensors    slow functions of time     their number
kinds    the fall of the criterion when the amounts   the columns of R           number of kinds
         are estimated too
any      no test: the ceiling of all tests            R a alone                  none
======== ============================================ ========================== =======================

The first three are noncentral chi-square. The ceiling is that of Neyman and Pearson: bearings of the
departed target differ by ``R a`` from those of the uniform motion that the estimate goes to, and nothing
tells two known means that are r standard deviations apart better than
``Phi(r - z)``, with z the normal quantile of the level. A test of that level for *every* uniform motion
cannot do more.

*Price.* With the amounts among the unknowns, the bound ``P`` of the position at a time grows to
``P + B (R'R)^-1 B'``, where ``B a`` is the error that the departure makes there. For a single kind, with the
ratio q of the roots of the traces of the two::

    |B a| = sqrt(noncentrality) sqrt(q^2 - 1) sqrt(trace P).

What is dear to estimate does harm before it is noticed, and only that.

Sources: the first-order response is `robustness`, Proposition 2. The largest departure that a test notices
with a given power is the minimal detectable bias of Baarda (1968), and what it does to the estimate his
external reliability.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .bounds import crlb, whitened_jacobian
from .checks import as_numbers, check_has, check_is, check_probability, check_scalar
from .departed import Departed, slopes, ways
from .residual_statistics import RANK, slow_functions
from .scenario import Scenario
from .sensitivity import position_criterion
from .types import FloatArray, Motion

TESTS = ("size", "drift", "kinds", "any")
COSINES = 8  # as in `residual_tests`
VISIBLE = 1e-6  # singular value of what a test sees of kinds of length one, from which on it sees them


@dataclass(frozen=True, eq=False)
class DepartureEffect:
    """Output of `departure_effect`, for K kinds of departure.

    Amounts are ``(..., K)``, or a number for a single kind. What the methods return is to first order in
    them, but for ``size``, which is exact.

    Attributes
    ----------
    scenario : Scenario
    others : tuple
        The motions that were given.
    time : float
        When the position is wanted, in seconds.
    gain : ndarray, shape (2, K)
        ``B``: estimated minus true position at that time, in metres, for an amount of one.
    bound : ndarray, shape (2, 2)
        Cramér-Rao bound of that position for a target without departure, in m^2.
    slope : ndarray, shape (N, K)
        ``D``: standardised measurements for an amount of one.
    residual : ndarray, shape (N, K)
        ``R``: what the estimate leaves of them.
    slow : ndarray, shape (m, K)
        What of that lies in the m slow functions of the test of drift.
    """

    scenario: Scenario
    others: tuple[Motion, ...]
    time: float
    gain: FloatArray
    bound: FloatArray
    slope: FloatArray
    residual: FloatArray
    slow: FloatArray

    def freedom(self, test: str = "size") -> int:
        """Degrees of freedom of a test; `ValueError` for ``"any"``, which is none."""
        count, kinds = self.residual.shape
        found = {"size": count - len(self.scenario.coordinates), "drift": len(self.slow), "kinds": kinds}
        return found[_check_test(test, tuple(found))]

    @property
    def bound_with_kinds(self) -> FloatArray:
        """Bound of the position when the amounts are estimated too, ``(2, 2)``.

        `ValueError` where the measurements do not tell the amounts.
        """
        spread = np.linalg.solve(self._triangle("kinds").T, self.gain.T).T
        return self.bound + spread @ spread.T

    @property
    def price(self) -> float:
        """Root of the trace of `bound_with_kinds` over that of ``bound``, at least one; fails likewise."""
        return float(np.sqrt(np.trace(self.bound_with_kinds) / np.trace(self.bound)))

    def error(self, amounts: ArrayLike) -> FloatArray:
        """Distance of estimate and target at ``time``, without noise, in metres, ``(...)``."""
        return np.linalg.norm(self._amounts(amounts) @ self.gain.T, axis=-1)

    def size(self, amounts: ArrayLike) -> FloatArray:
        """Largest distance of the target from its own nearest uniform motion, in metres, ``(...)``.

        At the times of measurement; nearest in the sum of squares.
        """
        times, amounts = np.unique(self.scenario.times), self._amounts(amounts)
        off = np.tensordot(amounts, ways(self._uniform, self.others, times), axes=1)
        basis = np.linalg.qr(np.stack([np.ones_like(times), times - times.mean()], axis=-1))[0]
        off = off - basis @ (basis.T @ off)
        return np.hypot(off[..., 0], off[..., 1]).max(axis=-1)

    def noncentrality(self, amounts: ArrayLike, test: str = "size") -> FloatArray:
        """What a test sees of a departure, ``(...)``: the energy of the residuals where it looks."""
        part = self.slow if _check_test(test) == "drift" else self.residual
        return np.sum((self._amounts(amounts) @ part.T) ** 2, axis=-1)

    def power(self, amounts: ArrayLike, test: str = "size", level: float = 0.05) -> FloatArray:
        """Chance that a test of a level notices a departure, ``(...)``; for ``"any"``, that none exceeds."""
        return self._chance(self.noncentrality(amounts, test), test, check_probability(level))

    def hidden(self, power: float = 0.5, test: str = "size", level: float = 0.05) -> FloatArray:
        """The most harmful of the departures that a test notices with a given chance, amounts ``(K,)``.

        It has the largest ``error`` of all with that chance. Its negative is as harmful; of the two it is the
        one whose largest amount is positive.

        Raises
        ------
        ValueError
            For a power that is not between level and one, and where the test does not see some combination
            of the kinds: no amount of that is ever noticed.
        """
        from scipy.optimize import brentq  # imported here: it costs half a second

        power, level = check_probability(power), check_probability(level)
        if power <= level:
            raise ValueError(f"power must be above the level {level}, got {power}")
        triangle = self._triangle(test)
        high = 1.0
        while self._chance(high, test, level) < power:
            high *= 2
        wanted = brentq(lambda v: self._chance(v, test, level) - power, 0.0, high, xtol=1e-10 * high)
        spread = np.linalg.solve(triangle.T, self.gain.T).T
        amounts = np.sqrt(wanted) * np.linalg.solve(triangle, np.linalg.svd(spread)[2][0])
        return amounts * np.sign(amounts[np.argmax(np.abs(amounts))])

    def target(self, amounts: ArrayLike) -> Departed:
        """The motion of a target with these amounts, ``(K,)``: for `Scenario.with_target`."""
        amounts = self._amounts(amounts)
        if amounts.ndim > 1:
            raise ValueError(f"amounts must be those of one target, got shape {amounts.shape}")
        return Departed(self._uniform, self.others, tuple(amounts.tolist()))

    @property
    def _uniform(self) -> Any:
        return self.scenario.target

    def _amounts(self, amounts: ArrayLike) -> FloatArray:
        amounts, kinds = as_numbers("amounts", amounts), len(self.others)
        amounts = amounts[..., None] if kinds == 1 and amounts.shape[-1:] != (1,) else amounts
        if amounts.shape[-1:] != (kinds,):
            raise ValueError(f"amounts must have shape (..., {kinds}), got {amounts.shape}")
        return amounts

    def _chance(self, noncentrality, test, level):
        from scipy.stats import chi2, ncx2, norm

        if _check_test(test) == "any":
            return norm.cdf(np.sqrt(noncentrality) - norm.isf(level))
        freedom = self.freedom(test)
        return ncx2.sf(chi2.isf(level, freedom), freedom, noncentrality)

    def _triangle(self, test):
        """``L`` ``(K, K)`` of the noncentrality ``|L a|^2``; `ValueError` if it is singular."""
        part = self.slow if _check_test(test) == "drift" else self.residual
        length = np.linalg.norm(self.slope, axis=0)
        scaled = part / np.where(length > 0, length, 1.0)
        if len(part) < len(self.others) or np.linalg.svd(scaled, compute_uv=False)[-1] < VISIBLE:
            raise ValueError(
                f"the test {test!r} does not see these motions, or some sum of them: where it looks, they "
                "give the measurements of a uniform motion"
            )
        return np.linalg.qr(part, mode="r")


def departure_effect(
    scenario: Scenario, others: Motion | Sequence[Motion], time: float | None = None
) -> DepartureEffect:
    """What it does to the estimate if the target goes another way, and with what chance that is noticed.

    Parameters
    ----------
    scenario : Scenario
        With a `Target`: the uniform motion from which the departure is counted, and that is assumed by the
        estimate. Any sensors.
    others : motion, or sequence of motions
        For each kind of departure the motion of an amount of one: anything with ``position_at(t)``, at all
        times of measurement (with delays, also before).
    time : float, optional
        When the position is wanted; the reference time by default.

    Returns
    -------
    DepartureEffect

    Raises
    ------
    ValueError
        For a target or sensors without uniform motion, or a state that is not observable.

    Notes
    -----
    Source: see the top of the module. All is to first order in the amounts: measurements are differentiated
    by them, by central differences.

    Examples
    --------
    A ship turns once in twenty minutes and takes a bearing every ten seconds. What if the target turns, by a
    degree a minute?

    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 6, 0.0, [tma.Straight(600), tma.Straight(600, heading=np.pi / 2)])
    >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 1200, 10.0), sigma=np.radians(0.5))
    >>> target = tma.Target((3e3, 8e3), speed=5, heading=np.radians(250))
    >>> watch = tma.Scenario(ship, [ear], reference_time=1190, target=target)
    >>> turn = tma.Course((3e3, 8e3), 5, np.radians(250), [tma.Turn(1200, np.radians(1) / 60)])
    >>> effect = tma.departure_effect(watch, turn)

    The p-value of the fit notices it in so many of a hundred cases, where five are false alarms, and the
    track is off by so many metres; then the bound, in metres:

    >>> round(100 * float(effect.power(1.0))), round(float(effect.error(1.0)))
    (11, 438)
    >>> round(float(np.sqrt(np.trace(effect.bound))))
    52

    The turn that is noticed in every second case, in degrees a minute, and its error in metres, for that test
    and for one that asks whether the target turns:

    >>> for test in ("size", "kinds"):
    ...     amounts = effect.hidden(power=0.5, test=test)
    ...     print(test, amounts.round(1), effect.error(amounts).round())
    size [2.1] 907.0
    kinds [0.8] 343.0

    The price of a fit that estimates a turn: so many times the bound.

    >>> round(effect.price, 1)
    3.5
    """
    if hasattr(others, "position_at"):
        others = (others,)
    others = tuple(check_has("each of others", other, "position_at") for other in others)
    if not others:
        raise ValueError("others is empty; a departure needs at least one other motion")
    check_is("scenario", scenario, Scenario)
    time = scenario.reference_time if time is None else check_scalar("time", time)
    criterion, jacobian = position_criterion(scenario, time), whitened_jacobian(scenario)
    bound = criterion @ crlb(scenario) @ criterion.T
    slope = slopes(scenario, others) / scenario.sigma[:, None]
    scale = np.linalg.norm(jacobian, axis=0)
    basis = np.linalg.qr(jacobian / scale)[0]
    shift = np.linalg.lstsq(jacobian / scale, slope)[0] / scale[:, None]
    uniform: Any = scenario.target  # there is one, or there were no Jacobian
    gain = criterion @ shift - ways(uniform, others, time).T
    residual = slope - basis @ (basis.T @ slope)
    slow = slow_functions(scenario, COSINES)
    left, singular, _ = np.linalg.svd(slow - basis @ (basis.T @ slow), full_matrices=False)
    slow = left[:, singular**2 > RANK].T @ residual
    return DepartureEffect(scenario, others, time, gain, bound, slope, residual, slow)


def _check_test(test, accepted=TESTS):
    if test not in accepted:
        raise ValueError(f"test must be one of {accepted}, got {test!r}")
    return test
