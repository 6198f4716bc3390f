"""The verdict on a printed value; the page "How a printed number is judged" of the book gives the reasons.

*Deterministic* rows and *inputs* agree within one unit of the last printed digit, a *count* must be equal, a
*text* (a phrase) lies between limits that the chapter sets beforehand. *Monte-Carlo* rows are compared by::

    z = max(0, |ours - printed| - half a unit) / sqrt(SE_ours^2 + SE_printed^2)

with the limit of Sidak for the m rows of a table, level ``1 - (1 - alpha)^(1/m)``. Agreement is inconclusive
where a deviation of half the errors' spread could not have been found, or our error exceeds the paper's.
"""

import re
from dataclasses import asdict, dataclass
from statistics import NormalDist

import numpy as np

from ..checks import check_scalar, set_fields
from ..montecarlo import Source
from .paper import Printed

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
SYMBOLS = {REPRODUCED: "✓", CORRECTED: "✓*", NOT_REPRODUCED: "✗", INCONCLUSIVE: "?", UNSPECIFIED: "~"}


def within(value, at_least=None, at_most=None):
    """Whether a value, or each of an array, is between its limits; NaN is not."""
    low = -np.inf if at_least is None else at_least
    high = np.inf if at_most is None else at_most
    value = np.asarray(value, dtype=float)
    return (value >= low) & (value <= high)


@dataclass(frozen=True)
class Ours:
    """Our value for a printed one.

    A deterministic value has no standard errors; a phrase has limits within which it holds.
    """

    value: float
    se: float = 0.0  # standard error of ours
    se_printed: float = 0.0  # and that of the printed statistic, from the paper's number of runs
    spread: float = 0.0  # standard deviation of one run's error: what the test ought to resolve
    erratum: str = ""  # whose correction was applied
    assumption: str = ""  # what had to be assumed because the paper does not say it
    note: str = ""
    at_least: float | None = None
    at_most: float | None = None

    @property
    def criterion(self):
        """The limits in words; empty where there are none."""
        limits = (("at least", self.at_least), ("at most", self.at_most))
        return " and ".join(f"{word} {limit:g}" for word, limit in limits if limit is not None)


def of_statistics(found, i, printed_runs):
    """Bias and standard deviation of component ``i``, two `Ours`, against those of ``printed_runs`` runs.

    ``found`` are the `tmalib.montecarlo.Statistics` of our own runs.
    """
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
    sources: tuple = ()  # of the Monte-Carlo runs behind ours
    notebook: str = ""  # where it was computed; filled in when it is read
    cell: int = -1

    def __post_init__(self):
        sources = (source if isinstance(source, Source) else Source(**source) for source in self.sources)
        set_fields(self, sources=tuple(sources))


def z_score(printed_value, last_digit, ours):
    """Deviation in standard errors, rounding of the printed value allowed for."""
    excess = max(0.0, abs(ours.value - printed_value) - last_digit / 2)
    return excess / np.hypot(ours.se, ours.se_printed)


def sidak_limit(rows, alpha=ALPHA):
    """Largest ``|z|`` in a family of ``rows`` rows that does not reject at level ``alpha``."""
    alpha = check_scalar("alpha", alpha, above=0.0)
    level = 1 - (1 - alpha) ** (1 / rows)
    return NormalDist().inv_cdf(1 - level / 2)


def judge(paper, table, ours, *, made_from=(), alpha=ALPHA):
    """`Verdicts` on rows of a table of a `Paper`; ``ours`` maps ``(row, column)`` to `Ours`.

    All Monte-Carlo rows of the table belong in one call: they are the family over which the level ``alpha``,
    the probability of rejecting a table that is right, is kept. They and phrases name the `Runs` or `Stream`
    that they are ``made_from``. `ValueError` for an unknown key, no rows, a value that is not finite, a
    Monte-Carlo row without standard errors, a text row without limits or another row with them.
    """
    rows = [(paper.printed(table, *key), value) for key, value in ours.items()]
    return judge_rows(rows, made_from=made_from, alpha=alpha)


