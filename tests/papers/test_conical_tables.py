"""Signs, roots and errata in the tables of conical-angles."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.judging import NOT_REPRODUCED
from tmalib.papers.conical_angles import tables
from tmalib.papers.conical_angles.paper import PAPER

MADE_FROM = [tma.Stream("a test of signs")]


def test_the_bias_of_the_paper_is_truth_minus_estimate():
    truth, estimates = 10.0, np.array([[11.0], [12.0], [14.0], [15.0]])
    found = tables.signed_bias_and_std("xT", 0, estimates - truth, "e-1", "e-2")
    assert found["xT", "bias"].value == truth - estimates.mean()
    assert found["xT", "bias"].erratum == "e-1, e-2"
    assert found["xT", "std_sample"].value == pytest.approx(np.std(estimates, ddof=1))
    assert found["xT", "std_sample"].erratum == "e-1"
    turned = tables.signed_bias_and_std("xT", 0, estimates - truth, sign=-1)
    assert turned["xT", "bias"].value == estimates.mean() - truth


@pytest.mark.parametrize(("table", "rows"), [("Table 3", 5), ("Table 4", 4)])
def test_the_bound_is_printed_as_standard_deviations(table, rows):
    """Judged with the squares of what is printed the bound agrees; with what is printed it does not."""
    names = tables.ROWS_WITH_DEPTH if rows == 5 else tables.ROWS
    sigma = np.array([PAPER.printed(table, row, "std_crlb").value for row in names])
    errors = np.random.default_rng(1).standard_normal((tables.PRINTED_RUNS, rows)) * sigma
    right = tables.judge_turning(table, errors, np.diag(sigma**2), MADE_FROM)
    wrong = tables.judge_turning(table, errors, np.diag(sigma), MADE_FROM)
    for i, row in enumerate(names):
        assert right.of(row, "std_crlb").ours == pytest.approx(sigma[i])
        assert right.of(row, "std_crlb").verdict != NOT_REPRODUCED
        assert wrong.of(row, "std_crlb").verdict == NOT_REPRODUCED or sigma[i] == 1
        assert right.of(row, "bias").ours == pytest.approx(-errors[:, i].mean())
    assert tables.bounds_agree(table, sigma).all()
    assert not tables.bounds_agree(table, 1.1 * sigma).any()
