"""What the directives and roles of the ledger share: judged rows, labels, links, and how a row is written."""

from pathlib import Path

from docutils import nodes
from sphinx import addnodes

from ..collect import read_claims
from ..statements import SYMBOLS as OF_STATEMENTS
from ..verdict import SYMBOLS, same_digits

ALL_SYMBOLS = SYMBOLS | OF_STATEMENTS


def claims_under(env, key=()):
    """The judged rows whose key starts so, in the order of the ledgers; `ValueError` if there are none."""
    found = [claim for claim in claims_of(env) if claim.key[: len(key)] == key]
    if not found:
        raise ValueError(f"nothing is judged under {'; '.join(key)!r}")
    return found


def claims_of(env):
    """All judged rows."""
    return read_claims(Path(env.srcdir) / "build" / "claims.json")


def is_inside(node, kinds):
    """Whether a node is somewhere within one of these kinds."""
    while node.parent is not None:
        node = node.parent
        if isinstance(node, kinds):
            return True
    return False


def parse_key(text, parts):
    """``a; b; c`` in a tuple of at least ``parts``."""
    key = tuple(part.strip() for part in text.split(";"))
    if len(key) < parts:
        raise ValueError(f"expected {parts} parts separated by ';', got {text!r}")
    return key


def label_of(paper, table):
    """Label of the judged table of a chapter, to which other pages link."""
    return "judged-" + nodes.make_id(f"{paper} {table}")


def row_id(claim):
    """Where a row stands on the page of verdicts, so that it can be cited."""
    return "row-" + nodes.make_id(" ".join(claim.key))


def table_id(name):
    """Where a table that can be filtered stands on its page; ``_static/ledger.js`` adds what is chosen."""
    return f"ledger-{name}"


def cell_label(notebook, cell):
    """Label of a code cell of a chapter; ``notebook`` is relative to the folder of notebooks."""
    return f"{nodes.make_id('notebooks/' + notebook.removesuffix('.ipynb'))}-cell-{cell}"


def link(env, label, text, kind="ref", title=""):
    """A link to a label, resolved when the whole book has been read; a ``numref`` writes its own text."""
    options = dict(refdomain="std", reftype=kind, reftarget=label, refexplicit=kind == "ref", refwarn=True)
    return addnodes.pending_xref("", nodes.inline("", text), refdoc=env.docname, reftitle=title, **options)


def in_brackets(unit):
    """``(m/s)``; nothing for a number without a unit."""
    return "" if unit == "1" else f"({unit.replace('^2', '²')})"


def written(claim):
    """Printed, words in quotation marks; ours, with as many digits; the verdict, symbol and word."""
    printed = f"“{claim.printed}”" if claim.in_words else claim.printed
    ours = "" if claim.kind == "statement" else same_digits(claim.ours, claim.printed)
    return printed, ours, f"{ALL_SYMBOLS[claim.verdict]} {claim.verdict}"
