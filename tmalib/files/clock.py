"""Times in files, read without loss.

A time is a decimal number of seconds or an ISO 8601 date-time such as ``2024-05-01T12:00:00.25Z``, with ``Z``
or an offset such as ``+02:00``. Without these it is UTC; all times of a file have a zone or none has. Both
are kept as decimal numbers until the epoch is subtracted: a Unix time of 1.7e9 s as a float is rounded to
2e-7 s.

Numbers in an own ship's track are *Unix times*, seconds since 1970, if the first is 1e8 or more. With Unix
times or date-times the *epoch* is the first fix, rounded down to a microsecond, and times are seconds since
it. With smaller numbers there is no epoch, and they stay as they are.
"""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from decimal import Decimal
from typing import NamedTuple

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
DATE = re.compile(r"(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d(?::\d\d)?)(\.\d+)?(Z|[+-]\d\d:\d\d)?", re.ASCII)
UNIX_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
LEAST_UNIX_TIME = 10**8
LONGEST = 60  # characters of a time
LATEST = 250_000_000_000  # seconds: the year 9892


class FileTime(NamedTuple):
    """A time in a file: exact ``seconds``, since 1970 if ``kind`` is no number."""

    kind: str  # "number", "date-time with a zone", "date-time without a zone"
    seconds: Decimal


def parse_time(text: str) -> FileTime:
    """The `FileTime` of a cell; `ValueError` for what is neither a number nor a date-time."""
    if len(text) <= LONGEST:
        if NUMBER.fullmatch(text):
            if abs(seconds := Decimal(text)) > LATEST:
                raise ValueError(f"{text} is more than {LATEST} seconds; milliseconds since 1970?")
            return FileTime("number", seconds)
        if found := DATE.fullmatch(text):
            day, clock, fraction, zone = found.groups()
            try:
                moment = datetime.fromisoformat(f"{day}T{clock}{zone or 'Z'}")
            except ValueError as error:
                raise ValueError(f"{text!r} is no date-time: {error}") from None
            kind = f"date-time {'with' if zone else 'without'} a zone"
            return FileTime(kind, unix_seconds(moment) + Decimal(fraction or 0))
    wanted = "a number or a date-time such as 2024-05-01T12:00:00Z"
    raise ValueError(f"a time is {wanted}, got {text[:LONGEST]!r}")


def unix_seconds(moment: datetime) -> Decimal:
    """Seconds since 1970 of an aware `datetime`, exactly."""
    return Decimal((moment - UNIX_EPOCH) // timedelta(microseconds=1)).scaleb(-6)


def moment_of(seconds: Decimal) -> datetime:
    """The `datetime` of seconds since 1970, rounded down to a microsecond."""
    return UNIX_EPOCH + timedelta(microseconds=int((seconds * 10**6).to_integral_value("ROUND_FLOOR")))


def date_time_of(seconds: Decimal) -> str:
    """The date-time in UTC of exact seconds since 1970, a text that `parse_time` reads back."""
    whole = seconds.to_integral_value("ROUND_FLOOR")
    fraction = f"{(seconds - whole).normalize():f}"[1:] if seconds != whole else ""
    return f"{moment_of(whole):%Y-%m-%dT%H:%M:%S}{fraction}Z"
