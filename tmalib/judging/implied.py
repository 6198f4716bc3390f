"""Printed numbers against one another: what some of them imply for another, without any simulation.

A printed number stands for everything within one unit of its last digit (rounded or cut off, nobody knows),
so that what a formula makes of some is an interval, and so is what is printed. They agree if the two overlap.
"""

import math
from dataclasses import dataclass
from itertools import product

from .paper import Printed


@dataclass(frozen=True)
class Interval:
    """All that a printed number, or what follows from some, can be; inf as an end is allowed."""

    low: float
    high: float

    def overlaps(self, other):
        """Whether a number can be in both; ends count, but for the rounding of the arithmetic."""
        ends = (self.low, self.high, other.low, other.high)
        slack = 1e-9 * max(abs(end) for end in ends if math.isfinite(end))
        return self.low <= other.high + slack and other.low <= self.high + slack

    def __str__(self):
        return f"{self.low:.5g} to {self.high:.5g}"


def stands_for(printed):
    """The `Interval` of a `Printed`; a count and an input are exact.

    >>> stands_for(Printed("p", "t", "r", "c", "0.89", "1", "deterministic", None))
    Interval(low=0.88, high=0.9)
    """
    if not isinstance(printed, Printed):
        return Interval(printed, printed)
    unit = 0.0 if printed.kind == "count" else printed.last_digit
    return Interval(round(printed.value - unit, 12), round(printed.value + unit, 12))


def implied(formula, *given):
    """The `Interval` of a formula of printed numbers (or exact ones), monotone in each of them.

    >>> four, two = (Printed("p", "t", "r", "c", digit, "1", "input", None) for digit in "42")
    >>> implied(lambda a, b: a / b, four, two)
    Interval(low=1.0, high=5.0)
    """
    sides = [(interval.low, interval.high) for interval in map(stands_for, given)]
    values = [formula(*corner) for corner in product(*sides)]
    return Interval(float(min(values)), float(max(values)))


@dataclass(frozen=True)
class Check:
    """What some printed numbers imply for another, and what is printed."""

    what: str
    implied: Interval
    printed: Interval

    @property
    def holds(self):
        """Whether a number can be in both."""
        return self.implied.overlaps(self.printed)

    def __str__(self):
        word = "holds" if self.holds else "FAILS"
        return f"{word}  {self.what}:\n       {self.implied} follows, {self.printed} is printed"
