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

A residual that is NaN is left out, with its row of ``J``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .checks import check_count, check_is
from .estimate import Fit
from .residual_words import sentences

LAGS, COSINES = 10, 8
FEWEST, FOR_A_LAG = 20, 30  # freedom from which on correlation is tested; measurements for a lag
RANK = 1e-8  # a singular value of the scaled Jacobian, or a share of a slow function's energy, that is none
NORMAL_MEDIAN = 0.6745  # of the magnitude of a normal number
LEVERAGE = 1e-4  # 1 - H_kk from which on a residual says something
BLOCK_ELEMENTS = 4_000_000  # of the largest array


class ResidualTest(NamedTuple):
    """One test: arrays ``(..., S + 1)``, a column a sensor and the last for all; NaN where there is none."""

    statistic: np.ndarray
    freedom: np.ndarray
    p_value: np.ndarray


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

    names: tuple
    size: ResidualTest
    drift: ResidualTest
    correlation: ResidualTest
    largest: ResidualTest
    when: np.ndarray
    scale: np.ndarray
    status: np.ndarray

    def warnings(self, level=0.001):
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


def residual_tests(fit, lags=LAGS, cosines=COSINES):
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
        For lags or cosines that are not positive integers, and a fit with a robust loss.

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
    check_is("fit", fit, Fit).check_squares("a test of residuals")
    scenario, shape = fit.scenario, fit.cost.shape
    slow = _slow_functions(scenario, cosines)
    state = np.where(fit.converged[..., None], fit.state, np.nan).reshape(-1, fit.state.shape[-1])
    measured = fit.measured.reshape(-1, fit.measured.shape[-1])
    count, block = len(state), max(1, BLOCK_ELEMENTS // (slow.size + len(slow)))
    parts = [
        _statistics(scenario, state[i : i + block], measured[i : i + block], slow, lags)
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


def _slow_functions(scenario, cosines):
    """Cosines over the time of each sensor, of length one, ``(N, functions)``; the sensor's rows alone."""
    blocks = []
    for sensor in scenario.sensors:
        span = np.ptp(sensor.times)
        angle = np.pi * (sensor.times - sensor.times[0]) / (span if span > 0 else 1.0)
        functions = np.cos(angle[:, None] * np.arange(min(cosines, max(1, len(sensor) // 2))))
        blocks.append(functions / np.linalg.norm(functions, axis=0))
    slow, row, column = np.zeros((len(scenario.times), sum(b.shape[1] for b in blocks))), 0, 0
    for part in blocks:
        slow[row : row + len(part), column : column + part.shape[1]] = part
        row, column = row + part.shape[0], column + part.shape[1]
    return slow


def _statistics(scenario, state, measured, slow, lags):
    """Statistic and freedom of the four tests, in turn, and the time of the largest residual."""
    with np.errstate(all="ignore"):  # what is not finite is left out
        value, gradient = scenario.linearise(state)
        residual = scenario.residual(measured, value) / scenario.sigma
        jacobian = gradient / scenario.sigma[:, None]
    there = np.isfinite(residual) & np.isfinite(jacobian).all(axis=-1)
    residual, jacobian = np.where(there, residual, 0.0), np.where(there[..., None], jacobian, 0.0)
    basis, rank = _orthonormal(jacobian)
    residual = residual - _project(basis, residual)
    size, lag_sums = [], []
    for block in scenario.blocks:
        own, own_rank = _orthonormal(jacobian[:, block.columns])
        part, here = residual[:, block.columns], there[:, block.columns]
        part = part - _project(own, part)
        freedom = here.sum(axis=-1) - own_rank
        size.append((np.vecdot(part, part), freedom))
        lag_sums.append(_correlation(part, own, here, freedom, lags))
    size.append((np.vecdot(residual, residual), there.sum(axis=-1) - rank))
    lag_sums.append(np.sum(lag_sums, axis=0))
    groups = [*(block.columns for block in scenario.blocks), slice(None)]
    kinds = [*(np.any(slow[columns] != 0, axis=0) for columns in groups)]
    drift = [_energy(residual, there, basis, slow[:, kind]) for kind in kinds]
    spread = 1 - np.vecdot(basis, basis)
    counted = there & (spread > LEVERAGE)
    scaled = np.where(counted, np.abs(residual) / np.sqrt(np.where(counted, spread, 1.0)), -1.0)
    largest = [(scaled[:, columns].max(axis=-1), counted[:, columns].sum(axis=-1)) for columns in groups]
    place = [scenario.times[columns][np.argmax(scaled[:, columns], axis=-1)] for columns in groups]
    rows = []
    for test in (size, drift, lag_sums, largest):
        statistic, freedom = (np.stack(part, axis=-1).astype(float) for part in zip(*test, strict=True))
        rows += [np.where(freedom > 0, statistic, np.nan), np.where(freedom > 0, freedom, np.nan)]
    scale = np.stack([_scale(scaled[:, columns]) for columns in groups], axis=-1)
    return *rows, np.where(rows[-1] > 0, np.stack(place, axis=-1), np.nan), scale


def _scale(magnitudes):
    """Median magnitude over that of a normal number, at least one; negative ones are left out."""
    counted = np.where(magnitudes >= 0, magnitudes, np.nan)
    none = np.isnan(counted).all(axis=-1)
    counted[none] = 0.0
    return np.maximum(1.0, np.nanmedian(counted, axis=-1) / NORMAL_MEDIAN)


def _orthonormal(matrix):
    """Orthonormal basis of the columns, ``(runs, N, k)``, zero beyond the rank, and the rank ``(runs,)``."""
    length = np.sqrt(np.vecdot(matrix.mT, matrix.mT))
    scaled = matrix / np.where(length > 0, length, 1.0)[:, None]
    basis, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    kept = singular > RANK
    return basis * kept[:, None], kept.sum(axis=-1)


def _project(basis, vector):
    """Part of vectors ``(runs, N)`` in the space of a basis."""
    return (basis @ (basis.mT @ vector[..., None]))[..., 0]


def _energy(residual, there, basis, slow):
    """Energy of residuals in slow functions less what the basis has of these, and its freedom."""
    present = slow * there[..., None]
    inside = basis.mT @ present
    values, vectors = np.linalg.eigh(present.mT @ slow - inside.mT @ inside)
    kept = values > RANK
    along = (vectors.mT @ (present.mT @ residual[..., None]))[..., 0]
    return np.sum(np.where(kept, along**2 / np.where(kept, values, 1.0), 0.0), axis=-1), kept.sum(axis=-1)


def _correlation(part, basis, here, freedom, lags):
    """Sum of squares of standardised lag products, and how many there are; none with too little freedom."""
    total, count = np.zeros(len(part)), np.zeros(len(part))
    m = np.maximum(freedom, 1)
    square = np.maximum(np.vecdot(part, part), np.finfo(float).tiny)
    for lag in range(1, min(lags, max(1, part.shape[1] // FOR_A_LAG)) + 1):
        pairs = np.sum(here[:, lag:] & here[:, :-lag], axis=-1)
        moved = np.zeros_like(basis)  # A times the basis, of the form x'A x = sum of x_t x_(t + lag)
        moved[:, lag:] += basis[:, :-lag] / 2
        moved[:, :-lag] += basis[:, lag:] / 2
        moved *= here[..., None]
        inner = basis.mT @ moved
        trace = -np.trace(inner, axis1=-2, axis2=-1)
        squares = pairs / 2 - 2 * np.sum(moved**2, axis=(-2, -1)) + np.sum(inner**2, axis=(-2, -1))
        mean, second = trace / m, (trace**2 + 2 * squares) / (m * (m + 2))
        variance = second - mean**2
        product = np.vecdot(part[:, lag:], part[:, :-lag]) / square
        good = (freedom >= FEWEST) & (pairs >= FEWEST // 2) & (variance > 0)
        total += np.where(good, (product - mean) ** 2 / np.where(good, variance, 1.0), 0.0)
        count += good
    return total, count
