"""The figure of one run: what is drawn where, and what is left out."""

from dataclasses import replace
from datetime import UTC, datetime

import matplotlib.pyplot as plt
import numpy as np
import pytest

import tmalib as tma
from tmalib.situation import situation

SHIP = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Straight(300, heading=np.pi / 2)])
EARS = [
    tma.Sensor(tma.Bearing(), np.arange(0, 600, 5.0), 0.01, "_bow"),
    tma.Sensor(tma.DelayedBearing(), np.arange(0, 600, 10.0), 0.02, "$a$b$"),  # no mathematics
]
NEAR = tma.Target((2e3, 4e3), speed=6, heading=1.5)


def fitted(target=NEAR, ship=SHIP, sensors=EARS, spoil=(), start=None):
    watch = tma.Scenario(ship, sensors, 595)
    angles = watch.with_target(target).simulate(runs=1, seed=1)[0]
    for columns, error in spoil:
        angles[columns] += error
    return tma.fit(watch, angles, start)


def labelled(ax):
    """Lines and patches by label."""
    return dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))


@pytest.fixture
def panels():
    """The two panels of the situation of a fit, drawn."""

    def panels(fit, **settings):
        figure = situation(fit, **settings)
        figure.canvas.draw()
        return figure.axes

    yield panels
    plt.close("all")


def test_a_situation_shows_where_the_target_is(panels):
    found = fitted()
    left, right = panels(found)
    drawn = labelled(left)
    np.testing.assert_allclose(drawn["at the reference time"].get_xydata()[0], found.state[:2] / 1e3)
    np.testing.assert_allclose(drawn["own ship"].get_xydata()[[0, -1]], [[0, 0], [1.475, 1.5]], atol=1e-9)
    start, end = drawn["target, estimated"].get_xydata()[[0, -1]] * 1e3
    np.testing.assert_allclose(end - start, 595 * found.state[2:])
    ring = drawn["90 % ellipse"].get_path().vertices * 1e3 - found.state[:2]
    level = np.vecdot(ring, np.linalg.solve(found.covariance[:2, :2], ring.T).T)
    np.testing.assert_allclose(level[:-1], -2 * np.log(0.1))
    assert left.get_aspect() == 1
    assert right.get_ylabel() == "Residual (standard deviations)"
    assert "range 4" in left.figure.get_suptitle()


def test_bearing_lines_go_where_they_were_measured(panels):
    found = fitted()
    lines = [line.get_xydata() for line in panels(found)[0].lines if line.get_alpha() == 0.7]
    assert 20 <= len(lines) <= 30
    directions = [np.arctan2(*(end - start)) for start, end in lines]
    gaps = np.abs(np.subtract.outer(directions, found.measured)).min(axis=1)
    assert gaps.max() < 1e-9
    for start, _ in lines:
        assert np.hypot(*(SHIP.position_at(found.scenario.times) / 1e3 - start).T).min() < 1e-9


def test_residuals_are_stacked_dots(panels):
    found = fitted(spoil=[(20, np.nan), (30, 0.05), (150, -0.5)])
    _, right = panels(found)
    drawn = labelled(right)
    bow = drawn[" _bow"].get_xydata()
    assert drawn[r"\$a\$b\$"].get_color() != drawn[" _bow"].get_color()
    np.testing.assert_array_equal(bow[:, 0], EARS[0].times)
    assert np.isnan(bow[20, 1])
    rest = np.delete(np.arange(120), 20)
    np.testing.assert_allclose(bow[rest, 1], np.clip(found.residuals[rest], -6, 6))
    wild = drawn["more than 4 standard deviations"].get_xdata()
    assert sorted(wild) == sorted(found.scenario.times[np.abs(found.residuals) > 4])
    assert {150.0, 300.0} <= set(wild)
    assert {tuple(line.get_ydata()) for line in right.lines} >= {(-2, -2), (2, 2)}


def test_a_hardly_known_range_has_its_region(panels):
    found = fitted(tma.Target((12e3, 24e3), speed=6, heading=1.5), sensors=EARS[:1])
    drawn = labelled(panels(found)[0])
    assert "90 % ellipse" not in drawn
    boundary = drawn["90 % region"].get_path().vertices * 1e3
    np.testing.assert_allclose(boundary, tma.confidence_region(found).boundary[0])


def test_what_is_not_known_is_not_drawn(panels):
    straight = fitted(ship=tma.Course((0, 0), 5, 0.0, [tma.Straight(600)]), sensors=EARS[:1])
    left, _ = panels(straight)
    assert left.figure.get_suptitle() == "No estimate: not observable"
    assert not {"at the reference time", "target, estimated", "90 % ellipse"} & labelled(left).keys()
    assert left.get_xlim()[1] < 30, "the map ends though the region does not"
    lost = replace(straight, state=np.full(4, np.nan), status=np.array("not finite"), cost=np.array(np.nan))
    left, right = panels(lost)
    assert [text.get_text() for text in right.texts] == ["no residuals"]
    with pytest.raises(ValueError, match="one run"):
        situation(replace(straight, state=straight.state[None]))


def test_a_target_that_turns_has_its_arc(panels):
    ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(200, heading=h) for h in (0.0, 2.0, 4.0)])
    target = tma.Course((2e3, 4e3), 6, 1.5, [tma.Turn(600, rate=0.003)])
    sensors = [tma.Sensor(tma.TurningBearing(), np.arange(0, 600, 2.0), 1e-4)]
    (x, y), heading = target.position_at(595.0), target.heading_at(595.0)
    truth = [x, y, 6 * np.sin(heading), 6 * np.cos(heading), 0.003]
    found = fitted(target, ship, sensors, start=truth)
    assert found.converged
    arc = labelled(panels(found)[0])["target, estimated"].get_xydata() * 1e3
    there = target.position_at(np.linspace(0, 598, len(arc)))
    assert np.hypot(*(arc - there).T).max() < 50  # the chord of the arc misses its middle by 750 m


def test_a_situation_is_white_whatever_the_style(panels, tmp_path):
    found = fitted()
    with plt.style.context("dark_background"):
        left, _ = panels(found)
        left.figure.savefig(tmp_path / "one.png")
    assert plt.imread(tmp_path / "one.png")[0, 0].tolist() == [1, 1, 1, 1]
    assert left.xaxis.label.get_color() == "black"
    assert len(left.lines) > 20


def test_a_frame_names_origin_and_time_zero(panels):
    frame = tma.Frame(datetime(2024, 5, 1, 12, tzinfo=UTC), 50.0, -5.0)
    left, right = panels(fitted(), frame=frame)
    assert left.get_xlabel() == "East of 50.0000, -5.0000 (km)"
    assert right.get_xlabel() == "Time (s) since 2024-05-01 12:00:00 UTC"
    assert left.figure.get_suptitle().startswith("At 2024-05-01T12:09:55Z:\nrange")
