"""The map of starts: every square has its colour and its place, and the share is the one that is shown."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import QuadMesh

from tmalib.papers.emw_acoustic import bound_drawing
from tmalib.papers.emw_acoustic import scenarios as emw


def test_squares_are_where_the_starts_are():
    side = 1e3 * np.arange(-4.5, 5)
    one, none = np.zeros((2, 10, 10), dtype=bool)
    one[7, 1] = True  # 2.5 km north, 3.5 km west
    scenarios = {"a": emw.scenario(2), "b": emw.scenario(4)}
    reached = {(name, chart): one if name == "a" else none for name in "ab" for chart in ("p", "c")}
    figure = bound_drawing.basins(side, reached, scenarios)
    figure.canvas.draw()
    assert [ax.get_title() for ax in figure.axes] == ["a, p: 1 %", "a, c: 1 %", "b, p: 0 %", "b, c: 0 %"]
    for ax, (name, _), grid in zip(figure.axes, reached, reached.values(), strict=True):
        (mesh,) = (item for item in ax.collections if isinstance(item, QuadMesh))
        colours = mesh.get_facecolors().reshape(10, 10, 4)
        corners = mesh.get_coordinates()
        centres = (corners[1:, 1:] + corners[:-1, :-1]) / 2
        differs = np.any(colours != colours[0, 0], axis=-1)
        np.testing.assert_array_equal(differs, grid)
        np.testing.assert_allclose(centres[differs], np.tile([-3.5, 2.5], (grid.sum(), 1)))
        now = scenarios[name]
        drawn = [line.get_xydata()[0] for line in ax.lines if len(line.get_xydata()) > 1]
        np.testing.assert_allclose(
            drawn, [now.platform.position_at(0) / 1e3, now.target.position_at(0) / 1e3]
        )
    plt.close(figure)
