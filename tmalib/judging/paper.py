"""A paper's manifest and ledger: all that the book has to know of it, read from its folder.

``paper.toml`` has key, title, citation, part of the book, chapters; tables, rows and columns as in the ledger
and as typeset; random streams with their numbers; errata with title and status; and, where phrases are judged
over what a paper does not print, from where that is drawn (``plausible``). ``published.csv`` is the
ledger, one row a printed value or statement, exactly as printed; the row of a statement is its name. No
number of a paper stands anywhere else. What its sections hold is in ``contents.toml``, and by what its
phrases are measured, where there are any, in ``phrases.toml``.
"""

from __future__ import annotations

import csv
import tomllib
from dataclasses import dataclass, field, fields
from decimal import Decimal
from functools import cached_property
from pathlib import Path
from typing import Any

from ..montecarlo import Stream
from ..types import FilePath
from .contents import Contents, read_contents

PAPERS = Path(__file__).parent.parent / "papers"
GROUPS = {  # of the kinds of rows, counted apart
    "results": ("deterministic", "count", "monte-carlo"),
    "statements": ("statement",),
    "phrases": ("text",),
    "inputs": ("input",),
}
KINDS = tuple(kind for kinds in GROUPS.values() for kind in kinds)
LEDGER = ("table", "row", "column", "printed", "unit", "kind", "runs")


@dataclass(frozen=True)
class Printed:
    """One row of the ledger."""

    paper: str
    table: str
    row: str
    column: str
    printed: str
    unit: str
    kind: str
    runs: int | None

    @property
    def key(self) -> tuple[str, str, str, str]:
        """``(paper, table, row, column)``."""
        return (self.paper, self.table, self.row, self.column)

    @property
    def value(self) -> float:
        """The printed number; `ValueError` for a phrase or a statement, which has none."""
        return float(self.printed)

    @property
    def in_words(self) -> bool:
        """Whether words are printed, not a number."""
        return self.kind in ("text", "statement")

    @property
    def group(self) -> str:
        """The one of `GROUPS` that it is counted in."""
        return next(group for group, kinds in GROUPS.items() if self.kind in kinds)

    @property
    def last_digit(self) -> float:
        """One unit of the last printed digit: 0.01 for "1.50", 10000 for "1.16e6"."""
        return 10.0 ** int(Decimal(self.printed).as_tuple().exponent)

    def units_off(self, value: float) -> float:
        """Distance of a value from the printed one, in units of the last printed digit."""
        return abs(value - self.value) / self.last_digit

    def agrees(self, value: float) -> bool:
        """Whether a value is within one unit of the last printed digit; a count must be equal."""
        one = 1 + 1e-9  # rounding of the difference itself must not decide
        return bool(value == self.value if self.kind == "count" else self.units_off(value) <= one)


@dataclass(frozen=True)
class Paper:
    """The manifest of a paper, and through it the ledger."""

    folder: Path  # whose name is also that of the folder of its chapters
    key: str
    title: str
    citation: str
    part: int
    chapters: list[str]
    tables: dict[str, str]
    rows: dict[str, str]
    columns: dict[str, str]
    streams: dict[str, int]
    errata: dict[str, dict[str, str]]
    plausible: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def ledger(self) -> dict[tuple[str, str, str], Printed]:
        """All printed values, a dict from ``(table, row, column)`` to `Printed`."""
        path = self.folder / "published.csv"
        found: dict[tuple[str, str, str], Printed] = {}
        known = dict(table=self.tables, row=self.rows, column=self.columns, kind=KINDS)
        with path.open(newline="", encoding="utf-8") as lines:
            reader = csv.DictReader(lines)
            if tuple(reader.fieldnames or ()) != LEDGER:
                raise ValueError(f"{path}: the columns must be {LEDGER}, got {reader.fieldnames}")
            for row in reader:
                for name, values in known.items():
                    names_itself = name == "row" and row["kind"] == "statement"
                    if row[name] not in values and not names_itself:
                        raise ValueError(f"{path}, line {reader.line_num}: {name} {row[name]!r} is unknown")
                cells: dict[str, Any] = row | {"runs": int(row["runs"]) if row["runs"] else None}
                printed = Printed(self.key, **cells)
                if found.setdefault(printed.key[1:], printed) is not printed:
                    raise ValueError(f"{path}: two rows have the same table, row and column")
        return found

    @cached_property
    def phrases(self) -> dict[str, Any]:
        """What is in ``phrases.toml``: by table and row, how a phrase is measured (see `phrases_of`)."""
        path = self.folder / "phrases.toml"
        return tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}

    @cached_property
    def contents(self) -> Contents:
        """What its sections hold, a `Contents`."""
        return read_contents(self.folder)

    def printed(self, table: str, row: str, column: str) -> Printed:
        """The ledger's row with this key; `ValueError` if there is none."""
        if (table, row, column) not in self.ledger:
            raise ValueError(f"{self.key} has no printed value {(table, row, column)}; see its published.csv")
        return self.ledger[table, row, column]

    def stream(self, name: str) -> Stream:
        """The `Stream` that the manifest numbers; `ValueError` for a name that it does not have."""
        if name not in self.streams:
            raise ValueError(f"stream must be one of {sorted(self.streams)}, got {name!r}")
        return Stream(name, self.streams[name])


def read_paper(folder: FilePath) -> Paper:
    """The `Paper` in a folder; `ValueError` for a manifest that lacks something or has something unknown."""
    path = Path(folder) / "paper.toml"
    found = tomllib.loads(path.read_text(encoding="utf-8"))
    wanted = {each.name for each in fields(Paper)} - {"folder", "plausible"}
    if found.keys() - {"plausible"} != wanted:
        raise ValueError(f"{path} must have {sorted(wanted)}, got {sorted(found)}")
    return Paper(Path(folder), **found)


def read_papers() -> dict[str, Paper]:
    """All papers, in the order of the book: a dict from key to `Paper`."""
    found = [read_paper(path.parent) for path in PAPERS.glob("*/paper.toml")]
    return {paper.key: paper for paper in sorted(found, key=lambda paper: paper.part)}
