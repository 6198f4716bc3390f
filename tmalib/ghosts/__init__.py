"""Ghost targets: other targets that give the same noise-free measurements.

A target in constant velocity motion, a line array on straight legs, one or two rays: which other targets
give the same cosines of conical angles at all times? The answer is a list of `Family`: isolated ghosts
and families with free parameters, each with the case of the theorem that it comes from. Physical
admissibility is reported by `admissible`, not applied.
"""

from .family import Family, admissible
from .one_leg import ghosts_of_one_leg
from .two_legs import ghosts_of_two_legs

__all__ = ["Family", "admissible", "ghosts_of_one_leg", "ghosts_of_two_legs"]
