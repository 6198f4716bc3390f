"""No runs give empty results: what many runs give, with a zero where the number of runs was."""

import dataclasses
from collections.abc import Mapping

import numpy as np
import pytest

import tmalib as tma
from tmalib import sensitivity
from tmalib.seen import length_and_direction, seen_from

SHIP = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
TIMES = np.arange(0, 600, 10.0)
WATCH = tma.Scenario(SHIP, [tma.Sensor(tma.Bearing(), TIMES, 0.01, "ear")], 595)
SCENARIO = WATCH.with_target(tma.Target((2e3, 4e3), speed=6, heading=1.5))
RAYS = [tma.ConicalAngle(path, 200.0, 4000.0, 100.0) for path in (tma.DIRECT, tma.BOTTOM_BOUNCE)]
ARRAY = tma.Scenario(
    tma.Course((0, 0), 5, 0.0, [tma.Straight(600)]),
    [tma.Sensor(ray, np.arange(0, 601, 30), 0.001, f"ray {k}") for k, ray in enumerate(RAYS)],
    0,
    tma.Target((5000, 7000), 4, 0.7, depth=100),
)
MODELS = [
    tma.Bearing(), tma.DelayedBearing(), tma.DelayedBearingUnknownSpeed(), tma.Range(),
    tma.DopplerFrequency(f0=300.0), tma.Biased(tma.Bearing()), tma.AcceleratedBearing(),
    tma.TurningBearing(), tma.ConicalAngle(tma.DIRECT, 100.0, 4000.0),
]  # fmt: skip
COMPASS = tma.Scenario(
    SHIP, [tma.Sensor(MODELS[5], TIMES, 0.01), tma.Sensor(tma.Bearing(), TIMES, 0.01)], 595
)
MANY = 7
NOISE = tma.ProcessNoise(1e-4)
PRIOR = tma.Prior([2e3, 4e3, 0.0, 0.0], np.diag([1e6, 1e6, 100.0, 100.0]), 0.0)


def states(runs, scenario=SCENARIO):
    return np.ones((runs, 1)) * scenario.state


def heard(runs, scenario=SCENARIO):
    return scenario.simulate(runs, seed=1)


def priors(runs):
    return tma.Prior(states(runs), np.ones((runs, 1, 1)) * PRIOR.covariance, 0.0)


def fitted(runs, **options):
    return tma.fit(WATCH, heard(runs), **options)


def tracked(runs, **options):
    return tma.ekf(WATCH, heard(runs), PRIOR, [100.0, 595.0], **options)


def toss(seed, runs):
    return {"heads": np.random.default_rng(seed).random((runs, 2)) < 0.5}


CALLS = {
    "simulate": heard,
    "monte_carlo": lambda n: tma.monte_carlo(toss, n, "coins")["heads"],
    "fit": fitted,
    "fit from starts": lambda n: tma.fit(WATCH, heard(n), states(n)),
    "fit from one start": lambda n: tma.fit(WATCH, heard(n), SCENARIO.state),
    "starts of one run": lambda n: tma.fit(WATCH, heard(1)[0], states(n)),
    "fit, Cartesian": lambda n: fitted(n, chart=tma.Cartesian),
    "fit, robust": lambda n: fitted(n, loss="bisquare"),
    "fit of cosines": lambda n: tma.fit(ARRAY, heard(n, ARRAY)),
    "fit with a bias": lambda n: tma.fit(COMPASS, np.repeat(heard(n), 2, axis=1)),
    "estimate": lambda n: fitted(n).at(700.0),
    "seen": lambda n: seen_from(fitted(n).at(700.0), np.zeros(2)),
    "tests of residuals": lambda n: tma.residual_tests(fitted(n)),
    "start": lambda n: tma.along_first_bearing(WATCH, heard(n), 5e3),
    "prior": lambda n: tma.prior_along_first_bearing(WATCH, heard(n), 5e3, 2e3, 10.0),
    "ekf": tracked,
    "ekf, polar": lambda n: tracked(n, chart=tma.ModifiedPolar, process_noise=NOISE, gate=0.9),
    "ekf, iterated": lambda n: tma.gaussian_filter(WATCH, heard(n), PRIOR, [100.0, 595.0], update="iterated"),
    "ekf, second order": lambda n: tma.gaussian_filter(WATCH, heard(n), PRIOR, update="second-order"),
    "cubature": lambda n: tma.gaussian_filter(WATCH, heard(n), PRIOR, process_noise=NOISE),
    "bank": lambda n: tma.range_bank(WATCH, heard(n), [1e3, 4e3, 9e3], 5.0, [100.0, 595.0]),
    "running fit": lambda n: tma.running_fit(WATCH, heard(n), [-1.0, 400.0, 595.0], most=16),
    "refit": lambda n: tma.refit(None, WATCH, heard(n), most=16),
    "compare": lambda n: tma.compare_with_truth(SCENARIO, tracked(n)),
    "fit over time": lambda n: tma.fit_over_time(SCENARIO, heard(n), [400.0, 595.0], SCENARIO.state),
    "predict": lambda n: tma.predict(priors(n), 30.0),
    "update": lambda n: tma.update(priors(n), WATCH, heard(n), chart=tma.ModifiedPolar, gate=0.9),
    "update of one prior": lambda n: tma.update(PRIOR, WATCH, heard(n)),
    "fisher information": lambda n: tma.fisher_information(WATCH, states(n)),
    "rank": lambda n: tma.information_rank(WATCH, states(n)),
    "bound": lambda n: tma.crlb(WATCH, states(n)),
    "sigma": lambda n: tma.crlb_sigma(WATCH, states(n)),
    "nees": lambda n: tma.nees(states(n), SCENARIO.state, tma.crlb(SCENARIO)),
    "nees of claims": lambda n: tma.nees(states(n), SCENARIO.state, tma.crlb(SCENARIO, states(n))),
    "means": lambda n: tma.average_measurements(WATCH, heard(n), 4)[1],
    "profile": lambda n: tma.profile_criterion(WATCH, heard(n), SCENARIO.state[:2]),
    "profile of places": lambda n: tma.profile_criterion(WATCH, heard(1)[0], states(n)[:, :2]),
    "propagate": lambda n: tma.propagate(states(n), 30.0),
    "transition": lambda n: tma.transition(np.ones(n)),
    "linearise": lambda n: WATCH.linearise(states(n)),
    "position": lambda n: SHIP.position_at(np.ones(n)),
    "heading": lambda n: SHIP.heading_at(np.ones(n)),
    "place of a target": lambda n: SCENARIO.target.position_at(np.ones(n)),
    "bearing": lambda n: tma.bearing(states(n)[:, :2]),
    "delay": lambda n: tma.propagation_delay(states(n)[:, :2], states(n)[:, 2:], 1500.0),
    "length and direction": lambda n: length_and_direction(states(n)[:, :2], np.ones((n, 2, 2))),
    "differential": lambda n: sensitivity.differential(SCENARIO, np.ones((n, len(TIMES), 2))),
    "displaced": lambda n: sensitivity.displaced_measurements(SCENARIO, np.ones((n, len(TIMES), 2))),
    "to polar": lambda n: tma.ModifiedPolar((0, 0)).from_state(states(n)),
    "from polar": lambda n: tma.ModifiedPolar((0, 0)).to_state(states(n)),
}  # fmt: skip
PROPERTIES = (
    "converged", "weights", "freedom", "p_value", "rank", "condition", "weakest", "covariance", "residuals",
    "sigma", "finite",
)  # fmt: skip


