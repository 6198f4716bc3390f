"""The verdict on a printed value; the page "How a printed number is judged" of the book gives the reasons.

*Deterministic* rows and *inputs* agree within one unit of the last printed digit, a *count* must be equal, a
*text* (a phrase) lies between limits that the chapter sets beforehand; if that rests on what is not printed,
the share of plausible scenarios in which it does decides (`share_word`). *Monte-Carlo* rows are compared by::

    z = max(0, |ours - printed| - half a unit) / sqrt(SE_ours^2 + SE_printed^2)

with the limit of Sidak for the m rows of a table, level ``1 - (1 - alpha)^(1/m)``. Agreement is inconclusive
where a deviation of half the errors' spread could not have been found, or our error exceeds the paper's.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from decimal import Decimal, InvalidOperation
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import check_scalar, set_fields
from ..montecarlo import Runs, Source, Statistics, Stream
from .paper import Paper, Printed

ALPHA = 0.05
POWER = 0.8
POWER_QUANTILE = NormalDist().inv_cdf(POWER)
RESOLUTION = 0.5  # of the errors' spread: a test that cannot see so much is not conclusive
CLAIMS = "application/vnd.tmalib.claims+json"  # the type of a notebook's output that carries claims

REPRODUCED = "reproduced"
CORRECTED = "reproduced after correction"
NOT_REPRODUCED = "not reproduced"
INCONCLUSIVE = "inconclusive"
UNSPECIFIED = "unspecified"
MOSTLY = "mostly holds"
DEPENDS = "depends on what is not printed"
RARELY = "rarely holds"
SYMBOLS = {REPRODUCED: "✓", CORRECTED: "✓*", NOT_REPRODUCED: "✗", INCONCLUSIVE: "?", UNSPECIFIED: "~"}
SYMBOLS |= {MOSTLY: "●", DEPENDS: "◐", RARELY: "○"}
FEW, MOST = 0.25, 0.75  # of the plausible scenarios


def within(value: ArrayLike, at_least: float | None = None, at_most: float | None = None) -> Any:
    """Whether a value, or each of an array, is between its limits; NaN is not."""
    value = np.asarray(value, dtype=float)
    return np.clip(value, at_least, at_most) == value


def share_interval(held: int, scenarios: int) -> tuple[float, float]:
    """Interval of Clopper and Pearson, level ``1 - ALPHA``, for a share seen as ``held`` of ``scenarios``."""
    from scipy.stats import binomtest  # imported here: it costs half a second

    low, high = binomtest(held, scenarios).proportion_ci(1 - ALPHA, method="exact")
    return float(low), float(high)


def share_word(held: int, scenarios: int) -> str:
    """The verdict on a phrase that holds in so many plausible scenarios: the interval decides."""
    low, high = share_interval(held, scenarios)
    return MOSTLY if low > MOST else RARELY if high < FEW else DEPENDS


@dataclass(frozen=True)
class Ours:
    """Our value for a printed one; standard errors are for Monte-Carlo rows, limits for phrases."""

    value: float
    se: float = 0.0  # standard error of ours
    se_printed: float = 0.0  # and that of the printed statistic, from the paper's number of runs
    spread: float = 0.0  # standard deviation of one run's error: what the test ought to resolve
    erratum: str = ""  # whose correction was applied
    assumption: str = ""  # what had to be assumed because the paper does not say it
    note: str = ""
    at_least: float | None = None
    at_most: float | None = None
    among: tuple[int, int] | None = None  # plausible scenarios in which a phrase holds, and how many

    @property
    def criterion(self) -> str:
        """The limits in words; empty where there are none."""
        limits = (("at least", self.at_least), ("at most", self.at_most))
        return " and ".join(f"{word} {limit:g}" for word, limit in limits if limit is not None)


def of_statistics(found: Statistics, i: int, printed_runs: int) -> tuple[Ours, ...]:
    """Two `Ours`: bias and standard deviation of component ``i`` of `Statistics`, for the paper's runs."""
    pairs = ((found.bias, found.bias_se), (found.std, found.std_se))
    return tuple(Ours(value[i], se()[i], se(printed_runs)[i], found.std[i]) for value, se in pairs)


@dataclass(frozen=True, kw_only=True)
class Claim(Printed):
    """A judged row of the ledger, as it is written into a notebook's output and as it is read from there.

    A deterministic row has no ``z``, ``limit``, ``rounding`` and ``detectable``.
    """

    ours: float
    se: float
    z: float | None = None
    limit: float | None = None  # for z, of the family
    rounding: float | None = None  # half a unit of the last printed digit in standard errors
    detectable: float | None = None  # the smallest deviation that would have been found
    verdict: str
    erratum: str
    note: str
    sources: tuple[Source, ...] = ()  # of the Monte-Carlo runs behind ours
    notebook: str = ""  # where it was computed; filled in when it is read
    cell: int = -1

    def __post_init__(self) -> None:
        sources = (source if isinstance(source, Source) else Source(**source) for source in self.sources)
        set_fields(self, sources=tuple(sources))

    def __str__(self) -> str:
        z = "" if self.z is None else f", z {self.z:.2f}"
        ours = same_digits(self.ours, self.printed)
        return f"{' | '.join(self.key)}: printed {self.printed}, ours {ours}{z}, {self.verdict}"


def z_score(printed_value: float, last_digit: float, ours: Ours) -> float:
    """Deviation in standard errors, rounding of the printed value allowed for."""
    excess = max(0.0, abs(ours.value - printed_value) - last_digit / 2)
    return excess / np.hypot(ours.se, ours.se_printed)


