import matplotlib.pyplot as plt
import numpy as np
import pytest

import tmalib as tma
from tmalib import figures


def draw():
    fig, ax = plt.subplots()
    figures.path(ax, [[0, 0], [1e3, 2e3]], "target", mark="T")
    figures.cloud(ax, np.random.default_rng(0).normal(size=(200, 2)) * 1e3, "mle")
    figures.ellipse(ax, tma.confidence_ellipse((0, 0), np.diag([4e6, 1e6])))
    figures.map_axes(ax)
    return fig


def test_the_same_figure_gives_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1451606400")
    with plt.rc_context():
        figures.use_style()
        for name in ("a/one", "a/two"):
            figures.save_figure(draw(), tmp_path / name)
    for suffix in (".svg", ".pdf"):
        one, two = ((tmp_path / f"a/{name}").with_suffix(suffix).read_bytes() for name in ("one", "two"))
        assert one == two
        assert len(one) > 1000


def test_axes_are_kilometres():
    fig, ax = plt.subplots()
    figures.path(ax, [[0, 0], [3e3, 4e3]], "platform")
    np.testing.assert_allclose(ax.lines[0].get_xydata()[1], [3, 4])
    figures.ellipse(ax, tma.confidence_ellipse((0, 0), np.diag([4e6, 1e6]), 0.9))
    assert ax.lines[1].get_xdata().max() == pytest.approx(2 * np.sqrt(-2 * np.log(0.1)), rel=1e-3)
    plt.close(fig)


def test_colours_differ():
    assert len(set(figures.COLOURS.values())) >= len(figures.COLOURS) - 1  # sound shares the platform's
    with pytest.raises(ValueError, match="entity must be one of"):
        figures.colour("nobody")
