"""Intervals of printed numbers, and what follows from them."""

import math

import pytest

from tmalib.judging.implied import Interval, implied, stands_for
from tmalib.judging.paper import Printed


def printed(text, kind="deterministic"):
    return Printed("p", "t", "r", "c", text, "1", kind, None)


@pytest.mark.parametrize(
    ("text", "kind", "low", "high"),
    [
        ("2.83", "input", 2.82, 2.84),
        ("1.16e6", "deterministic", 1.15e6, 1.17e6),
        ("-4.33", "input", -4.34, -4.32),
        ("75", "count", 75, 75),
    ],
)
def test_a_printed_number_stands_for_one_unit_to_either_side(text, kind, low, high):
    assert stands_for(printed(text, kind)) == Interval(low, high)


@pytest.mark.parametrize("digits", [1, 2, 3])
def test_what_is_rounded_or_cut_off_is_inside(digits):
    """Any rounding of the arguments of a formula, and of its value, overlaps: eighty cases."""
    for k in range(1, 41):
        a, b = math.sqrt(k) + 1, math.pi * k / 7 + 1
        for cut in (False, True):
            shown = [
                f"{math.floor(x * 10**digits) / 10**digits if cut else x:.{digits}f}"
                for x in (a, b, a * b, a / b)
            ]
            first, second, product, ratio = map(printed, shown)
            assert implied(lambda x, y: x * y, first, second).overlaps(stands_for(product))
            assert implied(lambda x, y: x / y, first, second).overlaps(stands_for(ratio))


def test_a_wrong_digit_is_seen():
    speed = implied(lambda v: v / math.sqrt(2), 4.0)
    assert speed.overlaps(stands_for(printed("2.83")))
    assert not speed.overlaps(stands_for(printed("2.85")))
    assert not speed.overlaps(stands_for(printed("2.81")))


def test_an_interval_without_an_end():
    at_least = Interval(5.0, math.inf)
    assert at_least.overlaps(Interval(4.0, 5.0))
    assert not at_least.overlaps(Interval(4.0, 4.9))
