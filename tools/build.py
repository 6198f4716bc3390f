"""The steps of the build between executing the chapters and building the pages; the Makefile calls them.

Usage: build.py STEP, from the root of the repository

stale    copy the chapters that must be executed to build/executing; print how many
keep     take over what was executed, with today's prose, and fill the cache from which the book takes outputs
collect  claims and origins of figures and tables: build/claims.json, build/provenance.json; print the score
export   every figure and table: build/figures
cached   check in the log of the book's build (a further argument) that no chapter was executed again
prose    check that the sentences take their verdicts and numbers from the ledger and the cells
"""

import sys
from pathlib import Path

from tmalib.judging import chapters, collect, export, prose, read_papers

SOURCES, LOCK = Path("notebooks"), Path("environment.txt")
BUILD = Path("build")
EXECUTED, EXECUTING = BUILD / "executed", BUILD / "executing"
CLAIMS, ORIGINS = BUILD / "claims.json", BUILD / "provenance.json"


def stale() -> list[str]:
    names = chapters.prepare(SOURCES, EXECUTED, EXECUTING, LOCK)
    print(f"{len(names)} of {len(chapters.notebooks_in(SOURCES))} chapters to execute", *names, sep="\n  ")
    return []


def keep() -> list[str]:
    found = chapters.keep(SOURCES, EXECUTED, EXECUTING)
    if not found:
        chapters.fill_cache(EXECUTED, BUILD / ".jupyter_cache")
    return found


def judge() -> list[str]:
    papers = read_papers()
    claims = collect.in_order(collect.claims_of(EXECUTED), papers)
    if found := collect.problems(claims, papers):
        return found
    collect.write_json(claims, CLAIMS)
    collect.write_json(collect.origins_of(EXECUTED, claims), ORIGINS)
    print(*collect.score(claims, papers), sep="\n")
    return []


def write() -> list[str]:
    claims, origins = collect.read_claims(CLAIMS), collect.read_origins(ORIGINS)
    drawn, tables = export.export(EXECUTED, claims, origins, read_papers(), BUILD / "figures")
    print(f"{drawn} figures and {tables} tables in {BUILD / 'figures'}")
    return []


def check() -> list[str]:
    pages = prose.pages_of("book", SOURCES)
    made = collect.numbers_of(EXECUTED)
    print(f"{len(pages)} pages, {sum(map(len, made.values()))} numbers from cells")
    return prose.wrong_verdicts(pages) + prose.wrong_numbers(pages, SOURCES, made)


def cached(log: str) -> list[str]:
    taken = Path(log).read_text(encoding="utf-8").count("Using cached notebook")
    wanted = len(chapters.notebooks_in(SOURCES))
    return [] if taken == wanted else [f"the book took the outputs of {taken} chapters, not of {wanted}"]


STEPS = {"stale": stale, "keep": keep, "collect": judge, "export": write, "cached": cached, "prose": check}

if __name__ == "__main__":
    step, *arguments = sys.argv[1:] or ["help"]
    if step not in STEPS:
        sys.exit(__doc__)
    if complaints := STEPS[step](*arguments):
        sys.exit("\n".join(complaints))
