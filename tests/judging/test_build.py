"""The steps of the build, tools/build.py, in a small book: each complains, and then nothing goes on."""

import csv
import importlib.util
import re
import runpy
import shutil
import sys
from pathlib import Path

import nbformat
import pytest
from nbformat import v4
from toy_paper import LEDGER, MANIFEST, notebook, write_notebook, write_paper

from tmalib.judging import Ours, collect, judge, read_paper

ROOT = Path(__file__).parents[2]
HEAD = LEDGER.splitlines()[0]
TWO = f"{HEAD}\nTable 1,heads,bound,0.5,1,deterministic,\nTable 2,heads,bound,0.2,1,deterministic,\n"


@pytest.fixture
def build(monkeypatch, tmp_path):
    """The tool, in a folder with a paper of two tables, a chapter and a page."""
    monkeypatch.chdir(tmp_path)
    spec = importlib.util.spec_from_file_location("build", ROOT / "tools/build.py")
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    manifest = MANIFEST.replace('"Table 1" = "Table 1"', '"Table 1" = "Table 1"\n"Table 2" = "Table 2"')
    listed = ", ".join(
        f'{{ kind = "table", name = "{t}", judged = ["{t}"] }}' for t in ("Table 1", "Table 2")
    )
    contents = f'[[section]]\nnumber = "1"\ntitle = "Coins"\nitems = [{listed}]\n[errata]\n'
    toy = read_paper(write_paper(Path("toy"), manifest, TWO, contents))
    monkeypatch.setattr(found, "read_papers", lambda: {"toy": toy})
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    Path("environment.txt").write_text("numpy==2\n")
    write_notebook(Path("notebooks/toy/coins.ipynb"), ["A sentence."], "print(1)")
    Path("book").mkdir()
    return found


def execute(build, **values):
    """An executed chapter that judges tables, by a value for each."""
    outputs, toy = [], build.read_papers()["toy"]
    for name, value in values.items():
        table = judge(toy, name.replace("_", " "), {("heads", "bound"): Ours(value)})
        outputs.append(v4.new_output("display_data", table._repr_mimebundle_()))
    made = notebook(("judge", outputs))
    path = Path("build/executed/toy/coins.ipynb")
    path.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(made, path)


def test_what_was_not_executed_is_a_complaint(build, capsys):
    build.stale()
    assert "1 of 1 chapters to execute\n  toy/coins.ipynb" in capsys.readouterr().out
    assert build.keep() == ["toy/coins.ipynb did not run to its end"]
    assert not Path("build/executed/toy/coins.ipynb").exists()


def test_an_incomplete_ledger_writes_nothing(build):
    execute(build, Table_1=0.5)
    assert build.judge() == ["unjudged: toy | Table 2 | heads | bound"]
    assert not Path("build/claims.json").exists()
    assert not Path("build/figures").exists()


def test_a_complete_ledger_writes_claims_and_a_file_for_each_table(build, capsys):
    execute(build, Table_1=0.5, Table_2=0.4)
    Path("build/figures").mkdir()
    Path("build/figures/stale.csv").write_text("of yesterday\n")
    assert build.judge() == []
    words = {claim.table: claim.verdict for claim in collect.read_claims("build/claims.json")}
    assert words == {"Table 1": "reproduced", "Table 2": "not reproduced"}
    assert capsys.readouterr().out.startswith("toy: 2 of 2 judged (1 reproduced, 1 not reproduced)\n")
    assert not Path("build/figures/stale.csv").exists()
    for number, printed in ((1, "0.5"), (2, "0.2")):
        with Path(f"build/figures/toy/table-{number}.csv").open(newline="") as file:
            assert [row["printed"] for row in csv.DictReader(file)] == [printed]
    with Path("build/figures/index.csv").open(newline="") as file:
        names = {row["file"] for row in csv.DictReader(file)}
    there = {p.relative_to("build/figures").as_posix() for p in Path("build/figures").rglob("*.*")}
    assert names | {"index.csv"} == there


@pytest.mark.parametrize(
    ("path", "text", "complaint"),
    [
        (
            "book/page.md",
            "Table 1 is reproduced.\n",
            "book/page.md: states a verdict: Table 1 is reproduced.",
        ),
        ("book/page.md", "{glue:text}`toy-gone:.2f`\n", "makes the number toy-gone"),
        (
            "notebooks/toy/coins.ipynb",
            "Table 1 is inconclusive.",
            "notebooks/toy/coins.ipynb: states a verdict",
        ),
    ],
)
def test_a_sentence_without_a_source_stops_the_build(build, monkeypatch, path, text, complaint):
    assert build.check() == []
    if path.endswith(".md"):
        Path(path).write_text(text)
    else:
        write_notebook(Path(path), [text], "print(1)")
    (found,) = build.check()
    assert complaint in found
    with pytest.raises(SystemExit, match=re.escape(complaint)):
        called(monkeypatch, "check")


def called(monkeypatch, *words):
    """As the Makefile calls it: an exit with a text is one with the code 1."""
    monkeypatch.setattr(sys, "argv", ["build.py", *words])
    runpy.run_path(str(ROOT / "tools/build.py"), run_name="__main__")


@pytest.mark.parametrize("words", [[], ["burn"], ["check", "judge"]])
def test_another_step_is_refused(monkeypatch, words):
    with pytest.raises(SystemExit, match=r"Usage: build\.py STEP"):
        called(monkeypatch, *words)


def test_without_a_complaint_it_ends_well(build, monkeypatch):
    called(monkeypatch, "check")
