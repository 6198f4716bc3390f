"""Plausible scenarios: that they have what is printed, and lie within what the manifest says."""

import numpy as np
import pytest

from tmalib.papers.robustness import measures, plausible
from tmalib.papers.robustness import phrases as text
from tmalib.papers.robustness import scenarios as paper
from tmalib.papers.robustness.paper import PAPER


def seed(k):
    return np.random.SeedSequence(11, spawn_key=(k,))


@pytest.fixture(scope="module")
def drawn():
    return [(form, *plausible.draw(form, seed(k))) for form in plausible.FORMS for k in range(8)]


def test_every_scenario_has_what_is_printed(drawn):
    times = np.linspace(0, paper.DURATION, 2001)
    for _, scenario, _ in drawn:
        pair = scenario.geometry.platform, scenario.geometry.target
        own, target = (course.position_at(times) for course in pair)
        step = times[1]
        for track, speed in ((own, 250.0), (target, 270.0)):
            assert np.hypot(*np.diff(track, axis=0).T) / step == pytest.approx(speed, rel=1e-3)
        acceleration = np.hypot(*np.diff(own, 2, axis=0).T) / step**2
        assert acceleration.max() == pytest.approx(50.0, rel=1e-3)
        assert np.hypot(*np.diff(target, 2, axis=0).T) / step**2 == pytest.approx(7.0, rel=1e-2)
        assert np.hypot(*(own - target).T).min() > 0.99e3
        assert np.all(np.ptp(np.concatenate([own, target]), axis=0) < [25.1e3, 14.1e3])
        assert measures.final_sigma(scenario.geometry) <= 0.1


def test_settings_are_within_the_manifest(drawn):
    for name in ("beta", "prior_range", "amplitude", "period"):
        values = np.array([getattr(scenario, name) for _, scenario, _ in drawn])
        low, high = PAPER.plausible[name]
        assert low <= values.min() < values.max() <= high
        assert np.ptp(np.log(values)) > 0.5 * np.log(high / low), "and spread over it"


def turns(course):
    """Angles between successive straight legs, or of the parts of a weave, in degrees."""
    return np.array([np.degrees(leg.rate * leg.duration) for leg in course.legs if leg.rate])


def test_forms_differ_in_their_turns(drawn):
    """A dogleg turns once; a weave to the left and right by half its period, a slow one for longer."""
    for form, scenario, _ in drawn:
        found = turns(scenario.geometry.platform)
        if form == "dogleg":
            (once,) = found
            assert 20 <= abs(once) <= 90
        elif form == "legs and turns":
            assert np.all((np.abs(found) >= 20) & (np.abs(found) <= 90))
        else:
            half = np.degrees(0.2) / 2 * np.array(PAPER.plausible[form.replace(" ", "_")])
            assert np.all(found[1:] * found[:-1] < 0)
            assert half[0] - 1e-9 <= np.abs(found).max() <= half[1] + 1e-9
    with pytest.raises(ValueError, match="form must be one of"):
        plausible.platform("spiral", np.random.default_rng(1))


def test_all_phrases_are_measured_and_the_same_again():
    same = seed(0)
    found = plausible.measure_all(same, 2)
    again = plausible.measure_all(same, 3)
    assert set(text.PHRASES) < set(found)
    assert set(found) - set(text.PHRASES) == {
        plausible.CONTROL, plausible.PREDICTED, plausible.ACTUAL,
        "form", "families, circular target", "families, worst perturbation",
    }  # fmt: skip
    for name, values in found.items():
        np.testing.assert_array_equal(values, again[name][:2])
    assert again["form"].tolist() == [0, 1, 2]
