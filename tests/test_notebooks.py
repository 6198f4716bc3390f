"""Chapters as source: what CONTRIBUTING.md says of how a chapter is built."""

import ast
import re
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parent.parent
NOTEBOOKS = sorted(p for p in ROOT.glob("notebooks/*/*.ipynb") if ".ipynb_checkpoints" not in p.parts)
FOLD = "The sentences above, asserted"
CELL, HELPER, LINE = 40, 15, 77  # lines, lines, characters at most

every_chapter = pytest.mark.parametrize(
    "path", NOTEBOOKS, ids=lambda p: p.relative_to(ROOT / "notebooks").as_posix()
)


def code_cells(path):
    return [cell for cell in nbformat.read(path, 4).cells if cell.cell_type == "code"]


def tags(cell):
    return set(cell.metadata.get("tags", []))


def test_there_are_chapters():
    assert len(NOTEBOOKS) >= 29


@every_chapter
def test_cells_helpers_and_lines_are_short(path):
    for cell in code_cells(path):
        lines = cell.source.splitlines()
        assert len(lines) <= CELL, lines[0]
        assert max(map(len, lines)) <= LINE, max(lines, key=len)
        for node in ast.walk(ast.parse(cell.source)):
            if isinstance(node, ast.FunctionDef | ast.Lambda):
                assert node.end_lineno - node.lineno < HELPER, getattr(node, "name", "lambda")


def excerpts(path):
    """The lines of the files that a chapter shows parts of."""
    for name, options in re.findall(r"```\{literalinclude\} (\S+)\n((?:.*\n)*?)```", prose(path)):
        text = (path.parent / name).read_text(encoding="utf-8")
        options = dict(re.findall(r":([a-z]+): (.*)", options))
        if wanted := options.get("pyobject"):
            (node,) = (n for n in ast.parse(text).body if getattr(n, "name", None) == wanted)
            yield from ast.get_source_segment(text, node).splitlines()
        else:
            yield from text.splitlines()[int(options["lines"].rstrip("-")) - 1 :]


def prose(path):
    return "\n".join(c.source for c in nbformat.read(path, 4).cells if c.cell_type == "markdown")


@every_chapter
def test_excerpts_fit_the_page(path):
    assert [line for line in excerpts(path) if len(line) > LINE] == []


def test_there_are_excerpts():
    assert len(list(excerpts(ROOT / "notebooks/use/stone_soup.ipynb"))) > 40


@every_chapter
def test_imports_are_in_sight(path):
    first, *others = code_cells(path)
    assert isinstance(ast.parse(first.source).body[0], ast.Import | ast.ImportFrom)
    assert not tags(first) & {"remove-cell", "remove-input", "hide-cell", "hide-input"}
    names = "\n".join(cell.source for cell in others)
    assert not re.search(r"(?m)^(import|from \S+ import) (?!IPython)", names), (
        "imports stand in the first cell"
    )


@every_chapter
def test_only_numbers_are_hidden(path):
    """What is taken off the page is a call of `numbers`, and what it needs; nothing is glued by hand."""
    for cell in code_cells(path):
        calls = [node.func.id for node in ast.walk(ast.parse(cell.source))
                 if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]  # fmt: skip
        assert "glue" not in calls
        assert ("numbers" in calls) == ("remove-cell" in tags(cell)), cell.source[:80]


@every_chapter
def test_assertions_are_introduced_and_folded(path):
    cells = nbformat.read(path, 4).cells
    folded = [
        k for k, cell in enumerate(cells) if cell.metadata.get("mystnb", {}).get("code_prompt_show") == FOLD
    ]
    assert folded
    stated = [k for k, cell in enumerate(cells) if "\n## Statement by statement\n" in cell.source] or [
        len(cells)
    ]
    code = [k for k, cell in enumerate(cells) if cell.cell_type == "code"]
    assert folded[-1] == max(k for k in code if k < stated[0]), (
        "they close the chapter, but for the statements"
    )
    assert all("hide-input" in tags(cells[k]) for k in code if k > stated[0])
    for k in folded:
        assert {"hide-input", "remove-output"} <= tags(cells[k])
        assert "assert" in cells[k].source
        assert cells[k - 1].cell_type == "markdown" or k - 1 in folded, "a sentence introduces them"


@every_chapter
def test_captioned_figures_have_alternative_text(path):
    for cell in code_cells(path):
        shown = cell.metadata.get("mystnb", {})
        if "figure" in shown:
            assert set(shown["figure"]) >= {"caption", "name"}
            assert len(shown["image"]["alt"]) > 20
            assert "lines_to_next_cell" not in cell.metadata


@every_chapter
def test_streams_come_from_the_manifest(path):
    """A name alone would make another stream than the numbered one."""
    for cell in code_cells(path):
        for call in ast.walk(ast.parse(cell.source)):
            if isinstance(call, ast.Call):
                name = getattr(call.func, "id", getattr(call.func, "attr", ""))
                assert name != "Stream"
                if name in ("stored_runs", "monte_carlo"):
                    stream = [*call.args, *(k.value for k in call.keywords if k.arg == "stream")][2:3]
                    assert not isinstance(stream[0], ast.Constant | ast.JoinedStr), "give PAPER.stream(...)"


@pytest.mark.parametrize("path", [p for p in NOTEBOOKS if p.parent.name == "beyond"], ids=lambda p: p.stem)
def test_a_chapter_beyond_the_papers_ends_in_a_finding_that_is_collected(path):
    cells = nbformat.read(path, 4).cells
    found = [cell.source for cell in cells if re.search(r"(?m)^## Finding$", cell.source)]
    assert len(found) == 1
    assert len(re.sub(r"(?s).*## Finding\n+", "", found[0]).strip().split("\n\n")) <= 2, (
        "one paragraph, and one that leads to the assertions"
    )
    label = re.match(r"\(([a-z0-9-]+)\)=\n# ", cells[0].source)[1]
    page = (ROOT / "book/beyond.md").read_text(encoding="utf-8")
    assert f"{{ref}}`{label}`" in page
    assert f"../notebooks/beyond/{path.name}::" in page, "with a number of the chapter"
