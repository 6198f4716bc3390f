"""What a reader meets: mathematics, search, narrow screens, dark mode, no network, accessibility."""

from urllib.parse import quote, urlsplit

import pytest
from built_site import SITE

PAGES = sorted(
    p.relative_to(SITE).as_posix() for d in ("book", "notebooks") for p in SITE.glob(f"{d}/**/*.html")
)
FRONT = "book/intro.html"
TEXT = {name: (SITE / name).read_text(encoding="utf-8") for name in PAGES}
CHAPTERS = sorted(PAGES, key=lambda name: -TEXT[name].count("<figcaption") - TEXT[name].count("<caption"))
LEDGERS = [name for name in PAGES if name.startswith("book/verdicts/")]
# The front page, the chapter with the most figures and tables, the longest ledger.
SAMPLE = [FRONT, *CHAPTERS[:1], *sorted(LEDGERS, key=lambda name: -len(TEXT[name]))[:1]]

# Violations of the theme, not of the book: rule -> the elements (CSS selectors) that are allowed to break it.
THEME_VIOLATIONS: dict[str, tuple[str, ...]] = {}


@pytest.mark.parametrize("name", PAGES)
def test_page(visit, address, name):
    """Silent console, no request to another host, every formula typeset, no sideways scroll on a phone."""
    seen = visit(f"{address}/{name}")
    assert seen.complaints == []
    assert {urlsplit(url).netloc for url in seen.requests if not url.startswith("data:")} == {
        urlsplit(address).netloc
    }
    assert seen.page.locator("mjx-merror, merror").count() == 0
    assert seen.page.locator("mjx-container").count() >= seen.page.locator(".math").count()
    assert seen.page.locator("div.cell_output .stderr, .traceback").count() == 0
    seen.page.set_viewport_size({"width": 400, "height": 800})
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= 400


@pytest.mark.parametrize("name", SAMPLE)
def test_opens_from_a_file(visit, site, name):
    """Without a server, as after unpacking an archive."""
    seen = visit((site / name).as_uri())
    assert seen.complaints == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in seen.requests)
    assert seen.page.locator("article h1").count() == 1
    assert seen.page.locator("mjx-merror").count() == 0


def test_some_page_has_mathematics(visit, address):
    name = next(name for name in PAGES if 'class="math' in TEXT[name])
    assert visit(f"{address}/{name}").page.locator("mjx-container").count() > 0


def test_search_finds_a_word(visit, address):
    page = visit(f"{address}/search.html?q=bearing").page
    page.wait_for_selector("#search-results li a")
    assert page.locator("#search-results li a").count() > 0


@pytest.mark.parametrize(
    ("words", "place"),
    [
        ("Theorem 2", "notebooks/conical_angles/theorem_2.html"),
        ("Table IV", "notebooks/emw_acoustic/scenario_4.html"),
        ("Cramer-Rao", "book/appendix/glossary.html"),
        ("not reproduced", "book/verdicts/conical_angles.html"),
    ],
)
def test_search_finds_what_a_reader_of_the_paper_types(visit, site, words, place):
    """From a file, without a server; among the first five."""
    page = visit(f"{(site / 'search.html').as_uri()}?q={quote(words)}").page
    page.wait_for_selector("#search-results li a")
    first = page.locator("#search-results li a").evaluate_all("all => all.slice(0, 5).map(a => a.href)")
    assert any(place in link for link in first), first


@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("Theorem 2", "notebooks/conical_angles/theorem_2.html"),
        ("Table V", "notebooks/emw_acoustic/scenario_5.html"),
    ],
)
def test_with_a_paper_in_hand_two_clicks(visit, site, name, place, width):
    """The first of them is on the first screen of the front page, and so is the second on its page."""
    page = visit((site / FRONT).as_uri(), width=width).page
    card = page.locator(".sd-card", has_text="Check").first
    assert card.bounding_box()["y"] + card.bounding_box()["height"] <= 900
    card.click()
    page.wait_for_url("**/concordance.html*")
    page.evaluate("scrollTo(0, 0)")
    link = page.get_by_role("link", name=name, exact=True).first
    assert link.bounding_box()["y"] <= 900
    link.click()
    page.wait_for_url(f"**/{place}*")


