"""The verdict on what a paper states: a theorem, a case of a proof, a remark, a claim in words.

A verdict follows from *marks*, the steps that lead to it: what a computation proves, what is argued by hand
in the text beside it, what is measured, what contradicts the printed form, what is left open. A mark that
claims a computation takes the boolean that the cell has computed: no statement claims more than its cell.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..checks import set_fields
from ..montecarlo import Runs, Source, Stream
from .paper import Paper, Printed
from .verdict import Claim, Verdicts

HOLDS = "holds"
AMENDED = "holds as corrected"
FALSE = "false"
OPEN = "open"
SYMBOLS = {HOLDS: "✓", AMENDED: "✓*", FALSE: "✗", OPEN: "?"}

PROVED, WITH_HAND, BY_HAND, MEASURED = "proved", "proved, steps by hand", "by hand", "measured"
BASES = {PROVED: "■", WITH_HAND: "◧", BY_HAND: "✎", MEASURED: "▒", FALSE: "✗", OPEN: "?"}
TABLE, COLUMN = "Statements", "claim"  # of the ledger, for every statement


@dataclass(frozen=True, kw_only=True)
class Marks:
    """The steps that lead to a verdict on a statement, each with a name.

    ``proved`` (computer algebra, exact arithmetic), ``measured`` (numbers, which support and prove nothing)
    and ``refuted`` (what contradicts the printed form) map names to booleans that the cell has computed;
    `judge_statements` refuses one that is not True. ``by_hand`` and ``left_open`` are names only. With an
    ``erratum`` the first three speak of the corrected form. ``rests_on`` names other statements of the paper.
    """

    proved: Mapping[str, bool] = field(default_factory=dict)
    by_hand: Sequence[str] = ()
    measured: Mapping[str, bool] = field(default_factory=dict)
    refuted: Mapping[str, bool] = field(default_factory=dict)
    left_open: Sequence[str] = ()
    erratum: str = ""
    rests_on: Sequence[str] = ()
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Statement(Printed):
    """A judged statement, as it is written into a notebook's output and as it is read from there."""

    proved: tuple[str, ...]
    by_hand: tuple[str, ...]
    measured: tuple[str, ...]
    refuted: tuple[str, ...]
    left_open: tuple[str, ...]
    rests_on: tuple[str, ...]
    verdict: str
    erratum: str
    note: str
    sources: tuple[Source, ...] = ()
    notebook: str = ""
    cell: int = -1

    z = probability = None  # there is no test of significance

    def __post_init__(self) -> None:
        names = ("proved", "by_hand", "measured", "refuted", "left_open", "rests_on")
        sources = (source if isinstance(source, Source) else Source(**source) for source in self.sources)
        set_fields(self, sources=tuple(sources), **{name: tuple(getattr(self, name)) for name in names})

    @property
    def basis(self) -> str:
        """On what the verdict rests, one of `BASES`: the weakest of its steps decides."""
        if self.verdict in (FALSE, OPEN):
            return self.verdict
        if self.proved:
            return WITH_HAND if self.by_hand else PROVED
        return BY_HAND if self.by_hand else MEASURED

    @property
    def steps(self) -> tuple[str, ...]:
        """The marks in words, a line a kind."""
        kinds = {"proved": self.proved, "by hand": self.by_hand, "measured": self.measured}
        kinds |= {"against the printed form": self.refuted, "open": self.left_open}
        return tuple(f"{kind}: {'; '.join(names)}" for kind, names in kinds.items() if names)

    def __str__(self) -> str:
        lines = (f"{self.row}: {self.verdict}", *self.steps)
        return "\n  ".join(textwrap.fill(line, 76, subsequent_indent="    ") for line in lines)


def judge_statements(
    paper: Paper, marks: Mapping[Any, Marks], *, made_from: Iterable[Runs | Stream] = ()
) -> Verdicts:
    """`Verdicts` on statements of a `Paper`; ``marks`` maps names of statements to `Marks`.

    ``made_from`` are the `Runs` or streams behind what is measured. `ValueError` for a statement that the
    ledger does not have, for a mark whose condition is not a computed True, and for marks that give no
    verdict: none at all, or a printed form that is contradicted beside a proof without an erratum.
    """
    sources = tuple(dict.fromkeys(found.source for found in made_from))
    found = [_state(paper.printed(TABLE, row, COLUMN), mark, sources) for row, mark in marks.items()]
    for claim in found:
        for other in claim.rests_on:
            paper.printed(TABLE, other, COLUMN)
    return Verdicts(tuple(found), None)


def _state(row, marks, sources):
    if row.kind != "statement":
        raise ValueError(f"{row.key} is no statement, but of the kind {row.kind!r}")
    for kind in ("proved", "measured", "refuted"):
        for name, shown in getattr(marks, kind).items():
            if not (isinstance(shown, bool | np.bool_) and shown):
                raise ValueError(f"{row.row}: {kind} {name!r} must be a computed True, got {shown!r}")
    lists = dict(by_hand=marks.by_hand, left_open=marks.left_open, rests_on=marks.rests_on)
    if words := [name for name, given in lists.items() if isinstance(given, str)]:
        raise ValueError(f"{row.row}: {words[0]} must be a list of names, got {lists[words[0]]!r}")
    steps = dict(proved=tuple(marks.proved), measured=tuple(marks.measured), refuted=tuple(marks.refuted))
    found = dict(verdict=_word(row, marks), erratum=marks.erratum, note=marks.note, sources=sources)
    return Statement(**vars(row), **steps, **lists, **found)


def _word(row, marks):
    """The verdict, which follows from the marks."""
    supported = bool(marks.proved or marks.by_hand or marks.measured)
    if marks.left_open:
        return OPEN
    if not supported and not marks.refuted:
        raise ValueError(f"{row.row}: there is no mark, so there is no verdict")
    if not supported:
        return FALSE
    if marks.refuted and not marks.erratum:
        raise ValueError(f"{row.row}: supported and contradicted; an erratum must say what is corrected")
    return AMENDED if marks.erratum else HOLDS


def read_claim(row: Mapping[str, Any]) -> Statement | Claim:
    """The `Statement` or `Claim` that ``row``, a dict, holds."""
    return (Statement if row["kind"] == "statement" else Claim)(**row)


def wrong_foundations(claims):
    """One line for each statement that rests on what is not judged, false, open, or in the end on itself."""
    stated = {claim.key: claim for claim in claims if isinstance(claim, Statement)}
    found = []
    for claim in stated.values():
        below = {key: stated.get(key) for key in foundations(claim)}
        for key, other in below.items():
            if other is None:
                found.append(f"{claim.row} rests on {key[2]}, which is not judged")
            elif other.verdict in (FALSE, OPEN) and claim.verdict in (HOLDS, AMENDED):
                found.append(
                    f"{claim.row} is said to hold, and rests on {other.row}, which is {other.verdict}"
                )
    grounded = heights(stated)
    return found + [f"{claim.row} rests on itself" for key, claim in stated.items() if key not in grounded]


def foundations(claim):
    """Keys of the statements that one rests on."""
    return [(claim.paper, TABLE, row, COLUMN) for row in claim.rests_on]


def heights(stated):
    """How many floors each statement is above those that rest on nothing; ``stated`` maps keys to statements.

    A statement in a circle, or above one, is missing.
    """
    found = {}
    while ready := [
        key
        for key, claim in stated.items()
        if key not in found and all(below in found for below in foundations(claim) if below in stated)
    ]:
        for key in ready:
            below = [found[other] for other in foundations(stated[key]) if other in found]
            found[key] = 1 + max(below, default=-1)
    return found
