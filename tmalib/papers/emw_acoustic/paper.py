"""The paper's manifest and ledger, from paper.toml and published.csv beside this file."""

from pathlib import Path

from ...judging import read_paper

PAPER = read_paper(Path(__file__).parent)
