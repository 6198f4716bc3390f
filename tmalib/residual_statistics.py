"""The numbers behind the tests of residuals, for runs at once; `tmalib.residuals` says what they test."""

from __future__ import annotations

import numpy as np

from .scenario import Scenario
from .types import FloatArray

FEWEST, FOR_A_LAG = 20, 30  # freedom from which on correlation is tested; measurements for a lag
RANK = 1e-8  # a singular value of the scaled Jacobian, or a share of a slow function's energy, that is none
NORMAL_MEDIAN = 0.6745  # of the magnitude of a normal number
LEVERAGE = 1e-4  # 1 - H_kk from which on a residual says something


def slow_functions(scenario: Scenario, cosines: int) -> FloatArray:
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


def statistics_of(
    scenario: Scenario, state: FloatArray, measured: FloatArray, slow: FloatArray, lags: int
) -> tuple[FloatArray, ...]:
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
