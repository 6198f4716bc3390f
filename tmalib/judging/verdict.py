"""The verdict on a printed value; the page "How a printed number is judged" of the book gives the reasons.

*Deterministic* rows and *inputs* agree within one unit of the last printed digit, a *count* must be equal, a
*text* (a phrase) lies between limits that the chapter sets beforehand; if that rests on what is not printed,
the share of plausible scenarios in which it does decides (`share_word`). The *Monte-Carlo* rows of a table
are compared, cell by cell and all together, with experiments of the paper's size drawn from our own runs
(`tmalib.judging.vector`). It is inconclusive where a number only does not fit with the others, where our own
runs could have decided otherwise, where a deviation of half the errors' spread could not have been found, or
ours are fewer runs than the paper's.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from decimal import Decimal, InvalidOperation
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import check_scalar, set_fields
from ..montecarlo import Runs, Source, Stream
from .paper import Paper, Printed
from .vector import ALPHA, Comparison, draw_tables, statistic_of

AT_LIMIT = "so near the limit that our own runs could have decided otherwise"
MISFIT = "not clearly off by itself, but it does not fit with the other numbers of its table"
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
    """Our value for a printed one; runs are for Monte-Carlo rows (`of_runs`), limits for phrases."""

    value: float
    se: float = 0.0  # standard error of the measure of a phrase
    erratum: str = ""  # whose correction was applied
    assumption: str = ""  # what had to be assumed because the paper does not say it
    note: str = ""
    at_least: float | None = None
    at_most: float | None = None
    among: tuple[int, int] | None = None  # plausible scenarios in which a phrase holds, and how many
    runs: NDArray[Any] | None = field(default=None, compare=False, repr=False)  # one number a run, (N,)
    statistic: str = ""  # of the runs: what the paper prints of them
    weights: NDArray[Any] | None = field(default=None, compare=False, repr=False)  # of the runs

    @property
    def criterion(self) -> str:
        """The limits in words; empty where there are none."""
        limits = (("at least", self.at_least), ("at most", self.at_most))
        return " and ".join(f"{word} {limit:g}" for word, limit in limits if limit is not None)


def of_runs(
    runs: ArrayLike, statistic: str = "mean", *, weights: ArrayLike | None = None, **more: Any
) -> Ours:
    """`Ours` for a statistic over runs ``(N,)``; ``more`` are other fields of `Ours`.

    ``statistic`` is ``"mean"``, its ``"magnitude"`` or ``"std"``; ``weights`` as in `vector.draw_tables`.
    """
    runs = np.asarray(runs)
    found: dict[str, Any] = dict(runs=runs, statistic=statistic, weights=weights)
    return Ours(statistic_of(runs, statistic, weights), **found, **more)


@dataclass(frozen=True, kw_only=True)
class Claim(Printed):
    """A judged row of the ledger, as it is written into a notebook's output and as it is read from there.

    Only a Monte-Carlo row has a ``probability`` and what follows it.
    """

    ours: float
    se: float = 0.0  # standard error of the printed value: root mean square distance of experiments from ours
    probability: float | None = None  # two-sided, of the printed value
    level: float | None = None  # for that
    together: float | None = None  # probability of all Monte-Carlo rows of the table together
    level_together: float | None = None
    accepted: tuple[float, ...] = ()  # least and greatest printed value that alone would have passed
    detectable: tuple[float | None, ...] = ()  # shifts down and up that would have been found; or None
    verdict: str
    erratum: str
    note: str
    sources: tuple[Source, ...] = ()  # of the Monte-Carlo runs behind ours
    notebook: str = ""  # where it was computed; filled in when it is read
    cell: int = -1

    def __post_init__(self) -> None:
        sources = (source if isinstance(source, Source) else Source(**source) for source in self.sources)
        pairs = dict(accepted=tuple(self.accepted), detectable=tuple(self.detectable))
        set_fields(self, sources=tuple(sources), **pairs)

    @property
    def deviation(self) -> float:
        """How far the printed value is from ours, beyond one unit of its last digit, in standard errors.

        It says how large a deviation is; whether it is too large says the ``probability``.
        """
        return max(0.0, abs(self.ours - self.value) - self.last_digit) / self.se

    @property
    def limit(self) -> float:
        """The deviation that is questioned where the statistic is Gaussian."""
        if self.level is None:
            raise ValueError(f"there is no limit for a row without a test: {self.key}")
        return NormalDist().inv_cdf(1 - self.level / 2)

    def __str__(self) -> str:
        tested = "" if self.probability is None else f", probability {self.probability:.2g}"
        ours = same_digits(self.ours, self.printed)
        return f"{' | '.join(self.key)}: printed {self.printed}, ours {ours}{tested}, {self.verdict}"


def judge(
    paper: Paper, table: str, ours: Mapping[tuple[str, str], Ours], *, made_from: Iterable[Runs | Stream] = ()
) -> Verdicts:
    """`Verdicts` on rows of a table of a `Paper`; ``ours`` maps ``(row, column)`` to `Ours`.

    All Monte-Carlo rows of the table belong in one call: they are the family over which the level `ALPHA`,
    the probability of rejecting a table that is right, is kept. They and phrases name the `Runs` or `Stream`
    that they are ``made_from``. `ValueError` for an unknown key, no rows, a value that is not finite, a
    Monte-Carlo row without runs or with others than the rest of the table, a text row without limits or
    another row with them.
    """
    return judge_rows([(paper.printed(table, *key), ours[key]) for key in ours], made_from=made_from)


def judge_rows(rows: Iterable[tuple[Printed, Ours]], *, made_from: Iterable[Runs | Stream] = ()) -> Verdicts:
    """Judge pairs of `Printed` and `Ours`, one table, like `judge`; the printed values may be simulated."""
    if not (rows := list(rows)):
        raise ValueError("nothing to judge: ours is empty")
    sources = tuple(dict.fromkeys(found.source for found in made_from))
    family = [(row, ours) for row, ours in rows if row.kind == "monte-carlo"]
    found = compare(family, tables_of(family)) if family else None
    place = {row.key: i for i, (row, _) in enumerate(family)}
    return Verdicts(
        tuple(_judge_row(row, ours, found, place.get(row.key), sources) for row, ours in rows), found
    )


def tables_of(family: Any) -> Any:
    """The `vector.RandomTables` for pairs of Monte-Carlo `Printed` and `Ours`, one table."""
    (first, like), *_ = family
    for row, ours in family:
        if ours.runs is None or ours.runs.shape != like.runs.shape or row.runs != first.runs:
            raise ValueError(f"the Monte-Carlo row {row.key} needs runs, as many as the rest of its table")
    runs = np.stack([ours.runs for _, ours in family], axis=1)
    return draw_tables(runs, [ours.statistic for _, ours in family], first.runs, weights=like.weights)


def compare(family: Any, tables: Any) -> Any:
    """The `vector.Comparison` of such pairs with such tables."""
    return tables.compare([row.value for row, _ in family], [row.last_digit for row, _ in family])


def _judge_row(row, ours, found, i, sources):
    """The claim on one row, the i-th of the table's Monte-Carlo rows in ``found``, or another."""
    check_scalar(f"our value of {row.key}", ours.value)
    if (row.kind == "text") != bool(ours.criterion):
        raise ValueError(f"limits are for text rows, which need one: {row.key}, got {ours}")
    if ours.among and (row.kind != "text" or not 0 <= ours.among[0] <= ours.among[1] > 0):
        raise ValueError(f"among is for text rows, held and scenarios: {row.key}, got {ours}")
    tested, held, resolved = {}, "", True
    if row.kind == "monte-carlo":
        tested = _tested(found, i) | dict(sources=sources)
        unsure = found.misfit[i] or found.at_limit[i]
        agrees = unsure or not found.alone[i]
        if found.misfit[i]:
            held = f"{MISFIT} (probability {found.together:.2g})"
        elif found.at_limit[i]:
            held = AT_LIMIT
        seen = np.nanmax(found.detectable[:, i]) <= RESOLUTION * np.std(ours.runs)
        resolved = seen and len(ours.runs) >= row.runs and not unsure
    elif row.kind == "text":
        agrees = within(ours.value, ours.at_least, ours.at_most)
        tested = dict(sources=sources, se=float(ours.se))
        held = f"{_where(agrees, ours)}: {ours.criterion} was asked"
    else:
        agrees = row.agrees(ours.value)
    note = "; ".join(filter(None, (held, ours.note, ours.assumption)))
    verdict = _word(agrees, resolved, ours)
    return Claim(
        **vars(row), ours=float(ours.value), erratum=ours.erratum, note=note, verdict=verdict, **tested
    )


def _tested(found, i):
    """What a `Claim` says of a Monte-Carlo row."""
    return dict(
        se=float(found.spread[i]),
        probability=float(found.probability[i]),
        level=found.level,
        together=found.together,
        level_together=found.level_together,
        accepted=tuple(map(float, found.accepted[:, i])),
        detectable=tuple(None if np.isnan(shift) else float(shift) for shift in found.detectable[:, i]),
    )


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
    """Judged rows of one table; shows itself as a table and carries its claims to the book.

    ``found`` is the `vector.Comparison` of its Monte-Carlo rows, None without any.
    """

    claims: tuple[Claim, ...]
    found: Comparison | None = None

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
