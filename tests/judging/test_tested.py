"""Which tests use a function: found in their source, whatever name they have imported it by."""

from types import SimpleNamespace

import pytest

from tmalib.judging.book import tested

SOURCE = """import numpy as np
import tmalib
import tmalib as tma
import tmalib.ghosts
from tmalib import crlb, figures as draw
from tmalib.ghosts import family
from tmalib.motion import Course as Way
from elsewhere import fit

def test_one():
    tma.fit(1), fit(2), np.fit(3)
    tmalib.fit(4)
    assert crlb(Way(5)).fit == family.Family
    draw.use_style()
    other.fit(6)
    tmalib.ghosts.near_ghosts(7)
"""


def test_names_lead_to_where_they_are_defined():
    assert tested.uses(SOURCE) == {
        "tmalib.batch.fit": [11, 12],
        "tmalib.bounds.crlb": [13],
        "tmalib.motion.Course": [13],
        "tmalib.ghosts.family.Family": [13],
        "tmalib.figures.use_style": [14],
        "tmalib.ghosts.near.near_ghosts": [16],
    }


def test_those_that_use_it_most_come_first():
    counts = [len(lines) for _, lines in tested.files_using("tmalib.batch.fit")]
    assert len(counts) > 10
    assert counts == sorted(counts, reverse=True)
    assert tested.files_using("tmalib.no.such") == []


@pytest.mark.parametrize(
    ("builder", "what", "said"), [("html", "function", 1), ("latex", "function", 0), ("html", "module", 0)]
)
def test_the_entry_of_the_reference(builder, what, said):
    app = SimpleNamespace(
        builder=SimpleNamespace(name=builder), env=SimpleNamespace(docname="book/api/batch")
    )
    lines = ["Fit.", "", ">>> 1", ""]
    tested.add_tests(app, what, "tmalib.batch.fit", None, None, lines)
    added = " ".join(lines[4:])
    assert added.count("Tests: the example above, `") == said
    assert added.count("<../../_tests/") == said * tested.MOST
    assert added.count("more files.") == said
