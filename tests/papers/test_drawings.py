"""Drawings hide nothing: every run is in a histogram, every share is a circle, every end is marked."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from tmalib import figures
from tmalib.papers.conical_angles import theorem_drawing
from tmalib.papers.emw_acoustic import bound_drawing, drawing
from tmalib.papers.robustness import drawing as of_tracks


@pytest.fixture(autouse=True)
def no_figure_is_left():
    yield
    plt.close("all")


def test_every_run_is_in_the_histogram_or_counted_beside_it():
    rng = np.random.default_rng(1)
    errors = {"mle": rng.normal(size=(500, 3)), "ekf": rng.normal(-6, 2, size=(500, 3))}
    errors["ekf"][:3, 1] = -31.7, 18.2, -0.01
    for k, ax in enumerate(drawing.histograms(1, errors).axes):
        steps = {patch.get_label(): patch.get_data() for patch in ax.patches}
        said = [line.split(": ") for text in ax.texts for line in text.get_text().split("\n") if ": " in line]
        for name in errors:
            values, edges, _ = steps[name.upper()]
            beyond = sum(int(runs) for label, runs in said if label == name.upper())
            assert np.sum(values * np.diff(edges)) + beyond / 500 == pytest.approx(1)
            inside = errors[name][(errors[name][:, k] >= edges[0]) & (errors[name][:, k] <= edges[-1]), k]
            assert len(inside) == 500 - beyond >= 480
            mean = np.average((edges[:-1] + edges[1:]) / 2, weights=values)
            assert mean == pytest.approx(inside.mean(), abs=0.125)
            left, right = ax.get_xlim()
            assert left <= inside.min() <= inside.max() <= right


def test_a_circle_is_filled_as_far_as_runs_find_the_minimum():
    ranges = np.array([1e3, 1e4, 6e4])
    found = {k: {"one, way": np.arange(300).reshape(3, 100) < 50 * k} for k in range(1, 7)}
    ends, starts = dict.fromkeys(found, (9e3, 5e3)), dict.fromkeys(found, 1e4)
    figure = bound_drawing.shares_by_start(ranges, found, ends, starts, assumed=(6,))
    for k, ax in zip(found, figure.axes, strict=False):
        (circles,) = ax.collections
        np.testing.assert_allclose(circles.get_offsets()[:, 0], [1, 10, 60])
        np.testing.assert_allclose(circles.get_array(), np.clip([0.5 * k, 0.5 * k - 1, 0.5 * k - 2], 0, 1))
        assert ax.lines[0].get_linestyle() == (":" if k == 6 else "-")


def test_the_prior_of_each_scenario_is_drawn_in_its_panel():
    x, found = np.array([1.0, 2.0, 4.0]), np.arange(36.0).reshape(6, 3, 2) + 1
    axes = bound_drawing.prior_sweeps((x, found, 2.0), (x, found, 2.0)).axes
    drawn = {line.get_label(): line.get_ydata() for ax in axes[:4] for line in ax.lines}
    for k in range(6):
        np.testing.assert_allclose(drawn[f"scenario {k + 1}"], found[k, :, 0])
    shares = [line.get_ydata() for line in axes[4].lines if len(line.get_ydata()) == 3]
    np.testing.assert_allclose(sorted(s[0] for s in shares), 100 * found[:, 0, 1])


def test_all_tracks_are_on_the_map_and_their_ends_are_circled():
    tracks = {
        "target": (np.array([[0.0, 6e3], [500.0, 600.0]]), "target", "-"),
        "BLSE": (np.array([[-2e3, 5e3], [3e3, 2e3]]), "mle", "--"),
    }
    ax, small = of_tracks.map_and_window(tracks).axes
    assert (small.get_xlim(), small.get_ylim()) == of_tracks.WINDOW
    circles = [line.get_xydata()[0] for line in ax.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(circles, [[0.5, 0.6], [3, 2]])
    for positions, *_ in tracks.values():
        for (low, high), values in zip((ax.get_xlim(), ax.get_ylim()), positions.T / 1e3, strict=True):
            assert low <= values.min() <= values.max() <= high


def test_rays_differ_by_line_and_end_where_the_target_is():
    _, ax = plt.subplots()
    theorem_drawing.elevations(ax, {"direct": -100.0, "bottom bounce": 7700.0}, 200.0, 100.0, 4000.0, 8600.0)
    rays = [line for line in ax.lines if len(line.get_xdata()) == 1001]
    assert len({line.get_linestyle() for line in rays}) == 2
    np.testing.assert_allclose([line.get_ydata()[-1] for line in rays], 100.0)
    assert {line.get_color() for line in rays} == {figures.colour("light"), figures.colour("sound")}
