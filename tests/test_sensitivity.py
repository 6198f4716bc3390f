"""Response of the batch estimate to a displaced target: against fits, brute force and exact geometry."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import tmalib as tma
from tmalib import sensitivity as sens
from tmalib.papers.conical_angles import scenarios as conical_angles
from tmalib.papers.robustness import scenarios as paper


@pytest.fixture(scope="module")
def straight():
    return paper.reference().straight


@pytest.fixture(scope="module")
def final(straight):
    return sens.position_criterion(straight, paper.DURATION)


@pytest.fixture(scope="module")
def small():
    """Nine bearings: few enough to try all corners of the box."""
    geometry = paper.reference().straight
    sensor = tma.Sensor(tma.Bearing(), np.arange(2.0, 20, 2), paper.SIGMA)
    return replace(geometry, sensors=[sensor])


@pytest.fixture(scope="module")
def conical():
    """A scenario with another model, another state and two sensors."""
    return conical_angles.section_5_2(2000.0, assumed_depth=100.0)


def tight_fit(scenario, measured):
    fitted = tma.fit(scenario, measured, start=scenario.state, tolerance=1e-6, max_iterations=50)
    assert fitted.converged.all()
    return fitted.state


@pytest.mark.parametrize("name", ["straight", "scenario", "conical"])
def test_differential_is_that_of_fits(name, request):
    """Central differences of actual fits, for bearings, delayed bearings and conical angles."""
    scenario = request.getfixturevalue(name)
    rng = np.random.default_rng(1)
    smooth = np.cumsum(np.cumsum(rng.standard_normal((len(scenario.times), 2)), axis=0), axis=0)
    displacement = smooth / np.abs(smooth).max()
    expected = sens.differential(scenario, displacement)
    remainders = []
    for size in (1e-2, 5e-3):
        measured = sens.displaced_measurements(scenario, size * np.stack([displacement, -displacement]))
        up, down = tight_fit(scenario, measured)
        remainders.append(np.linalg.norm((up - down) / (2 * size) - expected) / np.linalg.norm(expected))
    assert remainders[0] < 1e-3
    assert remainders[1] < remainders[0] / 3 + 1e-7, "what is left is of second order in the size"


def test_displaced_measurements_are_those_of_the_displaced_target(straight):
    rng = np.random.default_rng(2)
    displacement = rng.normal(0, 50, (len(straight.times), 2))
    truth = paper.reference().displaced(displacement)
    assert np.allclose(
        sens.displaced_measurements(straight, displacement), truth.measure(), rtol=0, atol=1e-12
    )


def test_modes_are_the_eigenvectors_of_the_papers_operator(straight):
    """The paper's construction, alpha by alpha, against the singular value decomposition."""
    _, gradient = straight.linearise(straight.state)
    length = np.hypot(*gradient[:, :2].T)
    values, vectors = np.linalg.eigh(gradient.T @ gradient)
    alpha = (gradient @ vectors / values * length[:, None]).T
    mu, f = np.linalg.eigh(alpha.T @ alpha)
    found = sens.modes(straight)
    assert found.mu == pytest.approx(mu[::-1][:4], rel=1e-6)
    assert np.abs(mu[:-4]).max() < 1e-9 * mu[-1], "rank d: the operator is only semi-definite"
    overlap = np.abs(np.sum(found.f[:2] * f.T[::-1][:2], axis=1))
    assert overlap == pytest.approx(1, abs=1e-6)
    assert np.linalg.norm(found.d, axis=1) == pytest.approx(np.sqrt(found.mu), rel=1e-9)
    off = found.d @ found.d.T - np.diag(found.mu)
    assert np.abs(off).max() < 1e-9 * found.mu[0]


def test_theorem_1(straight):
    """The development along the directions is the differential, and Bessel's inequality holds."""
    displacement = np.random.default_rng(3).normal(0, 3, (len(straight.times), 2))
    found = sens.modes(straight)
    h = found.f @ sens.response(straight).along(displacement)
    assert np.allclose(h @ found.d, sens.differential(straight, displacement), rtol=1e-9, atol=1e-9)
    assert np.linalg.norm(h) <= np.linalg.norm(displacement)


