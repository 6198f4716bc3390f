"""Cards: what a link leads to is shown on hover and on focus; not by touch; from a file, without a server."""

import json
import re
from functools import cache

import pytest
from bs4 import BeautifulSoup
from built_site import SITE

CARD = "#hover-card"
DATA = re.compile(r'<script type="application/json" id="cards">(.*?)</script>', re.DOTALL)
PAGES = sorted(
    p.relative_to(SITE).as_posix() for d in ("book", "notebooks") for p in SITE.glob(f"{d}/**/*.html")
)


@cache
def cards_of(name):
    found = DATA.search((SITE / name).read_text(encoding="utf-8"))
    return json.loads(found[1]) if found else {}


def with_card(word, *, least=1):
    """The first page with so many cards that lead to addresses with this word, and one such address."""
    for name in PAGES:
        found = [address for address in cards_of(name) if word in address]
        if len(found) >= least:
            return name, found[0]
    return pytest.fail(f"no page has a card of {word}")


def link_to(page, address):
    return page.locator(f'article a.reference.internal[href="{address}"]').first


def test_every_kind_has_cards():
    """Figures, equations, errata and references; images are there, and nothing loads from elsewhere."""
    known = [(name, address) for name in PAGES for address in cards_of(name)]
    for word, least in (("#fig-", 50), ("#equation-", 5), ("errata/", 30), ("bibliography.html#", 20)):
        assert sum(word in address for _, address in known) >= least, word
    for name, address in known:
        card = BeautifulSoup(cards_of(name)[address], "html.parser")
        assert not card.select("a, [id], script")
        assert card.get_text(strip=True)
        for image in card.select("img"):
            assert ((SITE / name).parent / image["src"]).is_file()


@pytest.mark.parametrize("word", ["#fig-", "#equation-", "errata/", "bibliography.html#"])
def test_hover_shows_and_leaving_hides(visit, site, word):
    name, address = with_card(word)
    seen = visit((site / name).as_uri())
    link = link_to(seen.page, address)
    link.scroll_into_view_if_needed()
    link.hover()
    card = seen.page.locator(CARD)
    card.wait_for(state="visible")
    seen.page.wait_for_timeout(300)  # for its formulas
    assert link.get_attribute("aria-describedby") == CARD[1:]
    assert card.locator(".math").count() == card.locator("mjx-container").count()
    assert card.locator("mjx-merror").count() == 0
    box = card.bounding_box()
    assert min(box["x"], box["y"]) >= 0
    assert box["x"] + box["width"] <= 1280
    assert box["y"] + box["height"] <= 900
    card.hover(position={"x": 10, "y": 10})  # the mouse may go onto the card
    seen.page.wait_for_timeout(400)
    assert card.is_visible()
    seen.page.mouse.move(2, 2)
    card.wait_for(state="hidden")
    assert link.get_attribute("aria-describedby") is None
    assert seen.complaints == []


def test_the_keyboard_shows_and_escape_hides(visit, site):
    name, address = with_card("#fig-", least=2)
    page = visit((site / name).as_uri()).page
    link = link_to(page, address)
    page.keyboard.press("Tab")  # from here on the keyboard leads
    link.focus()
    page.locator(CARD).wait_for(state="visible")
    page.keyboard.press("Escape")
    page.locator(CARD).wait_for(state="hidden")
    assert link.evaluate("link => link === document.activeElement")
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Tab")
    page.locator(CARD).wait_for(state="visible")
    page.keyboard.press("Shift+Tab")
    page.locator(CARD).wait_for(state="hidden")


def test_a_touch_follows_the_link(browser, site):
    name, address = with_card("#fig-")
    context = browser.new_context(viewport={"width": 400, "height": 800}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto((site / name).as_uri())
    link_to(page, address).tap()
    page.wait_for_timeout(500)
    assert page.evaluate("location.hash") == address[address.index("#") :]
    assert page.locator(CARD).is_hidden()
    context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("word", ["#fig-", "errata/"])
def test_an_open_card_is_accessible(visit, site, word, scheme):
    from axe_playwright_python.sync_playwright import Axe

    name, address = with_card(word)
    page = visit((site / name).as_uri(), scheme=scheme).page
    link_to(page, address).hover()
    page.locator(CARD).wait_for(state="visible")
    page.wait_for_timeout(300)
    options = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]}}
    assert [v["id"] for v in Axe().run(page, options=options).response["violations"]] == []
