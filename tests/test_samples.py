"""The sample data are what they say: read without a complaint, and the target is where the fit finds it."""

import numpy as np

import tmalib as tma
from tmalib.samples import sample, true_target


def test_the_target_is_found():
    ship = tma.read_track(sample("ownship.csv"))
    watch, angles = tma.read_bearings(sample("bearings.csv"), platform=ship)
    assert [sensor.name for sensor in watch.sensors] == ["sonar", "esm"]
    assert 0 < np.isnan(angles).sum() < len(angles) / 5
    found = tma.fit(watch, angles)
    truth = true_target().state(watch.reference_time)
    assert found.converged
    assert found.p_value > 0.01
    assert tma.nees(found.state, truth, found.covariance) < 13.28, "the 99 per cent point of four freedoms"
    assert tma.residual_tests(found).warnings() == []
