"""A paper is a folder: a toy one, added to a copy of the project, gets score, verdicts and provenance.

No line of Python is written outside its folder. The other papers are taken away, which shows that nothing
needs them.
"""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from bs4 import BeautifulSoup
from toy_paper import write_notebook, write_paper

ROOT = Path(__file__).parents[2]
EXPERIMENTS = '''"""Tossing a coin."""

import numpy as np


def toss(seed, runs):
    """Heads or tails, ``{"heads": (runs, 1)}``."""
    return {"heads": np.random.default_rng(seed).integers(0, 2, (runs, 1)).astype(float)}
'''
PAPER = '''"""The paper's manifest and ledger."""

from pathlib import Path

from ...judging import read_paper

PAPER = read_paper(Path(__file__).parent)
'''
CELLS = (
    ["(toy-coins)=\n# Coins\n\nThe share of heads is {glue:text}`toy-share:.3f`."],
    """\
    import matplotlib.pyplot as plt

    from tmalib import figures
    from tmalib.judging import Ours, judge, numbers, of_runs, show, stored_runs
    from tmalib.papers.toy.experiments import toss
    from tmalib.papers.toy.paper import PAPER

    figures.use_style()""",
    """\
    runs = stored_runs(toss, 20_000, PAPER.stream("toy/coins"))
    heads = runs["heads"][:, 0]
    mean, std = of_runs(heads), of_runs(heads, "std")
    ours = {("heads", "mean"): mean, ("heads", "std"): std, ("heads", "bound"): Ours(0.5)}
    table = judge(PAPER, "Table 1", ours, made_from=[runs])
    table""",
    ["```{judged-table} toy; Table 1\n```"],
    """\
    plt.hist(runs["heads"][:, 0])
    show(runs)""",
    """\
    numbers("toy", share=runs["heads"].mean())""",
)
CAPTION = {
    "mystnb": {"figure": {"caption": "Heads, and tails.", "name": "fig-toy"}, "image": {"alt": "Two bars."}},
    "tags": ["hide-input"],
}
PAGES = {
    "book/intro.md": "# Toy\n\n```{score}\n```\n\n{cite:t}`toy2026`, {ref}`toy-coins`\n[]{.link-to-pdf}\n",
    "book/verdicts/toy.md": "# Verdicts\n\n```{ledger-table} toy\n:of: results\n```\n\n"
    "```{bibliography}\n```\n",
    "book/appendix/glossary.md": "# Glossary\n\n:::{glossary}\nshare\n  A part of the whole.\n:::\n",
    "book/concordance.md": "# Concordance\n\n```{concordance} toy\n```\n",
    "book/references.bib": "@misc{toy2026, author = {A. Toy}, title = {Toys}, year = {2026}}\n",
    "book/_toc.yml": "format: jb-book\nroot: book/intro\nchapters:\n"
    "  - file: notebooks/toy/coins\n  - file: book/verdicts/toy\n  - file: book/concordance\n"
    "  - file: book/appendix/glossary\n",
}


def run(project, *command):
    env = os.environ | {"PYTHONPATH": str(project), "TMALIB_RUNS": str(project / "build/runs")}
    env |= {"IPYTHONDIR": str(project / "ipython"), "PYDEVD_DISABLE_FILE_VALIDATION": "1"}
    env.pop("MPLBACKEND", None)
    done = subprocess.run(command, cwd=project, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """The copy, executed, judged and built as the Makefile does."""
    project = tmp_path_factory.mktemp("project")
    clutter = shutil.ignore_patterns("__pycache__", "papers")
    shutil.copytree(ROOT / "tmalib", project / "tmalib", ignore=clutter)
    for name in (
        "environment.txt",
        "pyproject.toml",
        "tools",
        "book/_config.yml",
        "book/_static",
        "book/pdf.tex",
    ):
        (project / name).parent.mkdir(exist_ok=True)
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, project / name)
    folder = write_paper(project / "tmalib/papers/toy")
    shutil.copy(ROOT / "tmalib/papers/__init__.py", folder.parent)
    (folder / "__init__.py").write_text('"""A toy."""\n')
    (folder / "experiments.py").write_text(EXPERIMENTS)
    (folder / "paper.py").write_text(PAPER)
    for name, text in PAGES.items():
        (project / name).parent.mkdir(exist_ok=True)
        (project / name).write_text(text)
    path = write_notebook(project / "notebooks/toy/coins.ipynb", *CELLS)
    made = json.loads(path.read_text())
    for cell, metadata in ((2, {"tags": ["remove-output"]}), (4, CAPTION), (5, {"tags": ["remove-cell"]})):
        made["cells"][cell]["metadata"] = metadata
    path.write_text(json.dumps(made))

    run(project, sys.executable, "tools/build.py", "stale")
    run(project, sys.executable, "-m", "pytest", "-q", "--nbmake", "--overwrite", "-p", "no:cacheprovider",
        "-W", "default", "build/executing")  # fmt: skip
    for step in ("keep", "judge", "check"):
        (project / f"{step}.txt").write_text(run(project, sys.executable, "tools/build.py", step))
    jupyter_book = Path(sys.executable).parent / "jupyter-book"
    run(project, jupyter_book, "build", ".", "--config", "book/_config.yml", "--toc", "book/_toc.yml",
        "--path-output", "build/site", "-W", "-n", "--keep-going")  # fmt: skip
    run(project, jupyter_book, "build", ".", "--config", "book/_config.yml", "--toc", "book/_toc.yml",
        "--builder", "latex", "--path-output", "build/pdf", "-W", "-n", "--keep-going")  # fmt: skip
    return project


