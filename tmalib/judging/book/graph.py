"""``{statement-graph} paper``: what the numbered statements of a paper rest on, drawn from their marks.

A box is a statement and a link to its cell; its pattern of border, its symbol and its colour say on what its
verdict rests. A line leads from a statement to one that rests on it. Left are those that rest on no other.
"""

import posixpath
import textwrap
from html import escape

from docutils import nodes
from sphinx.util.texescape import escape as escape_tex

from ..contents import NUMBERED
from ..statements import BASES, FALSE, MEASURED, OPEN, PROVED, WITH_HAND, foundations, heights
from ..statements import SYMBOLS as VERDICTS
from .tables import LedgerDirective

WIDTH, HEIGHT, ACROSS, DOWN = 196, 56, 60, 14  # of a box, and between boxes
LETTERS = 23  # of a name in a line of a box


class StatementGraph(LedgerDirective):
    """The drawing, and its legend."""

    def shown(self, key, paper, found):
        stated = numbered(paper, found)
        if not stated:
            raise ValueError(f"no statement of {paper.key} is numbered")
        folder = posixpath.dirname(self.env.docname)
        links = {k: posixpath.relpath(page_of(claim), folder) for k, claim in stated.items()}
        html = drawing(stated, places(stated), links, f"What the statements of {paper.title} rest on")
        tex = on_paper(stated, places(stated))
        return [nodes.raw("", html, format="html"), nodes.raw("", tex, format="latex")]


def numbered(paper, claims):
    """Statements that are numbered or rest on others, and what those rest on; a dict from key to claim."""
    stated = {claim.key: claim for claim in claims if claim.kind == "statement"}
    wanted = [
        key
        for key, claim in stated.items()
        if claim.rests_on or any(item.kind in NUMBERED for item in paper.contents.items_of(claim))
    ]
    for key in wanted:  # grows while it is read
        wanted += [other for other in foundations(stated[key]) if other not in wanted]
    return {key: claim for key, claim in stated.items() if key in wanted}


def page_of(claim):
    """Address of the cell of a claim, from the root of the book."""
    return f"notebooks/{claim.notebook.removesuffix('.ipynb')}.html#cell-{claim.cell}"


