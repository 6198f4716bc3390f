"""Tables of judged numbers, and their score.

``{judged-table} paper; table`` is a table in the paper's layout: in every cell printed, ours and the verdict.
``{ledger-table} paper`` has all rows of a paper, with standard error, probability, detectable shifts, and a
link from each verdict to the cell that computed it. `_static/ledger.js` makes it sortable and filterable.
``{score}`` says how many printed values of each paper are judged, and how, as bars with numbers and words.
"""

from collections import Counter
from html import escape

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.util.docutils import SphinxDirective

from ..paper import read_papers
from ..verdict import SYMBOLS
from . import ledger


class LedgerDirective(SphinxDirective):
    """A directive that shows what is judged under its key; a key without a row is an error of the page."""

    required_arguments = 1
    final_argument_whitespace = True
    parts = 1  # of the key, at least

    def run(self):
        try:
            key = ledger.parse_key(self.arguments[0], self.parts)
            return self.shown(key, read_papers()[key[0]], ledger.claims_under(self.env, key))
        except (KeyError, ValueError) as problem:
            raise self.error(f"ledger: {problem}") from problem

    def make_table(self, caption, head, body, kind):
        """A docutils table; a cell is a text, or a list of nodes."""
        words, _ = self.state.inline_text(caption, self.lineno)
        group = nodes.tgroup("", *(nodes.colspec(colwidth=1) for _ in head), cols=len(head))
        for section, rows in ((nodes.thead(), [head]), (nodes.tbody(), body)):
            group += section
            section += [nodes.row("", *map(make_entry, cells)) for cells in rows]
        table = nodes.table("", nodes.title(caption, "", *words), group, classes=[kind])
        self.set_source_info(table)
        return table


def make_entry(cell):
    if isinstance(cell, str):
        return nodes.entry("", *([nodes.paragraph(cell, cell)] if cell else []))
    return nodes.entry("", *cell)


def lines(*texts):
    """The content of a cell with several lines."""
    return [nodes.line_block("", *(nodes.line(text, text) for text in texts))]


class JudgedTable(LedgerDirective):
    """The table as the paper lays it out, every number judged."""

    option_spec = {"caption": directives.unchanged_required}  # noqa: RUF012
    parts = 2

    def shown(self, key, paper, found):
        phrases = all(claim.kind == "text" for claim in found)
        head, body = (phrase_rows if phrases else number_rows)(paper, found)
        caption = self.options.get("caption", f"{paper.tables[key[1]]}, judged.")
        node = self.make_table(caption, head, body, "phrase-table" if phrases else "judged-table")
        node["names"].append(ledger.label_of(*key))
        self.state.document.note_explicit_target(node, node)
        return [node] if phrases else [node, legend(found)]


def phrase_rows(paper, found):
    """Head and body for phrases: what was printed, what was measured, and the verdict with its note."""
    cells = [(c, *ledger.written(c)) for c in found]
    body = [[paper.rows[c.row], printed, ours, lines(word, c.note)] for c, printed, ours, word in cells]
    return ["", "printed", "ours", "verdict, and what was measured"], body


def number_rows(paper, found):
    """Head and body in the paper's layout: printed, ours and verdict in every cell."""
    columns = list(dict.fromkeys(c.column for c in found))
    cells = {(c.row, c.column): lines(*ledger.written(c)[:2], SYMBOLS[c.verdict]) for c in found}
    units = {c.row: c.unit for c in reversed(found)}
    names = {c.row: lines(paper.rows[c.row], ledger.in_brackets(units[c.row])) for c in found}
    body = [[name, *(cells.get((row, column), "") for column in columns)] for row, name in names.items()]
    return ["", *(paper.columns[column] for column in columns)], body


def legend(found):
    """The symbols that occur, in words, what stands in a cell, and how probable the table is as a whole."""
    count = Counter(claim.verdict for claim in found)
    words = ", ".join(f"{SYMBOLS[v]} {v} ({n})" for v, n in count.items())
    text = f"In a cell, from top to bottom: printed, ours, verdict. {words}."
    if len(random := [claim for claim in found if claim.together is not None]) > 1:
        together, level = random[0].together, random[0].level_together
        text += f" The {len(random)} Monte-Carlo numbers together have a probability of {together:.2g}; "
        text += f"a table is questioned at {level:.2g} or less, and at {random[0].level:.2g} in one cell."
    return nodes.paragraph(text, text, classes=["legend"])


class LedgerTable(LedgerDirective):
    """All rows of a paper one below the other, with all that the verdicts rest on."""

    def shown(self, key, paper, found):
        head = ["table", "quantity", "printed", "ours", "standard error", "probability"]
        head += ["detectable shifts", "verdict"]
        caption = "Every printed value of the paper and its verdict, in the paper's order."
        return [self.make_table(caption, head, [self.row(paper, claim) for claim in found], "ledger-table")]

    def row(self, paper, c):
        where = ledger.link(self.env, ledger.label_of(c.paper, c.table), paper.tables[c.table])
        quantity = filter(None, (paper.rows[c.row], paper.columns[c.column], ledger.in_brackets(c.unit)))
        printed, ours, word = ledger.written(c)
        found = "" if c.probability is None else f"{c.probability:.4f}"
        tested = [digits(c.se, 2), found, shifts(c.detectable)]
        title, label = f"computed in cell {c.cell} of {c.notebook}", ledger.cell_label(c.notebook, c.cell)
        verdict = nodes.paragraph("", "", ledger.link(self.env, label, word, title=title))
        for erratum in filter(None, c.erratum.split(", ")):
            verdict += [nodes.Text(" "), ledger.link(self.env, erratum, erratum)]
        notes = [nodes.paragraph("", c.note, classes=["note"])] if c.note else []
        texts = [" ".join(quantity), printed, ours, *tested]
        return [[nodes.paragraph("", "", where)], *texts, [verdict, *notes]]


def digits(value, number):
    """So many significant digits, without an exponent where that can be: 6360, not 6.36e+03."""
    return f"{float(f'{value:.{number}g}'):g}" if value else ""


def shifts(detectable):
    """The shifts down and up of a claim."""
    signs = zip("−+", detectable, strict=False)
    return " / ".join(sign + digits(shift, 2) if shift else "none" for sign, shift in signs)


class Score(SphinxDirective):
    """One bar a paper."""

    def run(self):
        html = ""
        for paper in read_papers().values():
            count = Counter(claim.verdict for claim in ledger.claims_under(self.env, (paper.key,)))
            total = f"{len(paper.ledger)} printed values"
            html += f"<p><strong>{escape(paper.title)}</strong>: {total}</p>\n{bar(count)}\n"
        html = f'<div class="score" role="group" aria-label="Verdicts by paper">\n{html}</div>\n'
        return [nodes.raw("", html, format="html")]


def bar(count):
    """Segments as long as their numbers, each with its symbol; what they mean is the list below the bar."""
    segments, words = "", ""
    for verdict in filter(count.get, SYMBOLS):
        kind, sign, number = nodes.make_id(verdict), SYMBOLS[verdict], count[verdict]
        segments += f'<span class="{kind}" style="flex-grow: {number}">{sign} {number}</span>'
        words += f'<li><span class="{kind}">{sign}</span> {number} {verdict}</li>'
    return f'<div class="bar" aria-hidden="true">{segments}</div>\n<ul>{words}</ul>\n'
