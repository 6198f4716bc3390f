"""A family of ghosts: targets that give the same measurements, with the parameters that move among them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..checks import check_is, check_scalar
from ..motion import Target
from ..scenario import Scenario

# What is zero up to rounding, relative to the largest number that it comes from.
ROUNDING = 1e-13

# A millimetre in a kilometre: positions rounded to a millimetre, angles to a ten thousandth of a degree. Ten
# thousand measurements with a standard deviation of 1e-3 tell two such targets apart by a chi-square of 0.04.
TOLERANCE = 1e-6
LEAST, MOST = 1e-12, 1e-3


@dataclass(frozen=True)
class Family:
    """Targets with the same noise-free measurements as a given one, from one case of a theorem.

    Attributes
    ----------
    case : str
        The case of the theorem, in a few words: ``"mirror"``, ``"homothetic"``, ``"broadside"``, ...
    source : str
        Paper and theorem.
    parameters : dict
        Name of each free parameter to ``(low, high)``, its range; empty for an isolated ghost.
    make : callable
        ``make(**parameters)`` returns the `Target`, or raises `ValueError` if its cosines are not the given
        target's within twice the tolerance of the search. It can be pickled, and so can the family.

    Examples
    --------
    An isolated ghost is a family without parameters: ``family.target()``.
    """

    case: str
    source: str
    make: Callable[..., Target]
    parameters: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def is_isolated(self) -> bool:
        """Whether the family is a single target."""
        return not self.parameters

    def target(self, **values: float) -> Target:
        """The member with these parameters; `ValueError` for a missing, unknown or excluded value."""
        if set(values) != set(self.parameters):
            raise ValueError(
                f"case {self.case!r} has the parameters {sorted(self.parameters)}, got {sorted(values)}"
            )
        for name, (low, high) in self.parameters.items():
            if not low <= values[name] <= high:
                raise ValueError(f"{name} must be between {low} and {high}, got {values[name]}")
        return self.make(**values)


def check_tolerance(tolerance: float) -> float:
    """``tolerance`` as a float; `ValueError` below what rounding allows and above what is still the same."""
    tolerance = check_scalar("tolerance", tolerance, minimum=LEAST)
    if tolerance > MOST:
        raise ValueError(f"tolerance must be at most {MOST}, got {tolerance}")
    return tolerance


def check_one_array(scenario: Scenario) -> None:
    """`ValueError` for a sensor carried by another platform: the theorems are about one array."""
    others = [s.name for s in scenario.sensors if scenario.platform_of(s) is not scenario.platform]
    if others:
        raise ValueError(f"all sensors must be carried by the scenario's platform, not {others}")


def verified(scenario: Scenario, families: Sequence[Family], tolerance: float) -> list[Family]:
    """The same families, each member compared with the scenario's target when it is made.

    The cosines of the special target are the given one's within ``tolerance``, and so are those of its
    ghosts, but for a platform that is itself special within ``tolerance`` only: hence twice. A member that
    differs by more raises `ValueError`; an isolated one is no ghost, and left out.
    """
    bound = 2 * tolerance
    kept = [f for f in families if f.parameters or _difference(scenario, f.make()) <= bound]
    return [replace(family, make=partial(_compared, scenario, bound, family.make)) for family in kept]


def _compared(scenario, bound, make, **values):
    """The member that ``make`` makes; `ValueError` if its cosines differ by more than the bound."""
    target = make(**values)
    change = _difference(scenario, target)
    if change > bound:
        raise ValueError(f"the cosines of the member {values} differ by {change:.3g}, above {bound}")
    return target


def _difference(scenario, target):
    """Largest change of a cosine; infinite where a target has none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        cosines = [s.model.observe(target, scenario.platform_of(s), s.times) for s in scenario.sensors]
    change = np.abs(np.concatenate(cosines) - scenario.measure())
    return np.inf if np.isnan(change).any() else change.max()


def admissible(target: Target, bottom_depth: float, deepest: float | None = None) -> bool:
    """Whether a ghost could be a vehicle: ``0 <= z <= D``, and ``z <= zMax`` if ``deepest`` is given."""
    limit = check_scalar("bottom_depth", bottom_depth, above=0.0)
    if deepest is not None:
        limit = min(limit, check_scalar("deepest", deepest, minimum=0.0))
    if (depth := check_is("target", target, Target).depth) is None:
        raise ValueError("target must have a depth, got None")
    return 0 <= depth <= limit
