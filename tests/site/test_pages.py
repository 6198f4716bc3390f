"""The built pages as files: links resolve, nothing loads from another host, every image has alt text.

Ordinary links to other sites are not followed. `make book` runs this on what it has built, before that takes
the place of the book before.
"""

import re
from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from bs4 import BeautifulSoup
from built_site import SITE

PAGES = [p for p in sorted(SITE.rglob("*.html")) if "_static" not in p.parts]
# What makes the browser load something, as opposed to <a href>, which waits for a click.
LOADING = {
    "script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src", "audio": "src",
    "embed": "src", "object": "data",
}  # fmt: skip
LOADING_LINKS = {"stylesheet", "icon", "preload", "prefetch", "preconnect", "dns-prefetch", "manifest"}
CSS_LOAD = re.compile(r"""(?:url\(\s*|@import\s+)["']?([^"')\s;]+)""")


@cache
def soup(page):
    return BeautifulSoup(page.read_bytes(), "html.parser")


@cache
def anchors(page):
    return {tag["id"] for tag in soup(page)(id=True)}


def external(url):
    return url.startswith("//") or urlsplit(url).scheme in {"http", "https", "ftp", "ws", "wss"}


def loads(page):
    """Every address that the browser fetches to show the page."""
    tags = soup(page)
    found = [tag[key] for name, key in LOADING.items() for tag in tags(name) if tag.get(key)]
    found += [tag["href"] for tag in tags("link", href=True) if LOADING_LINKS & set(tag.get("rel", []))]
    styles = [tag.get_text() for tag in tags("style")] + [tag["style"] for tag in tags(style=True)]
    return found + [url for style in styles for url in CSS_LOAD.findall(style)]


def broken(page, url):
    """Why a link within the site does not resolve, or None."""
    parts = urlsplit(url)
    if parts.scheme or url.startswith("//"):
        return None
    target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
    target = target / "index.html" if target.is_dir() else target
    if not target.is_file():
        return f"no such file: {url}"
    anchor = unquote(parts.fragment).partition("?")[0]  # what follows is for ledger.js
    if anchor and target in PAGES and anchor not in anchors(target):
        return f"no such anchor: {url}"
    return None


def without_alt(tag):
    if tag.name == "svg":
        return tag.get("role") == "img" and not (tag.get("aria-label") or tag.get("aria-labelledby"))
    return not str(tag.get("alt") or "").strip()


def test_there_are_pages():
    assert len(PAGES) > 0, f"no pages in {SITE}: run `make book` first"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(SITE).as_posix())
def test_page(page):
    fetched = loads(page)
    assert [url for url in fetched if external(url)] == [], "loads from another host"
    inside = [url for url in fetched if not external(url)] + [a["href"] for a in soup(page)("a", href=True)]
    assert list(filter(None, (broken(page, url) for url in dict.fromkeys(inside)))) == []
    assert [str(tag)[:120] for tag in soup(page)(["img", "svg"]) if without_alt(tag)] == [], "no alt text"
    assert str(Path.cwd()) not in str(soup(page)), "else two machines would build two different books"


def test_style_sheets_load_nothing_from_another_host():
    sheets = {sheet: sheet.read_text(encoding="utf-8", errors="replace") for sheet in SITE.rglob("*.css")}
    assert [
        (s.name, url) for s, text in sheets.items() for url in CSS_LOAD.findall(text) if external(url)
    ] == []
