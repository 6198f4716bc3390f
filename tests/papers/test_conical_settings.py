"""Settings are read off a scenario's motion, so that a wrong scenario would be seen."""

from dataclasses import replace

import numpy as np
import pytest

import tmalib as tma
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.conical_angles.paper import PAPER
from tmalib.papers.conical_angles.settings import settings


@pytest.mark.parametrize(
    ("table", "scenario"),
    [
        ("Section 3.2", conical.section_3_2()),
        ("Section 4.2", conical.section_4_2()),
        ("Section 4.2", conical.section_4_2(path="printed")),
        ("Section 5.2", conical.section_5_2(2000.0)),
    ],
)
def test_settings_are_those_of_the_text(table, scenario):
    found = settings(scenario)
    printed = {
        row.row: row.value for row in PAPER.ledger.values() if row.table == table and row.kind == "input"
    }
    common = printed.keys() & found.keys()
    assert len(common) >= 4
    assert {name: found[name] for name in common} == pytest.approx({name: printed[name] for name in common})


def test_another_scenario_has_other_settings():
    scenario = conical.section_4_2()
    faster = replace(scenario, target=tma.Target((5e3, 7e3), speed=6.0, heading=np.radians(50), depth=90.0))
    changed = {
        name for name, value in settings(faster).items() if not np.isclose(value, settings(scenario)[name])
    }
    assert changed == {"target speed", "target heading", "target depth"}
    assert "array speed" not in settings(conical.section_5_2(2000.0)), "at rest"
