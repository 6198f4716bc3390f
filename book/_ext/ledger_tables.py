"""Tables of judged numbers.

``{judged-table} paper; table``
    a table of a paper in the paper's layout: in every cell the printed number, ours and the verdict.
``{ledger-table} paper``
    all rows of a paper, with standard error, z, smallest detectable deviation, and a link from each verdict
    to the cell that computed it. `_static/ledger.js` makes it sortable and filterable.
"""

from __future__ import annotations

from collections import Counter

from docutils import nodes
from docutils.parsers.rst import directives
from ledger import (
    cell_label,
    column_name,
    in_brackets,
    label_of,
    link,
    load_claims,
    load_provenance,
    ours_text,
    parse_key,
    printed_text,
    row_name,
    verdict_text,
)
from sphinx.util.docutils import SphinxDirective

from tmalib import claims


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
    directive.set_source_info(table)
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


class JudgedTable(SphinxDirective):
    """The table as the paper lays it out, every number judged."""

    has_content = False
    required_arguments = 1
    final_argument_whitespace = True
    option_spec = {"caption": directives.unchanged_required}  # noqa: RUF012

    def run(self):
        paper, table = parse_key(self.arguments[0], 2)
        found = [claim for key, claim in load_claims(self.env).items() if key[:2] == (paper, table)]
        if not found:
            raise self.error(f"no judged row of {paper}, {table} in build/claims.json")
        texts = all(claims.ledger()[paper, table, c["row"], c["column"]].kind == "text" for c in found)
        head, body = self.phrases(found) if texts else self.numbers(found)
        caption = self.options.get("caption", f"{table}, judged.")
        node = make_table(self, caption, head, body, ["phrase-table" if texts else "judged-table"])
        node["names"].append(label_of(paper, table))
        self.state.document.note_explicit_target(node, node)
        return [node] if texts else [node, legend(found)]

    @staticmethod
    def phrases(found):
        """Head and body for phrases: what was printed, what was measured, and the verdict with its note."""
        body = [
            [row_name(c["row"]), printed_text(c), ours_text(c), [verdict_text(c), c["note"]]] for c in found
        ]
        return ["", "printed", "ours", "verdict, and what was measured"], body

    @staticmethod
    def numbers(found):
        """Head and body in the paper's layout: printed, ours and verdict in every cell."""
        columns = list(dict.fromkeys(c["column"] for c in found))
        by_cell = {(c["row"], c["column"]): c for c in found}
        head = ["", *(column_name(column) for column in columns)]
        body = []
        for row in dict.fromkeys(c["row"] for c in found):
            unit = next(c["unit"] for c in found if c["row"] == row)
            cells = [[row_name(row), in_brackets(unit)]]
            for column in columns:
                claim = by_cell.get((row, column))
                symbol = claim and claims.SYMBOLS[claim["verdict"]]
                cells.append([printed_text(claim), ours_text(claim), symbol] if claim else "")
            body.append(cells)
        return head, body


def legend(found):
    """The symbols that occur, in words, and what stands in a cell."""
    count = Counter(claim["verdict"] for claim in found)
    words = ", ".join(f"{claims.SYMBOLS[v]} {v} ({n})" for v, n in count.items())
    text = f"In a cell, from top to bottom: printed, ours, verdict. {words}."
    return nodes.paragraph(text, text, classes=["legend"])


class LedgerTable(SphinxDirective):
    """All rows of a paper one below the other, with all that the verdicts rest on."""

    has_content = False
    required_arguments = 1

    def run(self):
        paper = self.arguments[0]
        found = [claim for key, claim in load_claims(self.env).items() if key[0] == paper]
        if not found:
            raise self.error(f"no judged row of {paper} in build/claims.json")
        self.cells = {
            (p["paper"], p["table"]): (p["notebook"], p["cell"])
            for p in load_provenance(self.env)
            if "table" in p
        }
        head = [
            "table", "quantity", "printed", "ours", "standard error", "z", "detectable deviation", "verdict"
        ]  # fmt: skip
        caption = "Every printed value of the paper and its verdict, in the paper's order."
        return [make_table(self, caption, head, [self.row(c) for c in found], ["ledger-table"])]

    def row(self, claim):
        where = link(self, label_of(claim["paper"], claim["table"]), nodes.Text(claim["table"]))
        quantity = (row_name(claim["row"]), column_name(claim["column"]), in_brackets(claim["unit"]))
        z, detectable, se = ("" if claim[q] is None else claim[q] for q in ("z", "detectable", "se"))
        return [
            [nodes.paragraph("", "", where)], " ".join(filter(None, quantity)), printed_text(claim),
            ours_text(claim), se and digits(se, 2), z if z == "" else f"{z:.2f}",
            detectable and digits(detectable, 3), self.verdict_cell(claim),
        ]  # fmt: skip

    def verdict_cell(self, claim):
        """The verdict in words, linked to the cell that computed it, with its errata and notes."""
        notebook, cell = self.cells[claim["paper"], claim["table"]]
        verdict = nodes.Text(verdict_text(claim))
        title = f"computed in cell {cell} of {notebook}"
        found = nodes.paragraph("", "", link(self, cell_label(notebook, cell), verdict, title=title))
        for label in filter(None, claim["erratum"].split(", ")):
            found += [nodes.Text(" "), link(self, label, nodes.Text(label))]
        return [found, nodes.paragraph("", claim["note"], classes=["note"])] if claim["note"] else [found]


def digits(value, number):
    """So many significant digits, without an exponent where that can be: 6360, not 6.36e+03."""
    return f"{float(f'{value:.{number}g}'):g}"


def setup(app):
    app.add_directive("judged-table", JudgedTable)
    app.add_directive("ledger-table", LedgerTable)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
