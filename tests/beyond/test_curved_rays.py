"""What the chapter on curved rays stands on, against straight rays where the water has no layers."""

import numpy as np
import pytest

import tmalib as tma
from tmalib.beyond import curved_rays as curved
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.sound_profile import SoundSpeedProfile

UNIFORM = SoundSpeedProfile([0, 4000], [1500, 1500])
DEPTH = conical.TARGET_DEPTH


def test_sound_speeds_are_those_of_another_formula():
    """Mackenzie's nine terms (1981) within its and TEOS-10's tolerance, in the two tropical casts."""
    gsw = pytest.importorskip("gsw")
    from pathlib import Path

    data = np.load(Path(gsw.__file__).parent / "tests" / "gsw_cv_v3_0.npz")
    for i, profile in enumerate(list(curved.profiles().values())[:2]):
        t, s, z = data["t_chck_cast"][:, i], data["SP_chck_cast"][:, i], profile.depths
        mackenzie = (
            1448.96 + 4.591 * t - 5.304e-2 * t**2 + 2.374e-4 * t**3 + 1.340 * (s - 35) + 1.630e-2 * z
            + 1.675e-7 * z**2 - 1.025e-2 * t * (s - 35) - 7.139e-13 * t * z**3
        )  # fmt: skip
        assert np.abs(profile.speeds - mackenzie).max() < 1.0


def test_there_are_six_places_of_which_one_is_shallow():
    found = curved.profiles()
    assert len(found) == 6
    assert sorted(profile.depths[-1] > 3000 for profile in found.values()) == [False] + 5 * [True]


@pytest.mark.parametrize(
    "scenario",
    [conical.section_4_2(), conical.section_4_2(assumed_depth=DEPTH), conical.section_5_2(2000.0, DEPTH)],
)
def test_without_layers_traced_cosines_are_straight_ones(scenario):
    for steered in ("array", "effective", 1500.0):
        found = curved.traced(scenario, scenario.state[None], UNIFORM, steered)
        np.testing.assert_allclose(found[0], scenario.measure(), atol=1e-12)
    np.testing.assert_allclose(curved.factors(scenario, scenario.state[None], UNIFORM), 1, rtol=1e-12)


def test_states_at_ranges_keep_bearing_and_velocity():
    scenario = conical.section_4_2()
    states = curved.at_ranges(scenario, [1000.0, 20e3])
    np.testing.assert_allclose(np.hypot(*states[:, :2].T), [1000, 20e3])
    np.testing.assert_allclose(np.arctan2(*states[:, :2].T), np.arctan2(5000, 7000))
    np.testing.assert_array_equal(states[:, 2:], [scenario.state[2:]] * 2)


def test_a_bias_is_nothing_without_layers_and_nan_without_a_ray():
    scenario = conical.section_4_2(assumed_depth=DEPTH)
    states = curved.at_ranges(scenario, [3000.0, 9000.0])
    measured = curved.traced(scenario, states, UNIFORM, "array")
    measured[1, 7] = np.nan
    errors, sizes = curved.biases(scenario, measured, states)
    assert sizes[0] < 1e-6
    assert np.isnan(sizes[1])
    assert np.isnan(errors[1]).all()


def test_tracing_once_more_ends_at_the_truth():
    """The fixed point of dividing the traced by the straight cosine, in a profile with a gradient."""
    profile = SoundSpeedProfile([0, 4000], [1450, 1530])
    scenario = conical.section_5_2(3000.0, DEPTH)
    state = scenario.state[None]
    found = curved.trace_and_fit(
        scenario, curved.traced(scenario, state, profile, "array"), profile, state, 4
    )
    assert tma.nees(found[0, 0], scenario.state, tma.crlb(scenario)) > 1
    np.testing.assert_allclose(found[-1], state, rtol=1e-6)


def test_direct_sound_without_layers_is_that_along_a_straight_line():
    level = curved.direct_level(UNIFORM, 4000.0, np.array([500.0, 2000.0, 5000.0]))
    np.testing.assert_allclose(level, 0, atol=0.1)


def test_direct_sound_in_a_gradient_by_its_closed_form():
    """Intensity along circles, ``cos(e) de / (x dx sin(e'))``, by differences of the circle's angle."""
    profile = SoundSpeedProfile([0, 4000], [1540, 1480])
    g, centre = 60 / 4000, 1540 * 4000 / 60
    x = np.array([500.0, 1000.0, 2000.0])

    def leaves(x):
        across = (x**2 + (centre - 200) ** 2 - (centre - 100) ** 2) / (2 * x)
        return -np.arctan2(across, centre - 100)

    slope = (leaves(x + 0.01) - leaves(x - 0.01)) / 0.02
    slowness = np.cos(leaves(x)) / (1540 - g * 100)
    sine = np.sqrt(1 - (slowness * (1540 - g * 200)) ** 2)
    exact = 10 * np.log10((x**2 + 100**2) * np.cos(leaves(x)) * np.abs(slope) / (x * sine))
    np.testing.assert_allclose(curved.direct_level(profile, 4000.0, x), exact, atol=0.15)


def test_runs_are_the_same_whatever_their_number():
    place = list(curved.profiles())[2 + 1]
    few, more = (curved.two_ray_runs(np.random.SeedSequence(4), n, place, 2000.0) for n in (2, 3))
    for name in few:
        assert few[name].shape == (2, 4)
        np.testing.assert_allclose(few[name], more[name][:2], rtol=1e-6)
