"""What the study counted: made from recorded tracks, kept as tables, read by the book."""

from __future__ import annotations

import csv
import tomllib
from dataclasses import asdict
from pathlib import Path

import numpy as np

from .encounters import encounters
from .records import without_jumps
from .trials import try_encounter

FOLDER = Path(__file__).parent


def run_case(case, tracks):
    """All encounters of recorded tracks tried out; their rows, and what is to be known of the case.

    Chunk 0 of the case's stream draws the targets, chunk k + 1 the noise of encounter k.
    """
    kept = {name: without_jumps(track, case.rules.fastest) for name, track in tracks.items()}
    places = {name: k for k, name in enumerate(kept)}
    met = encounters(kept, case.rules, np.random.default_rng(case.stream.chunk(0)))
    rows = [
        {"start": one.start - met[0].start, "own": places[one.own], "target": places[one.target]}
        | try_encounter(one, case.rules, case.model, np.random.default_rng(case.stream.chunk(k + 1)))
        for k, one in enumerate(met)
    ]
    counts = {
        "tracks": len(tracks),
        "fixes": sum(map(len, tracks.values())),
        "jumps": sum(map(len, tracks.values())) - sum(map(len, kept.values())),
        "own": len({one.own for one in met}),
        "targets": len({one.target for one in met}),
        "encounters": len(met),
        "stream": case.stream.number,
        "model": repr(case.model),
    }
    return rows, counts | {"rules": asdict(case.rules)}


def write_rows(path, rows):
    """Rows as a table, numbers with six digits."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(rows[0])
        table.writerows([[f"{value:.6g}" for value in row.values()] for row in rows])


def read_rows(name):
    """The stored table of a case, a dict of arrays, one number an encounter."""
    found = np.genfromtxt(FOLDER / f"{name}.csv", delimiter=",", names=True, encoding="utf-8")
    return {column: found[column] for column in found.dtype.names}


def about():
    """What is to be known of the stored tables: date, versions, archives, counts; a dict."""
    return tomllib.loads((FOLDER / "study.toml").read_text(encoding="utf-8"))


def as_toml(values, heading=""):
    """A nested dict of texts and numbers as TOML.

    Examples
    --------
    >>> print(as_toml({"date": "2026-11-28", "ships": {"seed": 1}}))
    date = "2026-11-28"
    <BLANKLINE>
    [ships]
    seed = 1
    """
    plain = {key: value for key, value in values.items() if not isinstance(value, dict)}
    lines = [f"\n[{heading}]"] if heading and plain else []
    lines += [f'{key} = "{v}"' if isinstance(v, str) else f"{key} = {v!r}" for key, v in plain.items()]
    for key, value in values.items():
        if isinstance(value, dict):
            lines.append(as_toml(value, f"{heading}.{key}" if heading else key))
    return "\n".join(lines)
