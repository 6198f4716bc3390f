"""``{errata-table} paper``: the errata of a paper in short, each with links to what shows it.

The words are those of ``contents.toml``, the status that of the manifest. The evidence ends with the cells
whose claims name the erratum, so that it leads to what was computed.
"""

from docutils import nodes

from . import ledger
from .tables import LedgerDirective

HEAD = ["", "where", "printed", "corrected", "evidence", "consequence", "status"]


class ErrataTable(LedgerDirective):
    """A row an erratum."""

    def shown(self, key, paper, found):
        body = [self.row(paper, name, cells_naming(found, name)) for name in paper.errata]
        return [self.make_table("The errata in short.", HEAD, body, ["errata-table"])]

    def row(self, paper, name, cells):
        short = paper.contents.errata[name]
        head = nodes.paragraph("", "", ledger.link(self.env, name, name))
        evidence = self.inline(short["evidence"])
        for notebook, cell in cells:
            chapter = notebook.rpartition("/")[2].removesuffix(".ipynb").replace("_", " ")
            label = ledger.cell_label(notebook, cell)
            evidence += [nodes.Text("; "), ledger.link(self.env, label, f"{chapter}, cell {cell}")]
        texts = [[self.inline(short[field])] for field in ("where", "printed", "corrected")]
        return [[head], *texts, [evidence], [self.inline(short["consequence"])], paper.errata[name]["status"]]

    def inline(self, text):
        """A paragraph with formulas, links and values of the ledger."""
        words, messages = self.state.inline_text(text, self.lineno)
        return nodes.paragraph(text, "", *words, *messages)


def cells_naming(claims, erratum):
    """``(notebook, cell)`` where an erratum is shown, each once, in the order of the ledger.

    These are the cells of the statements that name it, or, if there are none, of the numbers.
    """
    named = [claim for claim in claims if erratum in claim.erratum.split(", ")]
    named = [claim for claim in named if claim.kind == "statement"] or named
    return list(dict.fromkeys((claim.notebook, claim.cell) for claim in named))
