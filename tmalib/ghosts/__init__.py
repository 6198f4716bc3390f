"""Ghost targets: other targets that give the same noise-free measurements.

A target in constant velocity motion, a line array on straight legs, one or two rays: which other targets
give the same cosines of conical angles at all times? The answer is a list of `Family`: isolated ghosts
and families with free parameters, each with the case of the theorem that it comes from. Physical
admissibility is reported by `admissible`, not applied. Which other targets the noise hides is a search,
`near_ghosts`.
"""

from ..checks import check_is
from ..scenario import Scenario
from .family import TOLERANCE, Family, admissible, check_tolerance
from .near import NearGhost, near_ghosts
from .one_leg import ghosts_of_one_leg
from .turn import measured_on_a_turn
from .two_legs import ghosts_of_two_legs

__all__ = [
    "Family",
    "NearGhost",
    "admissible",
    "find_ghosts",
    "ghosts_of_one_leg",
    "ghosts_of_two_legs",
    "near_ghosts",
]  # fmt: skip


def find_ghosts(
    scenario: Scenario, *, tolerance: float = TOLERANCE, within: float | None = None
) -> list[Family]:
    """All targets with the same noise-free cosines of conical angles as the scenario's target.

    Parameters
    ----------
    scenario : Scenario
        A `Target` with a depth, `ConicalAngle` sensors, and a platform that is on one straight leg while it
        measures, or on two straight legs of a `Course`. Legs without measurements play no part.
    tolerance : float
        What is special for the numbers given, between 1e-12 and 1e-3. A special case (broadside, parallel,
        the same depth, over the array, ...) holds if a target exactly in that case (for a U-turn, an array)
        is nearer than ``tolerance`` times the distance from array to target, in every coordinate at all
        times, *and* its cosines are nearer than ``tolerance``. The default, 1e-6, is a millimetre in a
        kilometre.
    within : float, optional
        A level of chi-square: lists the `near_ghosts` below it as well.

    Returns
    -------
    list of Family
        See `ghosts_of_one_leg` (one ray, or direct and bottom-bounced ray) and `ghosts_of_two_legs`
        (one ray) for the cases and for what is refused. The cosines of every member are the target's within
        ``2 tolerance``; each is compared when it is made. The list is complete for the nearest special case.
        With ``within`` a `NearGhost` follows for every other minimum that the search finds; a family with
        parameters shows once more in it, as a valley.

    Raises
    ------
    ValueError
        For a scenario that is not covered; the message says why.

    Notes
    -----
    Source: `conical-angles`, Theorems 1 to 3, as corrected in the book.
    """
    check_is("scenario", scenario, Scenario)
    turned = measured_on_a_turn(scenario, check_tolerance(tolerance))
    families = (ghosts_of_two_legs if turned else ghosts_of_one_leg)(scenario, tolerance=tolerance)
    if within is None:
        return families
    known = [family.target() for family in families if family.is_isolated]
    return families + near_ghosts(scenario, within, known=known)
