"""A single page on paper: no controls, whole tables with their heads, code that breaks over lines."""

import pytest

PAGES = ("book/verdicts/emw_acoustic", "book/concordance", "notebooks/emw_acoustic/path", "book/statements")
CONTROLS = ".ledger-controls, .live, .headerlink, .copybtn, .bd-sidebar-primary, .prev-next-footer"
SEEN = "all => all.filter(e => e.checkVisibility()).map(e => e.className)"
WIDE = "all => all.filter(e => e.getBoundingClientRect().right > innerWidth + 1).map(e => e.className)"
A4 = 718  # pixels between the margins


@pytest.mark.parametrize("name", PAGES)
def test_on_paper(visit, address, name):
    page = visit(f"{address}/{name}.html", width=A4).page
    page.emulate_media(media="print")
    assert page.eval_on_selector_all(CONTROLS, SEEN) == []
    heads = page.eval_on_selector_all(".ledger-table thead", "all => all.map(e => e.innerText.trim())")
    assert all(heads)
    assert page.eval_on_selector_all(".bd-content :is(table, pre, svg, img)", WIDE) == []
