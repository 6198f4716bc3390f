"""``{score}``: how much of each paper is judged, and how, as bars with numbers and words.

Results, statements and phrases are counted apart; inputs, which nobody could fail to reproduce, in words. A
part of a bar, and its entry in the list below, lead to the rows that it counts, the verdicts filtered.
"""

import posixpath
from collections import Counter
from html import escape
from urllib.parse import urlencode

from docutils import nodes
from sphinx.util.docutils import SphinxDirective
from sphinx.util.texescape import escape as escape_tex

from ..paper import GROUPS, read_papers
from . import ledger

WIDE = 0.16  # of a bar: what is narrower has its number in the list only


class Score(SphinxDirective):
    """A bar for each group of each paper."""

    def run(self):
        html = ""
        for paper in read_papers().values():
            found = ledger.claims_under(self.env, (paper.key,))
            page = posixpath.relpath(
                f"book/verdicts/{paper.folder.name}.html", posixpath.dirname(self.env.docname)
            )
            html += f"<p><strong>{escape(paper.title)}</strong></p>\n{bars(found, page)}"
        html = f'<div class="score" role="group" aria-label="Verdicts by paper">\n{html}</div>\n'
        return [nodes.raw("", html, format="html"), nodes.raw("", on_paper(self.env), format="latex")]


def bars(claims, page):
    """What is said of one paper; ``page`` is the address of its verdicts."""
    count = {group: Counter(c.verdict for c in claims if c.group == group) for group in GROUPS}
    inputs = count.pop("inputs")
    address = {group: f"{page}#{ledger.table_id(group)}" for group in GROUPS}
    html = "".join(
        f"<p>{counted(c.total(), group)}</p>\n{bar(c, address[group])}" for group, c in count.items() if c
    )
    words = ", ".join(
        f'<a href="{filtered(address["inputs"], verdict)}">{number} {verdict}</a>'
        for verdict, number in inputs.items()
    )
    return html + (f"<p>{counted(inputs.total(), 'inputs')}: {words}</p>\n" if inputs else "")


def filtered(address, verdict):
    """The address at which `_static/ledger.js` shows the rows with a verdict."""
    return escape(f"{address}?{urlencode({'Verdict': f'{ledger.ALL_SYMBOLS[verdict]} {verdict}'})}")


def counted(number, group):
    """``2 results``, ``1 result``."""
    return f"{number} {group if number != 1 else group.removesuffix('s')}"


def on_paper(env):
    """The score of every paper, as lists for the PDF."""
    items = ""
    for paper in read_papers().values():
        items += f"\\item \\textbf{{{paper.title}}}\n{in_words(ledger.claims_under(env, (paper.key,)))}"
    return f"\\begin{{itemize}}\n{items}\\end{{itemize}}\n"


def in_words(claims):
    """A list with an item for each group."""
    items = ""
    for group in GROUPS:
        count = Counter(c.verdict for c in claims if c.group == group)
        words = [f"{sign} {count[word]} {word}" for word, sign in ledger.ALL_SYMBOLS.items() if count[word]]
        said = escape_tex(", ".join(words), "xelatex")
        items += f"\\item {counted(count.total(), group)}: {said}\n" if words else ""
    return f"\\begin{{itemize}}\n{items}\\end{{itemize}}\n"


def bar(count, address):
    """Parts as long as their numbers; the list below the bar says what they are, and is read aloud."""
    parts, words = "", ""
    for verdict in filter(count.get, ledger.ALL_SYMBOLS):
        kind, sign, number = nodes.make_id(verdict), ledger.ALL_SYMBOLS[verdict], count[verdict]
        link = f'href="{filtered(address, verdict)}"'
        text = f"{sign} {number}" if number >= WIDE * sum(count.values()) else ""
        parts += f'<a {link} class="{kind}" style="flex-grow: {number}" tabindex="-1">{text}</a>'
        words += f'<li><a {link}><span class="{kind}">{sign}</span> {number} {verdict}</a></li>'
    return f'<div class="bar" aria-hidden="true">{parts}</div>\n<ul>{words}</ul>\n'
