"""A wrong value planted in any column of any table of the ledgers is found, or declared undetectable."""

from pathlib import Path

import numpy as np
import pytest

from tmalib.judging import collect, read_papers, simulated
from tmalib.judging.vector import POWER, STATISTICS, draw_tables

PAPERS = read_papers()
ROWS = [row for paper in PAPERS.values() for row in paper.ledger.values() if row.kind == "monte-carlo"]
RANDOM = sorted({row.key[:2] for row in ROWS})
CLAIMS = Path(__file__).parents[2] / "build/claims.json"
TABLES = 60


def kind_of(row, signed):
    """The statistic of a column, by its name: a mean NEES, a bias with or without sign, a spread."""
    return "std" if row.column.startswith("std") else "mean" if signed else "magnitude"


@pytest.mark.slow
@pytest.mark.parametrize(("paper", "table"), RANDOM)
def test_a_wrong_monte_carlo_value(paper, table):
    """Correlated Gaussian errors with the printed biases, spreads and digits; every cell, up and down.

    Rounded by the printing a number can be easier to find, never harder.
    """
    rows = [r for r in PAPERS[paper].ledger.values() if r.table == table and r.kind == "monte-carlo"]
    signed = any(r.value < 0 for r in PAPERS[paper].ledger.values() if r.column == "bias") or table[0] == "S"
    kinds, size = [kind_of(r, signed) for r in rows], rows[0].runs
    spreads = {r.row: r.value for r in rows if r.column.startswith("std")}
    biases = {r.row: r.value for r in rows if not r.column.startswith("std")}
    names = sorted({r.row for r in rows})
    rng = np.random.default_rng(1)

    def errors(count):
        each = simulated.correlated_errors(rng, count, len(names), 0.7)
        by_row = {
            name: biases.get(name, 0.0) + spreads.get(name, 5.0) * each[:, i] for i, name in enumerate(names)
        }
        return np.stack([by_row[r.row] for r in rows], axis=1)

    tables, unit = draw_tables(errors(20_000), kinds, size), np.array([r.last_digit for r in rows])
    parts = errors(TABLES * size).reshape(TABLES, size, -1)
    mean, std = parts.mean(axis=1), parts.std(axis=1, ddof=1)
    printed = np.stack([STATISTICS[k](mean[:, i], std[:, i]) for i, k in enumerate(kinds)], axis=1)
    made = simulated.SimulatedTables(np.round(printed / unit) * unit, unit, tables)
    down, up = tables.compare(made.printed[0], unit).detectable
    least = POWER - 5 * np.sqrt(POWER * (1 - POWER) / TABLES)
    assert not np.isnan(up).any()
    assert np.all(made.found(up).mean(axis=0) > least)
    stated = ~np.isnan(down)
    assert np.all(stated | (np.array(kinds) == "magnitude")), "declared of magnitudes only"
    assert np.all(made.found(-np.nan_to_num(down)).mean(axis=0)[stated] > least)


@pytest.mark.book
def test_a_wrong_value_of_the_book():
    """Of a number that is right, three units of the last digit to either side; of a count, one.

    A Monte-Carlo row says below and above which value it would have been questioned, and by how much it has
    to be wrong: up always, down unless it is a magnitude that could be zero.
    """
    if not CLAIMS.is_file():
        pytest.skip("no claims: run `make claims` first")
    kinds = dict.fromkeys(("input", "deterministic", "count", "monte-carlo"), 0)
    for claim in collect.read_claims(CLAIMS):
        if claim.kind not in kinds:
            continue
        kinds[claim.kind] += 1
        if claim.kind == "monte-carlo":
            (low, high), (down, up) = claim.accepted, claim.detectable
            assert low < high
            assert up > 0
            assert down or low <= 0 <= claim.value
        elif claim.agrees(claim.ours):
            step = 1 if claim.kind == "count" else 3 * claim.last_digit
            assert not any(claim.agrees(claim.ours + sign * step) for sign in (-1, 1))
    assert min(kinds.values()) > 0
