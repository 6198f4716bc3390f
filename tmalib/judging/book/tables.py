"""Tables of judged numbers.

``{judged-table} paper; table`` is a table in the paper's layout: in every cell printed, ours and the verdict.
``{ledger-table} paper`` has all rows of a paper, with standard error, z, smallest detectable deviation, and a
link from each verdict to the cell that computed it. `_static/ledger.js` makes it sortable and filterable.
"""

from collections import Counter

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.util.docutils import SphinxDirective

from ..verdict import SYMBOLS
from . import ledger


class _LedgerDirective(SphinxDirective):
    """A directive whose argument starts with the key of a paper."""

    has_content = False
    required_arguments = 1
    final_argument_whitespace = True

    def chosen(self, key):
        """The paper, and its claims whose key starts so."""
        found = [claim for claim in ledger.load_claims(self.env) if claim.key[: len(key)] == key]
        if not found:
            raise self.error(f"no judged row of {'; '.join(key)} in build/claims.json")
        return ledger.load_papers(self.env)[key[0]], found

    def make_table(self, caption, head, body, kind):
        """A docutils table; cells are strings, lists of lines, or lists of paragraphs."""
        words, _ = self.state.inline_text(caption, self.lineno)
        group = nodes.tgroup("", *(nodes.colspec(colwidth=1) for _ in head), cols=len(head))
        for section, rows in ((nodes.thead(), [head]), (nodes.tbody(), body)):
            group += section
            section += [nodes.row("", *map(make_entry, cells)) for cells in rows]
        table = nodes.table("", nodes.title(caption, "", *words), group, classes=[kind])
        self.set_source_info(table)
        return table


def make_entry(cell):
    if isinstance(cell, list) and isinstance(cell[0], nodes.Element):
        return nodes.entry("", *cell)
    if isinstance(cell, list):
        return nodes.entry("", nodes.line_block("", *(nodes.line(line, line) for line in cell)))
    return nodes.entry("", *([nodes.paragraph(cell, cell)] if cell else []))


class JudgedTable(_LedgerDirective):
    """The table as the paper lays it out, every number judged."""

    option_spec = {"caption": directives.unchanged_required}  # noqa: RUF012

    def run(self):
        key = ledger.parse_key(self.arguments[0], 2)
        paper, found = self.chosen(key)
        texts = all(claim.kind == "text" for claim in found)
        head, body = (self.phrases if texts else self.numbers)(paper, found)
        caption = self.options.get("caption", f"{paper.tables[key[1]]}, judged.")
        node = self.make_table(caption, head, body, "phrase-table" if texts else "judged-table")
        node["names"].append(ledger.label_of(*key))
        self.state.document.note_explicit_target(node, node)
        return [node] if texts else [node, legend(found)]

    @staticmethod
    def phrases(paper, found):
        """Head and body for phrases: what was printed, what was measured, and the verdict with its note."""
        texts = (ledger.printed_text, ledger.ours_text)
        body = [
            [paper.rows[c.row], *(text(c) for text in texts), [ledger.verdict_text(c), c.note]] for c in found
        ]
        return ["", "printed", "ours", "verdict, and what was measured"], body

    @staticmethod
    def numbers(paper, found):
        """Head and body in the paper's layout: printed, ours and verdict in every cell."""
        columns = list(dict.fromkeys(c.column for c in found))
        texts = (ledger.printed_text, ledger.ours_text, lambda c: SYMBOLS[c.verdict])
        cells = {(c.row, c.column): [text(c) for text in texts] for c in found}
        units = {c.row: c.unit for c in reversed(found)}
        body = [
            [[paper.rows[row], ledger.in_brackets(units[row])], *(cells.get((row, c), "") for c in columns)]
            for row in dict.fromkeys(c.row for c in found)
        ]
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
        head = ["table", "quantity", "printed", "ours", "standard error", "z"]
        head += ["detectable deviation", "verdict"]
        caption = "Every printed value of the paper and its verdict, in the paper's order."
        return [self.make_table(caption, head, [self.row(paper, claim) for claim in found], "ledger-table")]

    def row(self, paper, c):
        where = ledger.link(self.env, ledger.label_of(c.paper, c.table), paper.tables[c.table])
        quantity = filter(None, (paper.rows[c.row], paper.columns[c.column], ledger.in_brackets(c.unit)))
        z, detectable = "" if c.z is None else f"{c.z:.2f}", c.detectable and digits(c.detectable, 3)
        texts = [" ".join(quantity), ledger.printed_text(c), ledger.ours_text(c), c.se and digits(c.se, 2)]
        return [[nodes.paragraph("", "", where)], *texts, z, detectable, self.verdict_cell(c)]

    def verdict_cell(self, c):
        """The verdict in words, linked to the cell that computed it, with its errata and notes."""
        title, label = f"computed in cell {c.cell} of {c.notebook}", ledger.cell_label(c.notebook, c.cell)
        found = nodes.paragraph("", "", ledger.link(self.env, label, ledger.verdict_text(c), title))
        for erratum in filter(None, c.erratum.split(", ")):
            found += [nodes.Text(" "), ledger.link(self.env, erratum, erratum)]
        return [found, nodes.paragraph("", c.note, classes=["note"])] if c.note else [found]


def digits(value, number):
    """So many significant digits, without an exponent where that can be: 6360, not 6.36e+03."""
    return f"{float(f'{value:.{number}g}'):g}"


def setup(app):
    app.add_directive("judged-table", JudgedTable)
    app.add_directive("ledger-table", LedgerTable)
