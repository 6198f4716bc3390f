"""Checks of the book's sentences: no verdict of their own, no number without a cell or without a reader.

In the pages and in the markdown, captions and alternative texts of the notebooks the words of a verdict stand
only inside roles such as {verdict} and {count}, which the build compares with the ledger. The page that
defines the words is exempt.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from .chapters import notebooks_in, read

WORDS = re.compile(r"\b(?:reproduced|inconclusive|unspecified|unjudged)\b|[✓✗]", re.IGNORECASE)
DEFINES = "(how-we-judge)="  # the label of the page that says what the words mean
FROM_LEDGER = re.compile(r"\{(?:verdict|count)\}`[^`]+`")
CODE = re.compile(r"^```(?:python|console|text)\n.*?^```", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"\{glue:\w*\}`(?:([^`:]+)::)?([^`:]+)(?::[^`]*)?`")


def texts_of(path):
    """The prose of a page or notebook: markdown, captions, alternative texts."""
    path = Path(path)
    if path.suffix == ".md":
        return [path.read_text(encoding="utf-8")]
    found = []
    for cell in read(path).cells:
        if cell.cell_type == "markdown":
            found.append(cell.source)
        shown = cell.metadata.get("mystnb", {})
        found += [shown.get("figure", {}).get("caption", ""), shown.get("image", {}).get("alt", "")]
    return found


def pages_of(*folders):
    """Markdown pages and notebooks below the folders."""
    pages = [path for folder in folders for path in sorted(Path(folder).rglob("*.md"))]
    return pages + [path for folder in folders for path in notebooks_in(folder).values()]


def verdicts_in(text):
    """The lines that state a verdict by themselves."""
    if DEFINES in text:
        return []
    bare = FROM_LEDGER.sub("", CODE.sub("", text))
    return [line.strip() for line in bare.splitlines() if WORDS.search(line)]


def wrong_verdicts(pages):
    """One line for every verdict that does not come from the ledger."""
    return [f"{p}: states a verdict: {line}" for p in pages for t in texts_of(p) for line in verdicts_in(t)]


def wrong_numbers(pages, notebooks, made):
    """One line for every number that no cell makes, or that no page uses.

    Parameters
    ----------
    pages : list of Path
    notebooks : Path
        The folder of the chapters.
    made : dict
        Notebook, relative to that folder, to the keys that it makes known.
    """
    found, used = [], set()
    for page in pages:
        for text in texts_of(page):
            for other, key in NUMBER.findall(text):
                path = (
                    posixpath.normpath(page.parent.joinpath(other).as_posix()) if other else page.as_posix()
                )
                name = posixpath.relpath(path, Path(notebooks).as_posix())
                used.add((name, key))
                if key not in made.get(name, ()):
                    found.append(f"{page}: no cell of {name} makes the number {key}")
    unused = [(name, key) for name, keys in made.items() for key in sorted(keys) if (name, key) not in used]
    return found + [f"{name}: no page uses the number {key}" for name, key in unused]