def arrays_of(thing, name="result"):
    """Shapes and kinds of all arrays in a result, those of a fit's properties among them."""
    if isinstance(thing, np.ndarray | np.generic):
        yield name, np.shape(thing), thing.dtype.kind
    elif isinstance(thing, Mapping):
        for key in thing:
            yield from arrays_of(thing[key], f"{name}[{key!r}]")
    elif isinstance(thing, tuple | list):
        for k, part in enumerate(thing):
            yield from arrays_of(part, f"{name}[{k}]")
    elif dataclasses.is_dataclass(thing) and not isinstance(thing, tma.Scenario):
        for part in (*(f.name for f in dataclasses.fields(thing)), *PROPERTIES):
            if hasattr(type(thing), part) or part in vars(thing):
                yield from arrays_of(getattr(thing, part), f"{name}.{part}")


@pytest.mark.parametrize("name", CALLS)
def test_no_runs_give_what_many_give_without_rows(name):
    many, none = (list(arrays_of(CALLS[name](runs))) for runs in (MANY, 0))
    assert any(MANY in shape for _, shape, _ in many)
    wanted = [(part, tuple(0 if n == MANY else n for n in shape), kind) for part, shape, kind in many]
    assert none == wanted


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_no_runs_of_every_model(model):
    scenario = tma.Scenario(SHIP, [tma.Sensor(model, TIMES, 0.01)], 595)
    n = len(scenario.coordinates)
    none = np.empty((0, n))
    value, gradient = scenario.linearise(none)
    assert (value.shape, gradient.shape) == ((0, len(TIMES)), (0, len(TIMES), n))
    assert tma.crlb(scenario, none).shape == (0, n, n)
    assert tma.fit(scenario, np.empty((0, len(TIMES))), none).state.shape == (0, n)


@pytest.mark.parametrize("shape", [(0,), (2, 0), (0, 3)])
def test_axes_of_a_batch_without_runs_stay(shape):
    found = tma.fit(WATCH, np.empty((*shape, len(TIMES))))
    assert found.covariance.shape == (*shape, 4, 4)
    assert tma.residual_tests(found).drift.p_value.shape == (*shape, 2)
    assert tma.ekf(WATCH, np.empty((*shape, len(TIMES))), PRIOR).state.shape == (*shape, 1, 4)
    assert (tma.summarise(found), found.explain()) == ([], "")


def test_no_runs_are_saved_and_loaded(tmp_path):
    tma.save(tmp_path / "fit.json", fitted(0))
    assert tma.load(tmp_path / "fit.json").state.shape == (0, 4)


def test_a_mean_of_no_runs_is_refused():
    with pytest.raises(ValueError, match="at least 4 runs, got 0 of 0"):
        tma.statistics(np.empty((0, 4)))
    with pytest.raises(ValueError, match="runs must be an integer that is not negative, got -1"):
        SCENARIO.simulate(-1, seed=1)
