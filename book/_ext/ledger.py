"""What the extensions of the ledger share: the judged rows, their names and how they are written.

The rows come from build/claims.json and build/provenance.json; nothing is typed.
"""

from __future__ import annotations

import json
from pathlib import Path

from docutils import nodes
from sphinx import addnodes

from tmalib import claims

PAPERS = {
    "emw-acoustic": "Electromagnetic and acoustic waves",
    "conical-angles": "Cosines of conical angles",
    "robustness": "Robustness",
}
COLUMNS = {
    "true": "true value",
    "bias_mle": "bias MLE",
    "bias_ekf": "bias EKF",
    "std_mle": "σ̂ MLE",
    "std_ekf": "σ̂ EKF",
    "std_crlb": "σ CRLB",
    "std_crlb_botma": "σ CRLB, BOTMA",
    "bias": "bias",
    "std_sample": "σ sample",
    "value": "",
    "claim": "",
}
ROWS = {"xT": "x", "yT": "y", "zT": "z", "vxT": "ẋ", "vyT": "ẏ"}


def _load(env, name):
    """A file of the build; the page that asks is built again when the file changes."""
    path = Path(env.srcdir) / "build" / name
    env.note_dependency(str(path))
    return json.loads(path.read_text(encoding="utf-8"))


def load_claims(env):
    """Judged rows by ``(paper, table, row, column)``, in the order of the ledger."""
    rows = _load(env, "claims.json")
    return {(row["paper"], row["table"], row["row"], row["column"]): row for row in rows}


def load_provenance(env):
    """Where the figures and judged tables come from, a list of dicts."""
    return _load(env, "provenance.json")


def parse_key(text, parts):
    """``a; b; c`` in a tuple of at least ``parts``."""
    key = tuple(part.strip() for part in text.split(";"))
    if len(key) < parts:
        raise ValueError(f"expected {parts} parts separated by ';', got {text!r}")
    return key


def label_of(paper, table):
    """Label of the judged table of a chapter, to which other pages link."""
    return "judged-" + nodes.make_id(f"{paper} {table}")


def cell_label(notebook, cell):
    """Label of a code cell of a chapter."""
    return f"{nodes.make_id(notebook.removesuffix('.ipynb'))}-cell-{cell}"


def link(directive, label, *content, title=""):
    """A reference to a label, resolved when the whole book has been read."""
    return addnodes.pending_xref(
        "", nodes.inline("", "", *content), refdomain="std", reftype="ref", reftarget=label,
        refexplicit=True, refwarn=True, refdoc=directive.env.docname, reftitle=title,
    )  # fmt: skip


def row_name(name):
    return ROWS.get(name, name)


def column_name(name):
    return COLUMNS.get(name, name)


def in_brackets(unit):
    """``(m/s)``; nothing for a number without a unit."""
    return "" if unit == "1" else f"({unit.replace('^2', '²')})"


def verdict_text(claim):
    return f"{claims.SYMBOLS[claim['verdict']]} {claim['verdict']}"


def printed_text(claim):
    """As printed; a phrase in quotation marks."""
    key = (claim["paper"], claim["table"], claim["row"], claim["column"])
    return f"“{claim['printed']}”" if claims.printed(*key).kind == "text" else claim["printed"]


def ours_text(claim):
    return claims.same_digits(claim["ours"], claim["printed"])
