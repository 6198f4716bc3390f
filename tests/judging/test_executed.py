"""What is taken over of executed chapters, and what is not; `test_chapters.py` is about the code they use."""

from pathlib import Path

import nbformat
import pytest
from toy_paper import write_notebook

from tmalib.judging import chapters

NAME = "toy/coins.ipynb"


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """A chapter of two cells, executed and kept."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(chapters, "PACKAGE", tmp_path)
    Path("environment.txt").write_text("numpy==2\n")
    Path("papers/toy").mkdir(parents=True)
    Path("papers/toy/published.csv").write_text("0.5\n")
    write_notebook(Path("notebooks") / NAME, ["A sentence."], "print(1)", "print(2)")
    assert prepare() == [NAME]
    execute("first")
    assert keep() == {}
    assert prepare() == []
    return tmp_path


def prepare():
    return chapters.prepare("notebooks", "executed", "executing", "environment.txt")


def keep():
    return chapters.keep("notebooks", "executed", "executing", "environment.txt")


def execute(text, error=False, until=2):
    """As nbmake: outputs of each cell, an error in the last, or none after some."""
    made = nbformat.read(Path("executing") / NAME, 4)
    for count, cell in enumerate(made.cells[1:][:until]):
        cell.execution_count = count + 1
        cell.outputs = [nbformat.v4.new_output("stream", name="stdout", text=text)]
    if error:
        cell.outputs.append(nbformat.v4.new_output("error", ename="AssertionError", evalue="", traceback=[]))
    nbformat.write(made, Path("executing") / NAME)


def shown():
    return nbformat.read(Path("executed") / NAME, 4).cells[1].outputs[0].text


def change():
    write_notebook(Path("notebooks") / NAME, ["A sentence."], "print(1)", "print(3)")


@pytest.mark.parametrize("name", ["environment.txt", "papers/toy/published.csv"])
def test_lock_and_ledger_count(folder, name):
    (folder / name).write_text("another\n")
    assert prepare() == [NAME]


def test_changed_code_is_executed_and_the_new_outputs_are_kept(folder):
    change()
    assert prepare() == [NAME]
    assert shown() == "first"
    execute("second")
    assert keep() == {}
    assert shown() == "second"
    assert prepare() == []


@pytest.mark.parametrize("how", [dict(error=True), dict(until=1), dict(until=0)])
def test_a_chapter_that_did_not_end_is_not_kept(folder, how):
    change()
    prepare()
    if how != dict(until=0):
        execute("half", **how)
    assert keep() == {NAME: "did not run to its end"}
    assert prepare() == [NAME]


def test_of_a_chapter_that_is_gone_nothing_stays(folder):
    (folder / "notebooks" / NAME).unlink()
    assert keep() == {}
    assert not (folder / "executed" / NAME).exists()
