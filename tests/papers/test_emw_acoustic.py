"""The scenarios of emw-acoustic against the printed tables."""

from dataclasses import replace

import numpy as np
import pytest

import tmalib as tma
from tmalib import judging
from tmalib.papers.emw_acoustic import experiments, tables
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.papers.emw_acoustic.paper import PAPER

NUMBERS = range(1, 7)


def printed(number, column):
    return [PAPER.printed(tables.TABLES[number], row, column) for row in tables.ROWS]


@pytest.mark.parametrize("number", NUMBERS)
def test_bounds_agree_with_the_tables(number):
    scenario = emw.scenario(number)
    for column, bound in (
        ("std_crlb", tma.crlb_sigma(scenario)),
        ("std_crlb_botma", tma.crlb_sigma(emw.botma_scenario(scenario))),
        ("true", scenario.state),
    ):
        for row, ours in zip(printed(number, column), bound, strict=True):
            assert abs(ours - row.value) <= row.last_digit, (row.key, ours)


def test_every_digit_of_table_i():
    for row, ours in zip(printed(1, "std_crlb"), tma.crlb_sigma(emw.scenario(1)), strict=True):
        assert judging.same_digits(ours, row.printed) == row.printed


@pytest.mark.parametrize("change", [{"radius": 199.0}, {"radius": 201.0}, {"speed": 7.01}])
def test_the_recovered_path_is_sharp(change):
    """A metre of radius or a centimetre a second already spoils the digits."""
    scenario = replace(emw.scenario(1), platform=emw.course_as_computed(1, **change))
    misses = [
        abs(ours - row.value) > row.last_digit
        for row, ours in zip(printed(1, "std_crlb"), tma.crlb_sigma(scenario), strict=True)
    ]
    assert any(misses)


@pytest.mark.parametrize("number", NUMBERS)
def test_the_path_as_printed_gives_other_bounds(number):
    bound = tma.crlb_sigma(emw.scenario(number, path="printed"))
    ratio = bound / [row.value for row in printed(number, "std_crlb")]
    assert np.all(np.abs(ratio - 1) > 0.02)


@pytest.mark.parametrize("number", NUMBERS)
def test_samples_repeat_at_the_start_of_a_leg(number):
    course = emw.course_as_computed(number)
    still = np.flatnonzero(np.hypot(*np.diff(course.positions, axis=0).T) < 1e-9)
    legs = {1: 3, 2: 3, 3: 3, 4: 3, 5: 5, 6: 5}[number]
    assert len(still) == legs - 1
    assert course.times[0] == 0
    assert course.times[-1] == emw.scenario(number).reference_time


def test_experiment_loses_no_run():
    results = experiments.both_estimators(PAPER.stream("emw/2").chunk(), 100, 2)
    assert results["mle"].shape == results["ekf"].shape == (100, 4)
    assert results["mle_converged"].all()
    assert all(np.all(np.isfinite(values)) for values in results.values())
    same = experiments.filter_alone(PAPER.stream("emw/2").chunk(), 100, 2, "tables", False)
    np.testing.assert_array_equal(same["ekf"], results["ekf"])


@pytest.mark.parametrize("number", [2, 3])
def test_consistency_of_the_mle(number):
    """The MLE is consistent at the end of a scenario; the last look is the table's experiment."""
    found = experiments.consistency_of_both(PAPER.stream(f"emw/{number}").chunk(), 300, number)
    assert found["mle_nees"].shape == (300, 12)
    low, high = tma.nees_limits(4, 300, 0.999)
    assert low < found["mle_nees"][:, -1].mean() < high
    assert 0.84 < found["mle_inside"][:, -1].mean() < 0.96
    same = experiments.both_estimators(PAPER.stream(f"emw/{number}").chunk(), 300, number)
    np.testing.assert_allclose(found["ekf_nees"][:, -1], same["ekf_nees"], rtol=1e-9)
    np.testing.assert_allclose(found["mle_nees"][:, -1], same["mle_nees"], rtol=1e-6)


def test_ellipses_shrink_along_the_scenario():
    areas = [shape.area for shape in experiments.ellipses(1)]
    assert areas[0] > areas[1] > areas[2]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: emw.scenario(7), "scenario must be one of"),
        (lambda: emw.scenario(1, path="guessed"), "path must be"),
        (lambda: emw.filter_scenario(emw.scenario(1), "wrong"), "gradient must be"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()
