"""What several estimators make of the problems of `tmalib.conformance`: `make conformance`.

Usage: conformance.py FILE

scipy is given our residuals and gradients, filterpy and Stone Soup our bearings and (filterpy) gradients,
and all filters the same prior: at rest on the first bearing, 10 km away give or take half of it. What has
no bearing, the filters do not take: no answer.
"""

import json
import platform
import sys
import time
from contextlib import suppress
from datetime import date, datetime
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

import tmalib as tma
from tmalib.conformance import NONE, judge_answer, problems
from tmalib.sensors import in_order_of_time
from tmalib.speed import processor

RANGE, FAST = 10e3, {True: 100.0, False: 7.0}  # m/s of a target, in air and in water
STARTS = 20


def ours(scenario, angles):
    found = tma.fit(scenario, angles)
    return found.state if found.converged else None


def _first(scenario, angles):
    if any(isinstance(sensor.model, tma.ConicalAngle) for sensor in scenario.sensors):
        start = {"x": RANGE / 2**0.5, "y": RANGE / 2**0.5, "z": 100.0}  # no bearing: to the north-east
        return np.array([start.get(name, 0.0) for name in scenario.coordinates])
    others = {name: 0.0 for name in scenario.coordinates if name == "compass"}
    return tma.along_first_bearing(scenario, angles, RANGE, others or None)


def _in_scipy(scenario, angles, start):
    scale = np.where(np.isin(scenario.coordinates, ("vx", "vy")), 1.0, 1e3)
    scale[np.isin(scenario.coordinates, ("compass",))] = 0.01
    sigma = scenario.sigma

    def residuals(x):
        with np.errstate(all="ignore"):
            return np.nan_to_num(scenario.residual(angles, scenario.linearise(x * scale)[0]) / sigma, nan=1e3)

    def jacobian(x):
        with np.errstate(all="ignore"):
            return np.nan_to_num(-scenario.linearise(x * scale)[1] * scale / sigma[:, None])

    found = least_squares(residuals, start / scale, jacobian, method="lm")
    return (found.cost, found.x * scale) if found.status > 0 else (np.inf, None)


def scipy_once(scenario, angles):
    """Levenberg-Marquardt from 10 km along the first bearing, at rest."""
    return _in_scipy(scenario, angles, _first(scenario, angles))[1]


def scipy_often(scenario, angles):
    """The best of twenty starts: ranges from 200 m to 60 km, at rest and in random directions."""
    rng, here = np.random.default_rng(1), _first(scenario, angles)
    place = scenario.platform.position_at(scenario.times[0])
    starts = []
    for distance in np.geomspace(200, 60e3, STARTS):
        start = here.copy()
        start[:2] = place + (here[:2] - place) * distance / RANGE
        start[scenario.coordinates.index("vx") :][:2] = rng.normal(0, 5, 2)
        starts.append(_in_scipy(scenario, angles, start))
    return min(starts, key=lambda found: found[0])[1]


def _prior(scenario, angles):
    fast = FAST[min(getattr(sensor.model, "c", 1500.0) for sensor in scenario.sensors) < 1000]
    others = {name: (0.0, 0.1) for name in scenario.coordinates if name == "compass"}
    return tma.prior_along_first_bearing(scenario, angles, RANGE, RANGE / 2, fast, others or None)


def our_filter(scenario, angles):
    track = tma.ekf(scenario, angles, _prior(scenario, angles))
    return track.state[-1] if track.finite else None


def _steps(scenario, angles):
    """Prior at the reference time; of each later bearing block, place, time, bearing and variance."""
    prior = _prior(scenario, angles)
    back = np.eye(len(scenario.coordinates))
    back[:4, :4] = tma.transition(scenario.reference_time - prior.time)
    steps = [
        (block, observer, lag, angles[column], scenario.sigma[column] ** 2)
        for _, group in in_order_of_time(scenario, prior.time)
        for column, block, observer, lag in group
    ]
    return back @ prior.mean, back @ prior.covariance @ back.T, steps


