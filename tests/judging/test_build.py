"""The scripts of the build and the roles of the book refuse what they should."""

import sys
from pathlib import Path

import nbformat
import pytest
from nbformat import v4

from tmalib import claims
from tmalib.montecarlo import SEED

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "book" / "_ext")]

import check_prose  # noqa: E402
import collect_claims  # noqa: E402
import ledger_roles  # noqa: E402
import trace_notebooks  # noqa: E402

PUBLISHED = collect_claims.published_values()
EMW = {key: row for key, row in PUBLISHED.items() if key[0] == "emw-acoustic"}


def claim(key, **changes):
    names = ("paper", "table", "row", "column")
    row = {"printed": PUBLISHED[key]["printed"], "verdict": claims.REPRODUCED, "notebook": "n.ipynb"}
    return dict(zip(names, key, strict=True)) | row | changes


def complete():
    return [claim(key) for key in EMW]


# -- the ledger ----------------------------------------------------------------------------------------


def test_a_complete_ledger_is_accepted():
    assert collect_claims.problems(complete(), EMW) == []


def test_an_unjudged_number_is_refused():
    left_out = complete()[1:]
    (problem,) = collect_claims.problems(left_out, EMW)
    assert problem == "unjudged: emw-acoustic | Table I | xT | true"
    assert len(collect_claims.problems([], PUBLISHED)) == len(PUBLISHED)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda key: [claim(key), claim(key)], "judged 2 times"),
        (lambda key: [claim(key, verdict="nearly")], "unknown verdict 'nearly'"),
        (lambda key: [claim(key, printed="1.0")], "printed value differs"),
        (lambda key: [claim(key), claim(key, row="wT")], "not a published value"),
    ],
)
def test_wrong_claims_are_refused(wrong, message):
    others = complete()[1:]
    found = collect_claims.problems([*wrong(next(iter(EMW))), *others], EMW)
    assert len(found) == 1
    assert message in found[0]


def test_the_words_of_a_verdict_are_those_of_the_library():
    assert set(claims.SYMBOLS) == collect_claims.VERDICTS
    assert all(check_prose.WORDS.search(word) for word in claims.SYMBOLS)


def test_claims_are_read_from_outputs(tmp_path):
    output = v4.new_output("display_data", {collect_claims.MIMETYPE: complete()[:2]})
    notebook = v4.new_notebook(cells=[v4.new_code_cell("table", outputs=[output])])
    (tmp_path / "notebooks").mkdir()
    nbformat.write(notebook, tmp_path / "notebooks" / "chapter.ipynb")
    found = collect_claims.collect(tmp_path, EMW)
    assert [c["notebook"] for c in found] == ["notebooks/chapter.ipynb"] * 2
    with pytest.raises(SystemExit, match="unjudged"):
        collect_claims.main(tmp_path, tmp_path / "claims.json")
    assert not (tmp_path / "claims.json").exists()


# -- prose ---------------------------------------------------------------------------------------------


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
    assert check_prose.claims_in(f"# Title\n\n{text}\n") == [text]


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
    assert check_prose.claims_in(text) == []


def test_captions_are_prose_too(tmp_path):
    metadata = {"mystnb": {"figure": {"caption": "All reproduced.", "name": "fig-x"}}}
    notebook = v4.new_notebook(cells=[v4.new_code_cell("1", metadata=metadata)])
    nbformat.write(notebook, tmp_path / "chapter.ipynb")
    with pytest.raises(SystemExit, match="states a verdict: All reproduced"):
        check_prose.main([str(tmp_path)])


def role(kind, text, monkeypatch):
    """What a role writes for a small ledger."""
    small = {("p", "T", "x", "a"): claims.REPRODUCED, ("p", "T", "y", "a"): claims.NOT_REPRODUCED}
    monkeypatch.setattr(
        ledger_roles, "load_claims", lambda env: {k: {"verdict": v} for k, v in small.items()}
    )
    monkeypatch.setattr(kind, "env", None, raising=False)
    instance = kind()
    instance.text = instance.title = instance.target = text
    words, _, key = text.partition(" <")
    instance.has_explicit_title = bool(key)
    if key:
        instance.title, instance.target = words, key.rstrip(">")
    return instance.text_for()


def test_a_false_verdict_in_a_sentence_is_refused(monkeypatch):
    assert role(ledger_roles.VerdictRole, "reproduced <p; T; x; a>", monkeypatch) == "reproduced"
    assert role(ledger_roles.VerdictRole, "p; T; y; a", monkeypatch) == "not reproduced"
    for false in ("reproduced <p; T; y; a>", "reproduced <p; T>", "p; T"):
        with pytest.raises(ValueError, match=r"the sentence says"):
            role(ledger_roles.VerdictRole, false, monkeypatch)
    with pytest.raises(ValueError, match="nothing is judged"):
        role(ledger_roles.VerdictRole, "reproduced <p; T; z; a>", monkeypatch)


def test_counts_come_from_the_ledger(monkeypatch):
    assert role(ledger_roles.CountRole, "p; T", monkeypatch) == "2"
    assert role(ledger_roles.CountRole, "p; T; not reproduced", monkeypatch) == "1 not reproduced"
    assert role(ledger_roles.CountRole, "p; inconclusive", monkeypatch) == "0 inconclusive"
    with pytest.raises(ValueError, match="nothing is judged"):
        role(ledger_roles.CountRole, "p; T 2; reproduced", monkeypatch)


# -- provenance ----------------------------------------------------------------------------------------

CELLS = [
    "import numpy as np\nimport tmalib as tma\nfrom tmalib import figures\n"
    "from tmalib.papers.emw_acoustic import experiments\nfigures.use_style()",
    "number = 2\nfound = tma.fit",
    'results = tma.monte_carlo(experiments.experiment, 500, f"emw/{number}")',
    "table = {}\nfor k in range(2):\n    table[k] = experiments.judge_table(k, results)",
    "other = tma.crlb\nfound = [tma.nees for found in range(3)]",
    "table[0]",
    "draw(found)",
]


def traced(tmp_path):
    cells = [v4.new_code_cell(source) for source in CELLS]
    row = {"paper": "emw-acoustic", "table": "Table II"}
    cells[5]["outputs"] = [v4.new_output("display_data", {trace_notebooks.MIMETYPE: [row]})]
    cells[6]["metadata"] = {"mystnb": {"figure": {"name": "fig-x"}}}
    nbformat.write(v4.new_notebook(cells=cells), tmp_path / "n.ipynb")
    return list(trace_notebooks.trace(tmp_path / "n.ipynb", "notebooks/n.ipynb"))


def test_provenance_follows_the_code(tmp_path):
    table, figure = traced(tmp_path)
    assert table["table"] == "Table II"
    assert table["cell"] == 3, "the cell that computes, not the one that shows"
    assert table["functions"] == [
        "tmalib.monte_carlo",
        "tmalib.papers.emw_experiments.experiment",
        "tmalib.papers.emw_experiments.judge_table",
    ]
    assert table["streams"] == [f"emw/{k}" for k in range(1, 7)], "any number may stand in the gap"
    assert table["seed"] == SEED
    assert figure["figure"] == "fig-x"
    assert (figure["cell"], figure["functions"]) == (6, ["tmalib.nees"]), "what was bound anew does not count"
    assert (figure["streams"], figure["seed"]) == ([], None)
