"""Tables of judged numbers, and their score.

``{judged-table} paper; table`` is a table in the paper's layout: in every cell printed, ours and the verdict,
which leads to its row in the other one.
``{ledger-table} paper`` has all rows of a group of a paper (``:of: results``, the default, ``statements``,
``phrases`` or ``inputs``), with what their verdicts rest on, and a link from each verdict to the cell that
computed it. `_static/ledger.js` makes it sortable and filterable.
"""

from collections import Counter

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx import addnodes
from sphinx.util.docutils import SphinxDirective

from ..paper import GROUPS, read_papers
from ..verdict import SYMBOLS
from . import ledger

NUMBERS = [
    "table",
    "quantity",
    "printed",
    "ours",
    "standard error",
    "probability",
    "detectable shifts",
    "verdict",
]


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

    def make_table(self, caption, head, body, kinds):
        """A docutils table; a cell is a text, or a list of nodes."""
        words, _ = self.state.inline_text(caption, self.lineno)
        group = nodes.tgroup("", *(nodes.colspec(colwidth=1) for _ in head), cols=len(head))
        for section, rows in ((nodes.thead(), [head]), (nodes.tbody(), body)):
            group += section
            section += [nodes.row("", *map(make_entry, cells)) for cells in rows]
        table = nodes.table("", nodes.title(caption, "", *words), group, classes=kinds)
        self.set_source_info(table)
        return table


def body_of(table):
    """The rows of a table below its head."""
    return next(table.findall(nodes.tbody)).children


def make_entry(cell):
    if isinstance(cell, str):
        return nodes.entry("", *([nodes.paragraph(cell, cell)] if cell else []))
    return nodes.entry("", *cell)


def lines(*texts):
    """The content of a cell with several lines, texts or nodes."""
    content = [nodes.Text(text) if isinstance(text, str) else text for text in texts]
    return [nodes.line_block("", *(nodes.line("", "", each) for each in content))]


class JudgedTable(LedgerDirective):
    """The table as the paper lays it out, every number judged."""

    option_spec = {"caption": directives.unchanged_required}  # noqa: RUF012
    parts = 2

    def shown(self, key, paper, found):
        phrases = all(claim.kind == "text" for claim in found)
        head, body = (phrase_rows if phrases else number_rows)(paper, found, self.to_row)
        caption = self.options.get("caption", f"{paper.tables[key[1]]}, judged.")
        node = self.make_table(caption, head, body, ["phrase-table" if phrases else "judged-table"])
        node["names"].append(ledger.label_of(*key))
        self.state.document.note_explicit_target(node, node)
        return [node] if phrases else [node, legend(found)]

    def to_row(self, claim, text):
        """A link from a verdict to its row on the page of verdicts, with all that it rests on."""
        return ledger.link(self.env, ledger.row_id(claim), text, title=claim.verdict)


def phrase_rows(paper, found, linked):
    """Head and body for phrases: what was printed, what was measured, and the verdict with its note."""
    cells = [(c, *ledger.written(c)) for c in found]
    body = [
        [paper.rows[c.row], printed, ours, lines(linked(c, word), c.note)] for c, printed, ours, word in cells
    ]
    return ["", "printed", "ours", "verdict, and what was measured"], body


def number_rows(paper, found, linked):
    """Head and body in the paper's layout: printed, ours and verdict in every cell."""
    columns = list(dict.fromkeys(c.column for c in found))
    cells = {(c.row, c.column): lines(*ledger.written(c)[:2], linked(c, SYMBOLS[c.verdict])) for c in found}
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
    """All rows of a group of a paper one below the other, with all that the verdicts rest on."""

    option_spec = {"of": lambda word: directives.choice(word, tuple(GROUPS))}  # noqa: RUF012

    def shown(self, key, paper, found):
        group = self.options.get("of", "results")
        chosen = [claim for claim in found if claim.group == group]
        if not chosen:
            raise ValueError(f"no {group} are judged under {'; '.join(key)!r}")
        if group == "statements":
            chosen.sort(key=paper.contents.order_of)
        in_words = group in ("statements", "phrases")
        head = ["where", "what", "printed", "what the cell shows", "verdict"] if in_words else NUMBERS
        row = self.words if in_words else self.numbers
        caption = f"The {group} of the paper and their verdicts, in the paper's order."
        kinds = ["ledger-table", "in-words"] if in_words else ["ledger-table"]
        table = self.make_table(caption, head, [row(paper, claim) for claim in chosen], kinds)
        table["ids"].append(ledger.table_id(group))
        for line, claim in zip(body_of(table), chosen, strict=True):
            line["ids"].append(label := ledger.row_id(claim))
            self.env.get_domain("std").note_hyperlink_target(label, self.env.docname, label)
        return [first_of_each(chosen), table]

    def numbers(self, paper, c):
        """The cells of a number."""
        where = ledger.link(self.env, ledger.label_of(c.paper, c.table), paper.tables[c.table])
        quantity = filter(None, (paper.rows[c.row], paper.columns[c.column], ledger.in_brackets(c.unit)))
        printed, ours, _ = ledger.written(c)
        found = "" if c.probability is None else f"{c.probability:.4f}"
        tested = [digits(c.se, 2), found, shifts(c.detectable)]
        texts = [" ".join(quantity), printed, ours, *tested]
        notes = [nodes.paragraph("", c.note, classes=["note"])] if c.note else []
        return [[nodes.paragraph("", "", where)], *texts, [self.verdict(c), *notes]]

    def words(self, paper, c):
        """The cells of a phrase or a statement."""
        printed, ours, _ = ledger.written(c)
        shown = (
            [*c.steps, *([f"rests on: {'; '.join(c.rests_on)}"] if c.rests_on else [])]
            if not ours
            else [ours]
        )
        shown += [c.note] if c.note else []
        where = paper.tables[c.table] if ours else paper.contents.place_of(c)
        return [where, paper.rows.get(c.row, c.row), printed, lines(*shown), [self.verdict(c)]]

    def verdict(self, c):
        """A link to the cell, and links to the errata."""
        title, label = f"computed in cell {c.cell} of {c.notebook}", ledger.cell_label(c.notebook, c.cell)
        found = nodes.paragraph("", "", ledger.link(self.env, label, ledger.written(c)[2], title=title))
        for erratum in filter(None, c.erratum.split(", ")):
            found += [nodes.Text(" "), ledger.link(self.env, erratum, erratum)]
        return found


def first_of_each(claims):
    """Entries of the index, where the search finds them: each verdict leads to the first row that has it."""
    firsts = {claim.verdict: ledger.row_id(claim) for claim in reversed(claims)}
    return addnodes.index(entries=[("single", word, row, "main", None) for word, row in firsts.items()])


def digits(value, number):
    """So many significant digits, without an exponent where that can be: 6360, not 6.36e+03."""
    return f"{float(f'{value:.{number}g}'):g}" if value else ""


def shifts(detectable):
    """The shifts down and up of a claim."""
    signs = zip("−+", detectable, strict=False)
    return " / ".join(sign + digits(shift, 2) if shift else "none" for sign, shift in signs)
