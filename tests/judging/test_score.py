"""The score counts results, statements, phrases and inputs apart; its bars are as long as their numbers."""

import re
import shutil
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote_plus

import pytest
from playwright.sync_api import sync_playwright
from sphinx.util import texescape

from tmalib.judging import DEPENDS, FALSE, HOLDS, NOT_REPRODUCED, REPRODUCED
from tmalib.judging.book import score

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
STYLE = Path(__file__).parents[2] / "book/_static/custom.css"


def claims(**groups):
    return [SimpleNamespace(group=g, verdict=v) for g, words in groups.items() for v in words]


def test_groups_are_counted_apart():
    found = claims(
        results=[REPRODUCED] * 2, statements=[HOLDS, FALSE], phrases=[DEPENDS], inputs=[REPRODUCED]
    )
    html = score.bars(found, "page.html")
    assert [re.sub("<.*?>", "", text) for text in re.findall(r"<p>(.*?)</p>", html)] == [
        "2 results", "2 statements", "1 phrase", "1 input: 1 reproduced",
    ]  # fmt: skip
    assert html.count('class="bar"') == 3, "inputs have none"
    assert "2 reproduced" in html
    assert "<p>" not in score.bars([], "page.html")


def test_every_part_and_every_entry_lead_to_the_rows_that_they_count():
    html = score.bars(claims(results=[REPRODUCED] * 2, statements=[FALSE]), "page.html")
    links = [unquote_plus(unescape(link)) for link in re.findall(r'href="(.*?)"', html)]
    wanted = ["page.html#ledger-results?Verdict=✓ reproduced", "page.html#ledger-statements?Verdict=✗ false"]
    assert links == [link for link in wanted for _ in ("bar", "list")]


def test_a_narrow_part_has_its_number_in_the_list_only():
    html = score.bar({REPRODUCED: 99, NOT_REPRODUCED: 1}, "page.html")
    bar, words = html.split("\n", 1)
    assert re.findall(">([^<]*)</a>", bar) == ["✓ 99", ""]
    assert "1 not reproduced" in words


def test_on_paper_groups_are_counted_apart():
    found = claims(results=[REPRODUCED] * 2 + [NOT_REPRODUCED], phrases=[DEPENDS], inputs=[REPRODUCED])
    texescape.init()
    tex = score.in_words(found).replace(r"\(\checkmark\)", "✓")
    assert re.findall(r"\\item (.*)", tex) == [
        "3 results: ✓ 2 reproduced, ✗ 1 not reproduced",
        "1 phrase: ◐ 1 depends on what is not printed",
        "1 input: ✓ 1 reproduced",
    ]


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
@pytest.mark.parametrize("width", [1280, 360])
def test_a_bar_is_in_true_proportion_on_the_screen(width):
    """Widths measured in Chromium: a share of one in two hundred is not drawn wider than it is."""
    number = {REPRODUCED: 197, NOT_REPRODUCED: 1, "inconclusive": 2}
    html = f"<style>{STYLE.read_text('utf-8')}</style><div class='score'>{score.bar(number, '')}</div>"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": width, "height": 400})
        page.set_content(html)
        measured = page.eval_on_selector_all(".bar a", "all => all.map(e => e.getBoundingClientRect().width)")
        browser.close()
    total = sum(measured)
    assert total > 0.8 * width
    for drawn, share in zip(measured, (197, 1, 2), strict=True):
        assert drawn / total == pytest.approx(share / 200, abs=1e-3)
