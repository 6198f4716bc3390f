"""The PDF of the book beside its pages: the same chapters, numbers and figures, nothing off the page.

Reads it with Poppler's tools. Skips, saying why, where there is no PDF or no Poppler; `make pdf` runs this on
what it has set, before the book offers it.
"""

import os
import re
import shutil
import subprocess
from functools import cache
from html import unescape
from pathlib import Path

import pytest
from bs4 import BeautifulSoup
from built_site import SITE

PDF = Path(os.environ.get("PDF") or SITE / "angles-only.pdf")
FIGURES = Path(__file__).parents[2] / "build" / "figures"
MARGIN = 14  # points that stay white at every side, at least

pytestmark = [
    pytest.mark.skipif(not PDF.is_file(), reason=f"no {PDF.name}: run `make pdf` first"),
    pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no Poppler on this machine"),
]


@cache
def poppler(tool, *arguments):
    """What a tool of Poppler prints."""
    return subprocess.run([tool, *arguments], capture_output=True, text=True, check=True).stdout


@cache
def text():
    """The words of the PDF, with one space between them and no hyphens at the ends of lines."""
    return " ".join(poppler("pdftotext", "-raw", PDF, "-").replace("-\n", "").split())


def squeezed(words):
    """Letters and digits only: in both, spaces and signs are set in other ways."""
    return "".join(filter(str.isalnum, words))


@cache
def pages():
    found = [
        p
        for p in sorted(SITE.rglob("*.html"))
        if p.parent != SITE and not {"_static", "_modules"} & {*p.parts}
    ]
    return {page: BeautifulSoup(page.read_bytes(), "html.parser") for page in found}


def test_it_is_the_whole_book():
    assert int(re.search(r"Pages: +(\d+)", poppler("pdfinfo", PDF))[1]) > 100
    outline = poppler("pdftohtml", "-xml", "-i", "-stdout", "-l", "1", PDF).partition("<outline>")[2]
    entries = [squeezed(unescape(entry)) for entry in re.findall(r"<item[^>]*>(.*?)</item>", outline)]
    for page, soup in pages().items():
        title = squeezed(soup.h1.get_text().removesuffix("#"))
        assert any(entry.endswith(title) or title.endswith(entry) for entry in entries if entry), page


def test_no_reference_is_open_and_no_letter_missing():
    assert "??" not in text()
    log = PDF.with_suffix(".log")
    complaints = log.read_text("utf-8", "replace") if log.is_file() else ""
    assert "undefined on input line" not in complaints
    assert "Missing character" not in complaints


def test_figures_and_tables_have_the_numbers_of_the_pages():
    there = squeezed(text())
    for page, soup in pages().items():
        for number in soup.select("figcaption .caption-number, caption .caption-number"):
            words = squeezed(number.parent.get_text().replace("#", ""))[:30]
            assert words in there, f"{page}: {number.parent.get_text()}"


def test_fonts_are_embedded():
    fonts = poppler("pdffonts", PDF).splitlines()[2:]
    assert fonts
    assert [font for font in fonts if font.split()[-5] != "yes"] == []


def images(path):
    """Width and height of the raster images of a PDF."""
    lines = poppler("pdfimages", "-list", path).splitlines()[2:]
    return {tuple(line.split()[3:5]) for line in lines}


def test_a_drawing_is_not_a_raster_image():
    """What is one is a cloud of points, as in the figures as exported."""
    assert images(PDF) <= set().union(*(images(path) for path in FIGURES.rglob("*.pdf")))


def test_no_word_runs_off_its_page():
    corners = re.compile(r'<word xMin="(.*?)" yMin="(.*?)" xMax="(.*?)" yMax="(.*?)">(.*)</word>')
    for number, page in enumerate(poppler("pdftotext", "-bbox", PDF, "-").split("<page ")[1:], 1):
        width, height = map(float, re.match(r'width="(.*?)" height="(.*?)"', page).groups())
        for *place, word in corners.findall(page):
            left, top, right, bottom = map(float, place)
            inside = min(left, top) >= MARGIN and right <= width - MARGIN and bottom <= height - MARGIN
            assert inside, f"page {number}: {word} at {left:.0f}, {top:.0f} to {right:.0f}, {bottom:.0f}"
