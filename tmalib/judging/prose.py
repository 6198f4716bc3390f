"""Checks of the book's sentences: no verdict of their own, no number without a cell or without a reader.

The words of a verdict stand only inside the roles {verdict} and {count}, which the build compares with the
ledger, and on the page that defines them. ("Holds", "false" and "open", verdicts on statements, are too
common to be watched.)
"""

import os
import re
from pathlib import Path

from .chapters import notebooks_in, read

WORDS = re.compile(
    r"\b(?:reproduced|inconclusive|unspecified|unjudged|(?:mostly|rarely) holds|holds as corrected)\b"
    r"|\bdepends on what is not printed\b|[✓✗●◐○]",
    re.IGNORECASE,
)
DEFINES = "(how-we-judge)="  # the label of the page that says what the words mean
FROM_LEDGER = re.compile(r"\{(?:verdict|count)\}`[^`]+`")
CODE = re.compile(r"^```(?:python|console|text)\n.*?^```", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"\{glue:\w*\}`(?:([^`:]+)::)?([^`:]+)(?::[^`]*)?`")


def pages_of(*folders):
    """Markdown pages and notebooks below the folders."""
    pages = [path for folder in folders for path in sorted(Path(folder).rglob("*.md"))]
    return pages + [path for folder in folders for path in notebooks_in(folder).values()]


def texts_of(path):
    """The prose of a page or notebook: markdown, captions, alternative texts."""
    if path.suffix == ".md":
        return [path.read_text(encoding="utf-8")]
    cells = read(path).cells
    shown = [cell.metadata.get("mystnb", {}) for cell in cells]
    captions = [each.get("figure", {}).get("caption", "") for each in shown]
    captions += [each.get("image", {}).get("alt", "") for each in shown]
    return [cell.source for cell in cells if cell.cell_type == "markdown"] + captions


def verdicts_in(text):
    """The lines that state a verdict by themselves."""
    bare = "" if DEFINES in text else FROM_LEDGER.sub("", CODE.sub("", text))
    return [line.strip() for line in bare.splitlines() if WORDS.search(line)]


def wrong_verdicts(pages):
    """One line for every verdict that does not come from the ledger."""
    return [f"{p}: states a verdict: {line}" for p in pages for t in texts_of(p) for line in verdicts_in(t)]


def wrong_numbers(pages, notebooks, made):
    """One line for every number that no cell makes, or that no page uses.

    ``made`` maps the notebooks, relative to the folder ``notebooks``, to the keys that they make known.
    """
    found, used = [], set()
    for page in pages:
        for other, key in [match for text in texts_of(page) for match in NUMBER.findall(text)]:
            name = Path(os.path.relpath(page.parent / other if other else page, notebooks)).as_posix()
            used.add((name, key))
            if key not in made.get(name, ()):
                found.append(f"{page}: no cell of {name} makes the number {key}")
    unused = [(name, key) for name, keys in made.items() for key in sorted(keys) if (name, key) not in used]
    return found + [f"{name}: no page uses the number {key}" for name, key in unused]
