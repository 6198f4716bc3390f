"""Check that prose states no verdict of its own: the words come from the ledger, by role or directive.

Usage: check_prose.py FOLDER...

In the pages and in the markdown, captions and alternative texts of the notebooks, the words of a verdict
stand only inside roles such as {verdict} and {count}, which the book's build compares with the ledger. The
page that defines the words is exempt.
"""

import re
import sys
from pathlib import Path

import nbformat

WORDS = re.compile(r"\b(?:reproduced|inconclusive|unspecified|unjudged)\b|[✓✗]", re.IGNORECASE)
DEFINES = "(how-we-judge)="  # the label of the page that says what the words mean
FROM_LEDGER = re.compile(r"\{(?:verdict|count)\}`[^`]+`")
CODE = re.compile(r"^```(?:python|console|text)\n.*?^```", re.MULTILINE | re.DOTALL)


def claims_in(text: str) -> list[str]:
    """The sentences' lines that state a verdict by themselves."""
    if DEFINES in text:
        return []
    bare = FROM_LEDGER.sub("", CODE.sub("", text))
    return [line.strip() for line in bare.splitlines() if WORDS.search(line)]


def texts(path: Path) -> list[str]:
    """The prose of a page or notebook."""
    if path.suffix == ".md":
        return [path.read_text(encoding="utf-8")]
    found = []
    for cell in nbformat.read(path, as_version=4).cells:
        if cell.cell_type == "markdown":
            found.append(cell.source)
        shown = cell.metadata.get("mystnb", {})
        found += [shown.get("figure", {}).get("caption", ""), shown.get("image", {}).get("alt", "")]
    return found


def main(folders: list[str]) -> None:
    paths = [p for f in folders for p in sorted(Path(f).rglob("*")) if p.suffix in {".md", ".ipynb"}]
    paths = [p for p in paths if ".ipynb_checkpoints" not in p.parts]
    found = [f"{p}: states a verdict: {line}" for p in paths for t in texts(p) for line in claims_in(t)]
    print(f"{len(paths)} pages: {len(found)} verdicts that do not come from the ledger")
    if found:
        sys.exit("\n".join(found))


if __name__ == "__main__":
    main(sys.argv[1:])
