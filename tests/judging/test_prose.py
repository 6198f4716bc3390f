"""Sentences take their verdicts from the ledger and their numbers from cells, and no number is left over."""

import json
from pathlib import Path

import pytest
from toy_paper import write_notebook

from tmalib.judging import prose
from tmalib.judging.verdict import SYMBOLS


def test_all_words_of_the_verdicts_are_watched():
    assert all(prose.WORDS.search(word) for word in SYMBOLS)


@pytest.mark.parametrize(
    "text",
    [
        "All numbers of Table VI are reproduced.",
        "Table I is **not reproduced**.",
        "The row is inconclusive.",
        "Its biases are ✓.",
        "| bias | ✗ |",
        "All {ours}`emw-acoustic; Table I; xT; true` are reproduced.",
    ],
)
def test_a_verdict_in_prose_is_found(text):
    assert prose.verdicts_in(f"# Title\n\n{text}\n") == [text]


@pytest.mark.parametrize(
    "text",
    [
        "{count}`emw-acoustic; Table I; reproduced`, {count}`emw-acoustic; Table I; inconclusive`",
        "The three stay {verdict}`not reproduced <emw-acoustic; Table VI; yT; std_ekf>`.",
        "A reader can reproduce this.",
        "```python\nassert count(reproduced)\n```",
        "(how-we-judge)=\n# What reproduced means",
    ],
)
def test_prose_from_the_ledger_passes(text):
    assert prose.verdicts_in(text) == []


def test_a_role_vouches_for_itself_only():
    text = "{count}`toy; Table 1; reproduced` agree.\nThe rest is not reproduced.\n"
    assert prose.verdicts_in(text) == ["The rest is not reproduced."]


def test_captions_and_alternative_texts_are_prose_too(tmp_path):
    path = write_notebook(tmp_path / "chapter.ipynb", "1")
    for part, name in (("figure", "caption"), ("image", "alt")):
        shown = json.dumps({"mystnb": {part: {name: "All reproduced."}}})
        text = path.read_text().replace('"metadata": {}', f'"metadata": {shown}', 1)
        marked = tmp_path / f"{name}.ipynb"
        marked.write_text(text)
        assert prose.wrong_verdicts([marked]) == [f"{marked}: states a verdict: All reproduced."]


def test_every_number_has_a_cell_and_a_reader(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_notebook(
        Path("notebooks/toy/coins.ipynb"),
        ["Its own {glue:text}`toy-share:.2f`, and {glue:text}`toy-gone:.0f`."],
    )
    page = Path("book/errata/toy.md")
    page.parent.mkdir(parents=True)
    page.write_text(
        "Another's {glue:text}`../../notebooks/toy/coins.ipynb::toy-other:.0f`, the same twice.\n"
    )
    made = {"toy/coins.ipynb": {"toy-share", "toy-other", "toy-dead"}}
    pages = prose.pages_of("book", "notebooks")
    assert pages == [page, Path("notebooks/toy/coins.ipynb")]
    assert prose.wrong_numbers(pages, "notebooks", made) == [
        "notebooks/toy/coins.ipynb: no cell of toy/coins.ipynb makes the number toy-gone",
        "toy/coins.ipynb: no page uses the number toy-dead",
    ]


def test_the_words_for_phrases_are_watched_and_their_parts_are_not():
    assert prose.verdicts_in("It mostly holds.\n") == ["It mostly holds."]
    assert prose.verdicts_in("It holds where the text says so, and depends on what is assumed.\n") == []
