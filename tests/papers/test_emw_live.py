"""The live view of the radius: what its output says is what the ledger and the courses say."""

import json

import numpy as np
import pytest
from bs4 import BeautifulSoup

from tmalib.papers.emw_acoustic import radius_view as view
from tmalib.papers.emw_acoustic import scenarios as emw

AT_7 = emw.OBSERVER_SPEED / emw.TURN_RATE


@pytest.fixture
def shown(monkeypatch):
    """The JSON that `radius_view` puts out, for deviations that are easily told apart."""
    outputs = []
    monkeypatch.setattr("IPython.display.display", lambda bundle, raw: outputs.append(bundle["text/html"]))
    radii = view.radius_slider(AT_7)
    deviations = (radii - 200)[:, None, None] * np.arange(1, 49).reshape(6, 8)
    view.radius_view(radii, deviations, 3, "instead")
    return radii, deviations, json.loads(BeautifulSoup(outputs[0], "html.parser").script.string)


def test_the_slider_has_the_radii_in_question(shown):
    radii, _, _ = shown
    assert np.all(np.diff(radii) > 0)
    assert {50.0, 180.0, 200.0, AT_7} <= set(radii)


def test_every_bound_has_its_mark(shown):
    radii, deviations, made = shown
    bounds, botma, _ = made["panels"][0]["curves"]
    for k in (0, 20, len(radii) - 1):
        for curve, part in ((bounds, slice(0, 4)), (botma, slice(4, 8))):
            x, y = curve["frames"]["of"][k]
            assert np.allclose(x, np.abs(deviations[k, :, part]).ravel(), rtol=5e-3)
            assert np.array_equal(np.round(y), np.repeat(np.arange(1, 7), 4)), "the row of its scenario"


def test_the_map_has_the_courses(shown):
    radii, _, made = shown
    line = made["panels"][1]["curves"][1]["frames"]["of"]
    for k in (0, 40, len(radii) - 1):
        course = emw.course_as_computed(1, radius=radii[k]).positions / 1e3
        nearest = [np.hypot(*(course - point).T).min() for point in np.transpose(line[k])]
        assert max(nearest) < 6e-3, "three digits of kilometres"
        assert np.allclose(np.transpose(line[k])[-1], course[-1], atol=6e-3)


def test_the_words_count():
    off = np.full((6, 8), -3.0)
    off[2, :5] = 0.4
    words = view.in_words(AT_7, off)
    assert "7.00 m/s" in words
    assert "5 of 48" in words
    assert "worst 3 units" in words