@pytest.mark.parametrize("rows", ["state", "position"])
def test_worst_sup_against_all_corners(small, rows):
    criterion = np.eye(4) if rows == "state" else sens.position_criterion(small, 20.0)
    gain = criterion @ sens.response(small).gain
    corners = np.array(list(product([-1.0, 1.0], repeat=len(small.times))))
    best = 2.0 * np.linalg.norm(corners @ gain.T, axis=1).max()
    found = sens.worst_sup(small, 2.0, criterion=criterion)
    assert np.hypot(*found.T) == pytest.approx(2.0, rel=1e-12)
    assert np.linalg.norm(criterion @ sens.differential(small, found)) == pytest.approx(best, rel=1e-9)


def test_worst_energy_against_random_displacements(straight, final):
    """No displacement of the same Euclidean norm does more; the mode itself does what mu says."""
    found = sens.worst_energy(straight, 15.0, criterion=final)
    along = sens.response(straight).along(found)
    assert np.abs(along).max() == pytest.approx(15.0, rel=1e-12)
    shift = np.linalg.norm(final @ sens.differential(straight, found))
    assert shift == pytest.approx(
        np.sqrt(sens.modes(straight, criterion=final).mu[0]) * np.linalg.norm(along)
    )
    others = np.random.default_rng(4).normal(size=(200, *found.shape)) + 0.3 * found
    others *= (np.linalg.norm(found) / np.linalg.norm(others, axis=(1, 2)))[:, None, None]
    assert np.all(np.linalg.norm(sens.differential(straight, others) @ final.T, axis=1) <= shift)


