"""Particle filter, ghosts and worst perturbations as others would compute them."""

import numpy as np
from scipy.optimize import least_squares, minimize

from tmalib.sensitivity import position_criterion, response


def particles_in_numpy(scenario, angles, cloud, beta, seed):
    """SIR of bearings, one run, as in a textbook: multinomial resampling at every step; the last mean."""
    (block,), rng = scenario.blocks, np.random.default_rng(seed)
    states, now, sigma = cloud.states.copy(), cloud.time, block.sensor.sigma
    for k in np.flatnonzero(scenario.times > now):
        step, place = scenario.times[k] - now, block.observer[:, k]
        kick = beta * rng.standard_normal((len(states), 2))
        states[:, :2] += step * states[:, 2:] + step**2 / 2 * kick
        states[:, 2:] += step * kick
        now = scenario.times[k]
        error = angles[k] - np.arctan2(states[:, 0] - place[0], states[:, 1] - place[1])
        error = (error + np.pi) % (2 * np.pi) - np.pi
        weight = np.exp(-0.5 * (error / sigma) ** 2)
        weight /= weight.sum()
        mean = weight @ states
        states = states[rng.choice(len(states), len(states), p=weight)]
    return mean


def particles_in_stone_soup(scenario, angles, cloud, beta, seed):
    """The same in Stone Soup, with its systematic resampler; the noise is as large, not of the same form."""
    from datetime import datetime, timedelta

    from stonesoup.models.measurement.nonlinear import Cartesian2DToBearing
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.particle import ParticlePredictor
    from stonesoup.resampler.particle import SystematicResampler
    from stonesoup.types.angle import Bearing
    from stonesoup.types.array import StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import ParticleState
    from stonesoup.updater.particle import ParticleUpdater

    (block,), swap, epoch = scenario.blocks, [0, 2, 1, 3], datetime(2000, 1, 1)
    times, sigma = scenario.times, block.sensor.sigma
    density = beta**2 * float(np.median(np.diff(times)))
    moving = CombinedLinearGaussianTransitionModel([ConstantVelocity(density)] * 2, seed=seed)
    predictor, updater = ParticlePredictor(moving), ParticleUpdater(None, SystematicResampler())
    count, start = len(cloud.states), epoch + timedelta(seconds=float(cloud.time))
    state = ParticleState(
        StateVectors(cloud.states.T[swap]), weight=np.full(count, 1 / count), timestamp=start
    )
    for k in np.flatnonzero(times > cloud.time):
        model = Cartesian2DToBearing(ndim_state=4, mapping=(0, 2), noise_covar=[[sigma**2]],
                                     translation_offset=block.observer[:, k][:, None])  # fmt: skip
        stamp = epoch + timedelta(seconds=float(times[k]))
        seen = Detection([[Bearing(np.pi / 2 - angles[k])]], timestamp=stamp, measurement_model=model)
        state = updater.update(SingleHypothesis(predictor.predict(state, timestamp=stamp), seen))
    return np.ravel(state.mean).astype(float)[swap]


def ghosts_by_search(scenario, starts, seed=0):
    """Targets with the same noise-free measurements, by `scipy` from random starts: states ``(k, 5)``.

    Positions within 20 km, speeds to 10 m/s, depths to 2 km; what two starts find is listed once.
    """
    rng, found = np.random.default_rng(seed), []

    def measured(state):
        return np.concatenate(
            [block.predict(state, block.observer, block.elapsed)[0] for block in scenario.blocks]
        )

    exact, sigma = measured(scenario.state), scenario.sigma
    scale = np.array([1e3, 1e3, 1e2, 1.0, 1.0])
    for _ in range(starts):
        start = np.r_[rng.uniform(-2e4, 2e4, 2), rng.uniform(0, 2e3), rng.uniform(-10, 10, 2)]
        solved = least_squares(
            lambda x: (measured(x) - exact) / sigma, start, x_scale=scale, xtol=1e-14, ftol=1e-14,
            gtol=1e-14, max_nfev=200,
        )  # fmt: skip
        state = solved.x
        if solved.cost < 1e-12 and not any(np.allclose(state, other, 1e-3, 1e-3) for other in found):
            found.append(state)
    return np.array(found)


def worst_by_scipy(scenario, bound, starts, seed=0):
    """The largest norm of the shift for displacements of at most ``bound``, by a bounded search."""
    gain, rng = response(scenario).gain, np.random.default_rng(seed)
    gain = position_criterion(scenario, scenario.reference_time) @ gain

    def minus_square(along):
        shift = gain @ along
        return -shift @ shift, -2 * gain.T @ shift

    box = [(-bound, bound)] * gain.shape[1]
    found = [
        minimize(minus_square, rng.uniform(-bound, bound, gain.shape[1]), jac=True, bounds=box).fun
        for _ in range(starts)
    ]
    return np.sqrt(-min(found))
