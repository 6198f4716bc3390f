"""Prose executes nothing again; code, an imported module, ledger and lock do; no stale output is kept."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from toy_paper import write_notebook

STEPS = """
import json, sys
from tmalib.judging import chapters
step, *arguments = sys.argv[1:]
print(json.dumps(getattr(chapters, step)(*arguments)))
"""


class Loop:
    """A book of two chapters over a copy of the library, executed in the copy as the Makefile does."""

    def __init__(self, root):
        self.root = root
        (root / "environment.txt").write_text("numpy==2\n")
        uses = "from tmalib.papers.emw_acoustic import scenarios"
        write_notebook(root / "notebooks/emw_acoustic/one.ipynb", ["A sentence."], uses, "print(1)")
        write_notebook(root / "notebooks/robustness/two.ipynb", "import tmalib.checks", "print(2)")

    def call(self, step, *arguments):
        done = subprocess.run(
            [sys.executable, "-c", STEPS, step, *arguments],
            cwd=self.root, env=os.environ | {"PYTHONPATH": str(self.root)}, capture_output=True, text=True,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def prepare(self):
        return self.call("prepare", "notebooks", "executed", "executing", "environment.txt")

    def keep(self):
        return self.call("keep", "notebooks", "executed", "executing", "environment.txt")

    def execute(self, output="1"):
        """What nbmake would write, without the time that it takes."""
        for path in (self.root / "executing").rglob("*.ipynb"):
            made = nbformat.read(path, 4)
            for count, cell in enumerate(cell for cell in made.cells if cell.cell_type == "code"):
                cell.execution_count = count + 1
                cell.outputs = [nbformat.v4.new_output("stream", name="stdout", text=output)]
            nbformat.write(made, path)

    def edit(self, name, change):
        path = self.root / name
        path.write_text(change(path.read_text()))

    def output(self, name):
        cells = nbformat.read(self.root / "executed" / name, 4).cells
        return cells[0].source, [o.text for cell in cells for o in cell.get("outputs", [])]


BOTH = ["emw_acoustic/one.ipynb", "robustness/two.ipynb"]


@pytest.fixture
def loop(copy_of_library):
    loop = Loop(copy_of_library)
    assert loop.prepare() == BOTH
    loop.execute()
    assert loop.keep() == {}
    assert loop.prepare() == []
    return loop


def test_prose_executes_nothing_and_is_taken_over(loop):
    loop.edit(
        "notebooks/emw_acoustic/one.ipynb", lambda text: text.replace("A sentence.", "Another, longer.")
    )
    bare, tagged = '"metadata": {}', '"metadata": {"tags": ["hide-input"]}'
    loop.edit("notebooks/robustness/two.ipynb", lambda text: text.replace(bare, tagged, 1))
    assert loop.prepare() == []
    assert loop.keep() == {}
    assert loop.output("emw_acoustic/one.ipynb") == ("Another, longer.", ["1", "1"])


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("notebooks/emw_acoustic/one.ipynb", BOTH[:1]),
        ("tmalib/papers/emw_acoustic/scenarios.py", BOTH[:1]),
        ("tmalib/motion.py", BOTH[:1]),  # imported by the module that the chapter imports
        ("tmalib/papers/emw_acoustic/published.csv", BOTH[:1]),
        ("tmalib/papers/robustness/paper.toml", BOTH[1:]),  # the manifest of the chapter's own paper
        ("tmalib/checks.py", BOTH),
        ("tmalib/papers/conical_angles/scenarios.py", []),
        ("environment.txt", BOTH),
    ],
)
def test_what_an_output_depends_on_executes_again(loop, name, expected):
    change = (
        (lambda text: text.replace("print(1)", "print(3)"))
        if name.endswith("ipynb")
        else (lambda text: text + "\nCHANGED = 1\n")
    )
    loop.edit(name, change)
    assert loop.prepare() == expected


def test_a_change_that_is_taken_back_is_executed_too(loop):
    """The key is of the contents, not of dates; but outputs of other code are never kept for it."""
    loop.edit("tmalib/motion.py", lambda text: text + "\nCHANGED = 1\n")
    loop.prepare()
    loop.execute("2")
    loop.keep()
    loop.edit("tmalib/motion.py", lambda text: text[: -len("\nCHANGED = 1\n")])
    assert loop.prepare() == BOTH[:1]


def test_a_failed_chapter_is_not_kept(loop):
    loop.edit("notebooks/emw_acoustic/one.ipynb", lambda text: text.replace("print(1)", "print(3)"))
    assert loop.prepare() == BOTH[:1]  # and never executed
    assert loop.keep() == {"emw_acoustic/one.ipynb": "did not run to its end"}
    assert loop.prepare() == BOTH[:1]


def test_a_chapter_that_complains_is_not_kept(loop):
    loop.edit("notebooks/robustness/two.ipynb", lambda text: text.replace("print(2)", "print(4)"))
    loop.prepare()
    loop.execute()
    path = loop.root / "executing/robustness/two.ipynb"
    made = nbformat.read(path, 4)
    made.cells[1].outputs = [nbformat.v4.new_output("stream", name="stderr", text="a warning")]
    nbformat.write(made, path)
    assert loop.keep() == {"robustness/two.ipynb": "wrote to stderr:\na warning"}


def test_code_that_changes_while_chapters_run_is_noticed(loop):
    loop.edit("tmalib/checks.py", lambda text: text + "\nCHANGED = 1\n")
    loop.prepare()
    loop.execute()
    loop.edit("notebooks/robustness/two.ipynb", lambda text: text.replace("print(2)", "print(5)"))
    assert loop.keep() == {"robustness/two.ipynb": "has changed its code since it was executed"}
    loop.edit("tmalib/checks.py", lambda text: text + "\nCHANGED = 1\n")
    assert loop.prepare() == BOTH, "the key is that of the code before the execution"


def test_a_module_that_changes_while_chapters_run_is_noticed(loop):
    """Nobody knows which of its versions made the outputs: only a chapter that does not use it is kept."""
    loop.edit("tmalib/checks.py", lambda text: text + "\nCHANGED = 1\n")
    assert loop.prepare() == BOTH
    loop.execute("2")
    loop.edit("tmalib/motion.py", lambda text: text + "\nCHANGED = 1\n")
    assert loop.keep() == {BOTH[0]: "has changed its code since it was executed"}
    assert loop.output(BOTH[1])[1] == ["2", "2"]
    assert loop.prepare() == BOTH[:1]


def test_a_chapter_that_is_gone_leaves_nothing(loop):
    shutil.rmtree(loop.root / "notebooks/robustness")
    assert loop.prepare() == []
    assert loop.keep() == {}
    assert not (loop.root / "executed/robustness/two.ipynb").exists()
    assert Path(loop.root / "executed/emw_acoustic/one.ipynb").exists()
