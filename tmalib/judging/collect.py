"""What the executed notebooks carry in their outputs: claims, sources of figures, numbers for sentences."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ..montecarlo import Source
from .chapter import SOURCES
from .chapters import notebooks_in, read
from .verdict import CLAIMS, SYMBOLS, Claim

GLUE = "application/papermill.record/"  # how myst-nb's glue marks an output


@dataclass(frozen=True)
class Origin:
    """Where a figure or a judged table comes from."""

    notebook: str
    cell: int
    sources: tuple
    figure: str = ""
    paper: str = ""
    table: str = ""

    @classmethod
    def from_dict(cls, row):
        """The origin that `asdict` wrote."""
        return cls(**row | {"sources": tuple(Source(**source) for source in row["sources"])})


def outputs_of(notebook):
    """Index of the cell and bundle of every output that has data."""
    for index, cell in enumerate(notebook.cells):
        for output in cell.get("outputs", []):
            if "data" in output:
                yield index, output


def claims_of(executed):
    """All claims of the executed notebooks, each with notebook and cell."""
    return [
        replace(Claim(**row), notebook=name, cell=index)
        for name, path in notebooks_in(executed).items()
        for index, output in outputs_of(read(path))
        for row in output.data.get(CLAIMS, [])
    ]


def figure_name(cell):
    """Label of the captioned figure that a cell shows, or an empty text."""
    return cell.metadata.get("mystnb", {}).get("figure", {}).get("name", "")


def origins_of(executed, claims):
    """The `Origin` of every captioned figure and every judged table."""
    found = []
    for name, path in notebooks_in(executed).items():
        notebook = read(path)
        made_from = {}
        for index, output in outputs_of(notebook):
            made_from[index] = made_from.get(index, []) + output.data.get(SOURCES, [])
        for index, cell in enumerate(notebook.cells):
            if figure := figure_name(cell):
                sources = tuple(Source(**source) for source in made_from.get(index, []))
                found.append(Origin(name, index, sources, figure=figure))
    tables = {}
    for claim in claims:
        place = (claim.notebook, claim.cell, claim.paper, claim.table)
        tables[place] = tuple(dict.fromkeys((*tables.get(place, ()), *claim.sources)))
    found += [Origin(n, c, sources, paper=p, table=t) for (n, c, p, t), sources in tables.items()]
    return sorted(found, key=lambda origin: (origin.notebook, origin.cell))


def numbers_of(executed):
    """Keys of the numbers that each notebook makes known, by the notebook's name."""
    return {
        name: {
            output.metadata["scrapbook"]["name"]
            for _, output in outputs_of(read(path))
            if any(kind.startswith(GLUE) for kind in output.data)
        }
        for name, path in notebooks_in(executed).items()
    }


def problems(claims, papers):
    """What is wrong with the claims, a line each: every row of every ledger has exactly one verdict."""
    rows = {row.key: row for paper in papers.values() for row in paper.ledger.values()}
    counts = Counter(claim.key for claim in claims)
    found = [f"unjudged: {' | '.join(key)}" for key in rows if not counts[key]]
    found += [f"judged {n} times: {' | '.join(key)}" for key, n in counts.items() if n > 1]
    for claim in claims:
        where = f"{' | '.join(claim.key)} ({claim.notebook})"
        if claim.key not in rows:
            found.append(f"not a published value: {where}")
        elif claim.printed != rows[claim.key].printed:
            found.append(f"printed value differs from the ledger's: {where}")
        if claim.verdict not in SYMBOLS:
            found.append(f"unknown verdict {claim.verdict!r}: {where}")
    return found


def in_order(claims, papers):
    """The claims in the order of the ledgers."""
    keys = [row.key for paper in papers.values() for row in paper.ledger.values()]
    order = {key: place for place, key in enumerate(keys)}
    return sorted(claims, key=lambda claim: order.get(claim.key, len(order)))


def score(claims, papers):
    """One line a paper: how many rows are judged, and how."""
    for paper in papers.values():
        verdicts = Counter(claim.verdict for claim in claims if claim.paper == paper.key)
        words = ", ".join(f"{verdicts[word]} {word}" for word in SYMBOLS if verdicts[word])
        yield f"{paper.key}: {verdicts.total()} of {len(paper.ledger)} judged ({words})"


def write_json(rows, path):
    """Write dataclasses as a list of objects, at once."""
    text = json.dumps([asdict(row) for row in rows], indent=1, ensure_ascii=False, allow_nan=False)
    temporary = Path(path).with_suffix(".tmp")
    temporary.write_text(text + "\n", encoding="utf-8")
    temporary.replace(path)


def read_claims(path):
    """The claims of a file that `write_json` wrote."""
    return [Claim(**row) for row in json.loads(Path(path).read_text(encoding="utf-8"))]


def read_origins(path):
    """The origins of a file that `write_json` wrote."""
    return [Origin.from_dict(row) for row in json.loads(Path(path).read_text(encoding="utf-8"))]
