"""Every figure (SVG, PDF) and judged table (CSV) of the book in one folder, with an index.

A figure is a cell with the metadata ``mystnb.figure.name``; the folder of its notebook names the paper.
"""

import base64
import csv
import shutil
from pathlib import Path

from docutils.nodes import make_id

from .. import figures
from . import drawings
from .chapters import notebooks_in, read
from .collect import origins_in

COLUMNS = ("row", "column", "printed", "ours", "se", "probability", "together", "verdict")
OF_STATEMENTS = ("row", "printed", "verdict", "basis", "steps", "rests_on", "erratum", "notebook", "cell")


def write_figures(executed, claims, papers, pyproject, folder):
    """Write all figures and tables anew, and their index; returns how many files."""
    folder = Path(folder)
    shutil.rmtree(folder, ignore_errors=True)
    figures.save_figure(drawings.draw_house(pyproject), folder / "house/fig-house")
    figures.save_figure(
        drawings.draw_probabilities(claims, papers), folder / "verdicts/fig-verdicts-probability"
    )
    write_csv(
        folder / "verdicts/fig-verdicts-probability.csv", ("name", "value"), drawings.counts(claims).items()
    )
    index = [(f"house/fig-house.{kind}", "pyproject.toml", "", "") for kind in ("svg", "pdf")]
    index += [
        (f"verdicts/fig-verdicts-probability.{k}", "all judged tables", "", "") for k in ("svg", "pdf", "csv")
    ]
    for name, path in notebooks_in(executed).items():
        notebook = read(path)
        for origin in origins_in(name, notebook):
            if origin.figure:
                stem = f"{path.parent.name.replace('_', '-')}/{origin.figure}"
                files = write_figure(notebook.cells[origin.cell], folder, stem)
            else:
                files = [f"{origin.paper}/{make_id(origin.table)}.csv"]
                rows = [claim for claim in claims if claim.key[:2] == (origin.paper, origin.table)]
                write_csv(folder / files[0], *table_of(rows))
            made_from = "; ".join(map(str, origin.sources))
            index += [(file, name, origin.cell, made_from) for file in files]
    write_csv(folder / "index.csv", ("file", "notebook", "cell", "made_from"), sorted(index))
    return len(index)


def write_figure(cell, folder, stem):
    """Write the SVG and PDF that a cell shows; returns their names."""
    data = [output.data for output in cell.outputs if "image/svg+xml" in output.get("data", {})]
    if len(data) != 1:
        raise ValueError(f"the cell of {stem} shows {len(data)} figures")
    (folder / stem).parent.mkdir(parents=True, exist_ok=True)
    (folder / f"{stem}.svg").write_text(data[0]["image/svg+xml"], encoding="utf-8")
    (folder / f"{stem}.pdf").write_bytes(base64.b64decode(data[0]["application/pdf"]))
    return [f"{stem}.svg", f"{stem}.pdf"]


def table_of(claims):
    """Head and rows of the table of some claims, all numbers and phrases or all statements."""
    head = OF_STATEMENTS if claims[0].kind == "statement" else COLUMNS
    values = [[getattr(claim, column) for column in head] for claim in claims]
    return head, [["; ".join(v) if isinstance(v, tuple) else v for v in row] for row in values]


def write_csv(path, head, rows):
    """Write a table."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])
