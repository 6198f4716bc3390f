"""The random geometries of the chapter on observability, against plain kinematics."""

import numpy as np
import pytest

from tmalib.papers.emw_acoustic import geometries

TIMES = np.arange(0.0, 601.0, 60.0)


def sample(kind, n=50):
    rng = np.random.default_rng(3)
    return [geometries.random_scene(kind, rng) for _ in range(n)]


def ray(position, velocity, observer, time):
    return position + time * (velocity - observer)


@pytest.mark.parametrize("kind", geometries.KINDS)
def test_a_geometry_is_what_its_kind_says(kind):
    """The line of sight keeps its direction in the five special kinds, and turns in the two general ones."""
    for position, velocity, observer in sample(kind):
        rays = np.array([ray(position, velocity, observer, time) for time in TIMES])
        # sine of the angle between each ray and the first: 0 for a constant bearing
        turned = (rays[0, 0] * rays[:, 1] - rays[0, 1] * rays[:, 0]) / (
            np.linalg.norm(rays, axis=1) * np.linalg.norm(rays[0])
        )
        if kind in geometries.KINDS[:2]:
            assert np.max(np.abs(turned)) > 1e-6
        else:
            assert np.max(np.abs(turned)) < 1e-12
            assert np.all(rays @ rays[0] > 0), "the target is never on the observer, nor past it"
        assert 10e3 <= np.linalg.norm(position) <= 30e3
        assert np.linalg.norm(velocity) < 30 + 1e-9
        assert (np.linalg.norm(observer) == 0) == kind.startswith("motionless")


def test_the_special_kinds_differ():
    closing = [np.dot(p, v - u) for p, v, u in sample("straight observer, collision course")]
    receding = [np.dot(p, v - u) for p, v, u in sample("straight observer, receding target")]
    radial = [np.dot(p, v - u) for p, v, u in sample("motionless observer, radial target")]
    assert max(closing) < 0 < min(receding)
    assert min(radial) < 0 < max(radial), "towards and away"
    assert all(np.array_equal(v, u) for _, v, u in sample("straight observer, same velocity"))
    assert all(not np.any(v) for _, v, _ in sample("motionless observer, fixed target"))


@pytest.mark.parametrize("kind", ["straight observer", "motionless observer"])
def test_the_scene_shows_the_geometry(kind):
    """Bearings without noise are those of straight lines: light from now, sound from when it left."""
    position, velocity, observer = sample(kind, 1)[0]
    scene = geometries.scene(position, velocity, observer)
    light, sound = scene.sensors
    angles, _ = scene.linearise(scene.state)
    np.testing.assert_array_equal(scene.state, [*position, *velocity])
    np.testing.assert_allclose([light.times[-1], sound.times[-1]], geometries.DURATION)
    for time, angle in zip(light.times, angles, strict=False):
        east, north = ray(position, velocity, observer, time)
        assert angle == pytest.approx(np.arctan2(east, north), abs=1e-12)
    for time, angle in zip(sound.times, angles[len(light.times) :], strict=True):
        late = 0.0
        for _ in range(30):
            gap = ray(position, velocity, observer, time) - late * velocity
            late = np.hypot(*gap) / 1500.0
        assert angle == pytest.approx(np.arctan2(*gap), abs=1e-12)


def test_unknown_kind():
    with pytest.raises(ValueError, match="kind must be one of"):
        geometries.random_scene("circling observer", np.random.default_rng(0))
