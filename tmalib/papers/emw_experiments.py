"""`emw-acoustic`: the Monte-Carlo experiments of Section V, and the judgement of Tables I-VI.

Each experiment is a task for `tmalib.monte_carlo`: a function of a seed and a number of runs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .. import claims
from ..batch import fit
from ..bounds import confidence_ellipse, crlb, crlb_sigma, nees
from ..montecarlo import CHUNK, statistics
from ..recursive import ekf
from . import emw_acoustic as emw

HEAVY = 10.0  # kurtosis above which a few runs decide a standard deviation


def experiment(seed, runs, number):
    """One chunk of the experiment of Section V: both estimators on the same bearings.

    Parameters
    ----------
    seed : see `Scenario.simulate`
    runs : int
    number : int
        Scenario 1 to 6, the observer's path as computed.

    Returns
    -------
    dict
        ``mle`` and ``ekf``: errors of the final state, ``(runs, 4)``; ``mle_converged``; ``mle_nees``
        against the bound and ``ekf_nees`` against the covariance that the filter claims, ``(runs,)``.
    """
    now = emw.scenario(number)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    batch = fit(now, angles, start)
    track = ekf(emw.for_filter(now), angles, emw.prior(start))
    final, claimed = track.state[:, -1], track.covariance[:, -1]
    return {
        "mle": batch.state - now.state,
        "mle_converged": batch.converged,
        "mle_nees": nees(batch.state, now.state, crlb(now)),
        "ekf": final - now.state,
        "ekf_nees": nees(final, now.state, claimed),
    }


def filter_experiment(seed, runs, number, gradient, first_again):
    """Errors of the EKF alone, ``{"ekf": (runs, 4)}``, for a variant of the filter.

    ``gradient`` as in `for_filter`, ``first_again`` as in `prior`. The bearings are those of `experiment`.
    """
    now = emw.scenario(number)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    track = ekf(emw.for_filter(now, gradient), angles, emw.prior(start, first_again))
    return {"ekf": track.state[:, -1] - now.state}


def positions_at_instants(seed, runs, number):
    """Estimated positions at the figure's `instants`: ``mle`` and ``ekf``, ``(runs, 3, 2)``, metres.

    The MLE at an instant uses the bearings up to it.
    """
    now = emw.scenario(number)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    times = emw.instants(number)
    track = ekf(emw.for_filter(now), angles, emw.prior(start), record=times)
    batch = []
    for time in times:
        then = now.until(time)
        batch.append(fit(then, angles[:, now.columns_until(time)], start).state[:, :2])
    return {"mle": np.stack(batch, axis=1), "ekf": track.state[:, :, :2]}


def check_times(number):
    """Times at which `consistency` looks at a scenario: twelve, multiples of 20 s, the last is t_M."""
    end = emw.scenario(number).reference_time
    return np.array([*(20.0 * np.round(np.linspace(end / 6, end, 12)[:-1] / 20)), end])


def consistency(seed, runs, number):
    """Do the estimators' errors have the size that their covariance says, and from when on?

    Returns
    -------
    dict
        ``mle_nees`` and ``ekf_nees``, ``(runs, T)`` at `check_times`: the normalised error squared of the
        state, for the MLE against the bound and for the EKF against the covariance it claims.
        ``mle_inside`` and ``ekf_inside``, ``(runs, T)``: whether the true position lies in the 90 %
        ellipse of that same covariance.
    """
    now, times = emw.scenario(number), check_times(number)
    angles = now.simulate(runs, seed)
    start = emw.start(now, angles, number)
    track = ekf(emw.for_filter(now), angles, emw.prior(start), record=times)
    found = {key: [] for key in ("mle_nees", "mle_inside", "ekf_nees", "ekf_inside")}
    for k, time in enumerate(times):
        then = now.until(time)
        state = fit(then, angles[:, now.columns_until(time)], start).state
        for name, estimate, covariance in (
            ("mle", state, crlb(then)),
            ("ekf", track.state[:, k], track.covariance[:, k]),
        ):
            position = nees(estimate[:, :2], then.state[:2], covariance[..., :2, :2])
            found[f"{name}_nees"].append(nees(estimate, then.state, covariance))
            found[f"{name}_inside"].append(position <= -2 * np.log(0.1))
    return {key: np.stack(values, axis=1) for key, values in found.items()}


def ellipses(number, probability=0.9):
    """Confidence ellipses of the bound at the figure's `instants`, centred on the true position."""
    now = emw.scenario(number)
    thens = [now.until(time) for time in emw.instants(number)]
    return [confidence_ellipse(then.state, crlb(then), probability) for then in thens]


# -- the tables ----------------------------------------------------------------------------------------


def judge_table(number, results, notes=None):
    """Judge all rows of the scenario's table.

    Parameters
    ----------
    number : int
    results : dict
        What `experiment` gave: errors ``mle`` and ``ekf``.
    notes : dict, optional
        ``(row, column)`` to a remark that goes with the verdict: what was tried, for instance.

    Returns
    -------
    claims.Verdicts
    """
    now = emw.scenario(number)
    bound, botma = crlb_sigma(now), crlb_sigma(emw.for_botma(now))
    ours = {}
    for i, row in enumerate(emw.ROWS):
        ours[row, "true"] = claims.Ours(now.state[i])
        ours |= spread_claims(row, i, results["mle"], "mle", "emw-1")
        ours |= spread_claims(row, i, results["ekf"], "ekf", filter_errata(number))
        ours[row, "std_crlb"] = claims.Ours(bound[i], erratum="emw-1")
        ours[row, "std_crlb_botma"] = claims.Ours(botma[i], erratum="emw-1, emw-4")
    for key, note in (notes or {}).items():
        ours[key] = replace(ours[key], note="; ".join(filter(None, [ours[key].note, note])))
    return claims.judge(emw.PAPER, emw.TABLES[number], ours)


def judge_filter(number, errors):
    """Judge the eight EKF numbers of a table alone, for a variant of the filter.

    ``errors`` is ``(runs, 4)``. For comparing variants: the chapter's own claims come from `judge_table`.
    """
    ours = {}
    for i, row in enumerate(emw.ROWS):
        ours |= spread_claims(row, i, errors, "ekf")
    return claims.judge(emw.PAPER, emw.TABLES[number], ours)


def filter_errata(number):
    """Errata on which the EKF columns of a table rest (see the book's errata page)."""
    radar_only = ["emw-2"] if number in (1, 3, 5) else []
    first_range = ["emw-5"] if number in (5, 6) else []
    return ", ".join(["emw-1", *radar_only, "emw-3", *first_range])


def spread_claims(row, i, errors, estimator, erratum=""):
    """Bias and standard deviation of component ``i`` as `claims.Ours`, against 500 printed runs.

    The paper prints biases without a sign, so ours is compared by its magnitude. Where a few stray runs
    decide a standard deviation, the note says what experiments of 500 of our own runs give.
    """
    found = statistics(errors)
    bias, std = claims.of_statistics(found, i, emw.PRINTED_RUNS)
    note = ""
    if found.kurtosis[i] > HEAVY and len(errors) >= CHUNK:
        experiments = errors[: len(errors) // CHUNK * CHUNK, i].reshape(-1, CHUNK)
        low, high = np.quantile(experiments.std(axis=1, ddof=1), [0.05, 0.95])
        note = f"stray runs: 90 % of our own experiments of {CHUNK} runs give {low:.3g} to {high:.3g}"
    return {
        (row, f"bias_{estimator}"): replace(bias, value=abs(bias.value), erratum=erratum),
        (row, f"std_{estimator}"): replace(std, erratum=erratum, note=note),
    }
