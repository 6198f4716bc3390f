"""Live views as data: frames in order, numbers rounded, a page that no text breaks."""

import json
import re

import numpy as np
import pytest
from bs4 import BeautifulSoup

import tmalib as tma
from tmalib.judging.live import Curve, Frames, Slider, frames, page, rounded
from tmalib.judging.live_bearings import sensors_of, solution
from tmalib.samples import sample


def test_the_last_slider_runs_fastest():
    sliders = [Slider("a", (1, 2), "m"), Slider("b", (7, 8, 9), "s"), Slider("c", (0,), "")]
    made = frames(lambda b, a: 10 * a + b, sliders, by=(1, 0))
    assert made == Frames((1, 0), (17, 27, 18, 28, 19, 29))


def test_rounded_is_json():
    value = {"a": np.array([[1 / 3, np.inf]]), "b": (np.float64(2), "x", None, True), "c": np.array(1.23456)}
    assert rounded(value, 3) == {"a": [[0.333, None]], "b": [2, "x", None, True], "c": 1.23}
    json.dumps(rounded(value, 3), allow_nan=False)


def test_no_text_breaks_the_page():
    text = page("frames", 'A "title" & more', "<b>", {"says": "</script><script>alert(1)</script>"})
    soup = BeautifulSoup(text, "html.parser")
    assert len(soup("script")) == 1
    assert json.loads(soup.script.string) == {"says": "</script><script>alert(1)</script>"}
    assert soup.div["aria-label"] == 'A "title" & more'
    assert soup.find(class_="live-instead").text == "<b>"


def test_an_unknown_mark_is_refused():
    with pytest.raises(ValueError, match="mark must be one of"):
        Curve("a", "star")


@pytest.fixture
def found():
    watch, angles = tma.read_bearings(sample("bearings.csv"), platform=tma.read_track(sample("ownship.csv")))
    return tma.fit(watch, angles)


def test_what_the_browser_needs_gives_the_fit_again(found):
    """The residuals from the rounded parts by formulas of their own: where the sound left, by iteration."""
    length, course, speed, bearing = solution(found)
    a, b = np.radians([bearing, course])
    here = found.scenario.platform.position_at(found.scenario.reference_time)
    place = here + length * np.array([np.sin(a), np.cos(a)])
    velocity = speed * np.array([np.sin(b), np.cos(b)])
    residuals = []
    for sensor in sensors_of(found):
        own, delay = np.stack([sensor["x"], sensor["y"]], axis=-1), 0.0
        for _ in range(30):
            gap = place + np.multiply.outer(sensor["elapsed"] - delay, velocity) - own
            delay = np.hypot(*gap.T) / sensor["c"] if sensor["c"] else 0.0
        off = sensor["bearing"] - np.degrees(np.arctan2(*gap.T))
        residuals.append(((off + 180) % 360 - 180) / sensor["sigma"])
    assert np.allclose(np.concatenate(residuals), found.residuals, atol=1e-8, equal_nan=True)


def test_other_fits_are_refused(found):
    ranges = tma.Sensor(tma.Range(), np.arange(0, 600, 20.0), 10.0)
    other = found.scenario.between(0, 1440).with_target(tma.Target((3e3, 4e3), 5.0, 1.0))
    other = tma.Scenario(other.platform, [*other.sensors, ranges], 600.0, target=other.target)
    with pytest.raises(ValueError, match="take bearings from the platform"):
        sensors_of(tma.fit(other, other.measure()))
    with pytest.raises(ValueError, match="one converged run"):
        sensors_of(tma.fit(found.scenario, np.stack([found.measured] * 2)))


def test_marks_are_those_of_the_script(pytestconfig):
    script = (pytestconfig.rootpath / "book/_static/live.js").read_text(encoding="utf-8")
    style = (pytestconfig.rootpath / "book/_static/custom.css").read_text(encoding="utf-8")
    from tmalib.judging.live import MARKS

    drawn = set(re.findall(r"^    (\w+): \(x, y\) => `M", script, re.MULTILINE))
    assert drawn <= set(MARKS)
    assert {"live-" + mark for mark in set(MARKS) - drawn} - {"live-line"} <= set(
        re.findall(r"live-\w+", style)
    )
