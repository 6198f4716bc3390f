"""What a name in a sentence leads to; every other literal stays as it is."""

import pytest

from tmalib.judging.book.names import full_name


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("tma.fit", ("obj", "tmalib.batch.fit")),
        ("fit(scenario, angles)", ("obj", "tmalib.batch.fit")),
        ("find_ghosts", ("obj", "tmalib.ghosts.find_ghosts")),
        ("tmalib.starts", ("mod", "tmalib.starts")),
        ("tma.figures.save_figure", ("obj", "tmalib.figures.save_figure")),
        ("Scenario.between", ("obj", "tmalib.scenario.Scenario.between")),
        ("Fit.covariance", ("obj", "tmalib.estimate.Fit")),
        ("tma.Sensor.sigma", ("obj", "tmalib.sensors.Sensor")),
        ("fit.weights", None),
        ("np.array", None),
        ("sigma", None),
        ("x", None),
        ("tma.nothing", None),
        ("fit(...).cost", None),
        ("import tmalib", None),
    ],
)
def test_names(text, found):
    assert full_name(text) == found
