"""Argument checks: every message names the argument, the value and what is accepted."""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Decimal
from numbers import Number
from typing import Any, TypeVar

import numpy as np

from .types import FloatArray

Kind = TypeVar("Kind")

LARGEST = 1e100  # of a number that is given: its square and its cube are still numbers
MOST = 10**15  # of a count


def set_fields(instance: object, **values: Any) -> None:
    """Put checked values into a frozen dataclass, from its ``__post_init__``."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def check_scalar(name: str, value: Any, minimum: float | None = None, above: float | None = None) -> float:
    """``value`` as a finite float, at least ``minimum``, greater than ``above``."""
    array = as_numbers(name, value, "a number")
    if array.ndim:
        raise ValueError(f"{name} must be a number, got an array of shape {array.shape}")
    number = float(array)
    if not np.isfinite(number):
        raise ValueError(f"{name} must be finite, got {number}")
    if abs(number) > LARGEST:
        raise ValueError(f"{name} must be at most {LARGEST:g} in size, got {number}")
    if minimum is not None and number < minimum:
        raise ValueError(f"{name} must be at least {minimum}, got {number}")
    if above is not None and number <= above:
        raise ValueError(f"{name} must be greater than {above}, got {number}")
    return number


def check_count(name: str, value: Any, least: int = 1) -> int:
    """``value`` as an integer, positive or, with ``least`` 0, not negative."""
    number = check_scalar(name, value)
    if number != int(number) or number < least:
        wanted = "a positive integer" if least else "an integer that is not negative"
        raise ValueError(f"{name} must be {wanted}, got {value!r}")
    if number > MOST:
        raise ValueError(f"{name} must be at most {MOST}, got {value!r}")
    return int(number)


def check_flag(name: str, value: Any) -> bool:
    """``value`` as a bool."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} must be True or False, got {short(value)}")
    return bool(value)


def check_is(name: str, value: Any, kind: type[Kind]) -> Kind:
    """``value``; `ValueError` unless it is of a class."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} must be a {kind.__name__}, got {short(value)}")
    return value


def check_has(name: str, value: Kind, *attributes: str) -> Kind:
    """``value``; `ValueError` unless it is an object with these attributes (and no class that has them)."""
    missing = [attribute for attribute in attributes if not hasattr(value, attribute)]
    if missing or isinstance(value, type):
        raise ValueError(f"{name} must be an object with {', '.join(attributes)}, got {short(value)}")
    return value


def check_pair(name: str, value: Any) -> tuple[float, float]:
    """``value`` as two finite floats."""
    pair = as_numbers(name, value)
    if pair.shape != (2,):
        raise ValueError(f"{name} must be two numbers, got {short(value)}")
    first, second = (check_scalar(name, number) for number in pair)
    return first, second


def check_sequence(name: str, value: Iterable[Any], kind: type[Kind]) -> tuple[Kind, ...]:
    """``value`` as a tuple of objects of a class."""
    try:
        parts = tuple(value)
    except TypeError:
        raise ValueError(f"{name} must be a sequence of {kind.__name__}, got {short(value)}") from None
    for part in parts:
        check_is(f"each of {name}", part, kind)
    return parts


def check_broadcast(**arrays: FloatArray) -> tuple[int, ...]:
    """The common shape of arrays by name; `ValueError` where they have none."""
    try:
        return np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise ValueError(f"the batch shapes must broadcast, got {shapes}") from None


def check_seed(seed: Any) -> np.random.Generator:
    """A generator of random numbers from anything that `numpy.random.default_rng` takes."""
    try:
        return np.random.default_rng(seed)
    except (TypeError, ValueError):
        raise ValueError(
            f"seed must be an integer that is not negative, a SeedSequence or a generator, got {short(seed)}"
        ) from None


def short(value: object) -> str:
    """A value in a message: what it is, in at most a line."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:60]}... ({type(value).__name__})"


def check_probability(value: Any) -> float:
    """``value`` as a float above 0 and below 1."""
    value = check_scalar("probability", value, above=0.0)
    if value >= 1:
        raise ValueError(f"probability must be below 1, got {value}")
    return value


def as_numbers(name: str, value: Any, wanted: str = "numbers") -> FloatArray:
    """``value`` as a float array of any shape, which may hold NaN; what is masked is NaN.

    `ValueError` for texts, dates, complex numbers, truth values, `None`, and rows of different lengths.
    """
    try:
        array = np.asanyarray(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be numbers, in rows of one length, got {short(value)}") from None
    if array.dtype.kind in "mM":
        raise ValueError(f"{name} must be {wanted} of seconds, not {array.dtype}; subtract an epoch")
    if array.dtype.kind == "O" and array.ndim == 0 and isinstance(value, Number | Decimal):
        try:
            return np.asarray(float(array[()]))  # a fraction, a large integer
        except (OverflowError, TypeError, ValueError):
            pass
    if array.dtype.kind not in "iuf":
        raise ValueError(f"{name} must be {wanted}, got {short(value)}")
    if np.ma.isMaskedArray(array):
        array = np.ma.filled(array.astype(float), np.nan)
    return np.asarray(array, dtype=float)


def check_array(name: str, value: Any, shape: tuple[int | None, ...]) -> FloatArray:
    """``value`` as a finite, read-only float array of ``shape`` (`None` accepts any length)."""
    array = np.array(as_numbers(name, value))
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        wanted = "(" + ", ".join("any" if want is None else str(want) for want in shape) + ")"
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}")
    if np.any(np.abs(array) > LARGEST) and np.all(np.isfinite(array)):
        raise ValueError(f"{name} must be at most {LARGEST:g} in size, got {array}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name} must be finite, got {array}")
    array.flags.writeable = False
    return array
