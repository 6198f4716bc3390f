"""Write every figure (SVG, PDF) and table (CSV) of the book to one folder, with an index.

Usage: export_figures.py EXECUTED CLAIMS_JSON PROVENANCE_JSON FIGURES

A figure is a cell with the metadata `mystnb.figure.name`; its notebook's folder names the paper. The index
says for every file which notebook, cell and functions made it, and from which random streams and seed.
"""

import base64
import csv
import json
import re
import shutil
import sys
from collections import defaultdict
from pathlib import Path

import draw_verdicts
import nbformat

COLUMNS = ("row", "column", "printed", "ours", "se", "z", "verdict")
INDEX = ("file", "notebook", "cell", "functions", "streams", "seed")


def write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def write_csv(path: Path, columns: tuple, rows: list[dict]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def export_figures(executed: Path, figures: Path) -> dict:
    """The SVG and PDF of every captioned figure; returns the file of each, without suffix, by its label."""
    files = {}
    for path in sorted(executed.rglob("*.ipynb")):
        folder = path.parent.name.replace("_", "-")
        for cell in nbformat.read(path, as_version=4).cells:
            name = cell.metadata.get("mystnb", {}).get("figure", {}).get("name")
            data = [o.data for o in cell.get("outputs", []) if "image/svg+xml" in o.get("data", {})]
            if name and data:
                if len(data) > 1:
                    sys.exit(f"{path}: the cell of {name} shows {len(data)} figures")
                write(figures / folder / f"{name}.svg", data[0]["image/svg+xml"].encode())
                write(figures / folder / f"{name}.pdf", base64.b64decode(data[0]["application/pdf"]))
                files[name] = f"{folder}/{name}"
    return files


def export_tables(claims: list[dict], figures: Path) -> dict:
    """One CSV a table, in the order of the ledger; returns the file of each by paper and table."""
    tables = defaultdict(list)
    for claim in claims:
        tables[claim["paper"], claim["table"]].append(claim)
    files = {}
    for (paper, table), rows in tables.items():
        slug = re.sub(r"[^a-z0-9]+", "-", table.lower()).strip("-")
        files[paper, table] = f"{paper}/{slug}.csv"
        write_csv(figures / files[paper, table], COLUMNS, rows)
    return files


def index(provenance: list[dict], drawn: dict, tables: dict) -> list[dict]:
    """One row a file: where it comes from."""
    rows = []
    for entry in provenance:
        if "figure" in entry:
            stem = drawn.get(entry["figure"])
            files = [f"{stem}.svg", f"{stem}.pdf"] if stem else []
        else:
            files = [tables[entry["paper"], entry["table"]]]
        text = {key: ", ".join(entry[key]) for key in ("functions", "streams")}
        rows += [entry | text | {"file": file} for file in files]
    return rows


def main(executed: Path, claims_json: Path, provenance_json: Path, figures: Path) -> None:
    claims, provenance = (json.loads(p.read_text(encoding="utf-8")) for p in (claims_json, provenance_json))
    shutil.rmtree(figures, ignore_errors=True)
    drawn, tables = export_figures(executed, figures), export_tables(claims, figures)
    rows = index(provenance, drawn, tables)
    stem = f"verdicts/{draw_verdicts.draw(claims, figures / 'verdicts')}"
    rows += [{"file": f"{stem}.{kind}", "notebook": "all judged tables"} for kind in ("svg", "pdf", "csv")]
    write_csv(figures / "index.csv", INDEX, sorted(rows, key=lambda row: row["file"]))
    print(f"{len(drawn) + 1} figures and {len(tables)} tables in {figures}")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
