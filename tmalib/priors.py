"""What is known of a state before a measurement, as a mean and a covariance.

After an update the same three, mean, covariance and time, are the prior of the next measurement: a
`FilterState` is a `Prior` that says what became of its measurements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .batch import along_first_bearing, first_bearing
from .checks import as_numbers, check_is, check_pair, check_scalar, check_sequence, set_fields
from .scenario import Scenario
from .status import FILTERED, status_of_filter
from .types import Array, BoolArray, FloatArray, TextArray
from .uniform import PLANE, moving_pairs


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of the state before filtering.

    The prior holds all that was measured up to and at its time: `ekf` uses later measurements only.

    Parameters
    ----------
    mean : array_like, shape (..., n)
        Of the state at ``time``.
    covariance : array_like, shape (..., n, n)
        Symmetric and positive definite. A run in which it is not finite is a lost run.
    time : float
    coordinates : sequence of str, optional
        Names of the state's components. By default ``x, y, vx, vy`` for four, else those of the scenario that
        the prior is used with.

    Raises
    ------
    ValueError
        For wrong shapes, or a covariance that is not symmetric and positive definite.
    """

    mean: Array
    covariance: Array
    time: float
    coordinates: Sequence[str] | None = None

    def __post_init__(self) -> None:
        mean, covariance = as_numbers("mean", self.mean), as_numbers("covariance", self.covariance)
        n = mean.shape[-1] if mean.ndim else 0
        square = n and covariance.shape[-2:] == (n, n)
        if not square or not np.allclose(covariance, covariance.mT, equal_nan=True):
            raise ValueError(
                f"prior covariance must be symmetric, of shape (..., {n}, {n}), got shape {covariance.shape}"
            )
        known = np.isfinite(covariance).all(axis=(-1, -2))
        if np.any(np.linalg.eigvalsh(covariance[known]) <= 0):
            raise ValueError("prior covariance must be positive definite")
        names = self.coordinates
        if names is None:
            names = PLANE if n == len(PLANE) else None
        elif isinstance(names, str) or len(names := check_sequence("coordinates", names, str)) != n:
            raise ValueError(f"coordinates must name the {n} components of the mean, got {names}")
        time = check_scalar("prior time", self.time)
        set_fields(self, mean=mean, covariance=covariance, time=time, coordinates=names)

    def names_for(self, scenario: Scenario) -> tuple[str, ...]:
        """Names of the components, among them all that the scenario's sensors want; else `ValueError`."""
        wanted, n = scenario.coordinates, self.mean.shape[-1]
        names = wanted if self.coordinates is None else tuple(self.coordinates)
        if len(names) != n or not set(wanted) <= set(names):
            raise ValueError(f"prior must have the components {wanted}, got mean {self.mean.shape}, {names}")
        return names


@dataclass(frozen=True, eq=False)
class FilterState(Prior):
    """What a filter knows after `predict` or `update`: the prior of the next measurement.

    Attributes
    ----------
    nis : ndarray, shape (..., N)
        Normalised innovation squared of each of the update's measurements, in the scenario's order:
        chi-square with one degree of freedom if the filter is right. NaN for a missing one. `None` after
        `predict`.
    used : ndarray of bool, shape (..., N)
        `False` for a measurement that is missing or outside the gate. `None` after `predict`.
    """

    nis: FloatArray | None = None
    used: BoolArray | None = None

    def __post_init__(self) -> None:
        """No checks: a covariance that a filter made is reported, not refused."""

    @property
    def status(self) -> TextArray:
        """A word of `tmalib.status` for each run, ``(...)``: ``"filtered"`` or ``"not finite"``."""
        return status_of_filter(self.mean[..., None, :], self.covariance[..., None, :, :])

    @property
    def finite(self) -> BoolArray:
        """Which runs came to a good end, ``(...)``."""
        return self.status == FILTERED