def test_worst_flyable(straight, final):
    """Feasible, below the jumping worst case, above flyable sines; nearly the former if jumps are allowed."""

    def shift(displacement):
        return np.linalg.norm(final @ sens.differential(straight, displacement))

    sup = shift(sens.worst_sup(straight, 15.0, criterion=final))
    sizes = []
    for acceleration in (3.0, 30.0, 1e6):
        found = sens.worst_flyable(straight, 15.0, acceleration, criterion=final)
        second = np.diff(found, n=2, axis=0) * paper.RATE**2
        assert np.hypot(*found.T).max() <= 15.0 * (1 + 1e-6)
        assert np.hypot(*second.T).max() <= acceleration * (1 + 1e-5)
        sizes.append(shift(found))
    assert sizes[0] < sizes[1] < sizes[2] <= sup * (1 + 1e-9)
    assert sizes[2] >= np.cos(np.pi / 12) * sup * (1 - 1e-6)
    for period in (4.0, 7.0, 12.0):
        for phase in np.linspace(0, np.pi, 5):
            amplitude = min(15.0, 30.0 * (period / (2 * np.pi)) ** 2)
            wave = amplitude * np.cos(2 * np.pi * straight.times / period + phase)
            heading = wave[:, None] * sens.response(straight).direction[len(wave) // 2]
            assert shift(heading) <= sizes[1] / np.cos(np.pi / 12)


def test_worst_stealth_leaves_no_residual(straight, final):
    found, other = sens.worst_stealth(straight, 15.0, criterion=final)
    assert np.hypot(*found.T).max() == pytest.approx(15.0, rel=1e-6)
    seen = sens.displaced_measurements(straight, found)
    assert np.allclose(seen, straight.linearise(other)[0], rtol=0, atol=1e-12)
    assert tight_fit(straight, seen) == pytest.approx(other, rel=1e-6)
    sup = np.linalg.norm(final @ sens.differential(straight, sens.worst_sup(straight, 15.0, criterion=final)))
    assert 0.1 * sup < np.linalg.norm(final @ sens.differential(straight, found)) <= sup * 1.01


def test_stealth_of_a_nearer_target_is_the_way_to_its_line_of_sight(straight):
    """Exact geometry: the displaced target is on the other target's ray."""
    other = straight.state * np.array([1.001, 1.0005, 1.0, 1.002])
    found = sens.stealth(straight, other)
    here = straight.platform.position_at(straight.times)
    ray = tma.propagate(other, straight.times)[:, :2] - here
    seen = straight.target.position_at(straight.times) + found - here
    assert np.abs(ray[:, 0] * seen[:, 1] - ray[:, 1] * seen[:, 0]).max() < 1e-6 * np.hypot(*ray.T).max()
    assert np.all(np.sum(ray * seen, axis=1) > 0)


def test_sandwich_is_the_bound_on_the_model_and_the_curvature_off_it(straight):
    assert np.allclose(
        sens.sandwich_covariance(straight, straight.measure(), straight.state),
        tma.crlb(straight), rtol=1e-6, atol=0,
    )  # fmt: skip
    circle = paper.reference().circle
    state = tight_fit(straight, circle.measure())
    found = sens.sandwich_covariance(straight, circle.measure(), state)
    rng = np.random.default_rng(5)
    runs = 12_000
    noise = 1e-3 * straight.sigma * rng.standard_normal((runs, len(straight.times)))
    spread = tma.fit(straight, circle.measure() + noise, start=state, tolerance=1e-6).state.var(axis=0) / 1e-6
    limit = 4 * np.sqrt(2 / runs)  # four standard errors of a variance
    assert np.abs(spread / np.diagonal(found) - 1).max() < limit
    assert np.abs(spread / np.diagonal(tma.crlb(straight, state)) - 1).max() > limit, "not the bound"


def test_nearest_motion():
    """First-order conditions of each of the three convex problems, in a turned and moved frame."""
    geometry = paper.reference()
    times = geometry.circle.times
    turn = np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    positions = geometry.target.position_at(times) @ turn.T + [1e4, -3e4]
    for norm in ("sum", "squares", "largest"):
        state = sens.nearest_motion(times, positions, reference_time=5.0, norm=norm)
        gap = positions - tma.propagate(state, times - 5.0)[:, :2]
        distance = np.hypot(*gap.T)
        if norm == "largest":  # the three farthest points hold the line: both ends and one between
            touching = np.flatnonzero(distance > distance.max() * (1 - 1e-6))
            assert {0, len(times) - 1} <= set(touching)
            assert len(touching) >= 3
        else:
            pull = gap if norm == "squares" else gap / distance[:, None]
            assert np.abs(pull.sum(axis=0)).max() < 1e-5 * np.abs(pull).sum()
            assert (
                np.abs((times[:, None] * pull).sum(axis=0)).max() < 1e-5 * np.abs(times @ np.abs(pull)).sum()
            )
    straight_line = tma.propagate(np.array([1.0, 2.0, 3.0, 4.0]), times)[:, :2]
    for norm in ("sum", "squares", "largest"):
        assert sens.nearest_motion(times, straight_line, norm=norm) == pytest.approx([1, 2, 3, 4])


def test_random_geometries_have_what_the_paper_prints():
    for seed in range(5):
        geometry = paper.random_geometry(seed)
        for course, speed, acceleration in (
            (geometry.platform, paper.PLATFORM_SPEED, paper.PLATFORM_ACCELERATION),
            (geometry.target, paper.TARGET_SPEED, paper.TARGET_ACCELERATION),
        ):
            dt = 1e-3
            places = course.position_at(np.array([3.0 - dt, 3.0, 3.0 + dt]))
            assert np.hypot(*np.diff(places, axis=0)[0]) / dt == pytest.approx(speed, rel=1e-5)
            assert np.hypot(*np.diff(places, 2, axis=0)[0]) / dt**2 == pytest.approx(acceleration, rel=1e-3)
        gap = geometry.target.position_at(geometry.circle.times) - geometry.platform.position_at(
            geometry.circle.times
        )
        assert np.hypot(*gap.T).min() > 900


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: sens.differential(s, np.zeros((3, 2))), "displacement must have shape"),
        (lambda s: sens.displaced_measurements(s, np.zeros((500, 3))), "displacement must have shape"),
        (lambda s: sens.response(s, np.zeros((2, 4))), "one state is needed"),
        (lambda s: sens.modes(s, criterion=np.eye(3)), "criterion must be"),
        (lambda s: sens.worst_energy(s, 0.0), "bound must be greater"),
        (lambda s: sens.worst_sup(s, -1.0), "bound must be greater"),
        (lambda s: sens.worst_flyable(s, 15.0, 0.0), "acceleration must be greater"),
        (lambda s: sens.worst_flyable(s, 15.0, 1.0, sides=5), "sides must be even"),
        (lambda s: sens.stealth(s, [np.nan, 3e3, 0.0, 0.0]), "no displacement gives"),
        (lambda s: sens.nearest_motion([0, 1], np.zeros((2, 2)), norm="median"), "norm must be one of"),
        (lambda s: sens.nearest_motion([1, 1], np.zeros((2, 2))), "must not be empty or all the same"),
    ],
)
def test_bad_input(straight, call, message):
    with pytest.raises(ValueError, match=message):
        call(straight)
