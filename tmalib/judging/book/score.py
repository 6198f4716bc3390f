"""``{score}``: how many printed values of each paper are judged, and how, as bars with numbers and words."""

from collections import Counter
from html import escape

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from ..verdict import SYMBOLS
from .ledger import load_claims, load_papers


def bar(counts):
    """Segments as long as their numbers, each with its symbol; what they mean is the list below the bar."""
    segments, words = "", ""
    for verdict, number in counts:
        kind, sign = nodes.make_id(verdict), SYMBOLS[verdict]
        segments += f'<span class="{kind}" style="flex-grow: {number}">{sign} {number}</span>'
        words += f'<li><span class="{kind}">{sign}</span> {number} {verdict}</li>'
    return f'<div class="bar" aria-hidden="true">{segments}</div>\n<ul>{words}</ul>\n'


class Score(SphinxDirective):
    """One bar a paper."""

    has_content = False

    def run(self):
        parts = []
        for paper in load_papers(self.env).values():
            count = Counter(claim.verdict for claim in load_claims(self.env) if claim.paper == paper.key)
            found = [(verdict, count[verdict]) for verdict in SYMBOLS if count[verdict]]
            total = f"{len(paper.ledger)} printed values"
            parts.append(f"<p><strong>{escape(paper.title)}</strong>: {total}</p>\n{bar(found)}")
        html = f'<div class="score" role="group" aria-label="Verdicts by paper">\n{"".join(parts)}</div>\n'
        return [nodes.raw("", html, format="html")]


def setup(app):
    app.add_directive("score", Score)