def check_others(
    scenario: Scenario, others: Mapping[str, tuple[float, float]] | None
) -> dict[str, tuple[float, float]]:
    """``others`` as a dict; `ValueError` unless it names the unknowns besides position and velocity, all."""
    others = check_is("others", {} if others is None else others, dict)
    wanted = set(scenario.coordinates) - set(PLANE)
    if wanted != others.keys():
        raise ValueError(f"others must have the unknowns {sorted(wanted)}, got {sorted(others)}")
    return {name: check_pair(f"others[{name!r}]", pair) for name, pair in others.items()}


def first_prediction(scenario: Scenario, column: int, states: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What the measurement in a column is predicted to be, and its gradient, for states at its time.

    States ``(..., n)``; value ``(...)`` and gradient ``(n, ...)``.
    """
    block = next(b for b in scenario.blocks if b.columns.start <= column < b.columns.stop)
    observer = block.observer[:, column - block.columns.start]
    return block.predict(np.moveaxis(states, -1, 0), observer, 0.0)


def prior_along_first_bearing(
    scenario: Scenario,
    angles: ArrayLike,
    range: float,
    range_sigma: float,
    velocity_sigma: float,
    others: Mapping[str, tuple[float, float]] | None = None,
) -> Prior:
    """`Prior` of each run: at rest on the first bearing, at ``range``, more or less.

    Parameters
    ----------
    scenario : Scenario
    angles : array_like, shape (..., N)
    range, range_sigma : float
        Mean and standard deviation of the range at the first bearing, in metres.
    velocity_sigma : float
        Standard deviation of each component of the velocity, whose mean is zero, in m/s.
    others : dict, optional
        Name of every further unknown to its mean and standard deviation.

    Returns
    -------
    Prior
        At the time of the first bearing, which it uses up. Across the bearing the standard deviation
        is ``range`` times the bearing's. In modified polar coordinates about the platform this is a
        diagonal covariance: ``sigma``, ``range_sigma / range^2`` and twice ``velocity_sigma / range``.
        Where further unknowns change the first bearing, as a bias does, its direction is corrected for their
        means, and errs with them: the covariance says so.
    """
    others = check_others(check_is("scenario", scenario, Scenario), others)
    mean = along_first_bearing(scenario, angles, range, {name: value for name, (value, _) in others.items()})
    range_sigma = check_scalar("range_sigma", range_sigma, above=0.0)
    velocity_sigma = check_scalar("velocity_sigma", velocity_sigma, above=0.0)
    first, platform = first_bearing(scenario)
    time, names = float(scenario.times[first]), scenario.coordinates
    places, speeds = moving_pairs(names)
    theta = scenario.check_measurements(angles)[..., first]
    if others:
        value, slope = first_prediction(scenario, first, mean)
        theta = 2 * theta - value
        unit = np.stack([np.sin(theta), np.cos(theta)], axis=-1)
        mean[..., places] = platform.position_at(time) + range * unit
    axes = np.stack([np.sin(theta), np.cos(theta), np.cos(theta), -np.sin(theta)], axis=-1)
    axes = axes.reshape(*theta.shape, 2, 2)  # rows: along and across the bearing
    spread = np.array([range_sigma, range * scenario.sigma[first]])
    covariance = np.zeros((*theta.shape, len(names), len(names)))
    covariance[..., places[:, None], places] = axes.mT @ (spread[:, None] ** 2 * axes)
    covariance[..., speeds, speeds] = velocity_sigma**2
    for name, (_, sigma) in others.items():
        # The error e of an unknown moves the position by -range slope e across the bearing.
        i, variance = names.index(name), check_scalar(name, sigma, above=0.0) ** 2
        moves = -range * slope[i][..., None] * axes[..., 1, :]
        covariance[..., places[:, None], places] += variance * moves[..., :, None] * moves[..., None, :]
        covariance[..., places, i] = covariance[..., i, places] = variance * moves
        covariance[..., i, i] = variance
    return Prior(mean, covariance, time, names)
