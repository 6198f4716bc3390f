"""figures/ is complete and agrees with the chapters as they were last executed."""

import csv
import math
from pathlib import Path

import pytest
from docutils.nodes import make_id

from tmalib.judging import collect, export, read_papers
from tmalib.judging.paper import Printed

ROOT = Path(__file__).parents[2]
EXECUTED = ROOT / "build" / "executed"
KINDS = {".svg", ".pdf", ".csv"}
STANDARD_ERRORS = 4  # of a difference; by chance once in 5000 phrases that were drawn 32 times

pytestmark = pytest.mark.book


def files(folder):
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*.*") if p.suffix in KINDS}


def read_csv(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    """What `make figures` would write now."""
    if not EXECUTED.is_dir():
        pytest.skip("no executed chapters: run `make notebooks` first")
    folder, papers = tmp_path_factory.mktemp("export") / "figures", read_papers()
    claims = collect.all_claims(EXECUTED, papers)
    export.write_figures(EXECUTED, claims, papers, ROOT / "pyproject.toml", folder)
    return folder


def test_the_set_is_complete(fresh):
    """Every figure and table of the book is in figures/, and nothing else; `make figures` mends it."""
    assert files(ROOT / "figures") == files(fresh)


def test_the_index_names_every_file(fresh):
    """A figure once; a table as often as there are cells that judge a part of it."""
    for folder in (fresh, ROOT / "figures"):
        rows = [tuple(row.values()) for row in read_csv(folder / "index.csv")]
        assert len(rows) == len(set(rows))
        names = [row[0] for row in rows]
        assert {*names, "index.csv"} == set(files(folder))
        assert all(names.count(name) == 1 for name in names if not name.endswith(".csv"))


def test_figures_and_tables_name_what_made_them(fresh):
    """Every table with a Monte-Carlo number names its runs."""
    random = {
        f"{row.paper}/{make_id(row.table)}"
        for paper in read_papers().values()
        for row in paper.ledger.values()
        if row.kind == "monte-carlo"
    }
    rows = read_csv(fresh / "index.csv")
    for row in rows:
        if row["notebook"].endswith(".ipynb"):
            assert (ROOT / "notebooks" / row["notebook"]).is_file()
            assert row["cell"].isdigit()
    named = {row["file"] for row in rows if row["made_from"]}
    assert {f"{name}.csv" for name in random} <= named


def test_the_numbers_agree_with_a_fresh_run(fresh):
    """Every number of ours to half a unit of the last printed digit; verdicts and printed values exactly.

    A phrase's measure that particles drew, to a few standard errors more: a rounding is another draw.
    """
    compared = 0
    for name in sorted(files(fresh)):
        old, new = ROOT / "figures" / name, fresh / name
        if new.suffix != ".csv" or not old.is_file() or "verdict" not in (found := read_csv(new))[0]:
            continue
        before = read_csv(old)
        assert len(before) == len(found), name
        words = [key for key in ("row", "column", "printed", "verdict") if key in found[0]]
        for a, b in zip(before, found, strict=True):
            assert [a[k] for k in words] == [b[k] for k in words], name
            if "ours" not in b:
                continue  # a statement
            assert abs(float(a["ours"]) - float(b["ours"])) <= tolerance(a, b), (name, a, b)
            compared += 1
    assert compared > 300


def tolerance(old, new):
    """Half a unit of the last printed digit; of the third digit of ours where a phrase is printed."""
    try:
        float(old["printed"])
    except ValueError:
        drawn = math.hypot(float(old["se"]), float(new["se"]))
        return abs(float(old["ours"])) * 5e-3 + STANDARD_ERRORS * drawn
    return Printed("", "", "", "", old["printed"], "", "", None).last_digit / 2
