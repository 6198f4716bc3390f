"""What the sections of a paper hold, item by item, and where each is judged or shown: ``contents.toml``.

::

    [[section]]
    number = "3.1"
    title = "Observability analysis"
    items = [
      { kind = "theorem", name = "Theorem 1", judged = ["Statements; Theorem 1"], see = ["conical-t1"] },
    ]

An item is ``judged`` under keys of the ledger, a table or a row of it, or can be seen (``see``) at labels of
the book, or both. Items are identified, not quoted. The same file has the errata in short, for their table.
"""

import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

ITEMS = ("theorem", "proposition", "remark", "case", "claim", "equation", "table", "figure", "numbers")
NUMBERED = ("theorem", "proposition", "remark", "case")  # what a proof is expected of
SHORT = ("where", "printed", "corrected", "evidence", "consequence")  # fields of an erratum in short


@dataclass(frozen=True, kw_only=True)
class Item:
    """A numbered item or a claim of a section."""

    kind: str
    name: str
    judged: tuple = ()  # parts of keys of the ledger: (table,), (table, row) or (table, row, column)
    see: tuple = ()  # labels of the book

    def covers(self, key):
        """Whether a row of the ledger, ``(table, row, column)``, is judged here."""
        return any(key[: len(part)] == part for part in self.judged)


@dataclass(frozen=True, kw_only=True)
class Section:
    """A section of a paper."""

    number: str
    title: str
    items: tuple


@dataclass(frozen=True, kw_only=True)
class Contents:
    """The sections of a paper, and its errata in short."""

    sections: tuple
    errata: dict

    def items_of(self, row):
        """The items under which a `Printed` is judged."""
        return [item for section in self.sections for item in section.items if item.covers(row.key[1:])]

    def order_of(self, row):
        """``(section, item)``, counted, where a `Printed` is first listed; `ValueError` if it is nowhere."""
        for place, section in enumerate(self.sections):
            for number, item in enumerate(section.items):
                if item.covers(row.key[1:]):
                    return place, number
        raise ValueError(f"no section lists {row.key}")

    def place_of(self, row):
        """The number of the section that lists a `Printed` first."""
        return self.sections[self.order_of(row)[0]].number


def read_contents(folder):
    """The `Contents` in a folder; `ValueError` for an item or an erratum of another form."""
    path = Path(folder) / "contents.toml"
    found = tomllib.loads(path.read_text(encoding="utf-8"))
    if found.keys() != {"section", "errata"}:
        raise ValueError(f"{path} must have section and errata, got {sorted(found)}")
    for name, short in found["errata"].items():
        if tuple(short) != SHORT or not all(short.values()):
            raise ValueError(f"{path}: erratum {name} must have {SHORT}, got {short}")
    sections = [Section(**row | {"items": tuple(map(_item, row["items"]))}) for row in found["section"]]
    return Contents(sections=tuple(sections), errata=found["errata"])


def _item(row):
    judged = tuple(tuple(part.strip() for part in key.split(";")) for key in row.get("judged", ()))
    item = Item(**row | {"judged": judged, "see": tuple(row.get("see", ()))})
    if item.kind not in ITEMS or not (item.judged or item.see):
        raise ValueError(f"an item has a kind of {ITEMS} and is judged or seen somewhere, got {row}")
    return item


def gaps(paper):
    """What a `Paper`'s contents lack, a line each: keys without a row, rows and errata in no list."""
    items = [item for section in paper.contents.sections for item in section.items]
    found = [
        f"{paper.key}: {item.name} is judged under {'; '.join(part)}, where nothing is printed"
        for item in items
        for part in item.judged
        if not any(key[: len(part)] == part for key in paper.ledger)
    ]
    found += [f"{paper.key}: in no section: {'; '.join(r.key)}" for r in _unlisted(paper)]
    if list(paper.contents.errata) != list(paper.errata):
        found.append(f"{paper.key}: the errata in short are not those of the manifest, in its order")
    names = Counter((s.number, item.kind, item.name) for s in paper.contents.sections for item in s.items)
    return found + [f"{paper.key}: listed {n} times: {' '.join(name)}" for name, n in names.items() if n > 1]


def _unlisted(paper):
    return [row for row in paper.ledger.values() if not paper.contents.items_of(row)]
