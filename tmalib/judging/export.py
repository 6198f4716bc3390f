"""Every figure (SVG, PDF) and judged table (CSV) of the book in one folder, with an index.

A figure is a cell with the metadata ``mystnb.figure.name``; the folder of its notebook names the paper.
"""

from __future__ import annotations

import base64
import csv
import re
import shutil
from collections import defaultdict
from dataclasses import asdict
from pathlib import Path

from . import deviations
from .chapters import notebooks_in, read
from .collect import figure_name

COLUMNS = ("row", "column", "printed", "ours", "se", "z", "verdict")
INDEX = ("file", "notebook", "cell", "made_from")


def export(executed, claims, origins, papers, folder):
    """Write all figures and tables anew; returns how many of each."""
    folder = Path(folder)
    shutil.rmtree(folder, ignore_errors=True)
    drawn, tables = export_figures(executed, folder), export_tables(claims, folder)
    rows = []
    for origin in origins:
        stem = drawn.get(origin.figure)
        files = [f"{stem}.svg", f"{stem}.pdf"] if origin.figure else [tables[origin.paper, origin.table]]
        made_from = "; ".join(map(str, origin.sources))
        rows += [dict(file=f, notebook=origin.notebook, cell=origin.cell, made_from=made_from) for f in files]
    stem = f"verdicts/{deviations.draw(claims, papers, folder / 'verdicts')}"
    rows += [dict(file=f"{stem}.{kind}", notebook="all judged tables") for kind in ("svg", "pdf", "csv")]
    write_csv(folder / "index.csv", INDEX, sorted(rows, key=lambda row: row["file"]))
    return len(drawn) + 1, len(tables)


def export_figures(executed, folder):
    """The SVG and PDF of every captioned figure; returns the file of each, without suffix, by its label."""
    files = {}
    for path in notebooks_in(executed).values():
        for cell in read(path).cells:
            data = [o.data for o in cell.get("outputs", []) if "image/svg+xml" in o.get("data", {})]
            name = figure_name(cell)
            if not name:
                continue
            if len(data) != 1:
                raise ValueError(f"{path}: the cell of {name} shows {len(data)} figures")
            files[name] = f"{path.parent.name.replace('_', '-')}/{name}"
            target = folder / files[name]
            target.parent.mkdir(parents=True, exist_ok=True)
            target.with_suffix(".svg").write_text(data[0]["image/svg+xml"], encoding="utf-8")
            target.with_suffix(".pdf").write_bytes(base64.b64decode(data[0]["application/pdf"]))
    return files


def export_tables(claims, folder):
    """One CSV a table, in the order of the ledger; returns the file of each by paper and table."""
    tables = defaultdict(list)
    for claim in claims:
        tables[claim.paper, claim.table].append(asdict(claim))
    files = {}
    for (paper, table), rows in tables.items():
        files[paper, table] = f"{paper}/{re.sub(r'[^a-z0-9]+', '-', table.lower()).strip('-')}.csv"
        write_csv(folder / files[paper, table], COLUMNS, rows)
    return files


def write_csv(path, columns, rows):
    """Write dicts as a table."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
