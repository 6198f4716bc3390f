"""``{score}``: how many printed numbers of each paper are judged, and how, as bars with numbers and words."""

from __future__ import annotations

from collections import Counter

from docutils import nodes
from ledger import PAPERS, load_claims
from sphinx.util.docutils import SphinxDirective

from tmalib import claims

UNJUDGED = "not yet judged"


def bar(counts):
    """Segments as long as their numbers, each with its symbol; what they mean is the list below the bar."""
    segments, words = "", ""
    for verdict, number in counts:
        kind, sign = nodes.make_id(verdict), claims.SYMBOLS.get(verdict, "…")
        segments += f'<span class="{kind}" style="flex-grow: {number}">{sign} {number}</span>'
        words += f'<li><span class="{kind}">{sign}</span> {number} {verdict}</li>'
    return f'<div class="bar" aria-hidden="true">{segments}</div>\n<ul>{words}</ul>\n'


class Score(SphinxDirective):
    """One bar a paper."""

    has_content = False

    def run(self):
        judged = load_claims(self.env)
        total = Counter(key[0] for key in claims.ledger())
        parts = []
        for paper, title in PAPERS.items():
            count = Counter(claim["verdict"] for key, claim in judged.items() if key[0] == paper)
            count[UNJUDGED] = total[paper] - count.total()
            found = [(verdict, count[verdict]) for verdict in (*claims.SYMBOLS, UNJUDGED) if count[verdict]]
            number = f"{total[paper]} printed values"
            parts.append(f"<p><strong>{title}</strong>: {number}</p>\n{bar(found)}")
        html = f'<div class="score" role="group" aria-label="Verdicts by paper">\n{"".join(parts)}</div>\n'
        return [nodes.raw("", html, format="html")]


def setup(app):
    app.add_directive("score", Score)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
