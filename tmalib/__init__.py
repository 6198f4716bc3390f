"""Target motion analysis from angles: scenarios, bounds, estimators, Monte-Carlo.

>>> import numpy as np, tmalib as tma
>>> platform = tma.Course((0, 0), speed=7, heading=np.pi / 2,
...     legs=[tma.Straight(200), tma.Turn(400, rate=-np.radians(20) / 60), tma.Straight(600)])
>>> target = tma.Target((15e3, 18e3), speed=5, heading=np.radians(150))
>>> scenario = tma.Scenario(platform, [
...     tma.Sensor(tma.Bearing(), times=np.arange(0, 1200, 1), sigma=np.radians(1)),
...     tma.Sensor(tma.DelayedBearing(c=1500), times=np.arange(0, 1200, 4), sigma=np.radians(1))],
...     reference_time=1199, target=target)
>>> tma.crlb_sigma(scenario).shape
(4,)
>>> angles = scenario.simulate(runs=500, seed=1)
>>> fit = tma.fit(scenario, angles, start=tma.along_first_bearing(scenario, angles, range=10e3))
>>> bool(fit.converged.all())
True
"""

from . import sensitivity
from .averaging import average_measurements
from .batch import along_first_bearing, fit
from .bearings import Bearing, DelayedBearing, bearing, propagation_delay, wrap
from .biased import Biased
from .bounded import RunningFit, refit, running_fit
from .bounds import (
    crlb,
    crlb_sigma,
    fisher_information,
    information_rank,
    nees,
    nees_limits,
)
from .charts import Cartesian, ModifiedPolar
from .clouds import Cloud, cloud_along_first_bearing
from .cones import BOTTOM_BOUNCE, DIRECT, SURFACE_BOUNCE, ConicalAngle, RayPath, image_depth
from .consistency import Consistency, compare_with_truth, fit_over_time
from .credible import CredibleRegion
from .curved import AcceleratedBearing, TurningBearing
from .departures import DepartureEffect, departure_effect
from .doppler import DopplerFrequency
from .ellipse import Ellipse, confidence_ellipse
from .estimate import Estimate, Fit
from .files import Frame, RecordedCourse, load, read_bearings, read_track, save, write_bearings
from .gaussian_filters import gaussian_filter, range_bank
from .ghosts import NearGhost, admissible, find_ghosts, near_ghosts
from .known import KnownComponent
from .minima import Alternative, alternatives, distinct_minima
from .models import check_model
from .montecarlo import Runs, Source, Statistics, Stream, monte_carlo, statistics
from .motion import Course, SampledCourse, Straight, Target, Turn
from .multipath import RayPosition, position_from_rays
from .particles import ParticleTrack, sir
from .posterior import Posterior, sample_posterior
from .priors import FilterState, Prior, prior_along_first_bearing
from .process_noise import ProcessNoise
from .profile import profile_criterion
from .progress import ProgressLine
from .ranges import Range
from .recursive import Track, ekf, predict, update
from .region import Region, confidence_region
from .residuals import ResidualTest, ResidualTests, residual_tests
from .scenario import Scenario
from .second_order import second_order_bias
from .sensors import Sensor
from .sound_speed import DelayedBearingUnknownSpeed
from .summary import summarise
from .uniform import propagate, transition

__version__ = "0.1.0"

__all__ = [
    "BOTTOM_BOUNCE",
    "DIRECT",
    "SURFACE_BOUNCE",
    "AcceleratedBearing",
    "Alternative",
    "Bearing",
    "Biased",
    "Cartesian",
    "Cloud",
    "ConicalAngle",
    "Consistency",
    "Course",
    "CredibleRegion",
    "DelayedBearing",
    "DelayedBearingUnknownSpeed",
    "DepartureEffect",
    "DopplerFrequency",
    "Ellipse",
    "Estimate",
    "FilterState",
    "Fit",
    "Frame",
    "KnownComponent",
    "ModifiedPolar",
    "NearGhost",
    "ParticleTrack",
    "Posterior",
    "Prior",
    "ProcessNoise",
    "ProgressLine",
    "Range",
    "RayPath",
    "RayPosition",
    "RecordedCourse",
    "Region",
    "ResidualTest",
    "ResidualTests",
    "RunningFit",
    "Runs",
    "SampledCourse",
    "Scenario",
    "Sensor",
    "Source",
    "Statistics",
    "Straight",
    "Stream",
    "Target",
    "Track",
    "Turn",
    "TurningBearing",
    "admissible",
    "along_first_bearing",
    "alternatives",
    "average_measurements",
    "bearing",
    "check_model",
    "cloud_along_first_bearing",
    "compare_with_truth",
    "confidence_ellipse",
    "confidence_region",
    "crlb",
    "crlb_sigma",
    "departure_effect",
    "distinct_minima",
    "ekf",
    "find_ghosts",
    "fisher_information",
    "fit",
    "fit_over_time",
    "gaussian_filter",
    "image_depth",
    "information_rank",
    "load",
    "monte_carlo",
    "near_ghosts",
    "nees",
    "nees_limits",
    "position_from_rays",
    "predict",
    "prior_along_first_bearing",
    "profile_criterion",
    "propagate",
    "propagation_delay",
    "range_bank",
    "read_bearings",
    "read_track",
    "refit",
    "residual_tests",
    "running_fit",
    "sample_posterior",
    "save",
    "second_order_bias",
    "sensitivity",
    "sir",
    "statistics",
    "summarise",
    "transition",
    "update",
    "wrap",
    "write_bearings",
]  # fmt: skip
