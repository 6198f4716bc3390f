"""Do the residuals of a fit look like noise of the stated sigma? Four tests, for each sensor and for all.

With z the measurement errors in standard deviations and ``J`` the whitened Jacobian, the residuals of a fit
are to first order ``e = (I - H) z``, with ``H`` the projector on the columns of ``J``. Under this linear
model and for independent Gaussian errors of the stated sigma:

*Size.* The residuals of a sensor, the columns of its own part ``J_s`` projected out, have a sum of squares
that is exactly chi-square with ``N_s - rank J_s`` degrees of freedom. The test has two sides: a sum that is
too small says that sigma is overstated.

*Drift.* The first few cosines ``cos(pi k t / T)``, ``k = 0, 1, ...``, over the time T of a sensor, less
their part in the columns of ``J``, span what is slow and no target of the model explains. The energy of the
residuals in this space is exactly chi-square, and its dimension the freedom. The constant, ``k = 0``, shows
a sensor at odds with the others.

*Correlation*, a portmanteau test. For the residuals x of the test of size and a lag of k measurements,
``q_k = sum_t x_t x_(t+k) / sum_t x_t^2`` is a ratio of quadratic forms in normal errors. Its mean and
variance are known exactly, the projection included (as for the statistic of Durbin and Watson). The sum of
the squares of the standardised ``q_k`` is chi-square, a degree of freedom a lag, if the ``q_k`` are normal
and independent. This is what is neglected: it holds for many measurements, where the sum is the statistic of
Ljung and Box. With a lag for thirty measurements, p < 0.001 comes up at most about twice in 1000 runs.

*Largest.* The largest residual over its standard deviation ``sqrt(1 - H_kk)``. If a single one is so large
by a chance p, one of N is by ``1 - (1 - p)^N`` (Šidák), or less where residuals are not independent.

A residual that is NaN is left out, with its row of ``J``, and so is one to which a robust fit gave the weight
zero. None of this asks by which loss the state was estimated: to first order ``(I - H) e`` is the same about
any state near the least squares estimate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .checks import check_count, check_is
from .estimate import Fit
from .residual_statistics import slow_functions, statistics_of
from .residual_words import sentences
from .types import FloatArray, TextArray

LAGS, COSINES = 10, 8
BLOCK_ELEMENTS = 4_000_000  # of the largest array


class ResidualTest(NamedTuple):
    """One test: arrays ``(..., S + 1)``, a column a sensor and the last for all; NaN where there is none."""

    statistic: FloatArray
    freedom: FloatArray
    p_value: FloatArray


@dataclass(frozen=True, eq=False)
class ResidualTests:
    """Output of `residual_tests`.

    Attributes
    ----------
    names : tuple of str
        What the columns are: the S sensors, then ``"all"``.
    size : ResidualTest
        Sum of squares. The p-value has two sides.
    drift : ResidualTest
        Energy in slow functions of time.
    correlation : ResidualTest
        Portmanteau statistic; the freedom is the number of lags.
    largest : ResidualTest
        Largest standardised residual; the freedom is the number of residuals.
    when : ndarray, shape (..., S + 1)
        Time of the largest residual in seconds.
    scale : ndarray, shape (..., S + 1)
        By how much residuals scatter more than sigma says, at least one: their median magnitude over that of
        a normal number, which a few wild ones do not move.
    status : ndarray of str, shape (...)
        Status of the fit. All tests of a run that has not converged are NaN.
    """

    names: tuple[str, ...]
    size: ResidualTest
    drift: ResidualTest
    correlation: ResidualTest
    largest: ResidualTest
    when: FloatArray
    scale: FloatArray
    status: TextArray

    def warnings(self, level: float = 0.001) -> list[str]:
        """What the tests of one run say in words, a list of sentences; empty if nothing is suspicious.

        Where residuals scatter more than sigma says, drift and the largest are judged by that ``scale``: a
        sigma that is too small is called that, and nothing else.

        A test speaks where its p-value is below ``level``. There are four a sensor and four of all, so that
        with a level of 0.001 one good fit in a hundred is called suspicious. `ValueError` for several runs.
        """
        drift = _upper(self.drift.statistic / self.scale**2, self.drift.freedom)
        largest = _of_many(self.largest.statistic / self.scale, self.largest.freedom)
        judged = replace(
            self, drift=self.drift._replace(p_value=drift), largest=self.largest._replace(p_value=largest)
        )
        return sentences(judged, level)


def residual_tests(fit: Fit, lags: int = LAGS, cosines: int = COSINES) -> ResidualTests:
    """Tests of the standardised residuals of a fit, for every run.

    Parameters
    ----------
    fit : Fit
    lags : int
        Most lags of the test of correlation; a sensor has one for thirty measurements.
    cosines : int
        Most slow functions of a sensor, with the constant; at most half as many as measurements.

    Returns
    -------
    ResidualTests
        NaN for a run that has not converged and for a sensor without freedom for a test (20 for correlation).

    Raises
    ------
    ValueError
        For lags or cosines that are not positive integers.

    Notes
    -----
    All is to first order in the errors: where the model is bent over the region, p-values are approximate.

    Examples
    --------
    A target that turns is not explained by a straight course:

    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
    >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 600, 5.0), sigma=0.01, name="ear")
    >>> watch = tma.Scenario(ship, [ear], reference_time=595)
    >>> turning = tma.Course((2e3, 4e3), 6, 1.5, [tma.Straight(200), tma.Straight(400, heading=0.0)])
    >>> found = tma.fit(watch, watch.with_target(turning).simulate(runs=1, seed=1)[0])
    >>> tests = tma.residual_tests(found)
    >>> tests.names
    ('ear', 'all')
    >>> bool(tests.drift.p_value[0] < 1e-6)
    True
    >>> any("ear drift slowly" in text for text in tests.warnings())
    True
    """
    lags, cosines = check_count("lags", lags), check_count("cosines", cosines)
    scenario, shape = check_is("fit", fit, Fit).scenario, fit.cost.shape
    slow = slow_functions(scenario, cosines)
    state = np.where(fit.converged[..., None], fit.state, np.nan).reshape(-1, fit.state.shape[-1])
    tested = np.where(fit.weights == 0, np.nan, fit.measured) if fit.robust else fit.measured
    measured = tested.reshape(-1, tested.shape[-1])
    count, block = len(state), max(1, BLOCK_ELEMENTS // (slow.size + len(slow)))
    parts = [
        statistics_of(scenario, state[i : i + block], measured[i : i + block], slow, lags)
        for i in range(0, max(count, 1), block)
    ]
    tables = [np.concatenate(part) for part in zip(*parts, strict=True)]
    found = [table.reshape(*shape, table.shape[-1]) for table in tables]
    size, drift, correlation, largest = zip(found[0:8:2], found[1:8:2], strict=True)
    names = (*(sensor.name for sensor in scenario.sensors), "all")
    return ResidualTests(
        names,
        ResidualTest(*size, np.minimum(1.0, 2 * np.minimum(_upper(*size), _lower(*size)))),
        ResidualTest(*drift, _upper(*drift)),
        ResidualTest(*correlation, _upper(*correlation)),
        ResidualTest(*largest, _of_many(*largest)),
        found[8],
        found[9],
        fit.status,
    )


def _upper(statistic, freedom):
    from scipy.special import chdtrc  # imported here: it costs time

    return chdtrc(freedom, statistic)


def _lower(statistic, freedom):
    from scipy.special import chdtr

    return chdtr(freedom, statistic)


def _of_many(largest, count):
    """Chance that one of a number of standard normal numbers is so large."""
    from scipy.special import erfc

    with np.errstate(divide="ignore"):
        return -np.expm1(count * np.log1p(-erfc(largest / np.sqrt(2))))
