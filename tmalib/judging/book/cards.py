"""Cards: what a link leads to - a figure, an equation, an erratum, a reference - shown on hover and focus.

When all pages are written each gets the cards of its own links, as JSON in the page: it needs no server.
``_static/cards.js`` shows them.
"""

import json
import posixpath
import re
from html import unescape
from pathlib import Path

from bs4 import BeautifulSoup

TARGETS = {  # what has a card, by its shape on the page where it is; the first group is its id
    "figure": re.compile(r'<figure [^>]*id="([^"]+)">.*?</figure>', re.DOTALL),
    "equation": re.compile(r'<div class="math[^"]*" id="([^"]+)">.*?</div>', re.DOTALL),
    "reference": re.compile(r'<div class="citation" id="([^"]+)".*?</div>', re.DOTALL),
    "erratum": re.compile(r'<section id="[^"]+">\s*<span id="([^"]+)"></span><h2>.*?</dl>', re.DOTALL),
}
ERRATA = "book/errata/"  # the pages whose sections are errata
FIELDS = ("Printed", "Corrected", "Status")  # of an erratum, in its card
LINK = re.compile(r'<a class="reference internal" href="([^"#]*)#([^"]+)"')
MAY_HAVE_FORMULAS = re.compile(r'<a class="reference internal" href="[^"]*(?:#fig-|#equation-|errata/)')


def load_mathjax(app, pagename, templatename, context, doctree):
    """On a page whose cards may have formulas, though it has none itself."""
    if MAY_HAVE_FORMULAS.search(context.get("body", "")):
        app.env.get_domain("math").data["has_equations"][pagename] = True


def write_cards(app, exception):
    """Give all pages their cards."""
    if exception is not None or app.builder.name != "html":
        return
    texts = {name: Path(app.outdir, f"{name}.html").read_text("utf-8") for name in sorted(app.env.found_docs)}
    found = {(name, anchor): card for name, text in texts.items() for anchor, card in cards_in(name, text)}
    for name, text in texts.items():
        if linked := links_with_cards(name, text, found):
            content = json.dumps(linked, ensure_ascii=False, separators=(",", ":")).replace("</", "<\\/")
            data = f'<script type="application/json" id="cards">{content}</script>\n</body>'
            Path(app.outdir, f"{name}.html").write_text(text.replace("</body>", data, 1), "utf-8")


def cards_in(page, text):
    """What on a page can be shown in a card: its id, and the HTML of the card."""
    for kind, pattern in TARGETS.items():
        if kind != "erratum" or page.startswith(ERRATA):
            for match in pattern.finditer(text):
                yield match[1], card(kind, BeautifulSoup(match[0], "html.parser"))


def card(kind, soup):
    """The HTML of a card: no links and no ids, for it is a copy and cannot be entered."""
    for tag in soup.select(".headerlink, .eqno, .backrefs"):
        tag.decompose()
    if kind == "erratum":
        for term in soup.select("dt"):
            if term.get_text(strip=True) not in FIELDS:
                term.find_next_sibling("dd").decompose()
                term.decompose()
        soup.h2.name = "strong"
    for tag in soup.find_all(True):
        del tag["id"]
        if tag.name == "a":
            tag.unwrap()
    soup.find(True).attrs.pop("style", None)
    return str(soup)


def links_with_cards(page, text, found):
    """The cards of the links of a page, by address as it stands in the link."""
    cards = {}
    for path, anchor in dict.fromkeys(LINK.findall(text)):
        folder = posixpath.dirname(page)
        target = posixpath.normpath(posixpath.join(folder, path)).removesuffix(".html") if path else page
        if html := found.get((target, unescape(anchor))):
            cards[f"{path}#{unescape(anchor)}"] = moved(html, posixpath.dirname(target), folder)
    return cards


def moved(html, origin, folder):
    """The same card on a page of another folder: its images are found from there."""

    def source(match):
        return f'src="{posixpath.relpath(posixpath.join(origin, match[1]), folder)}"'

    return re.sub(r'(?<= )src="([^":]+)"', source, html)
