"""``{score}``: how much of each paper is judged, and how, as bars with numbers and words.

Results, statements and phrases are counted apart; inputs, which nobody could fail to reproduce, in words.
"""

from collections import Counter
from html import escape

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from ..paper import GROUPS, read_papers
from . import ledger


class Score(SphinxDirective):
    """A bar for each group of each paper."""

    def run(self):
        html = ""
        for paper in read_papers().values():
            found = ledger.claims_under(self.env, (paper.key,))
            html += f"<p><strong>{escape(paper.title)}</strong></p>\n{bars(found)}"
        html = f'<div class="score" role="group" aria-label="Verdicts by paper">\n{html}</div>\n'
        return [nodes.raw("", html, format="html")]


def bars(claims):
    """What is said of one paper."""
    count = {group: Counter(c.verdict for c in claims if c.group == group) for group in GROUPS}
    inputs = count.pop("inputs")
    html = "".join(f"<p>{counted(c.total(), group)}</p>\n{bar(c)}" for group, c in count.items() if c)
    words = ", ".join(f"{number} {verdict}" for verdict, number in inputs.items())
    return html + (f"<p>{counted(inputs.total(), 'inputs')}: {words}</p>\n" if inputs else "")


def counted(number, group):
    """``2 results``, ``1 result``."""
    return f"{number} {group if number != 1 else group.removesuffix('s')}"


def bar(count):
    """Segments as long as their numbers, each with its symbol; what they mean is the list below the bar."""
    segments, words = "", ""
    for verdict in filter(count.get, ledger.ALL_SYMBOLS):
        kind, sign, number = nodes.make_id(verdict), ledger.ALL_SYMBOLS[verdict], count[verdict]
        segments += f'<span class="{kind}" style="flex-grow: {number}">{sign} {number}</span>'
        words += f'<li><span class="{kind}">{sign}</span> {number} {verdict}</li>'
    return f'<div class="bar" aria-hidden="true">{segments}</div>\n<ul>{words}</ul>\n'
