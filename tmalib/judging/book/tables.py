"""Tables of judged numbers.

``{judged-table} paper; table``
    a table of a paper in the paper's layout: in every cell the printed number, ours and the verdict.
``{ledger-table} paper``
    all rows of a paper, with standard error, z, smallest detectable deviation, and a link from each verdict
    to the cell that computed it. `_static/ledger.js` makes it sortable and filterable.
"""

from collections import Counter

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.util.docutils import SphinxDirective

from ..verdict import SYMBOLS
from .ledger import (
    cell_label,
    in_brackets,
    label_of,
    link,
    load_claims,
    load_papers,
    ours_text,
    parse_key,
    printed_text,
    verdict_text,
)


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
            section += nodes.row("", *map(make_entry, cells))
    directive.set_source_info(table)
    return table


def make_entry(cell):
    entry = nodes.entry()
    if isinstance(cell, list) and isinstance(cell[0], nodes.Element):
        entry += cell
    elif isinstance(cell, list):
        entry += nodes.line_block("", *(nodes.line(line, line) for line in cell))
    elif cell:
        entry += nodes.paragraph(cell, cell)
    return entry


class _LedgerDirective(SphinxDirective):
    """A directive whose argument starts with the key of a paper."""

    has_content = False
    required_arguments = 1
    final_argument_whitespace = True

    def chosen(self, key):
        """The paper, and its claims whose key starts so."""
        found = [claim for claim in load_claims(self.env) if claim.key[: len(key)] == key]
        if not found:
            raise self.error(f"no judged row of {'; '.join(key)} in build/claims.json")
        return load_papers(self.env)[key[0]], found


class JudgedTable(_LedgerDirective):
    """The table as the paper lays it out, every number judged."""

    option_spec = {"caption": directives.unchanged_required}  # noqa: RUF012

    def run(self):
        key = parse_key(self.arguments[0], 2)
        paper, found = self.chosen(key)
        texts = all(claim.kind == "text" for claim in found)
        head, body = (self.phrases if texts else self.numbers)(paper, found)
        caption = self.options.get("caption", f"{paper.tables[key[1]]}, judged.")
        node = make_table(self, caption, head, body, ["phrase-table" if texts else "judged-table"])
        node["names"].append(label_of(*key))
        self.state.document.note_explicit_target(node, node)
        return [node] if texts else [node, legend(found)]

    @staticmethod
    def phrases(paper, found):
        """Head and body for phrases: what was printed, what was measured, and the verdict with its note."""
        body = [[paper.rows[c.row], printed_text(c), ours_text(c), [verdict_text(c), c.note]] for c in found]
        return ["", "printed", "ours", "verdict, and what was measured"], body

    @staticmethod
    def numbers(paper, found):
        """Head and body in the paper's layout: printed, ours and verdict in every cell."""
        columns = list(dict.fromkeys(c.column for c in found))
        by_cell = {(c.row, c.column): c for c in found}
        body = []
        for row in dict.fromkeys(c.row for c in found):
            unit = next(c.unit for c in found if c.row == row)
            cells = [by_cell.get((row, column)) for column in columns]
            shown = [c and [printed_text(c), ours_text(c), SYMBOLS[c.verdict]] for c in cells]
            body.append([[paper.rows[row], in_brackets(unit)], *shown])
        return ["", *(paper.columns[column] for column in columns)], body


def legend(found):
    """The symbols that occur, in words, and what stands in a cell."""
    count = Counter(claim.verdict for claim in found)
    words = ", ".join(f"{SYMBOLS[v]} {v} ({n})" for v, n in count.items())
    text = f"In a cell, from top to bottom: printed, ours, verdict. {words}."
    return nodes.paragraph(text, text, classes=["legend"])


class LedgerTable(_LedgerDirective):
    """All rows of a paper one below the other, with all that the verdicts rest on."""

    def run(self):
        paper, found = self.chosen((self.arguments[0],))
        head = [
            "table",
            "quantity",
            "printed",
            "ours",
            "standard error",
            "z",
            "detectable deviation",
            "verdict",
        ]
        caption = "Every printed value of the paper and its verdict, in the paper's order."
        body = [self.row(paper, claim) for claim in found]
        return [make_table(self, caption, head, body, ["ledger-table"])]

    def row(self, paper, c):
        where = link(self.env, label_of(c.paper, c.table), paper.tables[c.table])
        quantity = filter(None, (paper.rows[c.row], paper.columns[c.column], in_brackets(c.unit)))
        return [
            [nodes.paragraph("", "", where)],
            " ".join(quantity),
            printed_text(c),
            ours_text(c),
            c.se and digits(c.se, 2),
            "" if c.z is None else f"{c.z:.2f}",
            c.detectable and digits(c.detectable, 3),
            self.verdict_cell(c),
        ]

    def verdict_cell(self, c):
        """The verdict in words, linked to the cell that computed it, with its errata and notes."""
        title = f"computed in cell {c.cell} of {c.notebook}"
        verdict = link(self.env, cell_label(c.notebook, c.cell), verdict_text(c), title)
        found = nodes.paragraph("", "", verdict)
        for label in filter(None, c.erratum.split(", ")):
            found += [nodes.Text(" "), link(self.env, label, label)]
        return [found, nodes.paragraph("", c.note, classes=["note"])] if c.note else [found]


def digits(value, number):
    """So many significant digits, without an exponent where that can be: 6360, not 6.36e+03."""
    return f"{float(f'{value:.{number}g}'):g}"


def setup(app):
    app.add_directive("judged-table", JudgedTable)
    app.add_directive("ledger-table", LedgerTable)