def places(stated):
    """``(column, line)`` of every statement: the column is its height, the line near what it rests on.

    Those that stand alone come last, line by line.
    """
    found, above = {}, heights(stated)
    used = {below for claim in stated.values() for below in foundations(claim)}
    alone = [key for key, claim in stated.items() if key not in used and not claim.rests_on]
    columns = max(above.values()) + 1
    for column in range(columns):
        keys = [key for key in stated if above[key] == column and key not in alone]
        lines = {key: [found[below][1] for below in foundations(stated[key])] for key in keys}
        line = -1.0
        for key in sorted(keys, key=lambda key: _mean(lines[key])):
            line = max(line + 1, round(_mean(lines[key])))
            found[key] = (column, line)
    bottom = max((line for _, line in found.values()), default=-1.0) + 1
    return found | {key: (k % columns, bottom + k // columns) for k, key in enumerate(alone)}


def _mean(values):
    return sum(values) / len(values) if values else 0.0


def standing(stated):
    """On what the verdict on every statement rests, those that it rests on included; the weakest decides."""
    found, above = {}, heights(stated)
    for key in sorted(stated, key=above.get):
        own, below = stated[key].basis, {found[other] for other in foundations(stated[key])}
        if own not in (FALSE, OPEN) and MEASURED in below:
            own = MEASURED
        elif own == PROVED and below - {PROVED}:
            own = WITH_HAND
        found[key] = own
    return found


def corner_of(place):
    """The upper left corner of the box at a place."""
    column, line = place
    return (column * (WIDTH + ACROSS) + 2, line * (HEIGHT + DOWN) + 2)


def drawing(stated, at, links, title):
    """The SVG in a box that scrolls, and the list of what the borders mean."""
    width, height = (max(sides) for sides in zip(*map(corner_of, at.values()), strict=True))
    width, height = width + WIDTH + 2, height + HEIGHT + 2
    lines = [f'<path d="{path}"/>' for path in curves(stated, at)]
    bases = standing(stated)
    boxes = [box(claim, bases[key], corner_of(at[key]), links[key]) for key, claim in stated.items()]
    size = f'viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}"'
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="group" aria-label="{escape(title)}">'
    used = [basis for basis in BASES if basis in bases.values()]
    legend = "".join(f'<li><span class="{kind(b)}">{BASES[b]}</span> {b}</li>' for b in used)
    drawn = "\n".join([svg, *lines, *boxes, "</svg>"])
    scrolled = f'<div class="statement-graph" tabindex="0">{drawn}</div>\n'
    return f'{scrolled}<ul class="statement-legend">{legend}</ul>\n'


def kind(basis):
    """The class of a box in the style sheet."""
    return f"basis-{nodes.make_id(basis)}"


def curves(stated, at):
    """The path of every line."""
    return [curve(at[below], at[key]) for key, claim in stated.items() for below in foundations(claim)]


def curve(below, above):
    """A curve from the right side of one box to the left side of another, through gaps between the others."""
    x, y = corner_of(below)
    x, y = x + WIDTH, y + HEIGHT / 2
    path = f"M{x:g} {y:g}"
    for column in range(below[0] + 1, above[0] + 1):
        share = (column - below[0]) / (above[0] - below[0])
        gap = round(below[1] + share * (above[1] - below[1]) - 0.5) + 0.5  # between two lines
        to_x, to_y = corner_of((column, above[1] if column == above[0] else gap))
        to_y, middle = to_y + HEIGHT / 2, (x + to_x) / 2
        path += f"C{middle:g} {y:g} {middle:g} {to_y:g} {to_x:g} {to_y:g}"
        x, y = to_x + WIDTH, to_y
        path += f"H{x:g}" if column < above[0] else ""
    return path


def box(claim, basis, corner, href):
    """A linked box with name, verdict and basis."""
    x, y = corner
    words = escape(f"{claim.row}: {claim.verdict}, {basis}")
    name = [escape(line) for line in textwrap.wrap(claim.row, LETTERS)]
    texts = [(x + 9, y + 17 + 15 * k, "", line) for k, line in enumerate(name)]
    texts += [(x + 9, y + HEIGHT - 8, ' class="small"', f"{VERDICTS[claim.verdict]} {claim.verdict}")]
    texts += [(x + WIDTH - 9, y + HEIGHT - 9, ' text-anchor="end"', BASES[basis])]
    return (
        f'<a href="{href}" class="{kind(basis)}" aria-label="{words}"><title>{words}</title>'
        f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="5"/>'
        + "".join(f'<text x="{left:g}" y="{top:g}"{look}>{text}</text>' for left, top, look, text in texts)
        + "</a>"
    )


def on_paper(stated, at):
    """The same drawing for the PDF, in TikZ, with its legend; the styles are in ``book/pdf.tex``."""
    bases = standing(stated)
    lines = [rf"\draw svg[yscale=-1] {{{path}}};" for path in curves(stated, at)]
    boxes = [box_on_paper(claim, bases[key], corner_of(at[key])) for key, claim in stated.items()]
    signs = [rf"\basissign{{{kind(b)}}}{{{BASES[b]}}} {b}" for b in BASES if b in bases.values()]
    drawn = [r"\begin{statementgraph}", *lines, *boxes, r"\end{statementgraph}", r" \quad ".join(signs), ""]
    return "\n".join(drawn)


def box_on_paper(claim, basis, corner):
    """A linked box with name, verdict and basis."""
    x, y = corner
    label = rf"\detokenize{{notebooks/{claim.notebook.removesuffix('.ipynb')}:cell-{claim.cell}}}"
    name = r"\\".join(escape_tex(line, "xelatex") for line in textwrap.wrap(claim.row, LETTERS))
    verdict = f"{VERDICTS[claim.verdict]} {claim.verdict}"
    parts = (kind(basis), f"{x:g}", f"{-y:g}", label, name, verdict, BASES[basis])
    return r"\statement" + "".join(f"{{{part}}}" for part in parts)
