"""A family of ghosts: targets that give the same measurements, with the parameters that move among them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ..motion import Target


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
        ``make(**parameters)`` returns the `Target`.

    Examples
    --------
    An isolated ghost is a family without parameters: ``family.target()``.
    """

    case: str
    source: str
    make: Callable[..., Target]
    parameters: dict = field(default_factory=dict)

    @property
    def is_isolated(self):
        """Whether the family is a single target."""
        return not self.parameters

    def target(self, **values):
        """The member with these parameters; `ValueError` for a missing, unknown or excluded value."""
        if set(values) != set(self.parameters):
            raise ValueError(
                f"case {self.case!r} has the parameters {sorted(self.parameters)}, got {sorted(values)}"
            )
        for name, (low, high) in self.parameters.items():
            if not low <= values[name] <= high:
                raise ValueError(f"{name} must be between {low} and {high}, got {values[name]}")
        return self.make(**values)


def admissible(target, bottom_depth, deepest=None):
    """Whether a ghost could be a vehicle: ``0 <= z <= D``, and ``z <= zMax`` if ``deepest`` is given."""
    limit = bottom_depth if deepest is None else min(bottom_depth, deepest)
    return 0 <= target.depth <= limit
