"""What the directives and roles of the ledger share: judged rows, labels, links, and how a row is written."""

from pathlib import Path

from docutils import nodes
from sphinx import addnodes

from ..collect import read_claims
from ..paper import read_papers
from ..verdict import SYMBOLS, same_digits


def load_claims(env):
    """All claims, in the order of the ledgers; the page that asks is built again when they change."""
    path = Path(env.srcdir) / "build" / "claims.json"
    env.note_dependency(str(path))
    return read_claims(path)


def load_papers(env):
    """The papers by key; the page that asks is built again when a manifest or ledger changes."""
    papers = read_papers()
    for paper in papers.values():
        for name in ("paper.toml", "published.csv"):
            env.note_dependency(str(paper.folder / name))
    return papers


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
    """Label of a code cell of a chapter; ``notebook`` is relative to the folder of notebooks."""
    return f"{nodes.make_id('notebooks/' + notebook.removesuffix('.ipynb'))}-cell-{cell}"


def reference(env, label, content, kind="ref", **attributes):
    """A reference to a label, resolved when the whole book has been read."""
    options = dict(refdomain="std", reftype=kind, reftarget=label, refexplicit=kind == "ref", refwarn=True)
    return addnodes.pending_xref("", content, refdoc=env.docname, **options, **attributes)


def link(env, label, text, title=""):
    """A link with a text of its own."""
    return reference(env, label, nodes.inline("", "", nodes.Text(text)), reftitle=title)


def in_brackets(unit):
    """``(m/s)``; nothing for a number without a unit."""
    return "" if unit == "1" else f"({unit.replace('^2', '²')})"


def verdict_text(claim):
    """Symbol and word."""
    return f"{SYMBOLS[claim.verdict]} {claim.verdict}"


def printed_text(claim):
    """As printed; a phrase in quotation marks."""
    return f"“{claim.printed}”" if claim.kind == "text" else claim.printed


def ours_text(claim):
    """Ours with as many digits as the printed number has."""
    return same_digits(claim.ours, claim.printed)
