"""Ghost targets: other targets that give the same noise-free measurements.

A target in constant velocity motion, a line array on straight legs, one or two rays: which other targets
give the same cosines of conical angles at all times? The answer is a list of `Family`: isolated ghosts
and families with free parameters, each with the case of the theorem that it comes from. Physical
admissibility is reported by `admissible`, not applied.
"""

from .family import Family, admissible
from .one_leg import ghosts_of_one_leg
from .two_legs import ghosts_of_two_legs

__all__ = ["Family", "admissible", "find_ghosts", "ghosts_of_one_leg", "ghosts_of_two_legs"]


def find_ghosts(scenario):
    """All targets with the same noise-free cosines of conical angles as the scenario's target.

    Parameters
    ----------
    scenario : Scenario
        A `Target` with a depth, a `Course` of one or two straight legs, `ConicalAngle` sensors.

    Returns
    -------
    list of Family
        See `ghosts_of_one_leg` (one ray, or direct and bottom-bounced ray) and `ghosts_of_two_legs`
        (one ray) for the cases and for what is refused.

    Raises
    ------
    ValueError
        For a scenario that is not covered; the message says why.

    Notes
    -----
    Source: `conical-angles`, Theorems 1 to 3, as corrected in the book.
    """
    legs = getattr(scenario.platform, "legs", ())
    return (ghosts_of_two_legs if len(legs) == 2 else ghosts_of_one_leg)(scenario)