def page(project, name):
    html = (project / "build/site/_build/html" / name).read_text(encoding="utf-8")
    return BeautifulSoup(html, "html.parser")


def test_it_is_judged(project):
    assert (project / "judge.txt").read_text().startswith("toy: 3 of 3 judged (3 reproduced)\n")


def test_the_front_page_has_its_score(project):
    (score,) = page(project, "book/intro.html").select(".score")
    assert [p.get_text() for p in score.select("p")] == ["A toy", "3 results"]


def test_it_has_a_page_of_verdicts_with_links_to_the_cell(project):
    rows = page(project, "book/verdicts/toy.html").select("table.ledger-table tbody tr")
    assert [row["id"] for row in rows] == [
        f"row-toy-table-1-heads-{name}" for name in ("mean", "std", "bound")
    ]
    assert [row.select("td")[1].get_text(strip=True) for row in rows] == [
        "share of heads mean", "share of heads σ", "share of heads bound",
    ]  # fmt: skip
    assert {link["href"] for row in rows for link in row.select("td:last-child a")} == {
        "../../notebooks/toy/coins.html#cell-2"
    }


def test_the_concordance_leads_from_the_paper_to_the_chapter_and_back(project):
    (row,) = page(project, "book/concordance.html").select("table.ledger-table tbody tr")
    assert row["id"] == "concordance-toy-1"
    section, item, places, errata, verdict = row.select("td")
    assert [cell.get_text(strip=True) for cell in (section, item, places, errata)] == [
        "1 Coins",
        "Table 1",
        "",
        "",
    ]
    assert [link["href"] for link in verdict.select("a")] == ["../notebooks/toy/coins.html#cell-2"]
    box = page(project, "notebooks/toy/coins.html").select_one(".in-the-paper")
    assert [(a.get_text(), a["href"]) for a in box.select("a")] == [
        ("1 Coins", "../../book/concordance.html#concordance-toy-1"), ("Table 1", "#cell-2"),
    ]  # fmt: skip
    entries = (project / "build/site/_build/html/searchindex.js").read_text(encoding="utf-8")
    assert '"table 1"' in entries[entries.index("indexentries") :]


def test_its_figure_and_table_are_exported_with_their_provenance(project):
    with (project / "build/figures/index.csv").open(newline="", encoding="utf-8") as file:
        rows = {row["file"]: row for row in csv.DictReader(file)}
    made_from = "tmalib.papers.toy.experiments.toss, 20000 runs, stream toy/coins, seed 2016"
    for name, cell in (("toy/fig-toy.svg", "4"), ("toy/fig-toy.pdf", "4"), ("toy/table-1.csv", "2")):
        assert (project / "build/figures" / name).is_file()
        assert (rows[name]["notebook"], rows[name]["cell"]) == ("toy/coins.ipynb", cell)
        assert rows[name]["made_from"] == made_from
    chapter = page(project, "notebooks/toy/coins.html")
    assert made_from in chapter.select_one(".provenance").get_text()
    assert "Code: Heads" in [fold.get_text(strip=True) for fold in chapter.select("summary p")]
    assert len(chapter.select("table.judged-table")) == 1


def test_its_number_is_in_the_sentence(project):
    share = float(page(project, "notebooks/toy/coins.html").select_one("p .pasted-text").get_text())
    assert abs(share - 0.5) < 5 * 0.5 / 20_000**0.5


def test_a_word_of_the_glossary_says_what_it_means(project):
    (link,) = page(project, "notebooks/toy/coins.html").select("a.term")
    assert (link.get_text(), link["title"]) == ("share", "A part of the whole.")
    assert link["href"] == "../../book/appendix/glossary.html#term-share"


def test_a_second_build_executes_nothing(project):
    assert run(project, sys.executable, "tools/build.py", "stale").startswith("0 of 1 chapters")


def test_the_pdf_has_what_the_pages_have(project):
    """Needs no TeX: what TeX would be given."""
    tex = (project / "build/pdf/_build/latex/angles-only.tex").read_text()
    assert re.search(r"\\item 3 results: \S+ 3 reproduced", tex), "the score"
    assert r"\caption{Heads, and tails.}" in tex
    assert "plt.hist" not in tex, "folded code"
    assert r"\PYG{n}{of\PYGZus{}runs}" in tex, "code that is not folded"
    assert r"\unprinted{imports: cell 1}" in tex
    labels = set(re.findall(r"\\label\{\\detokenize\{(.*?)\}\}", tex))
    wanted = set(re.findall(r"\\(?:hyperref\[|ref\{)\\detokenize\{(.*?)\}", tex))
    assert wanted - labels == set()
    assert "notebooks/toy/coins:judged-toy-table-1" in wanted


def test_a_pdf_is_offered_where_there_is_one(project):
    shutil.copytree(project / "build/site/_build/html", project / "build/html")
    assert not page(project, "book/intro.html").select(".link-to-pdf a"), "without a PDF"
    (project / "build/pdf/_build/latex/angles-only.pdf").write_bytes(b"%PDF" + bytes(2_000_000))
    for _ in range(2):
        run(project, sys.executable, "tools/build.py", "offer")
    (link,) = page(project, "../../../html/book/intro.html").select(".link-to-pdf a")
    assert (project / "build/html/book" / link["href"]).is_file()
    assert link.parent.get_text().endswith("2 MB.")
