"""The live view of ghosts: what is drawn are ghosts, by geometry of its own; the cases are those there."""

from itertools import product

import numpy as np
import pytest

from tmalib.papers.conical_angles import ghosts_view as view
from tmalib.papers.conical_angles.scenarios import ARRAY_DEPTH

TIMES = np.linspace(0, 600, 13)
ALONG = np.array([np.sin(np.radians(30)), np.cos(np.radians(30))])


def cosines(target):
    """Of the angle at the array's axis, direct path, for an array at 5 m/s on 30 degrees."""
    gap = target.position_at(TIMES) - 5 * np.outer(TIMES, ALONG)
    return gap @ ALONG / np.sqrt((gap**2).sum(axis=1) + (target.depth - ARRAY_DEPTH) ** 2)


@pytest.mark.parametrize("place", [(100, 90), (200, 90), (800, 330), (100, 210), (200, 300), (50, 30)])
def test_what_is_drawn_are_ghosts(place):
    scenario, ghosts, _ = view.drawn(*place)
    assert len(ghosts) >= 6
    for ghost in ghosts:
        assert np.allclose(cosines(ghost), cosines(scenario.target), atol=1e-13)
        assert 0 <= ghost.depth <= 4000


def test_the_target_is_where_the_sliders_say():
    for depth, course in product((0, 300), (0, 120, 270)):
        target = view.target_on(depth, course).target
        assert target.depth == depth
        assert target.speed == pytest.approx(5)
        assert np.cos(target.heading - np.radians(course)) == pytest.approx(1)
        assert np.hypot(*target.position_at(0.0)) == pytest.approx(np.hypot(*view.START))


def test_the_cases():
    def word(*place):
        return view.drawn(*place)[2].split(":")[0]

    assert word(100, 90) == "Otherwise"
    assert word(200, 90) == "Otherwise, in the array's depth"
    assert word(100, 210) == "Parallel"
    assert word(200, 300) == word(100, 30) == "Constant cosine"
    assert word(100, 300) == "Otherwise"


def test_a_family_that_is_not_drawn_is_refused():
    (family,) = view.find_ghosts(view.scenes.one_leg((5e3, 0), (3.0, 0.0), 50.0, view.DIRECT))
    with pytest.raises(ValueError, match="is not drawn"):
        view.members(family, 50.0)
