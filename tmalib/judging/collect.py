"""What the executed notebooks carry in their outputs: claims, origins of figures, numbers for sentences."""

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
    """Where a figure or a judged table comes from: notebook, cell, and the runs in it."""

    notebook: str
    cell: int
    sources: tuple
    figure: str = ""
    paper: str = ""
    table: str = ""


def outputs_of(notebook):
    """Index of the cell, and every output of it that has data."""
    cells = enumerate(notebook.cells)
    return [(index, o) for index, cell in cells for o in cell.get("outputs", []) if "data" in o]


def claims_in(name, notebook):
    """The claims of a notebook, each with the notebook's name and its cell."""
    rows = [(row, index) for index, output in outputs_of(notebook) for row in output.data.get(CLAIMS, [])]
    return [replace(Claim(**row), notebook=name, cell=index) for row, index in rows]


def figure_name(cell):
    """Label of the captioned figure that a cell shows, or an empty text."""
    return cell.metadata.get("mystnb", {}).get("figure", {}).get("name", "")


def origins_in(name, notebook):
    """The `Origin` of every captioned figure and every judged table of a notebook."""
    runs = {}
    for index, output in outputs_of(notebook):
        runs.setdefault(index, []).extend(Source(**row) for row in output.metadata.get(SOURCES, []))
    figures = [(index, figure_name(cell)) for index, cell in enumerate(notebook.cells)]
    found = [Origin(name, i, tuple(runs.get(i, ())), figure=figure) for i, figure in figures if figure]
    tables = {}
    for claim in claims_in(name, notebook):
        tables.setdefault((claim.cell, claim.paper, claim.table), {}).update(dict.fromkeys(claim.sources))
    return found + [Origin(name, i, tuple(of), paper=p, table=t) for (i, p, t), of in tables.items()]


def numbers_in(notebook):
    """Keys of the numbers that a notebook makes known."""
    outputs = [output for _, output in outputs_of(notebook)]
    return {o.metadata["scrapbook"]["name"] for o in outputs if any(k.startswith(GLUE) for k in o.data)}


def over_all(function, executed):
    """The results of ``function(name, notebook)`` for all executed notebooks, in one list."""
    return [found for name, path in notebooks_in(executed).items() for found in function(name, read(path))]


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
    """The claims in the order of the ledgers; unknown ones last."""
    order = [row.key for paper in papers.values() for row in paper.ledger.values()]
    place = {key: number for number, key in enumerate(order)}
    return sorted(claims, key=lambda claim: place.get(claim.key, len(place)))


def score(claims, papers):
    """One line a paper: how many rows are judged, and how."""
    for paper in papers.values():
        verdicts = Counter(claim.verdict for claim in claims if claim.paper == paper.key)
        words = ", ".join(f"{verdicts[word]} {word}" for word in SYMBOLS if verdicts[word])
        yield f"{paper.key}: {verdicts.total()} of {len(paper.ledger)} judged ({words})"


def write_claims(claims, path):
    """Write claims as a list of objects, at once."""
    text = json.dumps([asdict(row) for row in claims], indent=1, ensure_ascii=False, allow_nan=False)
    temporary = Path(path).with_suffix(".tmp")
    temporary.write_text(text + "\n", encoding="utf-8")
    temporary.replace(path)


def read_claims(path):
    """The claims that `write_claims` wrote."""
    return [Claim(**row) for row in json.loads(Path(path).read_text(encoding="utf-8"))]
