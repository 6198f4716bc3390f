"""From a printed number to its verdict, its cell, a function, its source and its tests: a click each."""

import ast
import inspect
import re
from functools import cache, reduce
from pathlib import Path

import nbformat
import pytest
from bs4 import BeautifulSoup
from built_site import SITE

ROOT = Path(__file__).parents[2]
CHAPTERS = sorted(path.relative_to(SITE).as_posix() for path in SITE.glob("notebooks/*/*.html"))
IN_CODE = "div.cell_input a.sphinx-codeautolink-a"
ROLE = re.compile(r"\{(?:glue:text|ref|numref|eq|printed|ours|verdict|count|tested|cite:[tp])\}`")


def imported(chapter):
    """The names that a chapter imports, the original ones too, each with the objects that it means."""
    notebook = nbformat.read(ROOT / chapter.replace(".html", ".ipynb"), 4)
    first = next(cell.source for cell in notebook.cells if cell.cell_type == "code")
    found = {}
    for node in ast.parse(first).body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            exec(compile(ast.Module([node], []), chapter, "exec"), names := {})
            for alias in node.names:
                name = alias.asname or alias.name.partition(".")[0]
                for each in {name, alias.name}:
                    found.setdefault(each, []).append(names[name])
    return found


def place_of(found):
    return (
        f"module-{found.__name__}" if inspect.ismodule(found) else f"{found.__module__}.{found.__qualname__}"
    )


@pytest.mark.parametrize("chapter", CHAPTERS)
def test_links_in_code_lead_to_what_python_means(chapter):
    """Every name that begins with an import: the reference's entry is that of the object itself."""
    names, checked = imported(chapter), 0
    for link in BeautifulSoup((SITE / chapter).read_bytes(), "html.parser").select(IN_CODE):
        root, *rest = "".join(link.get_text().split()).split(".")
        if root not in names or link.find_parent("div", class_="cell_input") is None:
            continue
        if link.previous_sibling is not None and link.previous_sibling.get_text().endswith("."):
            continue  # an attribute of something else, by the same name
        meant = [reduce(lambda each, name: getattr(each, name, None), rest, found) for found in names[root]]
        meant = [m for m in meant if inspect.ismodule(m) or inspect.isclass(m) or inspect.isfunction(m)]
        if meant:
            assert link["href"].partition("#")[2] in map(place_of, meant), link
            checked += 1
    assert checked >= 1


@cache
def rows_of(page):
    """The rows of a page of verdicts by their id: the texts of their cells."""
    rows = BeautifulSoup(page.read_bytes(), "html.parser").select("table.ledger-table tr[id]")
    return {row["id"]: [cell.get_text(" ", strip=True) for cell in row("td")] for row in rows}


def test_a_printed_number_leads_to_its_row():
    """Every cell of the judged tables: in the row to which its verdict leads, the same number is printed."""
    checked = 0
    for chapter in CHAPTERS:
        page = SITE / chapter
        for link in BeautifulSoup(page.read_bytes(), "html.parser").select("table.judged-table td a"):
            address, row = link["href"].split("#")
            printed, ours, sign = (
                line.get_text(strip=True) for line in link.find_parent("td").select(".line")
            )
            cells = rows_of((page.parent / address).resolve())[row]
            assert (printed, ours) == (cells[2], cells[3]), link
            assert cells[-1].startswith(f"{sign} "), link
            checked += 1
    assert checked > 200


def test_from_a_verdict_to_a_test(visit, address):
    page = visit(f"{address}/book/verdicts/emw_acoustic.html").page
    page.locator("table.ledger-table td:last-child a").first.click()
    page.wait_for_load_state()
    place = page.evaluate("location.hash.slice(1)")
    links = page.locator(IN_CODE)
    assert links.count() > 10
    assert page.evaluate("id => document.getElementById(id) !== null", place)
    page.locator(f"{IN_CODE}:visible", has_text="stored_runs").first.click()
    page.wait_for_load_state()
    entry = page.locator("dl.py", has=page.locator("dt[id='tmalib.judging.chapter.stored_runs']")).last
    source = entry.locator("a", has_text="[source]").first
    assert "_modules/" in source.get_attribute("href")
    entry.locator("a", has_text="test_store.py").click()
    page.wait_for_load_state()
    line = page.evaluate("document.getElementById(location.hash.slice(1)).textContent")
    assert "stored_runs" in line


def test_parts_of_the_score_lead_to_the_rows_that_they_count(visit, site):
    """From a file. Every entry of the list: so many rows are shown there, and all have that verdict."""
    page = visit((site / "book/intro.html").as_uri()).page
    entries = page.locator(".score li a").evaluate_all("all => all.map(a => [a.href, a.textContent])")
    parts = page.locator(".score .bar a").evaluate_all("all => all.map(a => a.href)")
    assert parts == [link for link, _ in entries]
    assert len(entries) > 15
    for link, text in entries:
        number, verdict = re.fullmatch(r"\S+ (\d+) (.*)", text).groups()
        shown = visit(link).page
        table = shown.locator(f"table#{link.partition('#')[2].partition('?')[0]}")
        verdicts = table.locator("tbody tr:visible td:last-child a:first-child").all_inner_texts()
        assert len(verdicts) == int(number), text
        assert {word.split(" ", 1)[1] for word in verdicts} == {verdict}


@pytest.mark.parametrize("width", [1280, 400])
def test_numbers_in_the_score_are_whole(visit, address, width):
    page = visit(f"{address}/book/intro.html", width=width).page
    clipped = (
        "all => all.filter(a => a.scrollWidth > a.clientWidth + 1 && a.textContent).map(a => a.textContent)"
    )
    assert page.locator(".score .bar a").evaluate_all(clipped) == []


@pytest.mark.parametrize("chapter", CHAPTERS)
def test_a_chapter_can_be_taken_along_with_its_outputs(chapter):
    """The button for the download leads to the executed chapter, in which no role is left."""
    soup = BeautifulSoup((SITE / chapter).read_bytes(), "html.parser")
    (button,) = soup.select(".dropdown-download-buttons a[href$='.ipynb']")
    path = ((SITE / chapter).parent / button["href"]).resolve()
    notebook = nbformat.read(path, 4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.execution_count for cell in code if cell.source.strip())
    assert sum(bool(cell.outputs) for cell in code) >= 1
    source = nbformat.read(ROOT / chapter.replace(".html", ".ipynb"), 4)
    assert [c.source for c in code] == [c.source for c in source.cells if c.cell_type == "code"]
    assert [c.source for c in notebook.cells if c.cell_type == "markdown" and ROLE.search(c.source)] == []
