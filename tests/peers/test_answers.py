"""Other people's estimators on the same data give the same answers."""

from functools import partial

import filter_peers
import fit_peers
import numpy as np
import pytest
from comparisons import AS_WELL, GHOST_STARTS, in_sigmas
from other_peers import ghosts_by_search, worst_by_scipy
from problem import problem

import tmalib as tma
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.papers.robustness import scenarios as robust
from tmalib.sensitivity import differential, position_criterion, worst_sup

FILTERS = filter_peers.PEERS | {
    "Stone Soup, our gradient": partial(filter_peers.in_stone_soup, analytic=True)
}


@pytest.mark.parametrize("number", [1, 4])
@pytest.mark.parametrize("name", fit_peers.PEERS)
def test_fits(name, number):
    """From the same start, and found without one; the minimum is one, so both have to be there."""
    case = problem(8, seed=5, scenario=emw.scenario(number))
    other = fit_peers.PEERS[name](case)
    for start in (case.start, None):
        ours = tma.fit(case.scenario, case.angles, start, tolerance=1e-6)
        near = in_sigmas(case.scenario, ours.state, other)
        assert near < (AS_WELL if "scipy" in name or number == 1 else 1), near


@pytest.mark.parametrize("name", FILTERS)
def test_filters(name):
    """To 1e-9 standard deviations where gradients are analytic, after 1 500 bearings."""
    case = problem(2, seed=6)
    ours = tma.ekf(case.scenario, case.angles, case.prior).state[:, -1]
    most = 1e-3 if name == "Stone Soup" else 1e-9
    assert in_sigmas(case.scenario, ours, FILTERS[name](case)) < most


def test_ghosts_are_those_that_a_search_finds():
    """Of two rays: the list of the theorem, and least squares from random starts, which knows none."""
    scenario = conical.section_5_2(2000.0)
    theorem = [scenario.state] + [
        tma.Scenario(scenario.platform, scenario.sensors, 0.0, family.target()).state
        for family in tma.find_ghosts(scenario)
    ]
    searched = ghosts_by_search(scenario, GHOST_STARTS)
    assert len(searched) == len(theorem) == 4
    for state in theorem:
        assert np.abs(searched - state).max(axis=1).min() < 0.1


def test_the_worst_displacement_is_that_of_a_search():
    scenario = robust.reference().straight
    criterion = position_criterion(scenario, scenario.reference_time)
    ours = worst_sup(scenario, robust.WORST, criterion=criterion)
    found = np.linalg.norm(criterion @ differential(scenario, ours))
    assert found == pytest.approx(worst_by_scipy(scenario, robust.WORST, 30), rel=1e-9)
