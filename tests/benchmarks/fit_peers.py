"""The batch fit as others would write it: functions of a `Problem` that return states ``(runs, 4)``."""

from functools import cache, partial

import numpy as np
from compiled import kernel
from problem import PASSES
from scipy.optimize import least_squares

TURN = 2 * np.pi


def residuals(state, angles, x, y, lag, sigma, sound, early):
    """In standard deviations, of one run."""
    dx, dy, _ = geometry(state, x, y, lag, sound, early)
    return np.remainder(np.arctan2(dx, dy) - angles + np.pi, TURN) / sigma - np.pi / sigma


def geometry(state, x, y, lag, sound, early):
    """Where the target was when it was seen or heard, from the platform; and for how long the sound came."""
    px, py, vx, vy = state
    dx, dy, tau = px + lag * vx - x, py + lag * vy - y, np.zeros_like(lag)
    c, late = sound[-1], slice(early, None)
    radial, slack = vx * dx[late] + vy * dy[late], c * c - vx * vx - vy * vy
    tau[late] = (np.sqrt(radial * radial + slack * (dx[late] ** 2 + dy[late] ** 2)) - radial) / slack
    return dx - tau * vx, dy - tau * vy, tau


def jacobian(state, angles, x, y, lag, sigma, sound, early):
    """Of `residuals`, ``(N, 4)``."""
    dx, dy, tau = geometry(state, x, y, lag, sound, early)
    _, _, vx, vy = state
    r = np.hypot(dx, dy)
    sine, cosine = dx / r, dy / r
    turn = np.zeros_like(lag)
    turn[early:] = (vy * sine - vx * cosine)[early:] / (sound[-1] + vx * sine + vy * cosine)[early:]
    weight = 1 / (r * sigma)
    rows = np.empty((len(angles), 4))
    rows[:, 0], rows[:, 1] = (cosine + turn * sine) * weight, (turn * cosine - sine) * weight
    rows[:, 2:] = (lag - tau)[:, None] * rows[:, :2]
    return rows


def flat(case):
    return case.x, case.y, case.lag, case.sigma, case.sound, case.early


def in_scipy(case, method):
    """`scipy.optimize.least_squares` run by run, with the analytic Jacobian."""

    def one(start, angles):
        return least_squares(
            residuals, start, jacobian, method=method, x_scale="jac", args=(angles, *flat(case))
        ).x

    return np.array([one(*run) for run in zip(case.start, case.angles, strict=True)])


def in_numpy(case):
    """Gauss and Newton run by run, all measurements of a run at once, scaled normal equations."""
    found, more = case.start.copy(), flat(case)
    for state, angles in zip(found, case.angles, strict=True):
        for _ in range(PASSES):
            rows, error = jacobian(state, angles, *more), residuals(state, angles, *more)
            scale = 1 / np.linalg.norm(rows, axis=0)
            rows *= scale
            state -= scale * np.linalg.solve(rows.T @ rows, rows.T @ error)
    return found


@cache
def _numba_kernel():
    import numba

    @numba.njit(fastmath=True)
    def gauss_newton(states, measured, x, y, lag, sigma, sound, passes):
        for r in range(len(states)):
            for _ in range(passes):
                information, gradient = np.zeros((4, 4)), np.zeros(4)
                px, py, vx, vy = states[r]
                for k in range(len(x)):
                    dx, dy, since, turn = px + lag[k] * vx - x[k], py + lag[k] * vy - y[k], lag[k], 0.0
                    if sound[k] > 0:
                        radial, slack = vx * dx + vy * dy, sound[k] ** 2 - vx * vx - vy * vy
                        tau = (np.sqrt(radial * radial + slack * (dx * dx + dy * dy)) - radial) / slack
                        dx, dy, since = dx - tau * vx, dy - tau * vy, since - tau
                    r2 = 1 / np.sqrt(dx * dx + dy * dy)
                    sine, cosine = dx * r2, dy * r2
                    if sound[k] > 0:
                        turn = (vy * sine - vx * cosine) / (sound[k] + vx * sine + vy * cosine)
                    error = np.arctan2(dx, dy) - measured[r, k]
                    error = (error - TURN * np.rint(error / TURN)) / sigma[k]
                    weight = r2 / sigma[k]
                    row = ((cosine + turn * sine) * weight, (turn * cosine - sine) * weight)
                    row = (row[0], row[1], since * row[0], since * row[1])
                    for i in range(4):
                        gradient[i] += row[i] * error
                        for j in range(4):
                            information[i, j] += row[i] * row[j]
                scale = 1 / np.sqrt(np.diag(information))
                scaled = information * scale.reshape(4, 1) * scale
                states[r] -= scale * np.linalg.solve(scaled, scale * gradient)

    return gauss_newton


def in_numba(case):
    """The same in loops, compiled by Numba."""
    found = case.start.copy()
    _numba_kernel()(found, case.angles, case.x, case.y, case.lag, case.sigma, case.sound, PASSES)
    return found


@cache
def _jax_kernel(early):
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)

    def values(state, x, y, lag, sound):
        px, py, vx, vy = state
        dx, dy = px + lag * vx - x, py + lag * vy - y
        c = sound[-1]
        radial, slack = vx * dx[early:] + vy * dy[early:], c * c - vx * vx - vy * vy
        tau = (jnp.sqrt(radial**2 + slack * (dx[early:] ** 2 + dy[early:] ** 2)) - radial) / slack
        back = jnp.concatenate([jnp.zeros(early), tau])
        return jnp.arctan2(dx - back * vx, dy - back * vy)

    def one(state, angles, x, y, lag, sigma, sound):
        def step(_, state):
            error = values(state, x, y, lag, sound) - angles
            error = (error - TURN * jnp.rint(error / TURN)) / sigma
            rows = jax.jacfwd(values)(state, x, y, lag, sound) / sigma[:, None]
            scale = 1 / jnp.linalg.norm(rows, axis=0)
            rows = rows * scale
            return state - scale * jnp.linalg.solve(rows.T @ rows, rows.T @ error)

        return jax.lax.fori_loop(0, PASSES, step, state)

    return jax.jit(jax.vmap(one, (0, 0, None, None, None, None, None)))


def in_jax(case):
    """The same in JAX, one run and differentiated by it, then ``vmap`` over the runs and compiled."""
    kernel_ = _jax_kernel(case.early)
    return np.asarray(kernel_(case.start, case.angles, case.x, case.y, case.lag, case.sigma, case.sound))


def in_c(case):
    """The same in C, as fast as it has it."""
    found, late = case.start.copy(), len(case.lag) - case.early
    weights = case.sigma[0] ** -2, case.sigma[-1] ** -2
    kernel("gauss_newton")(len(found), PASSES, case.early, late, case.x, case.y, case.lag, *weights,
                           case.sound[-1], case.angles, found)  # fmt: skip
    return found


PEERS = {
    "scipy lm": partial(in_scipy, method="lm"),
    "scipy trf": partial(in_scipy, method="trf"),
    "NumPy, run by run": in_numpy,
    "Numba": in_numba,
    "JAX, vmap": in_jax,
    "C": in_c,
}
