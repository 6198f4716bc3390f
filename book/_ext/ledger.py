"""Directives and roles that show the ledger and its verdicts; they read build/claims.json and type nothing.

``{score}``
    how many printed numbers of each paper are judged, and how.
``{judged-table} paper; table``
    a table of a paper in the paper's layout: in every cell the printed number, ours and the verdict.
``{ledger-table} paper; table``
    the same rows one below the other, with standard error, z, and smallest detectable deviation.
``{printed}`paper; table; row; column` ``, ``{ours}`...` ``, ``{verdict}`...` ``
    one number or verdict inside a sentence. ``{ours}`` takes a format: ``...; column; .1f``.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx import addnodes
from sphinx.util.docutils import SphinxDirective, SphinxRole

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
}
ROWS = {"xT": "x", "yT": "y", "zT": "z", "vxT": "ẋ", "vyT": "ẏ"}


def claims_file(env):
    return Path(env.srcdir) / "build" / "claims.json"


def load_claims(env):
    """Judged rows by key; the page that asks is built again when the file changes."""
    path = claims_file(env)
    env.note_dependency(str(path))
    rows = json.loads(path.read_text(encoding="utf-8"))
    return {(row["paper"], row["table"], row["row"], row["column"]): row for row in rows}


def parse_key(text, parts):
    key = tuple(part.strip() for part in text.split(";"))
    if len(key) < parts:
        raise ValueError(f"expected {parts} parts separated by ';', got {text!r}")
    return key


def label_of(paper, table):
    """Label of the judged table of a chapter, to which other pages link."""
    return "judged-" + nodes.make_id(f"{paper} {table}")


def in_brackets(unit):
    """``(m/s)``; nothing for a number without a unit."""
    return "" if unit == "1" else f"({unit})"


def verdict_text(claim):
    return f"{claims.SYMBOLS[claim['verdict']]} {claim['verdict']}"


def ours_text(claim):
    return claims.same_digits(claim["ours"], claim["printed"])


def make_table(directive, caption, head, body, classes):
    """A docutils table; cells are strings, lists of lines, or lists of paragraphs."""
    table = nodes.table(classes=classes)
    words, _ = directive.state.inline_text(caption, directive.lineno)
    table += nodes.title(caption, "", *words)
    group = nodes.tgroup(cols=len(head))
    table += group
    for _ in head:
        group += nodes.colspec(colwidth=1)
    for section, rows in ((nodes.thead(), [head]), (nodes.tbody(), body)):
        group += section
        for cells in rows:
            row = nodes.row()
            section += row
            for cell in cells:
                row += make_entry(cell)
    return table


def make_entry(cell):
    entry = nodes.entry()
    if isinstance(cell, list) and isinstance(cell[0], nodes.Element):
        entry += cell
    elif isinstance(cell, list):
        block = nodes.line_block()
        for line in cell:
            block += nodes.line(line, line)
        entry += block
    elif cell:
        entry += nodes.paragraph(cell, cell)
    return entry


class _LedgerDirective(SphinxDirective):
    has_content = False
    required_arguments = 1
    final_argument_whitespace = True
    option_spec = {"caption": directives.unchanged_required}  # noqa: RUF012

    def judged_rows(self):
        paper, table = parse_key(self.arguments[0], 2)
        found = [claim for key, claim in load_claims(self.env).items() if key[:2] == (paper, table)]
        order = {key: i for i, key in enumerate(claims.ledger())}
        found.sort(key=lambda c: order[c["paper"], c["table"], c["row"], c["column"]])
        if not found:
            raise self.error(f"no judged row of {paper}, {table} in build/claims.json")
        return paper, table, found


class JudgedTable(_LedgerDirective):
    """The table as the paper lays it out, every number judged."""

    def run(self):
        paper, table, found = self.judged_rows()
        rows = list(dict.fromkeys(c["row"] for c in found))
        columns = list(dict.fromkeys(c["column"] for c in found))
        by_cell = {(c["row"], c["column"]): c for c in found}
        head = ["", *(COLUMNS.get(column, column) for column in columns)]
        body = []
        for row in rows:
            unit = next(c["unit"] for c in found if c["row"] == row)
            cells = [[ROWS.get(row, row), in_brackets(unit)]]
            for column in columns:
                claim = by_cell.get((row, column))
                cells.append(
                    [claim["printed"], ours_text(claim), claims.SYMBOLS[claim["verdict"]]] if claim else ""
                )
            body.append(cells)
        node = make_table(
            self, self.options.get("caption", f"{table}, judged."), head, body, ["judged-table"]
        )
        node["names"].append(label_of(paper, table))
        self.state.document.note_explicit_target(node, node)
        self.set_source_info(node)
        return [node, legend(found)]


def legend(found):
    """The symbols that occur, in words, and what stands in a cell."""
    count = Counter(claim["verdict"] for claim in found)
    words = ", ".join(f"{claims.SYMBOLS[v]} {v} ({n})" for v, n in count.items())
    text = f"In a cell, from top to bottom: printed, ours, verdict. {words}."
    return nodes.paragraph(text, text, classes=["legend"])


class LedgerTable(_LedgerDirective):
    """The rows of a table one below the other, with all that the verdict rests on."""

    def run(self):
        paper, table, found = self.judged_rows()
        head = ["quantity", "printed", "ours", "standard error", "z", "detectable", "verdict"]
        body = []
        for c in found:
            quantity = (
                ROWS.get(c["row"], c["row"]),
                COLUMNS.get(c["column"], c["column"]),
                in_brackets(c["unit"]),
            )
            z, detectable = ("" if c[q] is None else c[q] for q in ("z", "detectable"))
            body.append([
                " ".join(quantity), c["printed"], ours_text(c), f"{c['se']:.2g}" if c["se"] else "",
                z and f"{z:.2f}", detectable and f"{detectable:.3g}", self.verdict_cell(c),
            ])  # fmt: skip
        node = make_table(
            self, self.options.get("caption", f"{table}, row by row."), head, body, ["ledger-table"]
        )
        self.set_source_info(node)
        where = nodes.paragraph()
        where += [
            nodes.Text("Computed and judged in "),
            self.link(label_of(paper, table), table),
            nodes.Text("."),
        ]
        return [where, node]

    def verdict_cell(self, claim):
        """The verdict in words, with links to the errata whose correction it needed."""
        cell = nodes.paragraph("", verdict_text(claim))
        for label in filter(None, claim["erratum"].split(", ")):
            cell += [nodes.Text(" "), self.link(label, label)]
        return [cell, nodes.paragraph("", claim["note"], classes=["note"])] if claim["note"] else [cell]

    def link(self, label, text):
        xref = addnodes.pending_xref(
            "", nodes.inline(text, text), refdomain="std", reftype="ref", reftarget=label, refexplicit=True,
            refwarn=True, refdoc=self.env.docname,
        )  # fmt: skip
        return xref


class Score(SphinxDirective):
    """How many printed numbers of each paper are judged, and how."""

    has_content = False

    def run(self):
        judged = load_claims(self.env)
        count = {p: Counter(c["verdict"] for key, c in judged.items() if key[0] == p) for p in PAPERS}
        total = Counter(key[0] for key in claims.ledger())
        body = [
            ["printed numbers", *(str(total[p]) for p in PAPERS)],
            ["judged so far", *(str(count[p].total()) for p in PAPERS)],
            *([f"{symbol} {v}", *(str(count[p][v]) for p in PAPERS)] for v, symbol in claims.SYMBOLS.items()),
        ]
        head = ["", *PAPERS.values()]
        node = make_table(self, "The score so far.", head, body, ["score"])
        node["names"].append("score")
        self.state.document.note_explicit_target(node, node)
        self.set_source_info(node)
        return [node]


class _LedgerRole(SphinxRole):
    def run(self):
        try:
            text = self.text_for(parse_key(self.text, 4))
        except (KeyError, ValueError) as problem:
            message = self.inliner.reporter.error(f"ledger: {problem}", line=self.lineno)
            return [self.inliner.problematic(self.rawtext, self.rawtext, message)], [message]
        return [nodes.inline(text, text, classes=["ledger"])], []


class PrintedRole(_LedgerRole):
    def text_for(self, key):
        return claims.printed(*key[:4]).printed


class OursRole(_LedgerRole):
    def text_for(self, key):
        claim = load_claims(self.env)[key[:4]]
        return format(claim["ours"], key[4]) if len(key) > 4 else ours_text(claim)


class VerdictRole(_LedgerRole):
    def text_for(self, key):
        return load_claims(self.env)[key[:4]]["verdict"]


def setup(app):
    app.add_directive("score", Score)
    app.add_directive("judged-table", JudgedTable)
    app.add_directive("ledger-table", LedgerTable)
    app.add_role("printed", PrintedRole())
    app.add_role("ours", OursRole())
    app.add_role("verdict", VerdictRole())
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
