"""Random scenarios of six families, and the best that scipy finds there: for tests and for benchmarks."""

import numpy as np
from scipy.optimize import least_squares

import tmalib as tma

FAMILIES = ("one to three legs", "close pass", "air", "straight", "through north", "two platforms")
GUESSES = 40


def course(rng, place, legs, speed, duration):
    """Straight legs with sudden turns of 30 to 120 degrees."""
    heading, parts = rng.uniform(0, 2 * np.pi), []
    for _ in range(legs):
        parts.append(tma.Straight(duration / legs, heading=heading))
        heading += rng.choice([-1, 1]) * np.radians(rng.uniform(30, 120))
    return tma.Course(place, speed, 0.0, parts)


def candidate(rng, family):
    """A random scenario, which may be useless."""
    air, duration = family == "air", rng.uniform(400, 1800)
    legs = 1 if family == "straight" else int(rng.integers(1, 4))
    platform = course(rng, (0, 0), legs, rng.uniform(60, 150) if air else rng.uniform(3, 10), duration)
    distance = np.exp(rng.uniform(np.log(1e3), np.log(10e3 if family == "close pass" else 60e3)))
    direction = rng.uniform(-0.1, 0.1) if family == "through north" else rng.uniform(0, 2 * np.pi)
    place = distance * np.array([np.sin(direction), np.cos(direction)])
    speed = rng.uniform(50, 0.7 * 340) if air else rng.uniform(0.5, 15)
    when = duration / 2 if family == "close pass" else 0.0
    target = tma.Target(place, speed, rng.uniform(0, 2 * np.pi), time=when)
    times = np.arange(0, duration, rng.choice([1, 2, 5, 10, 20]))
    sigma = np.radians(np.exp(rng.uniform(np.log(0.1), np.log(3))))
    light = tma.Sensor(tma.Bearing(), times, sigma)
    sound = tma.Sensor(tma.DelayedBearing(340.0 if air else 1500.0), times[:: rng.integers(1, 3)], sigma)
    sensors = [light, sound] if family == "straight" else [[light], [sound], [light, sound]][rng.integers(3)]
    if family == "two platforms":
        other = course(rng, rng.uniform(-5e3, 5e3, 2), 1, rng.uniform(3, 10), duration)
        sensors = [*sensors, tma.Sensor(tma.Bearing(), times, sigma, platform=other)]
    return tma.Scenario(platform, sensors, 0.999 * duration, target)


def weakness(scenario):
    """The bound of the target's place over its last range; infinite if it comes within 100 m."""
    times = scenario.times
    apart = np.hypot(*(scenario.target.position_at(times) - scenario.platform.position_at(times)).T)
    bound = tma.crlb(scenario, scenario.state[None])[0]
    return np.sqrt(np.trace(bound[:2, :2])) / apart[np.argmax(times)] if apart.min() > 100 else np.inf


def random_scenario(rng, family, well_seen=True):
    """A scenario whose `weakness` is below a tenth; or, ill-seen, from there to two."""
    low, high = (0.0, 0.1) if well_seen else (0.1, 2.0)
    while not low <= weakness(scenario := candidate(rng, family)) < high:
        pass
    return scenario


def nearest(scenario, states):
    """Least distances ``(runs,)`` of targets from the platforms that measure them."""
    elapsed = scenario.times - scenario.reference_time
    places = np.concatenate([scenario.platform_of(s).position_at(s.times) for s in scenario.sensors])
    gaps = states[:, None, :2] + elapsed[:, None] * states[:, None, 2:] - places
    return np.hypot(*np.moveaxis(gaps, -1, 0)).min(axis=1)


def best_of_scipy(rng, scenario, angles, guesses=GUESSES):
    """Lowest criterion that scipy's Levenberg-Marquardt finds from random starts, below the speed of sound.

    At that speed the model ends, and some criteria fall on the way there.
    """
    scale = np.array([1e3, 1e3, 1.0, 1.0])
    sound = min(getattr(sensor.model, "c", np.inf) for sensor in scenario.sensors)
    fast = 200 if sound < 1000 else 15

    def residuals(x):
        with np.errstate(all="ignore"):  # scipy may ask for a target faster than sound
            off = scenario.residual(angles, scenario.linearise(x * scale)[0]) / scenario.sigma
        return np.nan_to_num(off, nan=1e3)

    def jacobian(x):
        with np.errstate(all="ignore"):
            gradient = -scenario.linearise(x * scale)[1] * scale / scenario.sigma[:, None]
        return np.nan_to_num(gradient, nan=0.0, posinf=0.0, neginf=0.0)

    anywhere = np.hstack([rng.uniform(-60, 60, (guesses, 2)), rng.uniform(-fast, fast, (guesses, 2))])
    found = [least_squares(residuals, one, jacobian, method="lm", max_nfev=200) for one in anywhere]
    slow = [fit.cost for fit in found if fit.status > 0 and np.hypot(*fit.x[2:]) < 0.95 * sound]
    return 2 * min(slow, default=np.inf)
