"""What a course should make small: the area of the ellipse, or what a target out of the model may do.

With the whitened Jacobian ``J`` of a course at a state that the target may have (`tmalib.bounds`), an
*objective* is a positive number that should be small: the area of the confidence ellipse of the target's
position (`position_area`), the shift of the estimate by a displaced target (`worst_shift`), or a function of
one's own, of arrays ``(..., N, n)``. `objective_of_courses` compares courses, `tmalib.planning` searches the
best.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .checks import as_numbers, check_has, check_is, check_probability, check_scalar
from .scenario import Scenario
from .types import FloatArray, Motion
from .uniform import POSITION, transition

Objective: TypeAlias = Callable[[FloatArray], FloatArray]

DIRECTIONS = 48  # of a shift in the plane: the largest over them is within 0.06 per cent of the largest
SINGULAR = 1e-12  # on the triangle's diagonal, for columns of unit length


def position_area(scenario: Scenario, time: float | None = None, probability: float = 0.9) -> Objective:
    """The objective "area of the confidence ellipse of the target's position", in square metres.

    Parameters
    ----------
    scenario : Scenario
    time : float, optional
        When the target is there, in seconds; the reference time by default.
    probability : float
        Between 0 and 1.

    Returns
    -------
    callable
        From whitened Jacobians ``(..., N, n)`` to areas ``(...)`` of the Cramér-Rao bound's ellipse; infinite
        where the state is not observable.

    Notes
    -----
    With the position's columns last in ``J = Q R``, the lower right corner of R is the root of the inverse of
    their covariance.
    """
    level = -2 * np.log1p(-check_probability(probability))
    back, places = _to_time(scenario, time)
    order = [*(i for i in range(len(back)) if i not in places), *places]

    def area(jacobian: FloatArray) -> FloatArray:
        _, triangle, length = _factors((jacobian @ back)[..., order])
        corner = np.abs(np.diagonal(triangle, axis1=-2, axis2=-1))
        seen = (corner > SINGULAR).all(axis=-1)
        root = np.where(seen, np.prod(corner[..., -2:] * length[..., -2:], axis=-1), np.nan)
        return np.where(seen, np.pi * level / root, np.inf)

    return area


def worst_shift(scenario: Scenario, bound: float, time: float | None = None) -> Objective:
    """The objective "largest shift of the estimated position by a target that is displaced", in metres.

    Parameters
    ----------
    scenario : Scenario
    bound : float
        So many metres the target may be away from its uniform motion, at every measurement in any direction.
    time : float, optional
        When the position is wanted, in seconds; the reference time by default.

    Returns
    -------
    callable
        From whitened Jacobians ``(..., N, n)`` to shifts ``(...)``, to first order, as of
        `sensitivity.worst_sup` with `sensitivity.position_criterion`; infinite where the state is not
        observable. It is the largest over 48 directions, at most 0.06 % too small.
    """
    bound = check_scalar("bound", bound, above=0.0)
    back, places = _to_time(scenario, time)
    angle = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    directions = np.stack([np.cos(angle), np.sin(angle)])

    def shift(jacobian: FloatArray) -> FloatArray:
        jacobian = jacobian @ back
        feels = np.hypot(*np.moveaxis(jacobian[..., places], -1, 0))
        q, triangle, length = _factors(jacobian)
        seen = (np.abs(np.diagonal(triangle, axis1=-2, axis2=-1)) > SINGULAR).all(axis=-1)
        triangle = np.where(seen[..., None, None], triangle, np.eye(len(back)))
        wanted = np.zeros((len(back), DIRECTIONS))
        wanted[places] = directions
        weights = q @ np.linalg.solve(triangle.mT, wanted / length[..., None])
        largest = np.abs(weights * feels[..., None]).sum(axis=-2).max(axis=-1)
        return np.where(seen, bound * largest, np.inf)

    return shift


def _to_time(scenario, time):
    """The matrix from the state at a time to that at the reference time, and the places of x and y."""
    names = check_is("scenario", scenario, Scenario).coordinates
    time = scenario.reference_time if time is None else check_scalar("time", time)
    return transition(scenario.reference_time - time, names), [names.index(name) for name in POSITION]


def _factors(jacobian):
    length = np.linalg.norm(jacobian, axis=-2)
    length = np.where((length > 0) & np.isfinite(length), length, 1.0)
    with np.errstate(invalid="ignore"):
        scaled = jacobian / length[..., None, :]
    scaled = np.where(np.isfinite(scaled).all(axis=(-1, -2), keepdims=True), scaled, 0.0)
    return *np.linalg.qr(scaled), length


def objective_of_courses(
    scenario: Scenario, courses: Sequence[Motion], objective: Objective, states: ArrayLike | None = None
) -> FloatArray:
    """An objective for each course that the platform may take, and each state that the target may have.

    Parameters
    ----------
    scenario : Scenario
        Its platform is replaced; sensors that another platform carries stay there.
    courses : sequence of motion, B of them
    objective : callable
        `position_area`, `worst_shift`, or another function of whitened Jacobians ``(..., N, n)``.
    states : array_like, shape (Q, n) or (n,), optional
        At the reference time; the true one by default.

    Returns
    -------
    ndarray, shape (B, Q) or (B,)

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> bearings = tma.Sensor(tma.Bearing(), np.arange(0, 601.0, 10), np.radians(1))
    >>> target = tma.Target((0, 8000), speed=4, heading=np.radians(90))
    >>> turns = [
    ...     tma.Course((0, 0), 5, np.radians(90), [tma.Straight(300), tma.Straight(300, heading=heading)])
    ...     for heading in np.radians([95, 120, 270])]
    >>> scenario = tma.Scenario(turns[0], [bearings], reference_time=0, target=target)
    >>> (objective_of_courses(scenario, turns, position_area(scenario)) / 1e6).round(1)
    array([218.1,   5.9,   0.9])
    """
    courses = [check_has("each of courses", course, "position_at") for course in courses]
    state = check_is("scenario", scenario, Scenario).check_state(
        scenario.state if states is None else as_numbers("states", states)
    )
    several = np.atleast_2d(state)
    shape = (several.shape[1], len(courses), len(several), 1)
    rows = np.broadcast_to(several.T[:, None, :, None], shape)
    gradients = []
    with np.errstate(all="ignore"):  # what is not finite has no value
        for block in scenario.blocks:
            sensor = block.sensor
            observer = block.observer[:, None]
            if sensor.platform is None:
                observer = np.stack([sensor.model.observer_state(c, sensor.times) for c in courses], axis=1)
            gradient = block.predict(rows, observer[:, :, None], block.elapsed)[1]
            gradients.append(np.moveaxis(gradient, 0, -1))
    jacobian = np.concatenate(gradients, axis=-2) / scenario.sigma[:, None]
    found = np.asarray(objective(jacobian))
    if found.shape != jacobian.shape[:-2]:
        raise ValueError(f"objective must return one number for each Jacobian, got shape {found.shape}")
    return found[:, 0] if state.ndim == 1 else found
