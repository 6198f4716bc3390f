"""The list of mutants fits the code: `make mutants` runs them."""

import ast
import tomllib
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MUTANTS = tomllib.loads((ROOT / "tests/mutants/mutants.toml").read_text(encoding="utf-8"))["mutant"]


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant["name"])
def test_a_mutant_changes_one_place_and_its_tests_are_there(mutant):
    assert mutant.keys() - {"equivalent"} == {"name", "file", "text", "becomes", "tests", "why"}
    source = (ROOT / mutant["file"]).read_text(encoding="utf-8")
    assert source.count(mutant["text"]) == 1
    assert mutant["text"] != mutant["becomes"]
    if mutant["file"].endswith(".py"):
        ast.parse(source.replace(mutant["text"], mutant["becomes"]))
    assert mutant["tests"]
    for test in mutant["tests"]:
        name, _, function = test.partition("::")
        assert f"def {function}" in (ROOT / name).read_text(encoding="utf-8")


def test_no_two_mutants_are_the_same():
    for kind in (("name",), ("file", "text", "becomes")):
        (_, most), *_ = Counter(tuple(m[k] for k in kind) for m in MUTANTS).most_common(1)
        assert most == 1