def sidak_limit(rows: int) -> float:
    """Largest ``|z|`` in a family of ``rows`` rows that does not reject at level `ALPHA`."""
    level = 1 - (1 - ALPHA) ** (1 / rows)
    return NormalDist().inv_cdf(1 - level / 2)


def judge(
    paper: Paper, table: str, ours: Mapping[tuple[str, str], Ours], *, made_from: Iterable[Runs | Stream] = ()
) -> Verdicts:
    """`Verdicts` on rows of a table of a `Paper`; ``ours`` maps ``(row, column)`` to `Ours`.

    All Monte-Carlo rows of the table belong in one call: they are the family over which the level `ALPHA`,
    the probability of rejecting a table that is right, is kept. They and phrases name the `Runs` or `Stream`
    that they are ``made_from``. `ValueError` for an unknown key, no rows, a value that is not finite, a
    Monte-Carlo row without standard errors, a text row without limits or another row with them.
    """
    return judge_rows([(paper.printed(table, *key), ours[key]) for key in ours], made_from=made_from)


def judge_rows(rows: Iterable[tuple[Printed, Ours]], *, made_from: Iterable[Runs | Stream] = ()) -> Verdicts:
    """Judge pairs of `Printed` and `Ours`, one table, like `judge`; the printed values may be simulated."""
    if not (rows := list(rows)):
        raise ValueError("nothing to judge: ours is empty")
    sources = tuple(dict.fromkeys(found.source for found in made_from))
    family = sum(row.kind == "monte-carlo" for row, _ in rows)
    limit = sidak_limit(family) if family else None
    return Verdicts(tuple(_judge_row(row, ours, limit, sources) for row, ours in rows), limit)


def _judge_row(row, ours, limit, sources):
    check_scalar(f"our value of {row.key}", ours.value)
    if (row.kind == "text") != bool(ours.criterion):
        raise ValueError(f"limits are for text rows, which need one: {row.key}, got {ours}")
    if ours.among and (row.kind != "text" or not 0 <= ours.among[0] <= ours.among[1] > 0):
        raise ValueError(f"among is for text rows, held and scenarios: {row.key}, got {ours}")
    tested, held, resolved = {}, "", True
    if row.kind == "monte-carlo":
        if not (ours.se > 0 and ours.se_printed > 0 and ours.spread > 0):
            raise ValueError(f"the Monte-Carlo row {row.key} needs standard errors and a spread, got {ours}")
        half, error = row.last_digit / 2, np.hypot(ours.se, ours.se_printed)
        z, detectable = z_score(row.value, row.last_digit, ours), half + (limit + POWER_QUANTILE) * error
        tested = dict(z=float(z), rounding=float(half / error), detectable=float(detectable))
        tested |= dict(limit=limit, sources=sources)
        agrees = z <= limit
        resolved = ours.se <= ours.se_printed and detectable <= RESOLUTION * ours.spread
    elif row.kind == "text":
        agrees, tested = within(ours.value, ours.at_least, ours.at_most), dict(sources=sources)
        held = f"{_where(agrees, ours)}: {ours.criterion} was asked"
    else:
        agrees = row.agrees(ours.value)
    note = "; ".join(filter(None, (held, ours.note, ours.assumption)))
    verdict = _word(agrees, resolved, ours)
    found = dict(ours=float(ours.value), se=float(ours.se), erratum=ours.erratum, note=note, verdict=verdict)
    return Claim(**vars(row), **found, **tested)


def _where(agrees, ours):
    """Where a phrase holds, in words."""
    if not ours.among:
        return "holds" if agrees else "does not hold"
    low, high = share_interval(*ours.among)
    held, scenarios = ours.among
    return f"holds in {held} of {scenarios} plausible scenarios ({100 * low:.0f} to {100 * high:.0f} %)"


def _word(agrees, resolved, ours):
    """The verdict in one of the words of `SYMBOLS`."""
    if ours.among:
        return share_word(*ours.among)
    if ours.assumption:
        return UNSPECIFIED
    if not agrees:
        return NOT_REPRODUCED
    return INCONCLUSIVE if not resolved else CORRECTED if ours.erratum else REPRODUCED


@dataclass(frozen=True)
class Verdicts:
    """Judged rows of one table; shows itself as a table and carries its claims to the book."""

    claims: tuple[Claim, ...]
    limit: float | None

    def __iter__(self) -> Iterator[Claim]:
        return iter(self.claims)

    def __len__(self) -> int:
        return len(self.claims)

    def of(self, row: str, column: str) -> Claim:
        """The claim on one row."""
        found = {(claim.row, claim.column): claim for claim in self.claims}
        if (row, column) not in found:
            raise ValueError(f"no claim on row {row!r}, column {column!r} was judged here")
        return found[row, column]

    def count(self, *verdicts: str) -> int:
        """How many rows have one of these verdicts."""
        return sum(claim.verdict in verdicts for claim in self.claims)

    def _repr_mimebundle_(self, include=None, exclude=None):
        text = "\n".join(map(str, self.claims))
        return {"text/plain": text, CLAIMS: [asdict(claim) for claim in self.claims]}


def same_digits(value: float, like: str) -> str:
    """``value`` with as many digits as the printed number ``like``; three significant ones for a phrase."""
    try:
        printed = Decimal(like).as_tuple()
    except InvalidOperation:
        return f"{value:.3g}"
    if "e" not in like.lower():
        return f"{value:.{-int(printed.exponent)}f}"
    mantissa, exponent = f"{value:.{len(printed.digits) - 1}e}".split("e")
    return f"{mantissa}e{int(exponent)}"
