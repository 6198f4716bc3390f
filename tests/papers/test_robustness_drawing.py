"""Drawings of robustness: that every value is drawn, once, and on its side of the limit."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.stats import binom

from tmalib import figures
from tmalib.judging import Phrase
from tmalib.papers.robustness import periodic_drawing, phrase_drawing


@pytest.fixture(autouse=True)
def no_figure_is_left():
    yield
    plt.close("all")


def points(lines, colour):
    """Horizontal places of all markers of a colour, sorted."""
    return np.sort(np.concatenate([line.get_xdata() for line in lines if line.get_color() == colour]))


def test_each_scenario_is_drawn_once_and_right_of_the_line_where_the_phrase_holds():
    phrases = {
        "bad": Phrase("", "after", at_least=0.1),
        "good": Phrase("", "after", at_most=0.1),
    }
    values = np.array([0.0, 0.001, 0.05, 0.2, 3.0, 7.0, np.inf, np.nan])
    fig = phrase_drawing.in_scenarios(phrases, {"bad": 0.2, "good": 0.2}, dict.fromkeys(phrases, values))
    (ax,) = fig.axes
    low, high = phrase_drawing.MARGINS
    green, orange = (points(ax.lines, figures.colour(entity)) for entity in ("mle", "target"))
    assert len(green) + len(orange) == 2 * len(values)
    # bad holds for 0.2, 3, 7 and infinity, good for 0, 0.001 and 0.05; what is not a number holds for neither
    np.testing.assert_allclose(green, [2, 2, 30, high, high, high, high])
    np.testing.assert_allclose(orange, [low] * 7 + [0.5, 0.5])
    triangles = [line for line in ax.lines if line.get_marker() in "<>"]
    assert np.all(np.isin(np.concatenate([line.get_xdata() for line in triangles]), [low, high]))
    diamonds = [line.get_xdata()[0] for line in ax.lines if line.get_marker() == "D"]
    np.testing.assert_allclose(diamonds, [2, 0.5])
    assert [text.get_text() for text in ax.texts[:2]] == ["4 of 8", "3 of 8"]


def test_shares_are_drawn_with_their_intervals_and_an_empty_one_not_at_all():
    overall = {"a": (30, 40), "b": (0, 40)}
    by_form = {"weave": {"a": (20, 20), "b": (0, 0)}, "dogleg": {"a": (10, 20), "b": (0, 20)}}
    (ax,) = phrase_drawing.shares_by_form(overall, by_form).axes
    drawn = {line.get_label(): line.get_xdata().tolist() for line in ax.lines}
    assert drawn == {"weave": [1.0], "dogleg": [0.5, 0.0], "all": [0.75, 0.0]}
    low, high = ax.collections[-1].get_segments()[0][:, 0]
    # Clopper and Pearson: the share at which so many, or more (fewer), have a chance of 2.5 per cent
    assert binom.sf(29, 40, low) == pytest.approx(0.025, rel=1e-6)
    assert binom.cdf(30, 40, high) == pytest.approx(0.025, rel=1e-6)


def test_the_share_against_the_limit_is_that_of_the_values():
    phrases = {
        "bad": Phrase("", "after", at_least=0.1),
        "good": Phrase("", "after", at_most=0.1),
    }
    values = np.array([0.05, 0.09, 0.11, np.inf])
    fig = phrase_drawing.shares_against_limits(phrases, dict.fromkeys(phrases, values), ["bad", "good"])
    for ax, expected in zip(fig.axes, (0.5, 0.5), strict=True):
        limits, shares = ax.lines[0].get_data()
        assert shares[np.argmin(np.abs(limits - 0.1))] == expected
        assert shares[limits < 0.04].tolist() == [1.0 if ax is fig.axes[0] else 0.0] * np.sum(limits < 0.04)
        assert shares[limits > 0.12].tolist() == [0.25 if ax is fig.axes[0] else 0.75] * np.sum(limits > 0.12)


def test_a_period_without_an_estimate_at_some_phase_is_a_triangle():
    periods, errors = np.array([1.0, 7.0]), np.array([[10.0, 30.0], [900.0, 100.0]])
    settled = np.array([[True, True], [False, True]])
    _, ax = plt.subplots()
    periodic_drawing.fitted_errors(ax, periods, errors, settled, 10.0, "o", filled=True)
    dots, triangles = (line.get_xydata() for line in ax.lines)
    np.testing.assert_allclose(dots, [[1, 3]])
    np.testing.assert_allclose(triangles, [[7, periodic_drawing.BEYOND]])
