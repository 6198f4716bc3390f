"""The bearings of `tmalib.samples` tracked by Stone Soup: prints a table, for `make study`.

Usage: stone_soup.py OWNSHIP BEARINGS

As Stone Soup's example of bearings-only tracking: a state x, vx, y, vy of constant velocity, a Cartesian
model of the bearing, a Gaussian prior along the first bearing. Angles are from the x axis, anticlockwise.
Stone Soup has no model of a bearing that is late by the way of the sound; `DelayedBearing` extends it.
"""

import csv
import sys
from datetime import datetime
from pydoc import locate

import numpy as np
from stonesoup.base import Property
from stonesoup.models.measurement.nonlinear import Cartesian2DToBearing
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.kalman import ExtendedKalmanPredictor, UnscentedKalmanPredictor
from stonesoup.predictor.particle import ParticlePredictor
from stonesoup.regulariser.particle import MCMCRegulariser
from stonesoup.resampler.particle import ESSResampler
from stonesoup.types.angle import Bearing
from stonesoup.types.array import StateVectors
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.state import GaussianState, ParticleState, State
from stonesoup.updater.kalman import ExtendedKalmanUpdater, UnscentedKalmanUpdater
from stonesoup.updater.particle import ParticleUpdater

HAS = (  # what the book says that Stone Soup has; a name that is not there stops the script
    "stonesoup.tracker.simple.MultiTargetTracker",
    "stonesoup.initiator.simple.MultiMeasurementInitiator",
    "stonesoup.deleter.error.CovarianceBasedDeleter",
    "stonesoup.dataassociator.probability.JPDA",
    "stonesoup.updater.pointprocess.PHDUpdater",
    "stonesoup.updater.particle.MultiModelParticleUpdater",
    "stonesoup.updater.kalman.SchmidtKalmanUpdater",
    "stonesoup.smoother.kalman.ExtendedKalmanSmoother",
    "stonesoup.simulator.platform.PlatformDetectionSimulator",
    "stonesoup.metricgenerator.ospametric.OSPAMetric",
    "stonesoup.metricgenerator.pcrbmetric.PCRBMetric",
    "stonesoup.reader.aishub.JSON_AISDetectionReader",
    "stonesoup.sensormanager.base.SensorManager",
    "stonesoup.plotter.AnimatedPlotterly",
)
RANGES, SPEED = (3e3, 6e3, 12e3), 5.0  # m, of the priors, each with half of it as sigma; m/s
PARTICLES, JITTER = 20_000, 1e-3  # and their process noise, m^2/s^3: of 1e-4, 1e-3, 1e-2 the best
STATE, ORDER = ("x", "y", "vx", "vy"), [0, 2, 1, 3]  # and where they are in Stone Soup's x, vx, y, vy


class DelayedBearing(Cartesian2DToBearing):
    """Bearing of the place where a target was when the sound left it."""

    sound_speed: float = Property(doc="Metres a second")

    def _function(self, state, noise=False, **kwargs):
        values = np.asarray(state.state_vector, dtype=float)
        x, vx, y, vy = values  # each of one, or of all particles
        dx = x - self.translation_offset[0, 0]
        dy = y - self.translation_offset[1, 0]
        radial = dx * vx + dy * vy
        slack = self.sound_speed**2 - vx**2 - vy**2
        root = np.sqrt(radial**2 + slack * (dx**2 + dy**2))
        delay = (root - radial) / slack
        then = np.stack([x - delay * vx, vx, y - delay * vy, vy])
        past = State(state.state_vector.__class__(then))
        return super()._function(past, noise, **kwargs)


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return rows, [datetime.fromisoformat(row["time"].rstrip("Z")) for row in rows]


