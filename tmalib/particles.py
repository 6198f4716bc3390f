"""Particle filter with sampling, importance weights and resampling (SIR).

The target's velocity is disturbed at random (`robustness`, equation (4), corrected)::

    A_k = F A_{k-1} + beta G V_k,    F = [[I, dT I], [0, I]],    G = [dT^2/2 I; dT I],
    Y_k = Psi(A_k) + sigma eps_k,

with the 2x2 identity ``I``, ``dT`` the time since the last measurement, and ``V_k`` standard Gaussian *in
the plane*: ``beta V_k`` is an acceleration, in m/s^2, held from one measurement to the next.

A cloud of N particles stands for what is known of ``A_k``. In each step every particle moves by the first
equation with an acceleration of its own, gets the weight ``w = p(Y_k | A_k)``, and is copied
``N w / sum w`` times, rounded up or down (*systematic resampling*). The weights are kept as logarithms
less their largest, so that they cannot all underflow.

How far to trust the cloud. A range that no particle of the first cloud had is hardly ever found later, and
each resampling loses some of those there were. In the end all N particles may descend from a few, and
look like a posterior that is sure of itself. So the filter counts:

- *effective sample size* ``(sum w)^2 / sum w^2``: how many of the N particles a step really uses;
- *families*: ``N^2 / sum n_i^2``, where ``n_i`` of the N particles descend from particle i of the first
  cloud. The first cloud has N families of one; at the worst there is one family of N.

Families also tell by how much the filter's mean would scatter with other random numbers (Chan and Lai,
2013). With normalised weights and the sum ``S_i`` of ``w (x - mean)`` over family i, the variance of that
scatter is about ``sum_i S_i^2``. The sum over a single family is zero: this error is not to be believed
where there are few.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from . import status as words
from .checks import check_is, check_scalar, check_seed
from .clouds import Cloud, one_run
from .process_noise import ProcessNoise
from .scenario import Scenario
from .sensors import in_order_of_time
from .types import FloatArray, IntArray, Seed
from .uniform import moving_pairs

FEW_FAMILIES = 10  # the spread of so many independent draws is known to 1 / sqrt(2 10), 22 per cent


@dataclass(frozen=True, eq=False)
class ParticleTrack:
    """Output of `sir`: K steps, N particles.

    Attributes
    ----------
    times : ndarray, shape (K,)
        Times of the measurements.
    state, covariance : ndarray, shapes (K, n) and (K, n, n)
        Mean and covariance of the weighted cloud at each of the times. NaN where no particle has a weight;
        the cloud moves on as if nothing was measured at that time, and later rows go on.
    standard_error : ndarray, shape (K, n)
        By how much `state` would scatter with other random numbers, judged from the families.
    effective : ndarray, shape (K,)
        Effective sample size, before resampling: N where all measurements are missing, 0 where no particle
        has a weight.
    families : ndarray, shape (K,)
        Effective number of families, after resampling.
    log_likelihood : float
        Logarithm of the density of the measurements after the cloud's time, those that are not missing. Its
        exponential is unbiased. Minus infinity if no particle has a weight at one of the times.
    particles : ndarray, shape (N, n)
        States at the last of the times, resampled: equally likely.
    ancestor : ndarray of int, shape (N,)
        The particle of the first cloud that each of them descends from.
    status : str
        A word of `tmalib.status`: ``"filtered"``, ``"no particle explains a measurement"``, or
        ``"not finite"`` where another row of `state`, `covariance` or `standard_error` is not.
    """

    times: FloatArray
    state: FloatArray
    covariance: FloatArray
    standard_error: FloatArray
    effective: FloatArray
    families: FloatArray
    log_likelihood: float
    particles: FloatArray
    ancestor: IntArray
    status: str

    @property
    def finite(self) -> bool:
        """Whether the filter came to a good end."""
        return self.status == words.FILTERED

    @property
    def degenerate(self) -> bool:
        """Whether the last cloud has fewer than `FEW_FAMILIES` families.

        What the first cloud had and nothing disturbs, such as a range that only the whole series of bearings
        tells, is then known from so few draws, whatever the number of particles: of that the filter is surer
        than it has reason to be. Where the state is disturbed so much that it forgets the first cloud, few
        families do no harm; then compare filters with other seeds, whose means scatter little against
        their spread if the cloud is sound. Earlier clouds, and whether rows are `finite`, do not count:
        families can grow again, and ``track.families < FEW_FAMILIES`` tells it for each of the times.
        """
        return bool(self.families[-1] < FEW_FAMILIES)


def sir(
    scenario: Scenario,
    angles: ArrayLike,
    cloud: Cloud,
    beta: float,
    seed: Seed,
    walks: Mapping[str, float] | None = None,
) -> ParticleTrack:
    """SIR particle filter for a target whose velocity is disturbed at random.

    Parameters
    ----------
    scenario : Scenario
        What the filter assumes; its target is not read.
    angles : array_like, shape (N,)
        Measurements of one run, in the scenario's order. NaN is a missing one, and weighs nothing.
    cloud : Cloud
        What is known before; later measurements are used. The number of particles stays.
    beta : float
        Standard deviation of each component of the acceleration in m/s^2, drawn anew for every step.
    seed : int, SeedSequence or Generator
    walks : dict, optional
        Name of a further unknown to the density of its random walk, in its unit squared a second (see
        `ProcessNoise`). What is not named stays constant.

    Returns
    -------
    ParticleTrack

    Raises
    ------
    ValueError
        For wrong shapes, a negative `beta`, no measurement after the cloud's time, a state whose motion is
        not uniform, or a walk of what is no further unknown.

    Notes
    -----
    Source: `robustness`, Section IV, equation (4) with the corrections stated at the top of this file.
    In steps of T seconds a velocity wanders as far as by white acceleration of spectral density ``beta^2 T``.
    ``Cloud(track.particles, track.times[-1])`` is what is known then; from it the filter goes on with what is
    measured later.
    """
    angles, pairs = one_run(scenario, angles), moving_pairs(scenario.coordinates)
    walking = ProcessNoise(walks={} if walks is None else walks).walking(scenario.coordinates)
    beta = check_scalar("beta", beta, minimum=0.0)
    scenario.check_state(check_is("cloud", cloud, Cloud).states)
    rng = check_seed(seed)
    steps = in_order_of_time(scenario, cloud.time)
    if not steps:
        raise ValueError(f"no measurement after the cloud's time, {cloud.time}")
    state = np.array(cloud.states.T, order="C")  # (n, N): a component is contiguous; a copy, moved in place
    other, noise = np.empty_like(state), np.empty((2, state.shape[1]))
    ancestor = np.arange(state.shape[1])
    kept, effective, families, log_likelihood = [], [], [], 0.0
    now = cloud.time
    with np.errstate(all="ignore"):  # a cloud without weights shows in `finite`
        for time, group in steps:
            if beta:
                rng.standard_normal(out=noise)
            else:
                noise[:] = 0.0
            _move(state, pairs, noise, time - now, beta)
            for i, density in walking.items():
                state[i] += np.sqrt(density * (time - now)) * rng.standard_normal(state.shape[1])
            now = time
            weight, log_density = _weights(state, [(*where, angles[column]) for column, *where in group])
            log_likelihood += log_density
            kept.append(_moments(state, weight, ancestor))
            effective.append(np.nan_to_num(1 / np.vecdot(weight, weight)))
            index = systematic_resample(weight, rng.random())
            np.take(state, index, axis=1, out=other, mode="clip")
            state, other = other, state
            ancestor = ancestor[index]
            families.append(_families(ancestor))
    mean, covariance, error = map(np.array, zip(*kept, strict=True))
    status = str(words.status_of_filter(mean, covariance)) if np.isfinite(error).all() else words.NOT_FINITE
    return ParticleTrack(
        np.array([time for time, _ in steps]), mean, covariance, error, np.array(effective),
        np.array(families), float(log_likelihood), state.T, ancestor,
        status if min(effective) > 0 else words.NO_WEIGHT,
    )  # fmt: skip


def systematic_resample(weights: ArrayLike, u: float) -> IntArray:
    """Indices of the particles that survive, each about ``N w / sum w`` times, shape ``(N,)``.

    Particle i is taken once for each of the points ``(u + j) / N``, ``j = 0 .. N - 1``, that lies in its
    part ``[c_{i-1}, c_i)`` of the unit interval, ``c`` being the cumulated and normalised weights: the
    floor or the ceiling of ``N w_i`` times, and on average over a uniform ``u`` exactly ``N w_i``.

    Parameters
    ----------
    weights : array_like, shape (N,)
        Not negative. Where their sum is not positive and finite, every particle is taken once.
    u : float
        In [0, 1).

    Returns
    -------
    ndarray of int, shape (N,)
        Increasing, so that what is gathered lies together.
    """
    edges = np.cumsum(weights, dtype=float)
    n = len(edges)
    if not (0 < edges[-1] < np.inf):
        return np.arange(n)
    edges *= n / edges[-1]
    edges -= u
    counts = np.ceil(edges, out=edges).astype(np.intp)  # how many points lie below each edge
    counts[-1] = n
    counts[1:] -= counts[:-1].copy()
    return np.repeat(np.arange(n), counts)


def _move(state, pairs, noise, step, beta):
    """One step of the model, in place; ``noise`` is used up. Half of the new velocity before, half after."""
    noise *= beta * step / 2
    for place, speed, half in zip(*pairs, noise, strict=True):
        state[speed] += half
        state[place] += np.multiply(state[speed], step)
        state[speed] += half


def _weights(state, group):
    """Normalised weights ``(N,)``, and the logarithm of their mean before that: a density.

    A missing measurement weighs nothing; a particle that predicts nothing has no weight. NaN, and a density
    of zero, where no particle has any.
    """
    log_weight, constant = np.zeros(state.shape[1]), 0.0
    for block, observer, _, measured in group:
        if np.isnan(measured):
            continue
        value, _ = block.predict(state, observer, 0.0)  # the state is that of now
        sensor = block.sensor
        residual = sensor.model.residual(measured, value)
        residual /= sensor.sigma
        residual *= residual
        log_weight += residual
        constant += np.log(sensor.sigma * np.sqrt(2 * np.pi))
    log_weight *= -0.5
    largest = log_weight.max()
    if np.isnan(largest):
        log_weight[np.isnan(log_weight)] = -np.inf
        largest = log_weight.max()
    if largest == -np.inf:
        return np.full(len(log_weight), np.nan), largest
    weight = np.exp(np.subtract(log_weight, largest, out=log_weight), out=log_weight)
    total = weight.sum()
    weight /= total
    return weight, largest + np.log(total / len(weight)) - constant


def _families(ancestor):
    """Effective number of families; ``ancestor`` is sorted."""
    n = len(ancestor)
    sizes = np.diff(np.flatnonzero(np.diff(ancestor, prepend=-1)), append=n)
    return n * n / np.vecdot(sizes, sizes)


def _moments(state, weight, ancestor):
    """Weighted mean and covariance, and the standard error of the mean from the families."""
    mean = state @ weight
    centred = state - mean[:, None]
    weighted = centred * weight
    first = np.flatnonzero(np.diff(ancestor, prepend=-1))
    families = np.add.reduceat(weighted, first, axis=1)
    return mean, weighted @ centred.T, np.sqrt(np.vecdot(families, families))
