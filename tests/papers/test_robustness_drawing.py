"""Drawings of robustness: that every value is drawn, once, and on its side of the limit."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from tmalib import figures
from tmalib.papers.robustness import drawing, periodic_drawing
from tmalib.papers.robustness.phrases import Phrase


@pytest.fixture(autouse=True)
def no_figure_is_left():
    yield
    plt.close("all")


def points(lines, colour):
    """Horizontal places of all markers of a colour, sorted."""
    return np.sort(np.concatenate([line.get_xdata() for line in lines if line.get_color() == colour]))


def test_each_geometry_is_drawn_once_and_right_of_the_line_where_the_phrase_holds():
    phrases = {"bad": Phrase("", "", at_least=0.1), "good": Phrase("", "", at_most=0.1)}
    values = np.array([0.0, 0.001, 0.05, 0.2, 3.0, 7.0, np.inf, np.nan])
    fig = drawing.phrases_in_geometries(phrases, {"bad": 0.2, "good": 0.2}, dict.fromkeys(phrases, values))
    (ax,) = fig.axes
    low, high = drawing.MARGINS
    green, orange = (points(ax.lines, figures.colour(entity)) for entity in ("mle", "target"))
    assert len(green) + len(orange) == 2 * len(values)
    # bad holds for 0.2, 3, 7 and infinity, good for 0, 0.001 and 0.05; what is not a number holds for neither
    np.testing.assert_allclose(green, [2, 2, 30, high, high, high, high])
    np.testing.assert_allclose(orange, [low] * 7 + [0.5, 0.5])
    triangles = [line for line in ax.lines if line.get_marker() in "<>"]
    assert np.all(np.isin(np.concatenate([line.get_xdata() for line in triangles]), [low, high]))
    diamonds = [line.get_xdata()[0] for line in ax.lines if line.get_marker() == "D"]
    np.testing.assert_allclose(diamonds, [2, 0.5])
    assert [text.get_text() for text in ax.texts[:2]] == ["4", "3"]


def test_a_period_without_an_estimate_at_some_phase_is_a_triangle():
    periods, errors = np.array([1.0, 7.0]), np.array([[10.0, 30.0], [900.0, 100.0]])
    settled = np.array([[True, True], [False, True]])
    _, ax = plt.subplots()
    periodic_drawing.fitted_errors(ax, periods, errors, settled, 10.0, "o", filled=True)
    dots, triangles = (line.get_xydata() for line in ax.lines)
    np.testing.assert_allclose(dots, [[1, 3]])
    np.testing.assert_allclose(triangles, [[7, periodic_drawing.BEYOND]])
