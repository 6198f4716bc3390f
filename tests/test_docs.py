"""What the documentation shows runs, and says what comes out."""

import re
import subprocess
import sys
from pathlib import Path

import nbformat
import numpy as np
import pytest
import yaml

import tmalib
from tmalib.judging import read_papers

ROOT = Path(__file__).parent.parent


def test_the_tour_of_the_own_scenario_page():
    page = (ROOT / "book" / "own_scenario.md").read_text(encoding="utf-8")
    names = {}
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(block, names)
    assert names["angles"].shape == (500, 1500)
    assert names["fit"].state.shape == (500, 4)
    assert names["fit"].converged.all()
    assert names["track"].state.shape == (500, 3, 4)
    scenario = names["scenario"]
    mean = tmalib.nees(names["fit"].state, scenario.state, tmalib.crlb(scenario)).mean()
    low, high = tmalib.nees_limits(4, 500, 0.999)
    assert low < mean < high


def test_the_ten_lines_of_the_readme(capsys):
    (block,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len([line for line in block.splitlines() if line]) <= 10
    exec(block, {})
    out = capsys.readouterr().out
    assert "converged" in out
    assert "[]" in out.splitlines(), "nothing speaks against it"
    assert "Ellipse(" in out


@pytest.mark.parametrize("name", sorted(set(tmalib.__all__)))
def test_public_names_have_docstrings(name):
    assert len(getattr(tmalib, name).__doc__ or "") > 20


def test_import_is_light():
    """matplotlib and scipy cost half a second each; the library loads neither until asked."""
    code = "import sys, tmalib; print([m for m in ('matplotlib', 'scipy', 'sympy') if m in sys.modules])"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert loaded.strip() == "[]"


def test_no_printed_number_is_typed_in_the_sources():
    """Numbers that only the ledger may hold: results of four digits and more."""
    rows = [row for paper in read_papers().values() for row in paper.ledger.values()]
    results = {row.printed for row in rows if row.kind != "input" and len(row.printed) >= 6}
    pages = [*ROOT.glob("book/**/*.md"), *ROOT.glob("notebooks/**/*.ipynb"), *ROOT.glob("tmalib/**/*.py")]
    assert len(pages) > 15
    for page in pages:
        words = set(re.findall(r"\d+\.\d+", page.read_text(encoding="utf-8")))
        assert not words & results, page


ERRATA = [
    (page.stem, entry)
    for page in sorted(ROOT.glob("book/errata/*.md"))
    for entry in re.split(r"(?m)^(?=\([a-z0-9-]+\)=$\n## )", page.read_text(encoding="utf-8"))[1:]
]


@pytest.mark.parametrize(("page", "entry"), ERRATA, ids=[entry[1 : entry.index(")")] for _, entry in ERRATA])
def test_an_erratum_has_its_five_fields(page, entry):
    """Printed form, corrected form, evidence with a link, consequence, and a status of three."""
    label, key, title = re.match(r"\(([a-z0-9-]+)\)=\n## ([a-z0-9-]+): (.*)\n", entry).groups()
    assert label == key
    fields = dict(re.findall(r"(?ms)^([A-Z][a-z]+)\n: (.*?)(?=\n\n|\Z)", entry))
    assert list(fields) == ["Printed", "Corrected", "Evidence", "Consequence", "Status"]
    assert re.search(r"\{(num)?ref\}", fields["Evidence"]), "evidence is a link"
    status = re.match(r"(Confirmed|Likely|Open)\b", fields["Status"])[0]
    (paper,) = (paper for paper in read_papers().values() if paper.folder.name == page)
    assert paper.errata[label] == {"title": title, "status": status}, "as in the manifest"


def test_the_manifests_name_every_erratum_and_every_chapter():
    toc = yaml.safe_load((ROOT / "book" / "_toc.yml").read_text(encoding="utf-8"))
    files = [chapter["file"] for part in toc["parts"] for chapter in part["chapters"]]
    for paper in read_papers().values():
        assert [
            label
            for page, entry in ERRATA
            if page == paper.folder.name
            for label in [entry[1 : entry.index(")")]]
        ] == list(paper.errata)
        folder = f"notebooks/{paper.folder.name}/"
        assert [f.removeprefix(folder) for f in files if f.startswith(folder)] == paper.chapters
        assert {p.stem for p in (ROOT / folder).glob("*.ipynb")} == set(paper.chapters)
        assert f"{{{paper.citation}," in (ROOT / "book" / "references.bib").read_text(encoding="utf-8")


def test_the_title_of_a_paper_s_chapter_says_what_of_the_paper_it_treats():
    for paper in read_papers().values():
        for chapter in paper.chapters:
            text = nbformat.read(ROOT / f"notebooks/{paper.folder.name}/{chapter}.ipynb", 4).cells[0].source
            title = re.search(r"(?m)^# (.*)$", text)[1]
            assert re.match(r"(Sections?|Theorem|Proposition|Beyond) .*: \w", title), title


def test_shapes_of_the_public_example():
    assert np.shape(tmalib.transition([1.0, 2.0])) == (2, 4, 4)


def test_every_module_of_the_library_is_in_the_reference():
    pages = [page for page in (ROOT / "book/api").glob("*.md") if not page.name.startswith("of_")]
    found = [re.findall(r"automodule:: (\S+)", page.read_text(encoding="utf-8")) for page in pages]
    listed = {module for modules in found for module in modules}
    modules = {
        path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".").removesuffix(".__init__")
        for path in (ROOT / "tmalib").rglob("*.py")
        if not {"papers", "judging", "study", "speed", "conformance", "beyond"}
        & set(path.relative_to(ROOT).parts)
    }
    ghosts = {f"tmalib.ghosts.{name}" for name in ("leg", "starts", "turn", "ways")}
    files = {f"tmalib.files.{name}" for name in ("tables", "text")}
    inner = {"tmalib", "tmalib.checks", *ghosts, *files}
    assert listed == modules - inner
