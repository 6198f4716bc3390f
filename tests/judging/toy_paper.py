"""A toy paper and notebooks in memory, for tests of the machine that judges."""

import textwrap

import nbformat
from nbformat import v4

MANIFEST = """
key = "toy"
title = "A toy"
citation = "toy2026"
part = 4
chapters = ["coins"]
[tables]
"Table 1" = "Table 1"
[rows]
heads = "share of heads"
[columns]
mean = "mean"
std = "σ"
bound = "bound"
[streams]
"toy/coins" = 40
[errata]
"""
LEDGER = """\
table,row,column,printed,unit,kind,runs
Table 1,heads,mean,0.49,1,monte-carlo,500
Table 1,heads,std,0.50,1,monte-carlo,500
Table 1,heads,bound,0.5,1,deterministic,
"""

CONTENTS = """
[[section]]
number = "1"
title = "Coins"
items = [{ kind = "table", name = "Table 1", judged = ["Table 1"] }]
[errata]
"""


def write_paper(folder, manifest=MANIFEST, ledger=LEDGER, contents=CONTENTS):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "paper.toml").write_text(manifest, encoding="utf-8")
    (folder / "published.csv").write_text(ledger, encoding="utf-8")
    (folder / "contents.toml").write_text(contents, encoding="utf-8")
    return folder


def notebook(*cells):
    """A notebook of cells: a text is code, a pair is code with outputs, a list is markdown."""
    made = []
    for cell in cells:
        if isinstance(cell, list):
            made.append(v4.new_markdown_cell(textwrap.dedent(cell[0])))
        else:
            source, outputs = cell if isinstance(cell, tuple) else (cell, [])
            made.append(v4.new_code_cell(textwrap.dedent(source), outputs=outputs))
    language = {"language_info": {"name": "python"}}
    return v4.new_notebook(cells=made, metadata=language)


def write_notebook(path, *cells):
    path.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook(*cells), path)
    return path
