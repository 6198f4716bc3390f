"""Write every figure (SVG, PDF) and table (CSV) of the papers as last regenerated.

Usage: export_figures.py EXECUTED CLAIMS_JSON FIGURES

A figure is a cell with the metadata `mystnb.figure.name`; the notebook's folder names the paper.
"""

import base64
import csv
import json
import re
import sys
from collections import defaultdict
from pathlib import Path

import nbformat

COLUMNS = ("row", "column", "printed", "ours", "se", "z", "verdict")


def write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def export_figures(executed: Path, figures: Path) -> int:
    """The SVG and PDF of every captioned figure; returns how many figures were written."""
    count = 0
    for path in sorted(executed.rglob("*.ipynb")):
        folder = figures / path.parent.name.replace("_", "-")
        for cell in nbformat.read(path, as_version=4).cells:
            name = cell.metadata.get("mystnb", {}).get("figure", {}).get("name")
            data = [o.data for o in cell.get("outputs", []) if "image/svg+xml" in o.get("data", {})]
            if name and data:
                if len(data) > 1:
                    sys.exit(f"{path}: the cell of {name} shows {len(data)} figures")
                write(folder / f"{name}.svg", data[0]["image/svg+xml"].encode())
                write(folder / f"{name}.pdf", base64.b64decode(data[0]["application/pdf"]))
                count += 1
    return count


def export_tables(claims: list[dict], figures: Path) -> int:
    """One CSV a table, in the order of the ledger; returns how many tables were written."""
    tables = defaultdict(list)
    for claim in claims:
        tables[claim["paper"], claim["table"]].append(claim)
    for (paper, table), rows in tables.items():
        slug = re.sub(r"[^a-z0-9]+", "-", table.lower()).strip("-")
        path = figures / paper / f"{slug}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    return len(tables)


def main(executed: Path, claims: Path, figures: Path) -> None:
    for stale in [f for f in figures.rglob("*.*") if f.suffix in {".svg", ".pdf", ".csv"}]:
        stale.unlink()
    drawn = export_figures(executed, figures)
    written = export_tables(json.loads(claims.read_text(encoding="utf-8")), figures)
    print(f"{drawn} figures and {written} tables in {figures}")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
