"""``{statement-graph} paper``: what the numbered statements of a paper rest on, drawn from their marks.

A box is a statement and a link to its cell; its pattern of border, its symbol and its colour say on what its
verdict rests. A line leads from a statement to one that rests on it. Left are those that rest on no other.
"""

import posixpath
from html import escape

from docutils import nodes

from ..contents import NUMBERED
from ..statements import BASES, foundations, heights
from ..statements import SYMBOLS as VERDICTS
from .tables import LedgerDirective

WIDTH, HEIGHT, ACROSS, DOWN = 196, 40, 76, 14  # of a box, and between boxes


class StatementGraph(LedgerDirective):
    """The drawing, and its legend."""

    def shown(self, key, paper, found):
        stated = numbered(paper, found)
        if not stated:
            raise ValueError(f"no statement of {paper.key} is numbered")
        folder = posixpath.dirname(self.env.docname)
        links = {k: posixpath.relpath(page_of(claim), folder) for k, claim in stated.items()}
        html = drawing(stated, places(stated), links, f"What the statements of {paper.title} rest on")
        return [nodes.raw("", html, format="html")]


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
    """``(column, line)`` of every statement: the column is its height, the line near what it rests on."""
    found, above = {}, heights(stated)
    for column in range(max(above.values()) + 1):
        keys = [key for key in stated if above[key] == column]
        if column:
            keys.sort(key=lambda key: _mean([found[other][1] for other in foundations(stated[key])]))
        line = -1.0
        for key in keys:
            below = [found[other][1] for other in foundations(stated[key])]
            line = max(line + 1, round(_mean(below))) if below else line + 1
            found[key] = (column, line)
    return found


def _mean(values):
    return sum(values) / len(values)


def drawing(stated, at, links, title):
    """The SVG in a box that scrolls, and the list of what the borders mean."""
    corner = {key: (c * (WIDTH + ACROSS) + 2, n * (HEIGHT + DOWN) + 2) for key, (c, n) in at.items()}
    width = max(x for x, _ in corner.values()) + WIDTH + 2
    height = max(y for _, y in corner.values()) + HEIGHT + 2
    lines = [
        line(corner[below], corner[key]) for key, claim in stated.items() for below in foundations(claim)
    ]
    boxes = [box(claim, corner[key], links[key]) for key, claim in stated.items()]
    size = f'viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}"'
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="group" aria-label="{escape(title)}">'
    used = dict.fromkeys(claim.basis for claim in stated.values())
    legend = "".join(f'<li><span class="{kind(b)}">{BASES[b]}</span> {b}</li>' for b in BASES if b in used)
    drawn = "\n".join([svg, *lines, *boxes, "</svg>"])
    scrolled = f'<div class="statement-graph" tabindex="0">{drawn}</div>\n'
    return f'{scrolled}<ul class="statement-legend">{legend}</ul>\n'


def kind(basis):
    """The class of a box in the style sheet."""
    return f"basis-{nodes.make_id(basis)}"


def line(below, above):
    """A curve from the right side of one box to the left side of another."""
    (x0, y0), (x1, y1) = below, above
    x0, y0, y1 = x0 + WIDTH, y0 + HEIGHT / 2, y1 + HEIGHT / 2
    bend = min(ACROSS, x1 - x0) / 2
    return f'<path d="M{x0:g} {y0:g}C{x0 + bend:g} {y0:g} {x1 - bend:g} {y1:g} {x1:g} {y1:g}"/>'


def box(claim, corner, href):
    """A linked box with name, verdict and basis."""
    x, y = corner
    words = escape(f"{claim.row}: {claim.verdict}, {claim.basis}")
    return (
        f'<a href="{href}" class="{kind(claim.basis)}" aria-label="{words}"><title>{words}</title>'
        f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="5"/>'
        f'<text x="{x + 9:g}" y="{y + 17:g}">{escape(claim.row)}</text>'
        f'<text x="{x + 9:g}" y="{y + 33:g}" class="small">{VERDICTS[claim.verdict]} {claim.verdict}</text>'
        f'<text x="{x + WIDTH - 9:g}" y="{y + 26:g}" text-anchor="end">{BASES[claim.basis]}</text></a>'
    )
