"""The house as CONTRIBUTING.md describes it; import directions are the linter's."""

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MODULES = sorted((ROOT / "tmalib").rglob("*.py"))
TREES = {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8")) for path in MODULES}


@pytest.mark.parametrize("name", TREES)
def test_a_file_holds_one_concept(name):
    assert len((ROOT / name).read_text(encoding="utf-8").splitlines()) <= 300


@pytest.mark.parametrize("name", TREES)
def test_no_private_name_leaves_its_module(name):
    for node in ast.walk(TREES[name]):
        if isinstance(node, ast.ImportFrom):
            private = [alias.name for alias in node.names if alias.name.startswith("_")]
            assert not private
            assert not any(
                part.startswith("_") and part != "__future__" for part in (node.module or "").split(".")
            )


def test_one_place_writes_into_frozen_dataclasses():
    text = {name: (ROOT / name).read_text(encoding="utf-8") for name in TREES}
    assert [name for name in text if "__setattr__" in text[name]] == ["tmalib/checks.py"]


def names_with_two_meanings(files):
    """Public functions and classes that several of these files, or one twice, define."""
    names = Counter(
        node.name
        for name in files
        for node in TREES[name].body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
    )
    return [name for name, count in names.items() if count > 1]


def test_no_name_of_the_library_has_two_meanings():
    """Below papers, judging and beyond."""
    assert (
        names_with_two_meanings(name for name in TREES if not re.search(r"/(papers|judging|beyond)/", name))
        == []
    )


@pytest.mark.parametrize("paper", sorted(p.parent.name for p in ROOT.glob("tmalib/papers/*/paper.toml")))
def test_no_name_of_a_paper_has_two_meanings(paper):
    """Among its own modules."""
    assert names_with_two_meanings(name for name in TREES if f"/papers/{paper}/" in name) == []


@pytest.mark.parametrize("chapter", sorted(p.stem for p in ROOT.glob("notebooks/beyond/*.ipynb")))
def test_no_name_of_a_chapter_beyond_the_papers_has_two_meanings(chapter):
    """Among the modules that are named as it is."""
    assert names_with_two_meanings(name for name in TREES if f"/beyond/{chapter}" in name) == []


def test_the_library_names_no_paper():
    """Its streams, its tables, its folder; a docstring may cite its source."""
    streams = re.compile(r"\"(emw|conical|robustness)/")
    for path in MODULES:
        if not {"papers", "judging", "beyond"} & set(path.relative_to(ROOT).parts):
            assert not streams.search(path.read_text(encoding="utf-8")), path
    for name, tree in TREES.items():
        if "/judging/" in name:
            constants = [
                n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)
            ]
            docs = {ast.get_docstring(n, clean=False) for n in ast.walk(tree)
                    if isinstance(n, ast.Module | ast.FunctionDef | ast.ClassDef)}  # fmt: skip
            assert not [c for c in constants if c not in docs and re.search("emw|conical|robustness", c)], (
                name
            )
