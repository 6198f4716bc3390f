"""Every figure (SVG, PDF) and judged table (CSV) of the book in one folder, with an index.

A figure is a cell with the metadata ``mystnb.figure.name``; the folder of its notebook names the paper.
"""

import base64
import csv
import re
import shutil
from dataclasses import asdict
from itertools import groupby
from pathlib import Path

from . import deviations, house
from .chapters import notebooks_in, read
from .collect import figure_name, origins_in, over_all

COLUMNS = ("row", "column", "printed", "ours", "se", "z", "verdict")
INDEX = ("file", "notebook", "cell", "made_from")


def write_figures(executed, claims, papers, pyproject, folder):
    """Write all figures and tables anew; returns how many of each."""
    folder = Path(folder)
    shutil.rmtree(folder, ignore_errors=True)
    figures, tables = export_figures(executed, folder), export_tables(claims, folder)
    rows = []
    for origin in over_all(origins_in, executed):
        files = figures[origin.figure] if origin.figure else tables[origin.paper, origin.table]
        made_from = "; ".join(map(str, origin.sources))
        rows += [dict(file=f, notebook=origin.notebook, cell=origin.cell, made_from=made_from) for f in files]
    stem = f"verdicts/{deviations.draw_deviations(claims, papers, folder / 'verdicts')}"
    rows += [dict(file=f"{stem}.{kind}", notebook="all judged tables") for kind in ("svg", "pdf", "csv")]
    stem = f"house/{house.draw_house(pyproject, folder / 'house')}"
    rows += [dict(file=f"{stem}.{kind}", notebook="pyproject.toml") for kind in ("svg", "pdf")]
    write_csv(folder / "index.csv", INDEX, sorted(rows, key=lambda row: row["file"]))
    return len(figures) + 2, len(tables)


def export_figures(executed, folder):
    """The SVG and PDF of every captioned figure; returns the files of each by its label."""
    files = {}
    for path in notebooks_in(executed).values():
        for cell in read(path).cells:
            if not (name := figure_name(cell)):
                continue
            data = [o.data for o in cell.outputs if "image/svg+xml" in o.get("data", {})]
            if len(data) != 1:
                raise ValueError(f"{path}: the cell of {name} shows {len(data)} figures")
            stem = f"{path.parent.name.replace('_', '-')}/{name}"
            files[name] = [f"{stem}.svg", f"{stem}.pdf"]
            (folder / stem).parent.mkdir(parents=True, exist_ok=True)
            (folder / f"{stem}.svg").write_text(data[0]["image/svg+xml"], encoding="utf-8")
            (folder / f"{stem}.pdf").write_bytes(base64.b64decode(data[0]["application/pdf"]))
    return files


def export_tables(claims, folder):
    """One CSV a table, in the order of the ledger; returns the file of each by paper and table."""
    files = {}
    for (paper, table), rows in groupby(claims, key=lambda claim: claim.key[:2]):
        files[paper, table] = [f"{paper}/{file_name(table)}.csv"]
        write_csv(folder / files[paper, table][0], COLUMNS, map(asdict, rows))
    return files


def file_name(table):
    """The name of a table as that of a file."""
    return re.sub(r"[^a-z0-9]+", "-", table.lower()).strip("-")


def write_csv(path, columns, rows):
    """Write dicts as a table."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