def in_filterpy(scenario, angles):
    from filterpy.kalman import ExtendedKalmanFilter

    mean, covariance, steps = _steps(scenario, angles)
    kalman = ExtendedKalmanFilter(dim_x=len(mean), dim_z=1)
    kalman.x, kalman.P = mean[:, None], covariance
    for block, observer, lag, angle, variance in steps:

        def seen(x, where=(block, observer, lag)):
            block, observer, lag = where
            return block.predict(x[:, 0], observer, lag)

        kalman.update(
            np.array([[angle]]),
            HJacobian=lambda x, f=seen: f(x)[1][None, :],
            Hx=lambda x, f=seen: np.atleast_2d(f(x)[0]),
            R=variance,
            residual=lambda a, b: tma.wrap(a - b),
        )
    return kalman.x[:, 0] if np.isfinite(kalman.x).all() else None


def in_stone_soup(scenario, angles):
    """Its extended Kalman filter; the state is that at the reference time, so nothing moves."""
    from stonesoup.base import Property
    from stonesoup.models.measurement.nonlinear import NonLinearGaussianMeasurement
    from stonesoup.types.angle import Bearing
    from stonesoup.types.array import StateVector, StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.prediction import GaussianStatePrediction
    from stonesoup.updater.kalman import ExtendedKalmanUpdater

    class OurBearing(NonLinearGaussianMeasurement):
        step: tuple = Property(doc="Block, place and time")

        @property
        def ndim_meas(self):
            return 1

        def function(self, state, noise=False, **kwargs):
            block, observer, lag = self.step
            columns = np.array(state.state_vector, dtype=float).T  # one state, or all that it differs by
            values = [block.predict(column, observer, lag)[0] for column in columns]
            kind = StateVector if len(columns) == 1 else StateVectors
            return kind([[Bearing(float(value)) for value in values]])

        def rvs(self, *args, **kwargs):
            raise NotImplementedError

    mean, covariance, steps = _steps(scenario, angles)
    updater, now, n = ExtendedKalmanUpdater(None), datetime(2000, 1, 1), len(mean)
    for *step, angle, variance in steps:
        model = OurBearing(ndim_state=n, mapping=tuple(range(n)), noise_covar=[[variance]], step=tuple(step))
        seen = Detection(StateVector([[Bearing(angle)]]), timestamp=now, measurement_model=model)
        state = GaussianStatePrediction(mean[:, None], covariance, timestamp=now)
        state = updater.update(SingleHypothesis(state, seen))
        mean, covariance = np.ravel(state.mean).astype(float), np.asarray(state.covar, dtype=float)
    return mean if np.isfinite(mean).all() else None


ESTIMATORS = {
    "tmalib, fit": ours,
    "scipy, one start": scipy_once,
    "scipy, 20 starts": scipy_often,
    "tmalib, EKF": our_filter,
    "filterpy, EKF": in_filterpy,
    "Stone Soup, EKF": in_stone_soup,
}


def run(estimate):
    """Verdicts by problem, seconds for those with an answer, and what was raised."""
    verdicts, took, raised = {}, 0.0, {}
    for problem in problems():
        begin = time.perf_counter()
        try:
            state = estimate(problem.scenario, problem.angles)
        except Exception as error:
            state, raised[problem.name] = None, f"{type(error).__name__}: {error}"[:100]
        took += time.perf_counter() - begin
        verdicts[problem.name] = judge_answer(problem, state)
    return {"verdicts": verdicts, "seconds": took, "raised": raised}


def main(path):
    for estimate in ESTIMATORS.values():  # imports are not to be timed
        with suppress(Exception):
            estimate(*next(problems())[1:3])
    found = {name: run(estimate) for name, estimate in ESTIMATORS.items()}
    about = {
        "date": date.today().isoformat(),
        "processor": processor(),
        "versions": {"tmalib": tma.__version__, "python": platform.python_version()}
        | {name: version(name) for name in ("numpy", "scipy", "filterpy", "stonesoup")},
    }
    Path(path).write_text(json.dumps(about | {"estimators": found}, indent=1) + "\n", encoding="utf-8")
    for name, result in found.items():
        counts = {v: list(result["verdicts"].values()).count(v) for v in ("solved", "near", "wrong", NONE)}
        print(f"{name:20s} {counts} {result['seconds']:.2f} s, raised {len(result['raised'])}")


if __name__ == "__main__":
    main(sys.argv[1])
