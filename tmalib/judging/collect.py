"""What the executed notebooks carry in their outputs: claims, origins of figures, numbers for sentences."""

import json
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

from ..montecarlo import Source
from .chapter import SOURCES
from .chapters import notebooks_in, read
from .contents import gaps
from .statements import SYMBOLS as OF_STATEMENTS
from .statements import Statement, read_claim, wrong_foundations
from .verdict import CLAIMS, SYMBOLS


@dataclass(frozen=True)
class Origin:
    """Where a figure or a judged table comes from: notebook, cell, and the runs in it."""

    notebook: str
    cell: int
    figure: str  # its label; empty for a table
    paper: str  # empty for a figure
    table: str
    sources: tuple


def outputs_of(cell):
    """The outputs of a cell that have data."""
    return [output for output in cell.get("outputs", []) if "data" in output]


def claims_in(name, notebook):
    """The claims of a notebook, each with the notebook's name and its cell."""
    return [
        read_claim(row | {"notebook": name, "cell": index})
        for index, cell in enumerate(notebook.cells)
        for output in outputs_of(cell)
        for row in output.data.get(CLAIMS, [])
    ]


def origins_in(name, notebook):
    """The `Origin` of every captioned figure and every judged table of a notebook."""
    found = {}
    for index, cell in enumerate(notebook.cells):
        if figure := cell.metadata.get("mystnb", {}).get("figure", {}).get("name"):
            rows = [row for output in outputs_of(cell) for row in output.metadata.get(SOURCES, [])]
            found[index, figure, "", ""] = dict.fromkeys(Source(**row) for row in rows)
    for claim in claims_in(name, notebook):
        found.setdefault((claim.cell, "", claim.paper, claim.table), {}).update(dict.fromkeys(claim.sources))
    return [Origin(name, *what, tuple(sources)) for what, sources in found.items()]


def numbers_in(notebook):
    """Keys of the numbers that a notebook makes known."""
    outputs = [output for cell in notebook.cells for output in outputs_of(cell)]
    return {output.metadata.scrapbook.name for output in outputs if "scrapbook" in output.metadata}


def all_claims(executed, papers):
    """The claims of all executed notebooks in the order of the ledgers; unknown ones last."""
    claims = [c for name, path in notebooks_in(executed).items() for c in claims_in(name, read(path))]
    place = {key: number for number, key in enumerate(ledger_of(papers))}
    return sorted(claims, key=lambda claim: place.get(claim.key, len(place)))


def ledger_of(papers):
    """The rows of all ledgers by their keys."""
    return {row.key: row for paper in papers.values() for row in paper.ledger.values()}


def problems(claims, papers):
    """What is wrong with the claims, a line each: every row of every ledger has exactly one verdict."""
    rows, counts = ledger_of(papers), Counter(claim.key for claim in claims)
    found = [f"unjudged: {' | '.join(key)}" for key in rows if not counts[key]]
    found += [f"judged {n} times: {' | '.join(key)}" for key, n in counts.items() if n > 1]
    for claim in claims:
        where = f"{claim} ({claim.notebook})"
        if claim.key not in rows:
            found.append(f"not a published value: {where}")
        elif claim.printed != rows[claim.key].printed:
            found.append(f"printed value differs from the ledger's: {where}")
        if claim.verdict not in (OF_STATEMENTS if isinstance(claim, Statement) else SYMBOLS):
            found.append(f"unknown verdict {claim.verdict!r}: {where}")
    return found + wrong_foundations(claims) + [gap for paper in papers.values() for gap in gaps(paper)]


def score(claims, papers):
    """One line a paper: how many rows are judged, and how."""
    for paper in papers.values():
        verdicts = Counter(claim.verdict for claim in claims if claim.paper == paper.key)
        words = ", ".join(f"{verdicts[word]} {word}" for word in SYMBOLS | OF_STATEMENTS if verdicts[word])
        yield f"{paper.key}: {verdicts.total()} of {len(paper.ledger)} judged ({words})"


def write_claims(claims, path):
    """Write claims as a list of objects."""
    text = json.dumps([asdict(row) for row in claims], indent=1, ensure_ascii=False, allow_nan=False)
    Path(path).write_text(text + "\n", encoding="utf-8")


def read_claims(path):
    """The claims that `write_claims` wrote."""
    return [read_claim(row) for row in json.loads(Path(path).read_text(encoding="utf-8"))]
