"""How often a fit without a start is lost, and what it costs; `make bench` prints a table. No pass, no fail.

A run is *lost* if the fit without a start has not converged, or has converged *elsewhere*, to a criterion
above the best that is known: that of the fit from the truth and, for one scenario in ten, of scipy's
`least_squares` from forty random starts. The interval is that of Clopper and Pearson, 95 percent.

`STARTS=830 make bench` takes 830 scenarios a family, 5 000 in all; `STARTS_SEED` draws others.
"""

import os
import time

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import beta

import tmalib as tma
from tmalib import starts

SCENARIOS = int(os.environ.get("STARTS", 100))  # a family
SEED = int(os.environ.get("STARTS_SEED", 1))
RUNS, TIMED_RUNS, EVERY, GUESSES = 2, 100, 10, 40
FAMILIES = ("one to three legs", "close pass", "air", "straight", "through north", "two platforms")


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


def useful(scenario):
    """Whether the target keeps 100 m away and the bound of its place is below a tenth of its last range."""
    times = scenario.times
    apart = np.hypot(*(scenario.target.position_at(times) - scenario.platform.position_at(times)).T)
    bound = tma.crlb(scenario, scenario.state[None])[0]
    return apart.min() > 100 and np.sqrt(np.trace(bound[:2, :2])) < 0.1 * apart[np.argmax(times)]


def random_scenario(rng, family):
    while not useful(scenario := candidate(rng, family)):
        pass
    return scenario


def best_of_scipy(rng, scenario, angles):
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

    guesses = np.hstack([rng.uniform(-60, 60, (GUESSES, 2)), rng.uniform(-fast, fast, (GUESSES, 2))])
    found = [least_squares(residuals, guess, jacobian, method="lm", max_nfev=200) for guess in guesses]
    slow = [fit.cost for fit in found if fit.status > 0 and np.hypot(*fit.x[2:]) < starts.SUBSONIC * sound]
    return 2 * min(slow, default=np.inf)


def cost_over_truth(scenario, angles, repeat=3):
    """Time of a fit without a start over that of a fit from the truth, in turns."""
    took = np.full(2, np.inf)
    for _ in range(repeat):
        for k, start in enumerate((None, scenario.state)):
            begin = time.perf_counter()
            tma.fit(scenario, angles, start)
            took[k] = min(took[k], time.perf_counter() - begin)
    return took[0] / took[1]


def study(family, number):
    """Of every run: lost, elsewhere, tried; the ratios of time of many runs and of one; what is lost."""
    rng, counts, many, single, cases = np.random.default_rng([SEED, number]), [], [], [], []
    for k in range(SCENARIOS):
        scenario = random_scenario(rng, family)
        angles = scenario.simulate(RUNS, rng)
        found = tma.fit(scenario, angles, tolerance=1e-3)
        truth = tma.fit(scenario, angles, scenario.state, tolerance=1e-3)
        best = np.where(truth.converged, truth.cost, np.inf)
        if k % EVERY == 0:
            best = np.minimum(best, [best_of_scipy(rng, scenario, run) for run in angles])
            more = scenario.simulate(TIMED_RUNS, rng)
            many.append(cost_over_truth(scenario, more))
            single.append(cost_over_truth(scenario, more[0]))
        elsewhere = found.converged & (found.cost > best + 1e-3 * (1 + best))
        lost = elsewhere | (~found.converged & np.isfinite(best))
        counts.append(np.stack([lost, elsewhere, starts.find_start(scenario, angles)[1]]))
        cases += [
            (k, int(run), found.status[run], found.cost[run], best[run]) for run in np.flatnonzero(lost)
        ]
    return np.concatenate(counts, axis=1), np.array(many), np.array(single), cases


def interval(lost, runs):
    """Clopper and Pearson's 95 percent interval of a share."""
    low = beta.ppf(0.025, lost, runs - lost + 1) if lost else 0.0
    return low, beta.ppf(0.975, lost + 1, runs - lost) if lost < runs else 1.0


def row(name, counts, many, single):
    lost, elsewhere, tried = counts.mean(axis=1)
    low, high = interval(int(counts[0].sum()), counts.shape[1])
    print(
        f"{name:18s} {counts.shape[1]:6d} {lost:7.2%} [{low:.2%}, {high:.2%}] {elsewhere:10.2%} {tried:7.1%}"
        f" {np.median(many):8.2f} {np.median(single):8.2f}",
        flush=True,
    )


def test_starts():
    print(
        f"\n{SCENARIOS} scenarios a family, {RUNS} runs each; scipy from {GUESSES} starts in one of {EVERY};"
    )
    print(f"time over that of a fit from the truth, {TIMED_RUNS} runs and 1 run, in one scenario of {EVERY}")
    print("family               runs    lost                elsewhere   tried     many      one")
    studies = [study(family, number) for number, family in enumerate(FAMILIES)]
    for family, (counts, many, single, _) in zip(FAMILIES, studies, strict=True):
        row(family, counts, many, single)
    row("all", *(np.concatenate([s[i] for s in studies], axis=-1) for i in range(3)))
    for family, (*_, cases) in zip(FAMILIES, studies, strict=True):
        for k, run, why, cost, best in cases:
            print(f"lost: {family}, scenario {k}, run {run}: {why}, criterion {cost:.4f}, best {best:.4f}")
