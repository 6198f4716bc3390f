"""The notebook that a reader downloads: a chapter with its outputs, and with words where its text has roles.

In the repository a chapter has no outputs, and roles that only the book resolves. Here are the outputs of its
execution; numbers, verdicts, titles, numbers of figures and citations are written out, captions stand below
their figures, and judged tables are plain tables.
"""

import os
import re
from ast import literal_eval
from functools import cache
from pathlib import Path

import nbformat

from ..chapters import read, write
from ..collect import outputs_of
from . import ledger, roles
from .launch import repository
from .provenance import executed

ROLE = re.compile(r"\{([a-z:]+)\}`([^`]+)`")
LABEL = re.compile(r"(?m)^\([\w-]+\)=\n")
DIRECTIVE = re.compile(r"(?ms)^```\{([a-z-]+)\} *(.*?)\n((?::[a-z-]+:.*?\n)*)(.*?)^```$")
OF_THE_LEDGER = {
    find.__name__: find
    for find in (roles.printed, roles.ours, roles.verdict, roles.count, roles.tested, roles.version)
}
NUMBERED = {"figure": "Fig.", "table": "Table"}
TWICE = "application/pdf"  # a figure is there as an SVG, too


def write_downloads(app, exception):
    """Put the notebooks where the pages' download buttons lead."""
    if exception is None and app.builder.name == "html":
        for docname in sorted(app.env.found_docs):
            if path := executed(app, docname):
                notebook = readable(read(path), Words(app, docname), repository(os.environ))
                write(notebook, Path(app.outdir) / "_sources" / f"{docname}.ipynb")


def readable(notebook, words, address):
    """The notebook with words for roles, captions below figures, and a note at its top."""
    cells = [nbformat.v4.new_markdown_cell(note(address), id="about")]
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cell.source = filled(cell.source, words)
        else:
            for output in outputs_of(cell):
                output.data.pop(TWICE, None)
        cells.append(cell)
        if caption := cell.metadata.get("mystnb", {}).get("figure"):
            text = f"**{words('numref', caption.name)}.** {filled(caption.caption, words)}"
            cells.append(nbformat.v4.new_markdown_cell(text, id=f"caption-{caption.name}"[:64]))
    notebook.cells = cells
    return notebook


def note(address):
    """What the notebook is, and how to run it."""
    where = f"[its repository]({address})" if address else "its repository"
    return (
        '*A chapter of the book "Angles only" with the outputs of its execution. Links between chapters, and '
        f"what it takes from other files, are only on its pages. To run it, have {where} and say* `make lab`."
    )


def filled(text, words):
    """Markdown with words for roles and directives; ``words(role, text)`` is None for what has none."""
    text = DIRECTIVE.sub(lambda found: words.directive(*found.groups()), LABEL.sub("", text))
    return ROLE.sub(lambda found: found[0] if (word := words(*found.groups())) is None else word, text)


class Words:
    """The words for the roles and directives of a page."""

    def __init__(self, app, docname):
        self.app, self.env, self.docname = app, app.env, docname

    def __call__(self, role, text):
        if role in OF_THE_LEDGER:
            return OF_THE_LEDGER[role](self.env, text)
        kinds = {"glue:text": self.number, "ref": self.title, "numref": self.figure, "eq": self.equation}
        if role.startswith("cite:"):
            return self.citation(text)
        return kinds[role](text) if role in kinds else None

    def number(self, text):
        """A number of this chapter or of another, ``path::key:format``."""
        page, _, name = text.rpartition("::")
        key, _, form = name.partition(":")
        path = executed(self.app, self.docname)
        return format(numbers_of((path.parent / page).resolve() if page else path)[key], form)

    def title(self, text):
        words, _, label = text.removesuffix(">").rpartition("<")
        return f"*{words.strip() or self.env.get_domain('std').labels[label.lower()][2]}*"

    def figure(self, label):
        page, anchor = self.env.get_domain("std").anonlabels[label.lower()]
        kind = next(kind for kind in NUMBERED if anchor in self.env.toc_fignumbers[page].get(kind, ()))
        return f"{NUMBERED[kind]} {self.counted(page, kind, anchor)}"

    def equation(self, label):
        page, _ = self.env.get_domain("math").equations[label]
        return f"({self.counted(page, 'displaymath', f'equation-{label}')})"

    def counted(self, page, kind, anchor):
        return ".".join(map(str, self.env.toc_fignumbers[page][kind][anchor]))

    def citation(self, keys):
        return "; ".join(self.author_and_year(key.strip()) for key in keys.split(","))

    def author_and_year(self, key):
        entry = self.env.get_domain("cite").bibdata.data.entries[key]
        names = [" ".join(person.last_names) for person in entry.persons["author"]]
        several = {1: names[0], 2: " and ".join(names)}.get(len(names), f"{names[0]} et al.")
        return f"{several} ({entry.fields['year']})"

    def directive(self, name, title, options, body):
        """A judged table in rows, another table as it is, and where else something stands on the page."""
        options = dict(re.findall(r"(?m)^:([a-z-]+): *(.*)$", options))
        if name == "judged-table":
            return f"{options.get('caption', title)}\n\n{self.judged(ledger.parse_key(title, 2))}"
        if name == "table":
            return f"**{self.figure(options['name'])}.** {title}\n{body}"
        if name == "list-table":
            rows = re.split(r"(?m)^\* - ", body.strip())[1:]
            cells = [re.split(r"\n  - ", row.strip()) for row in rows]
            return f"{title}\n\n{table(cells)}"
        return f"*Here the page of the book shows* `{title or options['file']}`."

    def judged(self, key):
        claims = ledger.claims_under(self.env, key)
        head = ["row", "column", "printed", "ours", "verdict"]
        return table([head, *([c.row, c.column, *ledger.written(c)] for c in claims)])


def table(rows):
    """A table in Markdown; the first row is its head."""
    head, *body = [f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in rows]
    return "\n".join([head, "|" + "---|" * len(rows[0]), *body])


@cache
def numbers_of(path):
    """The numbers that an executed chapter makes known, by key."""
    outputs = [
        output for cell in read(path).cells for output in outputs_of(cell) if "scrapbook" in output.metadata
    ]
    return {
        o.metadata.scrapbook.name: literal_eval(o.data["application/papermill.record/text/plain"])
        for o in outputs
    }
