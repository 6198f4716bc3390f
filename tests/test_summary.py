"""What is said of a fit: numbers against Monte Carlo, texts escaped, nothing where it would mislead."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

import tmalib as tma
from tmalib.seen import is_hardly_known, length_and_direction, seen_from
from tmalib.summary import at_reference, describe, with_sigma

SHIP = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
EAR = tma.Sensor(tma.Bearing(), times=np.arange(0, 600, 5.0), sigma=0.01, name="bow")
WATCH = tma.Scenario(SHIP, [EAR], reference_time=595)
TRUTH = tma.Target((2e3, 4e3), speed=6, heading=1.5)
FAR = tma.Target((12e3, 24e3), speed=6, heading=1.5)
ALONG = tma.Scenario(tma.Course((0, 0), 5, 0.0, [tma.Straight(600)]), [EAR], 595)


def fitted(watch=WATCH, target=TRUTH, seed=1):
    return tma.fit(watch, watch.with_target(target).simulate(runs=1, seed=seed)[0])


def texts(rows):
    return {row.name: row.text for row in rows}


@pytest.mark.parametrize("seed", range(6))
def test_sigmas_of_length_and_direction_against_monte_carlo(seed):
    """A spread of two per cent of the length; with 200 000 draws a sigma is known to 0.16 per cent."""
    rng = np.random.default_rng(seed)
    vector, root = rng.normal(size=2) * 1000, rng.normal(size=(2, 2))
    root *= 0.02 * np.hypot(*vector) / np.linalg.norm(root)
    drawn = vector + rng.standard_normal((200_000, 2)) @ root.T
    value, sigma = length_and_direction(vector, root @ root.T)
    away = np.arctan2(drawn[:, 0], drawn[:, 1]) - value[1]
    spread = [np.hypot(*drawn.T).std(), tma.wrap(away).std()]
    assert value == pytest.approx([np.hypot(*vector), tma.bearing(vector)])
    assert sigma == pytest.approx(spread, rel=0.015)


def test_what_is_seen_against_draws_of_the_whole_state():
    """With a hundredth of the covariance, so that what is neglected, of second order, is below 1e-3."""
    found = at_reference(fitted())
    found = replace(found, covariance=found.covariance / 100)
    here = SHIP.position_at(595.0)
    value, sigma = seen_from(found, here)
    drawn = np.random.default_rng(0).multivariate_normal(found.state, found.covariance, 200_000)
    x, y = (drawn[:, :2] - here).T
    parts = [np.hypot(x, y), np.arctan2(x, y), np.hypot(*drawn[:, 2:].T), np.arctan2(*drawn[:, 2:].T)]
    assert value == pytest.approx([np.mean(part) for part in parts], rel=0.005)
    assert sigma == pytest.approx([np.std(part) for part in parts], rel=0.01)


def test_a_batch_of_estimates_is_each_alone():
    found = tma.fit(WATCH, WATCH.with_target(TRUTH).simulate(runs=4, seed=2))
    lost = replace(found, status=np.where(np.arange(4) == 2, "ran away", found.status))
    value, sigma = seen_from(at_reference(lost), np.array([100.0, 50.0]))
    for k in (0, 1, 3):
        one = tma.Estimate(595.0, lost.scenario.coordinates, found.state[k], found.covariance[k])
        alone = seen_from(one, np.array([100.0, 50.0]))
        assert np.allclose([value[k], sigma[k]], alone, rtol=1e-12)
    assert np.isnan(sigma[2]).all()


def test_length_zero_has_no_direction():
    value, sigma = length_and_direction([0.0, 0.0], np.eye(2))
    assert np.isnan([value, sigma]).all()


@pytest.mark.parametrize(("number", "text"), [
    ((4512.3, 234.0, "m"), "4510 ± 230 m"),
    ((0.01234, 0.00099, ""), "0.01234 ± 0.00099"),
    ((-0.004, 0.2, "m/s"), "0.00 ± 0.20 m/s"),
    ((12345.0, 5e4, "m"), "12000 ± 50000 m"),
    ((359.996, 0.1, "degrees", 360), "0.00 ± 0.10 degrees"),
    ((-90.0, 1.0, "degrees", 360), "270.0 ± 1.0 degrees"),
    ((4.0, np.nan, "m"), "4 m"),
])  # fmt: skip
def test_numbers_with_their_sigmas(number, text):
    assert with_sigma(*number) == text


def test_a_good_fit():
    found = fitted()
    said = texts(tma.summarise(found))
    assert said["status"] == "converged"
    assert said["reference time"] == "595 s"
    numbers = {name: [float(n) for n in re.findall(r"-?\d+\.?\d*", said[name])[:2]] for name in said}
    for k, name in enumerate(("x", "y", "vx", "vy")):
        assert numbers[name][0] == pytest.approx(found.state[k], abs=0.05 * found.sigma[k])
        assert numbers[name][1] == pytest.approx(found.sigma[k], rel=0.05)
    assert numbers["criterion"] == [pytest.approx(found.cost, rel=1e-3), 116]
    assert f"p = {found.p_value:.2g}" in said["criterion"]
    (major,) = re.findall(r"semi-axes ([\d.]+) m", said["90 % ellipse"])
    largest = np.linalg.eigvalsh(found.covariance[:2, :2])[-1]
    assert float(major) == pytest.approx(np.sqrt(-2 * np.log(0.1) * largest), abs=0.1)
    assert "warning" not in said
    assert str(found).splitlines()[0].split() == ["status", "converged"]
    assert repr(found) == "Fit(1 run, 1 converged; x, y, vx, vy at 595 s)"


def test_no_state_without_convergence_and_no_ellipse_without_range():
    lost, far = fitted(ALONG), fitted(target=FAR)
    assert lost.status == "not observable"
    assert not {"x", "range", "90 % ellipse", "known least"} & texts(tma.summarise(lost)).keys()
    assert texts(tma.summarise(lost))["status"] == lost.explain()
    assert is_hardly_known(at_reference(far), WATCH)
    said = texts(tma.summarise(far))
    assert "90 % ellipse" not in said
    assert "confidence_region" in said["range"]
    assert said["course"].startswith("not known")


def test_a_wild_bearing_is_warned_of():
    angles = WATCH.with_target(TRUTH).simulate(runs=1, seed=1)[0]
    angles[[3, 4]] = np.nan
    angles[30] += 0.2
    found = tma.fit(WATCH, angles)
    rows = tma.summarise(found)
    assert [row.text for row in rows if row.name == "warning"] == tma.residual_tests(found).warnings()
    assert any("150 s" in row.text for row in rows if row.name == "warning")
    assert texts(rows)["measurements"] == "118 of 1 sensor, 2 missing"


def test_an_unknown_sigma_and_a_bias():
    """The sigma of bearings and their bias are told in degrees; ranges anchor the bias."""
    ears = tma.Sensor(tma.Biased(tma.Bearing(), "compass", 0.02), EAR.times, None, "bow")
    watch = tma.Scenario(SHIP, [ears, tma.Sensor(tma.Range(), EAR.times, 20.0)], 595)
    known = replace(watch, sensors=[replace(ears, sigma=0.01), watch.sensors[1]], target=TRUTH)
    found = tma.fit(watch, known.simulate(runs=1, seed=3)[0])
    assert found.converged
    said = texts(tma.summarise(found))
    sigma = float(said["sigma of bow"].split()[0])
    assert np.radians(sigma) == pytest.approx(0.01, rel=0.3)  # 120 residuals tell it to 6.5 per cent
    bias, its_sigma = (float(n) for n in re.findall(r"-?\d+\.\d+", said["compass"]))
    assert np.degrees(0.02) == pytest.approx(bias, abs=4 * its_sigma)
    assert "no test" in said["criterion"]


def test_many_runs_are_counted_by_status():
    angles = WATCH.with_target(TRUTH).simulate(runs=7, seed=1)
    angles[2:4, :] = np.nan
    rows = tma.summarise(tma.fit(WATCH, angles))
    assert rows[0] == ("5 of 7 runs", "converged")
    assert rows[1].name == "2 of 7 runs"
    assert rows[1].text.startswith("not observable: ")
    assert "manoeuvre" in rows[1].text


def test_a_platform_whose_track_ends_too_early():
    times = np.arange(0, 600, 5.0)
    ship = tma.SampledCourse(times, SHIP.position_at(times))
    watch = replace(WATCH, platform=ship, reference_time=900)
    said = texts(describe(at_reference(fitted(watch)), watch))
    assert "does not go to this time" in said["range"]
    assert "bearing" not in said
    assert "course" in said


class Cells(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.tags, self.texts = set(), []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)

    def handle_data(self, data):
        self.texts.append(data)


def test_html_has_the_same_rows_and_escapes_names():
    angles = WATCH.with_target(TRUTH).simulate(runs=1, seed=1)[0]
    angles[30] += 0.2
    named = replace(WATCH, sensors=[replace(EAR, name="<b>&\"'<script>")])
    found = tma.fit(named, angles)
    page = Cells(found._repr_html_())
    assert page.tags == {"table", "tr", "th", "td"}
    assert any("<b>&\"'<script>" in text for text in page.texts)
    assert [text for text in page.texts if text.strip()] == [t for row in tma.summarise(found) for t in row]
