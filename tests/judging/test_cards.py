"""Cards of links: a copy of what they lead to, found by address, whatever folder the page is in."""

import pytest
from bs4 import BeautifulSoup

from tmalib.judging.book import cards

FIGURE = """<figure class="align-default" id="fig-a">
<img alt="A line" src="../_images/a.svg" />
<figcaption>
<p><span class="caption-number">Fig. 1</span><span class="caption-text">Of <a href="x.html">x</a>.</span>
<a class="headerlink" href="#fig-a">#</a></p>
</figcaption>
</figure>"""
EQUATION = """<div class="math notranslate nohighlight" id="equation-e">
<span class="eqno">(1)</span>\\[x &lt; 1\\]</div>"""
ERRATUM = """<section id="emw-1-a-title">
<span id="emw-1"></span><h2>emw-1: a title<a class="headerlink" href="#emw-1-a-title">#</a></h2>
<dl class="simple myst">
<dt>Printed</dt><dd><p>one</p></dd>
<dt>Corrected</dt><dd><p>two</p></dd>
<dt>Evidence</dt><dd><p>a proof</p></dd>
<dt>Status</dt><dd><p>Confirmed</p></dd>
</dl>
</section>"""
CITED = """<div class="citation" id="id8" role="doc-biblioentry">
<span class="label">[AB]</span>
<p>A. B.</p>
</div>"""


def found(page, text):
    return dict(cards.cards_in(page, text))


def test_what_has_a_card():
    made = found("book/errata/emw", FIGURE + EQUATION + ERRATUM + CITED)
    assert set(made) == {"fig-a", "equation-e", "emw-1", "id8"}
    assert set(found("book/other", FIGURE + ERRATUM)) == {"fig-a"}, "sections are errata on their pages only"
    for html in made.values():
        soup = BeautifulSoup(html, "html.parser")
        assert not soup.select("a, [id], .eqno, .headerlink"), "a copy has no links and no ids"
    assert "x &lt; 1" in made["equation-e"]
    text = BeautifulSoup(made["emw-1"], "html.parser").get_text(" ", strip=True)
    assert text == "emw-1: a title Printed one Corrected two Status Confirmed"


@pytest.mark.parametrize(
    ("page", "address", "image"),
    [
        ("notebooks/a", "#fig-a", "../_images/a.svg"),
        ("notebooks/b", "a.html#fig-a", "../_images/a.svg"),
        ("book/errata/c", "../../notebooks/a.html#fig-a", "../../_images/a.svg"),
    ],
)
def test_a_link_finds_its_card_and_the_card_its_image(page, address, image):
    known = {("notebooks/a", anchor): html for anchor, html in found("notebooks/a", FIGURE).items()}
    text = f'<a class="reference internal" href="{address}"><a class="reference internal" href="{address}x">'
    shown = cards.links_with_cards(page, text, known)
    assert list(shown) == [address]
    assert BeautifulSoup(shown[address], "html.parser").img["src"] == image