def judge_rows(rows, *, made_from=(), alpha=ALPHA):
    """Judge pairs of `Printed` and `Ours`, one table, like `judge`; the printed values may be simulated."""
    rows = list(rows)
    if not rows:
        raise ValueError("nothing to judge: ours is empty")
    sources = tuple(dict.fromkeys(found.source for found in made_from))
    family = sum(row.kind == "monte-carlo" for row, _ in rows)
    limit = sidak_limit(family, alpha) if family else None
    return Verdicts(tuple(_judge_row(row, ours, limit, sources) for row, ours in rows), limit)


def _judge_row(row, ours, limit, sources):
    check_scalar(f"our value of {row.key}", ours.value)
    if (row.kind == "text") != bool(ours.criterion):
        raise ValueError(f"limits are for text rows, which need one: {row.key}, got {ours}")
    resolved, random, held = True, {}, ""
    if row.kind == "monte-carlo":
        if not (ours.se > 0 and ours.se_printed > 0 and ours.spread > 0):
            raise ValueError(f"the Monte-Carlo row {row.key} needs standard errors and a spread, got {ours}")
        half, spread = row.last_digit / 2, np.hypot(ours.se, ours.se_printed)
        z, detectable = z_score(row.value, row.last_digit, ours), half + (limit + POWER_QUANTILE) * spread
        agrees = z <= limit
        resolved = ours.se <= ours.se_printed and detectable <= RESOLUTION * ours.spread
        random = dict(z=float(z), rounding=float(half / spread), detectable=float(detectable), limit=limit)
    elif row.kind == "text":
        agrees = within(ours.value, ours.at_least, ours.at_most)
        held = f"{'holds' if agrees else 'does not hold'}: {ours.criterion} was asked"
    else:
        agrees = row.agrees(ours.value)
    return Claim(
        **vars(row),
        **random,
        ours=float(ours.value),
        se=float(ours.se),
        verdict=_word(agrees, resolved, ours),
        erratum=ours.erratum,
        note="; ".join(filter(None, (held, ours.note, ours.assumption))),
        sources=sources if row.kind in ("monte-carlo", "text") else (),
    )


def _word(agrees, resolved, ours):
    """The verdict in one of the five words."""
    if ours.assumption:
        return UNSPECIFIED
    if not agrees:
        return NOT_REPRODUCED
    return INCONCLUSIVE if not resolved else CORRECTED if ours.erratum else REPRODUCED


@dataclass(frozen=True)
class Verdicts:
    """Judged rows of one table; shows itself as a table and carries its claims to the book."""

    claims: tuple
    limit: float | None

    def __iter__(self):
        return iter(self.claims)

    def __len__(self):
        return len(self.claims)

    def of(self, row, column):
        """The claim on one row."""
        for claim in self.claims:
            if (claim.row, claim.column) == (row, column):
                return claim
        raise ValueError(f"no claim on row {row!r}, column {column!r} was judged here")

    def count(self, *verdicts):
        """How many rows have one of these verdicts."""
        return sum(claim.verdict in verdicts for claim in self.claims)

    def __str__(self):
        lines = [("row", "column", "printed", "ours", "se", "z", "verdict")]
        for c in self.claims:
            z = "" if c.z is None else f"{c.z:.2f}"
            se = f"{c.se:.2g}" if c.se else ""
            lines.append((c.row, c.column, c.printed, same_digits(c.ours, c.printed), se, z, c.verdict))
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)

    def _repr_mimebundle_(self, include=None, exclude=None):
        return {"text/plain": str(self), CLAIMS: [asdict(claim) for claim in self.claims]}


def same_digits(value, like):
    """``value`` with as many digits as the printed number ``like``; three significant ones for a phrase."""
    if not re.fullmatch(r"[-+]?[0-9.]+(e[-+]?[0-9]+)?", like.lower()):
        return f"{value:.3g}"
    mantissa, _, exponent = like.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    text = f"{value:.{decimals}{'e' if exponent else 'f'}}"
    return re.sub(r"e([+-])0*(\d)", lambda m: f"e{m[1].replace('+', '')}{m[2]}", text)
