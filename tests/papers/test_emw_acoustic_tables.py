"""What the chapters of emw-acoustic compute from a table and along the line of sight."""

from functools import partial
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import tmalib as tma
from tmalib import judging
from tmalib.papers.emw_acoustic import drawing, experiments, line_of_sight, tables
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.papers.emw_acoustic.paper import PAPER


@pytest.mark.parametrize("number", [1, 4])
def test_sigma_is_the_bound_of_the_displacement_along_the_axis(number):
    for shape, time in zip(experiments.ellipses(number), emw.instants(number), strict=True):
        axis = np.array([np.sin(shape.heading), np.cos(shape.heading)])
        covariance = tma.crlb(emw.scenario(number).until(time))[:2, :2]
        assert line_of_sight.sigma(shape) == pytest.approx(np.sqrt(axis @ covariance @ axis), rel=1e-6)


@pytest.mark.parametrize("number", [1, 4])
def test_errors_at_the_ends_of_the_ellipses(number):
    """The ends of the long axis are the quantile of chi-square away, the far one outwards; those of the
    short axis not at all."""
    ends = np.stack([shape.boundary(5)[:4] for shape in experiments.ellipses(number)], axis=1)
    errors = line_of_sight.errors(number, {"mle": ends})["mle"]
    observer = emw.scenario(number).platform.position_at(emw.instants(number))
    distance = np.hypot(*np.moveaxis(ends - observer, -1, 0))
    outwards = np.sign(distance[0] - distance[2])
    quantile = np.sqrt(2 * np.log(10))
    expected = np.outer([quantile, 0, -quantile, 0], outwards)
    np.testing.assert_allclose(errors, expected, atol=1e-9)


def test_printed_columns():
    """As the paper prints them."""
    rows = tables.printed_rows(1, "std_crlb")
    assert [row.printed for row in rows] == ["342.38", "161.52", "0.2985", "0.5463"]
    np.testing.assert_array_equal(tables.printed_values(1, "true"), [17998, 12808, 2.5, -4.33])
    off = tables.units_off(1, "std_crlb", [342.40, 161.51, 0.2985, 0.5473])
    np.testing.assert_allclose(off, [2, 1, 0, 10], atol=1e-6)


def test_least_probability_leaves_out_what_does_not_agree():
    probability = np.array([0.5, 0.001, 0.004, 0.1, 0.2])
    questioned, at_limit = (np.array([0, k, 1 - k, 0, 0], dtype=bool) for k in (1, 0))
    found = SimpleNamespace(probability=probability, questioned=questioned, at_limit=at_limit)
    assert tables.least_probability(judging.Verdicts((), found)) == 0.1


def test_rare_runs_come_in_with_their_share():
    usual = {"mle": np.zeros((1001, 4)), "ekf": np.ones((1001, 4))}
    usual["ekf"][3] = -6.5  # one of the kind, which says nothing of how often it is
    rare = tables.RareRuns(np.full((2, 4), 5.0), np.full((2, 4), 7.0), 1_000_000, beyond=6.0)
    mle, ekf, weights = rare.among(usual)
    assert mle.shape == ekf.shape == (1002, 4)
    assert weights.sum() == pytest.approx(1)
    assert weights[-2:].sum() == pytest.approx(2e-6)
    assert weights @ ekf[:, 0] == pytest.approx(1 + 6 * 2e-6)


def test_judged_variants_name_their_runs():
    task = partial(experiments.filter_alone, number=2, gradient="tables", first_again=False)
    runs = tma.monte_carlo(task, 100, PAPER.stream("emw/2"))
    judged = tables.judge_filter(2, runs["ekf"], made_from=[runs])
    assert {claim.column for claim in judged} == {"bias_ekf", "std_ekf"}
    assert all(claim.sources == (runs.source,) for claim in judged)


def test_places_by_component():
    """Four neighbouring places a scenario, and a gap before the next."""
    figure, ax = plt.subplots()
    places = drawing.by_component(ax, [2, 6])
    np.testing.assert_array_equal(places, [[0, 1, 2, 3], [5, 6, 7, 8]])
    assert [text.get_text() for text in ax.texts] == ["scenario 2", "scenario 6"]
    assert [label.get_text() for label in ax.get_xticklabels()] == 2 * list(drawing.COMPONENTS)
    plt.close(figure)


def judged_as_wished(**changed):
    """Table II as it should be, the claims on (row, column) changed."""
    words = {"true": judging.REPRODUCED}
    claims = []
    for (table, row, column), printed in PAPER.ledger.items():
        if table == "Table II":
            found = dict(ours=printed.value, verdict=words.get(column, judging.CORRECTED))
            found |= changed.get(f"{row}_{column}", {})
            claims.append(judging.Claim(**vars(printed), se=0.0, erratum="", note="", **found))
    return judging.Verdicts(tuple(claims), 3.0)


def test_shortcomings_of_a_table():
    good = {"mle_converged": np.ones(5, dtype=bool), "ekf": np.zeros((5, 4))}
    assert tables.shortcomings(2, judged_as_wished(), good) == []
    rejected = {"verdict": judging.NOT_REPRODUCED}
    assert tables.shortcomings(2, judged_as_wished(xT_std_ekf=rejected), good) == []
    for row, column in (("xT", "true"), ("yT", "bias_mle"), ("vxT", "std_mle"), ("vyT", "std_crlb")):
        (found,) = tables.shortcomings(2, judged_as_wished(**{f"{row}_{column}": rejected}), good)
        assert f"{row} | {column}" in found
    (found,) = tables.shortcomings(2, judged_as_wished(xT_std_crlb={"ours": 111.64}), good)
    assert found == "std_crlb is 3.0 units off"
    lost = {"mle_converged": np.array([True, False]), "ekf": np.array([[0.0] * 4, [np.nan, 0, 0, 0]])}
    assert tables.shortcomings(2, judged_as_wished(), lost) == [
        "1 fits have not converged",
        "1 runs of the filter are not finite",
    ]
    short = judging.Verdicts(judged_as_wished().claims[:-1], 3.0)
    with pytest.raises(ValueError, match="no claim"):
        tables.shortcomings(2, short, good)


@pytest.mark.parametrize("number", [1, 4])
def test_each_bound_is_that_of_its_column(number):
    errors = np.random.default_rng(1).standard_normal((500, 4))
    ours = tables.ours_of_scenario(number, {"mle": errors, "ekf": errors})
    for column in ("std_crlb", "std_crlb_botma"):
        values = [ours[row, column].value for row in tables.ROWS]
        assert tables.units_off(number, column, values).max() <= 1
