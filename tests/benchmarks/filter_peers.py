"""The extended Kalman filter as others have it: functions of a `Problem`; states at the reference time."""

from datetime import datetime, timedelta

import numpy as np
from compiled import kernel

import tmalib as tma
from tmalib.papers.emw_acoustic import scenarios as emw


def in_c(case):
    """All runs beside one another, in C."""
    order, upper = np.concatenate(case.groups), np.triu_indices(4)
    joint = np.concatenate([np.arange(len(group)) > 0 for group in case.groups]).astype(float)
    prior = case.prior
    back = tma.transition(case.scenario.reference_time - prior.time)
    state = np.ascontiguousarray((case.start @ back.T).T)
    covariance = np.repeat((back @ prior.covariance @ back.T)[upper][:, None], len(case.start), axis=1)
    arrays = [np.ascontiguousarray(a[order]) for a in (case.x, case.y, case.lag, case.sound, case.sigma**2)]
    measured = np.ascontiguousarray(case.angles[:, order].T)
    kernel("ekf")(
        len(case.start), len(order), joint, *arrays, measured, state, np.ascontiguousarray(covariance)
    )
    return state.T


def in_filterpy(case):
    """Run by run; functions of the bearing and its gradient are ours."""
    from filterpy.kalman import ExtendedKalmanFilter

    times, noise, piece = case.scenario.times, case.sigma**2, {}
    for sensor, columns, site, *_ in case.scenario.blocks:
        piece |= {columns.start + j: (sensor.model, site[:, j]) for j in range(len(sensor))}

    def one_run(start, angles):
        kalman = ExtendedKalmanFilter(dim_x=4, dim_z=1)
        kalman.x, kalman.P = start.reshape(4, 1).copy(), np.diag(emw.PRIOR_VARIANCE)
        kalman.Q, now = np.zeros((4, 4)), 0.0
        for group in case.groups:
            kalman.F = tma.transition(times[group[0]] - now)
            kalman.predict()
            now, kalman.dim_z = times[group[0]], len(group)

            def seen(x, group=group):
                return [piece[k][0].value_and_gradient(x[:, 0], piece[k][1], 0.0) for k in group]

            kalman.update(
                angles[group][:, None],
                HJacobian=lambda x: np.array([gradient for _, gradient in seen(x)]),
                Hx=lambda x: np.array([[value] for value, _ in seen(x)]),
                R=np.diag(noise[group]),
                residual=lambda a, b: tma.wrap(a - b),
            )
        return tma.transition(case.scenario.reference_time - now) @ kalman.x[:, 0]

    return np.array([one_run(*run) for run in zip(case.start, case.angles, strict=True)])


def _stone_soup_models(case, analytic):
    """A model for each group of bearings: Stone Soup's own, extended for sound."""
    from stonesoup.base import Property
    from stonesoup.models.measurement.nonlinear import (
        Cartesian2DToBearing,
        CombinedReversibleGaussianMeasurementModel,
    )
    from stonesoup.types.state import State

    class DelayedBearing(Cartesian2DToBearing):
        """Of the place where the target was when it was heard; with our gradient, if it is to be analytic."""

        k: int = Property(doc="Which bearing of the case")

        def _function(self, state, noise=False, **kwargs):
            x, vx, y, vy = np.asarray(state.state_vector, dtype=float)
            dx, dy, c = x - case.x[self.k], y - case.y[self.k], case.sound[self.k]
            if c:
                radial, slack = dx * vx + dy * vy, c * c - vx**2 - vy**2
                delay = (np.sqrt(radial**2 + slack * (dx**2 + dy**2)) - radial) / slack
                x, y = x - delay * vx, y - delay * vy
            then = np.stack([x, vx, y, vy])
            return super()._function(State(state.state_vector.__class__(then)), noise, **kwargs)

        def jacobian(self, state, **kwargs):
            if not analytic:
                return super().jacobian(state, **kwargs)
            x, vx, y, vy = np.ravel(state.state_vector).astype(float)
            model = case.scenario.blocks[int(self.k >= case.early)].sensor.model
            site = np.array([case.x[self.k], case.y[self.k]])
            return -model.value_and_gradient(np.array([x, y, vx, vy]), site, 0.0)[1][[0, 2, 1, 3]][None, :]

    def one(k):
        place, noise = np.array([[case.x[k]], [case.y[k]]]), [[case.sigma[k] ** 2]]
        return DelayedBearing(ndim_state=4, mapping=(0, 2), noise_covar=noise, translation_offset=place, k=k)

    def joint(group):
        models = [one(k) for k in group]
        return models[0] if len(models) == 1 else CombinedReversibleGaussianMeasurementModel(models)

    return [joint(group) for group in case.groups]


def in_stone_soup(case, analytic=False):
    """Run by run; gradients are its own differences, or ours."""
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.kalman import ExtendedKalmanPredictor
    from stonesoup.types.angle import Bearing
    from stonesoup.types.array import StateVector
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState
    from stonesoup.updater.kalman import ExtendedKalmanUpdater

    straight = CombinedLinearGaussianTransitionModel([ConstantVelocity(0.0)] * 2)
    predictor, updater = ExtendedKalmanPredictor(straight), ExtendedKalmanUpdater(None)
    swap, epoch = [0, 2, 1, 3], datetime(2000, 1, 1)
    covariance = np.diag(emw.PRIOR_VARIANCE)[np.ix_(swap, swap)]
    models, times = _stone_soup_models(case, analytic), case.scenario.times
    stamps = [epoch + timedelta(seconds=float(times[group[0]])) for group in case.groups]

    def one_run(start, angles):
        state = GaussianState(start[swap][:, None], covariance, timestamp=epoch)
        for group, model, stamp in zip(case.groups, models, stamps, strict=True):
            measured = StateVector([Bearing(np.pi / 2 - angle) for angle in angles[group]])
            seen = Detection(measured, timestamp=stamp, measurement_model=model)
            state = updater.update(SingleHypothesis(predictor.predict(state, timestamp=stamp), seen))
        last = np.ravel(state.mean).astype(float)[swap]
        return tma.transition(case.scenario.reference_time - times[case.groups[-1][0]]) @ last

    return np.array([one_run(*run) for run in zip(case.start, case.angles, strict=True)])


PEERS = {"C": in_c, "filterpy": in_filterpy, "Stone Soup": in_stone_soup}