def detections(ownship, bearings, delayed):
    """In order of time, each with the measurement model of its sensor and of the ship's place."""
    fixes, stamps = read(ownship)
    clock, found = [stamp.timestamp() for stamp in stamps], []
    for row, stamp in zip(*read(bearings), strict=True):
        if not row["bearing"]:
            continue
        place = [[np.interp(stamp.timestamp(), clock, [float(fix[axis]) for fix in fixes])] for axis in "xy"]
        seen = {
            "ndim_state": 4,
            "mapping": (0, 2),
            "noise_covar": [[np.radians(float(row["sigma"])) ** 2]],
            "translation_offset": np.array(place),
        }
        if delayed and row["sound_speed"]:
            model = DelayedBearing(sound_speed=float(row["sound_speed"]), **seen)
        else:
            model = Cartesian2DToBearing(**seen)
        angle = Bearing(np.pi / 2 - np.radians(float(row["bearing"])))
        found.append(Detection(np.array([[angle]]), timestamp=stamp, measurement_model=model))
    return sorted(found, key=lambda one: one.timestamp)


def prior(first, distance):
    """Along the first bearing: half the range as sigma, a speed of zero."""
    angle, model = float(first.state_vector[0, 0]), first.measurement_model
    across = distance * np.sqrt(model.noise_covar[0, 0])
    along = np.array([np.cos(angle), np.sin(angle)])
    turn = np.column_stack([along, [-along[1], along[0]]])
    covariance = np.diag([0.0, SPEED**2, 0.0, SPEED**2])
    spread = turn @ np.diag([(distance / 2) ** 2, across**2]) @ turn.T
    covariance[np.ix_([0, 2], [0, 2])] = spread
    place = model.translation_offset[:, 0] + distance * along
    mean = [[place[0]], [0.0], [place[1]], [0.0]]
    return GaussianState(mean, covariance, timestamp=first.timestamp)


def filters():
    straight = CombinedLinearGaussianTransitionModel([ConstantVelocity(0.0)] * 2)
    shaken = CombinedLinearGaussianTransitionModel([ConstantVelocity(JITTER)] * 2, seed=21)
    return {
        "EKF": (ExtendedKalmanPredictor(straight), ExtendedKalmanUpdater(None)),
        "UKF": (UnscentedKalmanPredictor(straight), UnscentedKalmanUpdater(None)),
        "particles": (ParticlePredictor(shaken), ParticleUpdater(None, ESSResampler(), MCMCRegulariser())),
    }


def track(state, seen, predictor, updater):
    """The last state of a filter; the first detection is in its prior."""
    for detection in seen[1:]:
        prediction = predictor.predict(state, timestamp=detection.timestamp)
        state = updater.update(SingleHypothesis(prediction, detection))
    return state


def particles(state):
    """A cloud of particles for a Gaussian prior."""
    draws = np.random.default_rng(21).multivariate_normal(np.ravel(state.mean), state.covar, PARTICLES)
    weights = np.full(PARTICLES, 1 / PARTICLES)
    return ParticleState(StateVectors(draws.T), weight=weights, timestamp=state.timestamp)


def main(ownship, bearings):
    if missing := [name for name in HAS if locate(name) is None]:
        sys.exit(f"Stone Soup has no {missing}")
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(
        ["filter", "delayed", "range", *STATE, *(f"c_{one}_{other}" for one in STATE for other in STATE)]
    )
    for delayed in (False, True):
        seen = detections(ownship, bearings, delayed)
        for distance in RANGES:
            for name, (predictor, updater) in filters().items():
                np.random.seed(21)  # noqa: NPY002  of the resampler
                start = prior(seen[0], distance)
                last = track(particles(start) if name == "particles" else start, seen, predictor, updater)
                mean, covariance = np.ravel(last.mean).astype(float), np.asarray(last.covar, dtype=float)
                numbers = [*mean[ORDER], *covariance[np.ix_(ORDER, ORDER)].ravel()]
                table.writerow([name, int(delayed), int(distance), *(f"{one:.6g}" for one in numbers)])


if __name__ == "__main__":
    main(*sys.argv[1:])