def results_of(page):
    """The rows shown of the table of results on a page of verdicts, and its controls."""
    tables = page.locator("table.ledger-table")
    kinds = tables.evaluate_all("all => all.map(table => table.className)")
    number = next(k for k, kind in enumerate(kinds) if "in-words" not in kind)
    table = tables.nth(number)
    return table.locator("tbody tr:visible"), page.locator(f"#{table.get_attribute('id')}-controls")


@pytest.mark.parametrize("name", LEDGERS)
def test_the_ledger_filters_and_sorts(visit, site, name):
    """From a file, without a server: by table, verdict and words; without script it is a plain table."""
    page = visit((site / name).as_uri()).page
    shown, controls = results_of(page)
    everything = shown.count()
    assert f"{everything} of {everything} rows" in controls.locator("output").inner_text()
    chosen = controls.get_by_label("Verdict", exact=True)
    chosen.select_option(index=1)
    verdicts = shown.locator("td:last-child a:first-child").all_inner_texts()
    assert 0 < len(verdicts) <= everything
    assert set(verdicts) == {chosen.input_value()}
    chosen.select_option(index=0)
    place = controls.get_by_label("Table", exact=True)
    place.select_option(index=1)
    assert set(shown.locator("td:first-child").all_inner_texts()) == {place.input_value()}
    place.select_option(index=0)
    words = controls.get_by_label("Words", exact=True)
    words.fill("no such words")
    assert shown.count() == 0
    words.fill("")
    assert shown.count() == everything


def test_words_are_whole_and_what_is_chosen_is_in_the_address(visit, site):
    """«Table 2» is not Table 3 with a 2 in a note; the address brings the choice back."""
    address = (site / "book/verdicts/conical_angles.html").as_uri()
    page = visit(address).page
    shown, controls = results_of(page)
    controls.get_by_label("Words", exact=True).fill("Table 2")
    assert set(shown.locator("td:first-child").all_inner_texts()) == {"Table 2"}
    found = shown.count()
    again, controls = results_of(visit(page.url).page)
    assert again.count() == found
    assert controls.get_by_label("Words", exact=True).input_value() == "Table 2"


def test_the_ledger_sorts_by_number(visit, site):
    page = visit((site / "book/verdicts/emw_acoustic.html").as_uri()).page
    shown, _ = results_of(page)
    page.get_by_role("button", name="probability", exact=True).first.click()
    found = [float(text) for text in shown.locator("td:nth-child(6)").all_inner_texts() if text.strip()]
    assert found == sorted(found, reverse=True)


def test_a_verdict_leads_to_its_cell(visit, address):
    for name in LEDGERS:
        page = visit(f"{address}/{name}").page
        page.locator("table.ledger-table td:last-child a").first.click()
        page.wait_for_load_state()
        target = page.evaluate("document.getElementById(location.hash.slice(1))?.className ?? ''")
        assert "cell" in target or "judged-table" in target


@pytest.mark.parametrize("name", LEDGERS)
def test_a_ledger_on_a_phone(visit, address, name):
    """Every number and verdict is within 400 pixels."""
    page = visit(f"{address}/{name}", width=400).page
    edges = "cells => Math.max(...cells.map(cell => cell.getBoundingClientRect().right))"
    assert page.locator("table.ledger-table td").evaluate_all(edges) <= 400


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", SAMPLE)
def test_accessibility(visit, address, name, scheme):
    """axe-core finds no violation of WCAG 2.1 A or AA."""
    from axe_playwright_python.sync_playwright import Axe

    page = visit(f"{address}/{name}", scheme=scheme).page
    assert page.locator(f'html[data-theme="{scheme}"]').count() == 1
    options = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]}}
    found = [
        f"{violation['id']}: {' '.join(node['target'])}: {node.get('failureSummary', '')}"
        for violation in Axe().run(page, options=options).response["violations"]
        for node in violation["nodes"]
        if not any(t in " ".join(node["target"]) for t in THEME_VIOLATIONS.get(violation["id"], ()))
    ]
    assert found == []
