"""The readings of the chapter on what makes a paper reproducible."""

import re

import numpy as np
import pytest
from scipy.stats import chi2

import tmalib as tma
from tmalib.beyond import kinds_of_errata, reproducible
from tmalib.judging import read_papers
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.emw_acoustic import scenarios as emw

OMISSIONS = {now.name: now for now in reproducible.omissions()}
ERRATA = {name: entry for paper in read_papers().values() for name, entry in paper.errata.items()}


def test_every_erratum_is_sorted_once():
    named = " ".join(kinds_of_errata.KINDS.values()).split()
    assert sorted(named) == sorted(ERRATA)
    settings = kinds_of_errata.KINDS[kinds_of_errata.SETTING].split()
    assert set(kinds_of_errata.BY_RUNS_ONLY) <= set(settings)
    assert {now.erratum for now in OMISSIONS.values()} <= set(settings) - set(kinds_of_errata.BY_RUNS_ONLY)


@pytest.mark.parametrize("name", OMISSIONS)
def test_a_reading_gives_a_value_for_each_printed_number(name):
    now = OMISSIONS[name]
    assert now.used in now.readings
    assert all(row.kind == "deterministic" for row in now.printed)
    for values in now.readings.values():
        assert values.shape == (len(now.printed),)
        assert np.isfinite(values).all()
    assert now.agreeing()[now.used] == max(now.agreeing().values())


def test_the_readings_in_use_are_those_of_the_scenarios():
    course = OMISSIONS["observer's course"]
    for number in (1, 6):
        ours = tma.crlb_sigma(emw.scenario(number))
        np.testing.assert_allclose(course.readings[course.used][8 * (number - 1) :][:4], ours, rtol=1e-12)
    turn = OMISSIONS["turn and its heading"]
    np.testing.assert_allclose(
        turn.readings[turn.used][:5], tma.crlb_sigma(conical.section_4_2()), rtol=1e-12
    )
    samples = OMISSIONS["number of samples"]
    np.testing.assert_allclose(
        samples.readings[samples.used][:4], tma.crlb_sigma(conical.section_3_2()), rtol=1e-12
    )


def test_the_course_continued_at_seven_metres_a_second_is_the_printed_one():
    now = OMISSIONS["observer's course"]
    scenario = emw.scenario(1)
    printed = tma.Scenario(
        emw.course_as_printed(1), scenario.sensors, scenario.reference_time, scenario.target
    )
    ours = now.readings["7 m/s, 133.3°, continued"][:4]
    np.testing.assert_allclose(ours, tma.crlb_sigma(printed), rtol=1e-2)


def test_a_wrong_sign_is_wrong_and_gives_the_bounds_of_exchanged_depths():
    now = OMISSIONS["whose depth is whose"]
    assert sorted(now.twins) == ["exchanged", "wrong sign"]
    scenario = conical.section_5_2(2000.0)
    model = reproducible.WrongSign(tma.DIRECT, 200.0, 2000.0)
    times = scenario.sensors[0].times
    assert tma.check_model(model, scenario.platform, times, scenario.state) > 1


def test_digits_by_hand():
    """1234 against 1260: told by two units of the third digit, not by the second."""
    now = reproducible.Omission(
        "toy", read_papers()["conical-angles"], "", (("Table 1", "xT", "std_crlb"),) * 2,
        {"right": np.array([1234.0, 0.05]), "wrong": np.array([1260.0, 0.5])}, "right",
    )  # fmt: skip
    assert now.digits_needed().tolist() == [3, 1]
    assert now.distances()["wrong"] == pytest.approx(9)
    assert [now.fitting_if_rounded(k) for k in (1, 2, 3)] == [1, 1, 1]
    assert now.twins == ["right"]


def test_runs_see_what_they_need():
    assert reproducible.seen_by(reproducible.runs_needed(0.02)) == pytest.approx(0.02)
    wide, usual = 1 + reproducible.seen_by(500), 1.96 / np.sqrt(2 * 500)
    limits = 499 * ((1 + np.array([-usual, usual])) / wide) ** 2  # of chi-square: exact, Gaussian errors
    seen = chi2.cdf(limits[0], 499) + chi2.sf(limits[1], 499)
    assert seen == pytest.approx(0.8, abs=0.05)


def test_the_checklist_has_at_most_twelve_lines_each_with_its_evidence():
    from pathlib import Path

    import nbformat

    cells = nbformat.read(Path(__file__).parents[2] / "notebooks/beyond/reproducible.ipynb", 4).cells
    (page,) = [cell.source for cell in cells if "## A checklist" in cell.source]
    lines = re.findall(r"(?m)^\| \d+ \|.*$", page)
    assert 8 <= len(lines) <= 12
    assert all(re.search(r"\{(num)?ref\}", line) for line in lines)
    cited = set(re.findall(r"\{ref\}`([a-z]+-\d+[a-z]?)`", "\n".join(lines)))
    assert cited <= set(ERRATA)
    settings = set(kinds_of_errata.KINDS[kinds_of_errata.SETTING].split())
    assert settings - cited <= {"conical-12", "conical-18"}, "and none of the omissions is forgotten"


def test_the_radius_left_open_is_where_the_bounds_round_alike():
    """At the ends, computed without interpolation, a bound is a unit off; within, none; outside, one more."""

    def off(radius, digits):
        course = emw.course_as_computed(1, radius=radius)
        scenarios = [emw.scenario(1), emw.botma_scenario(emw.scenario(1))]
        bounds, best = (
            np.concatenate(
                [tma.crlb_sigma(tma.Scenario(path, s.sensors, s.reference_time, s.target)) for s in scenarios]
            )
            for path in (course, emw.course_as_computed(1))
        )
        unit = 10.0 ** (np.floor(np.log10(best)) - digits + 1)
        return np.max(np.abs(bounds - unit * np.round(best / unit)) / unit)

    for digits in (2, 4):
        low, high = reproducible.radii_left_open(digits)
        assert low < emw.TURN_RADIUS < high
        for end, away in ((low, -1), (high, 1)):
            assert off(end, digits) == pytest.approx(1, abs=0.03)
            assert off(end + away * 0.1 * (high - low), digits) > 1.05
        assert off((low + high) / 2, digits) < 1
