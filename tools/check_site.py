"""Check the built book: links and anchors resolve, nothing loads from another host, every image has alt text.

Usage: check_site.py SITE

Ordinary links to other sites are not followed. The path of this checkout must not appear on a page either,
else two machines would build two different books.
"""

import re
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit

from bs4 import BeautifulSoup, Tag

# What makes the browser load something, as opposed to <a href>, which waits for a click.
LOADING = {
    "script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src", "audio": "src",
    "embed": "src", "object": "data",
}  # fmt: skip
LOADING_LINKS = {"stylesheet", "icon", "preload", "prefetch", "preconnect", "dns-prefetch", "manifest"}
CSS_LOAD = re.compile(r"""(?:url\(\s*|@import\s+)["']?([^"')\s;]+)""")


def external(url: str) -> bool:
    return url.startswith("//") or urlsplit(url).scheme in {"http", "https", "ftp", "ws", "wss"}


def loads(soup: BeautifulSoup) -> list[str]:
    """Every address the browser fetches to show the page."""
    found = [str(tag[key]) for name, key in LOADING.items() for tag in soup(name) if tag.get(key)]
    found += [str(t["href"]) for t in soup("link", href=True) if LOADING_LINKS & set(t.get("rel", []))]
    styles = [tag.get_text() for tag in soup("style")] + [str(tag["style"]) for tag in soup(style=True)]
    return found + [url for style in styles for url in CSS_LOAD.findall(style)]


def without_alt(tag: Tag) -> bool:
    if tag.name == "svg":
        return tag.get("role") == "img" and not (tag.get("aria-label") or tag.get("aria-labelledby"))
    return not str(tag.get("alt") or "").strip()


class Site:
    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        paths = [p for p in sorted(self.root.rglob("*.html")) if "_static" not in p.parts]
        self.pages = {p: BeautifulSoup(p.read_bytes(), "html.parser") for p in paths}
        self.anchors = {p: self.anchors_of(s) for p, s in self.pages.items()}
        self.links = 0

    @staticmethod
    def anchors_of(soup: BeautifulSoup) -> set[str]:
        return {str(tag["id"]) for tag in soup(id=True)}

    def broken(self, page: Path, url: str) -> str | None:
        """Why a link within the site does not resolve, or None."""
        parts = urlsplit(url)
        if parts.scheme or url.startswith("//"):
            return None
        target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
        if target.is_dir():
            target /= "index.html"
        if not target.is_file():
            return f"no such file: {url}"
        self.links += 1
        anchors = self.anchors.get(target)
        if parts.fragment and anchors is not None and unquote(parts.fragment) not in anchors:
            return f"no such anchor: {url}"
        return None

    def findings(self, page: Path, soup: BeautifulSoup) -> list[str]:
        fetched = loads(soup)
        found = [f"loads from another host: {url}" for url in fetched if external(url)]
        inside = [u for u in fetched if not external(u)] + [str(a["href"]) for a in soup("a", href=True)]
        found += [reason for url in dict.fromkeys(inside) if (reason := self.broken(page, url))]
        found += [f"no alt text: {str(t)[:120]}" for t in soup(["img", "svg"]) if without_alt(t)]
        if str(Path.cwd()) in str(soup):
            found.append("names the directory it was built in")
        return found

    def style_sheets(self) -> list[str]:
        """Loads from another host in the style sheets."""
        return [
            f"{sheet.relative_to(self.root)}: loads from another host: {url}"
            for sheet in sorted(self.root.rglob("*.css"))
            for url in CSS_LOAD.findall(sheet.read_text(encoding="utf-8", errors="replace"))
            if external(url)
        ]


def main(root: Path) -> None:
    site = Site(root)
    found = [f"{p.relative_to(site.root)}: {f}" for p, s in site.pages.items() for f in site.findings(p, s)]
    found += site.style_sheets()
    images = sum(len(soup("img")) for soup in site.pages.values())
    print(f"{len(site.pages)} pages, {site.links} links inside, {images} images: {len(found)} findings")
    if found or not site.pages:
        sys.exit("\n".join(found) or f"no pages in {root}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
