"""A figure opens larger: by click, tap and keyboard, from a file, and closes again; a phone can read it."""

import pytest
from built_site import SITE

PAGE = max(
    SITE.glob("notebooks/**/*.html"), key=lambda page: page.read_text().count("<figcaption"), default=None
)
OPEN = "dialog.large-figure[open]"


@pytest.fixture
def open_page(visit, site):
    return lambda **options: visit(PAGE.as_uri(), **options).page


def test_every_figure_is_a_link_to_its_file(open_page):
    page = open_page()
    links = page.locator("a.to-large-figure")
    assert links.count() == page.locator(".bd-content figure").count() > 1
    for link in links.all():
        assert link.get_attribute("href") == link.locator("img").evaluate("image => image.src")


def test_opened_and_closed_by_the_keyboard(open_page):
    page = open_page()
    link = page.locator("a.to-large-figure").nth(1)
    link.focus()
    page.keyboard.press("Enter")
    figure = page.locator(f"{OPEN} img")
    assert figure.get_attribute("src") == link.get_attribute("href")
    assert figure.get_attribute("alt") == link.locator("img").get_attribute("alt")
    name = link.locator("xpath=..").locator(".caption-number").inner_text()
    assert page.get_by_role("dialog", name=name).count() == 1
    box = figure.bounding_box()
    assert min(box["x"], box["y"]) >= 0  # whole, within the window
    assert box["x"] + box["width"] <= 1280
    assert box["y"] + box["height"] <= 900
    assert box["width"] > 1.2 * link.locator("img").bounding_box()["width"]
    page.keyboard.press("Escape")
    page.wait_for_selector(OPEN, state="detached", timeout=3000)
    assert link.evaluate("link => link === document.activeElement")


@pytest.mark.parametrize("what", ["img", "button"])
def test_a_click_closes(open_page, what):
    page = open_page()
    page.locator("a.to-large-figure").first.click()
    page.locator(f"{OPEN} {what}").click()
    assert page.locator(OPEN).count() == 0


def test_on_a_phone_the_text_is_legible_and_the_page_stays_put(open_page):
    """Larger than the window, scrolled in its own box; in proportion."""
    page = open_page(width=400)
    link = page.locator("a.to-large-figure").first
    small = link.locator("img").bounding_box()
    link.click()
    large = page.locator(f"{OPEN} img").bounding_box()
    assert small["width"] <= 400
    assert large["width"] >= 900
    assert large["width"] / large["height"] == pytest.approx(small["width"] / small["height"], rel=0.02)
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
    sheet = page.locator(f"{OPEN} .sheet")
    assert sheet.evaluate("sheet => { sheet.scrollTo(300, 0); return sheet.scrollLeft; }") == 300


def test_an_open_figure_is_accessible(open_page):
    from axe_playwright_python.sync_playwright import Axe

    page = open_page(scheme="dark")
    page.locator("a.to-large-figure").first.click()
    options = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]}}
    assert Axe().run(page, options=options).response["violations"] == []
