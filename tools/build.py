"""The steps of the build between executing the chapters and building the pages; the Makefile calls them.

Usage: build.py STEP, from the root of the repository

stale    copy the chapters that must be executed to build/executing; print which
keep     take over what was executed, with today's prose
judge    collect the claims, refuse an incomplete ledger; write build/claims.json and build/figures
check    check that the sentences take their verdicts and numbers from the ledger and the cells
offer    put the PDF into the built book, and a link to it where a page has a place for one
"""

import re
import shutil
import sys
from pathlib import Path

from tmalib.judging import chapters, collect, export, prose, read_papers

SOURCES, LOCK, BUILD = Path("notebooks"), Path("environment.txt"), Path("build")
EXECUTED, EXECUTING = BUILD / "executed", BUILD / "executing"
SITE, PLACE = BUILD / "html", '<span class="link-to-pdf">'


def stale() -> None:
    names = chapters.prepare(SOURCES, EXECUTED, EXECUTING, LOCK)
    print(f"{len(names)} of {len(chapters.notebooks_in(SOURCES))} chapters to execute", *names, sep="\n  ")


def keep() -> list[str]:
    return [*map(" ".join, chapters.keep(SOURCES, EXECUTED, EXECUTING, LOCK).items())]


def judge() -> list[str]:
    papers = read_papers()
    claims = collect.all_claims(EXECUTED, papers)
    if not (found := collect.problems(claims, papers)):
        collect.write_claims(claims, BUILD / "claims.json")
        print(*collect.score(claims, papers), sep="\n")
        files = export.write_figures(EXECUTED, claims, papers, "pyproject.toml", BUILD / "figures")
        print(f"{files} files of figures and tables in {BUILD / 'figures'}")
    return found


def check() -> list[str]:
    pages = prose.pages_of("book", SOURCES)
    made = {name: collect.numbers_in(chapters.read(p)) for name, p in chapters.notebooks_in(EXECUTED).items()}
    print(f"{len(pages)} pages, {sum(map(len, made.values()))} numbers from cells")
    return prose.wrong_verdicts(pages) + prose.wrong_numbers(pages, SOURCES, made)


def offer() -> None:
    pdf = BUILD / "pdf" / "_build" / "latex" / "angles-only.pdf"
    shutil.copy(pdf, SITE)
    link = f'<a href="../{pdf.name}">The whole book as a PDF</a>, {pdf.stat().st_size / 1e6:.0f} MB.'
    for page in SITE.glob("book/*.html"):
        text = page.read_text(encoding="utf-8")
        page.write_text(re.sub(f"{PLACE}.*?</span>", f"{PLACE}{link}</span>", text), encoding="utf-8")


STEPS = {step.__name__: step for step in (stale, keep, judge, check, offer)}

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in STEPS:
        sys.exit(__doc__)
    if complaints := STEPS[sys.argv[1]]():
        sys.exit("\n".join(complaints))
