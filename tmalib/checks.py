"""Argument checks: every message names the argument, the value and what is accepted."""

import numpy as np


def set_fields(instance, **values):
    """Put checked values into a frozen dataclass, from its ``__post_init__``."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def check_scalar(name, value, minimum=None, above=None):
    """``value`` as a finite float, at least ``minimum``, greater than ``above``."""
    if isinstance(value, np.datetime64 | np.timedelta64):
        raise ValueError(f"{name} must be a number of seconds, not {value!r}; subtract an epoch")
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a number, got {value!r}") from None
    if not np.isfinite(number):
        raise ValueError(f"{name} must be finite, got {number}")
    if minimum is not None and number < minimum:
        raise ValueError(f"{name} must be at least {minimum}, got {number}")
    if above is not None and number <= above:
        raise ValueError(f"{name} must be greater than {above}, got {number}")
    return number


def check_count(name, value):
    """``value`` as a positive integer."""
    number = check_scalar(name, value)
    if number != int(number) or number < 1:
        raise ValueError(f"{name} must be a positive integer, got {value!r}")
    return int(number)


def check_probability(value):
    """``value`` as a float above 0 and below 1."""
    value = check_scalar("probability", value, above=0.0)
    if value >= 1:
        raise ValueError(f"probability must be below 1, got {value}")
    return value


def check_array(name, value, shape):
    """``value`` as a finite, read-only float array of ``shape`` (`None` accepts any length)."""
    if np.asarray(value).dtype.kind in "mM":
        raise ValueError(
            f"{name} must be numbers of seconds, not {np.asarray(value).dtype}; subtract an epoch"
        )
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be numbers, got {value!r}") from None
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        wanted = "(" + ", ".join("any" if want is None else str(want) for want in shape) + ")"
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name} must be finite, got {array}")
    array.flags.writeable = False
    return array
