"""Live views (tmalib.judging.live) in the built book: from a file, by keyboard and touch, without script."""

import re

import numpy as np
import pytest
from built_site import SITE

import tmalib as tma
from tmalib.judging.live_bearings import solution
from tmalib.samples import sample

PAGES = sorted(SITE.glob("notebooks/**/*.html"))
LIVE = [p for p in PAGES if ' class="live" ' in p.read_text(encoding="utf-8")]
every_view = pytest.mark.parametrize("path", LIVE, ids=lambda path: path.relative_to(SITE).as_posix())
DRAWN = "views => views.map(view => [...view.querySelectorAll('[data-curve]')].map(path => path.outerHTML))"
LARGEST = 150_000  # bytes of the views of a page


def test_there_are_views(site):
    assert len(LIVE) > 0


@every_view
def test_every_slider_moves_the_picture(visit, path):
    """By keyboard, from a file: the drawing, what the slider says, and nothing to complain of."""
    seen = visit(path.as_uri())
    page = seen.page
    for slider in page.locator(".live input").all():
        before = page.locator(".live").evaluate_all(DRAWN), slider.get_attribute("aria-valuetext")
        slider.focus()
        page.keyboard.press("End" if slider.input_value() != slider.get_attribute("max") else "Home")
        after = page.locator(".live").evaluate_all(DRAWN), slider.get_attribute("aria-valuetext")
        assert after[0] != before[0], "the drawing"
        assert after[1] != before[1], "the spoken value"
        assert slider.evaluate("slider => getComputedStyle(slider).outlineStyle") == "solid", (
            "the focus is seen"
        )
    for one in page.locator(".live").all():
        assert not {"NaN", "undefined"} & set(re.findall(r"\w+", one.inner_html()))
        assert one.locator("output.live-says").inner_text().strip()
    assert seen.complaints == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in seen.requests)


@every_view
def test_by_touch_on_a_phone(browser, path):
    with browser.new_context(viewport={"width": 400, "height": 800}, has_touch=True, is_mobile=True) as phone:
        page = phone.new_page()
        page.goto(path.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        slider = page.locator(".live input").first
        slider.scroll_into_view_if_needed()
        box, before = slider.bounding_box(), slider.input_value()
        share = 0.2 if int(before) > int(slider.get_attribute("max")) / 2 else 0.8
        slider.tap(position={"x": share * box["width"], "y": box["height"] / 2})
        assert slider.input_value() != before
        assert box["height"] >= 24, "large enough for a finger"


@every_view
def test_without_script_a_figure_stays(browser, path):
    with browser.new_context(java_script_enabled=False) as plain:
        page = plain.new_page()
        page.goto(path.as_uri())
        views = page.locator(".live").count()
        assert page.locator(".live .live-instead:visible").count() == views > 0
        assert page.locator(".live input").count() == 0
        assert page.locator("article figure img:visible").count() > 0


@every_view
def test_not_too_large(visit, path):
    page = visit(path.as_uri()).page
    sizes = page.locator(".live script").evaluate_all(
        "all => all.map(one => new Blob([one.textContent]).size)"
    )
    assert sum(sizes) < LARGEST


@pytest.mark.parametrize("scheme", ["light", "dark"])
@every_view
def test_accessibility(visit, path, scheme):
    """axe-core finds no violation of WCAG 2.1 A or AA in a view."""
    from axe_playwright_python.sync_playwright import Axe

    page = visit(path.as_uri(), scheme=scheme).page
    options = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]}}
    found = Axe().run(page, context=".live", options=options).response["violations"]
    assert [(violation["id"], node["target"]) for violation in found for node in violation["nodes"]] == []


def test_the_browser_has_the_residuals_of_the_library(visit, site):
    """The analyst's view: at the fit, and at random solutions."""
    page = visit((site / "notebooks/use/own_data.html").as_uri()).page
    ship = tma.read_track(sample("ownship.csv"))
    watch, angles = tma.read_bearings(sample("bearings.csv"), platform=ship)
    fit = tma.fit(watch, angles)
    rng = np.random.default_rng(5)
    random = rng.uniform([500, 0, 0, 0], [8000, 360, 15, 360], (20, 4)).tolist()
    for wanted in [solution(fit), *random]:
        length, course, speed, bearing = wanted
        away, velocity = (
            size * np.array([np.sin(angle), np.cos(angle)])
            for size, angle in ((length, np.radians(bearing)), (speed, np.radians(course)))
        )
        state = np.concatenate([ship.position_at(watch.reference_time) + away, velocity])
        off = tma.wrap(angles - watch.linearise(state)[0]) / watch.sigma
        view = page.locator('[data-live="bearings"]')
        found = view.evaluate("(view, wanted) => view.compute(wanted)", wanted)
        residuals = np.concatenate([np.array(part, dtype=float) for part in found["residuals"]])
        assert np.allclose(residuals, off, rtol=0, atol=1e-6, equal_nan=True)
        assert np.isclose(found["squares"], np.nansum(off**2), rtol=1e-8)


def test_the_button_goes_to_the_fit(visit, site):
    page = visit((site / "notebooks/use/own_data.html").as_uri()).page
    page.get_by_role("button", name="Go to the fit").press("Enter")
    words = page.locator(".live output.live-says").inner_text().split()
    assert words[0] == "Criterion"
    assert words[1].rstrip(";") == words[5].rstrip(","), "that of the fit"
    speed = page.get_by_label("Speed").get_attribute("aria-valuetext")
    assert speed == "6.0 m/s"
