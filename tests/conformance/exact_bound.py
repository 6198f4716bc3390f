"""The bound in sixty digits: measurements and derivatives once more, in mpmath, from their definitions."""

import mpmath as mp
import numpy as np

import tmalib as tma

DIGITS = 60


def bearing(state, site, lag, model):
    x, y, vx, vy = state[:4]
    return mp.atan2(x + lag * vx - site[0], y + lag * vy - site[1])


def delayed_bearing(state, site, lag, model):
    """The sound left at ``t - tau`` with ``c tau = |place(t - tau) - site|``."""
    x, y, vx, vy = state[:4]
    c, dx, dy = mp.mpf(model.c), x + lag * vx - site[0], y + lag * vy - site[1]
    radial, slack = vx * dx + vy * dy, c**2 - vx**2 - vy**2
    tau = (mp.sqrt(radial**2 + slack * (dx**2 + dy**2)) - radial) / slack
    return mp.atan2(dx - tau * vx, dy - tau * vy)


def values(scenario):
    """Functions of the state, one a measurement, with their sigmas."""
    found = []
    for sensor in scenario.sensors:
        platform, model = scenario.platform_of(sensor), sensor.model
        biased = isinstance(model, tma.Biased)
        inner = model.model if biased else model
        function = {tma.Bearing: bearing, tma.DelayedBearing: delayed_bearing}.get(type(inner))
        if function is None:
            return None
        for time in sensor.times:
            site = [mp.mpf(float(v)) for v in platform.position_at(time)]
            lag = mp.mpf(float(time)) - mp.mpf(float(scenario.reference_time))
            found.append((function, site, lag, inner, biased, mp.mpf(float(np.min(sensor.sigma)))))
    return found


def slope(function, site, lag, model, point, i):
    """Derivative by component i."""
    return mp.diff(lambda t: function([*point[:i], t, *point[i + 1 :]], site, lag, model), point[i])


def deviations(scenario, state):
    """Standard deviations of the bound at a state, texts of fifty digits; `None` for cones."""
    with mp.workdps(DIGITS):
        measured = values(scenario)
        if measured is None:
            return None
        point = [mp.mpf(float(x)) for x in state]
        n = len(point)
        rows = mp.matrix(len(measured), n)
        for k, (*about, biased, sigma) in enumerate(measured):
            for i in range(n):
                rows[k, i] = (1 if i == 4 and biased else slope(*about, point, i)) / sigma
        covariance = (rows.T * rows) ** -1
        return [mp.nstr(mp.sqrt(covariance[i, i]), 50) for i in range(n)]
