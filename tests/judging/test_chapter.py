"""What chapters call: numbers for sentences, figures with their sources."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import tmalib as tma
from tmalib.judging import chapter, numbers, show


@pytest.fixture
def glued(monkeypatch):
    """Keys and values as they reach myst-nb."""
    found = {}
    monkeypatch.setattr("myst_nb.glue", lambda key, value, display: found.__setitem__(key, value))
    return found


def test_keys_and_casts(glued):
    table = numbers(
        "emw-1",
        worst_z=np.float64(1.5),
        runs=np.int64(500),
        along={"mle": np.array([0.5, 2.0]), "x_T": True},
        nested=[{"a": 1}, {"a": 2}],
    )
    assert glued == {
        "emw-1-worst-z": 1.5,
        "emw-1-runs": 500,
        "emw-1-along-mle-0": 0.5,
        "emw-1-along-mle-1": 2,
        "emw-1-along-x-T": 1,
        "emw-1-nested-0-a": 1,
        "emw-1-nested-1-a": 2,
    }
    assert {type(value) for value in glued.values()} == {int, float}
    assert "<td>emw-1-worst-z</td><td>1.5</td>" in table.data


def test_what_is_no_number_is_refused(glued):
    with pytest.raises((TypeError, ValueError)):
        numbers("p", name="text")


def test_a_figure_names_its_runs(monkeypatch):
    shown = []
    monkeypatch.setattr("IPython.display.display", lambda figure, metadata: shown.append((figure, metadata)))
    runs = tma.monte_carlo(lambda seed, n: {"x": np.zeros(n)}, 3, "own")
    drawn, _ = plt.subplots()
    show(runs, tma.Stream("drawn", 4))
    ((figure, metadata),) = shown
    assert figure is drawn
    first, last = metadata[chapter.SOURCES]
    assert (first["runs"], first["stream"], first["seed"]) == (3, "own", 2016)
    assert last == {"task": "", "stream": "drawn", "seed": 2016, "runs": 0}
    assert plt.get_fignums() == [], "closed, so that the next cell does not show it again"
