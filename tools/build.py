"""The steps of the build between executing the chapters and building the pages; the Makefile calls them.

Usage: build.py STEP, from the root of the repository

stale    copy the chapters that must be executed to build/executing; print which
keep     take over what was executed, with today's prose, and fill the cache from which the book takes outputs
judge    collect the claims, refuse an incomplete ledger, write build/claims.json, print the score
export   every figure and table: build/figures
prose    check that the sentences take their verdicts and numbers from the ledger and the cells
cached   check in build/book.log that the book executed no chapter again
"""

import sys
from pathlib import Path

from tmalib.judging import chapters, collect, export, prose, read_papers

SOURCES, LOCK, BUILD = Path("notebooks"), Path("environment.txt"), Path("build")
EXECUTED, EXECUTING, CLAIMS = BUILD / "executed", BUILD / "executing", BUILD / "claims.json"


def stale() -> None:
    names = chapters.prepare(SOURCES, EXECUTED, EXECUTING, LOCK)
    print(f"{len(names)} of {len(chapters.notebooks_in(SOURCES))} chapters to execute", *names, sep="\n  ")


def keep() -> list[str]:
    found = chapters.keep(SOURCES, EXECUTED, EXECUTING)
    return found or chapters.fill_cache(EXECUTED, BUILD / ".jupyter_cache")


def judge() -> list[str]:
    papers = read_papers()
    claims = collect.in_order(collect.over_all(collect.claims_in, EXECUTED), papers)
    if not (found := collect.problems(claims, papers)):
        collect.write_claims(claims, CLAIMS)
        print(*collect.score(claims, papers), sep="\n")
    return found


def write() -> None:
    claims, target = collect.read_claims(CLAIMS), BUILD / "figures"
    drawn, tables = export.write_figures(EXECUTED, claims, read_papers(), "pyproject.toml", target)
    print(f"{drawn} figures and {tables} tables in {target}")


def check() -> list[str]:
    pages = prose.pages_of("book", SOURCES)
    made = {name: collect.numbers_in(chapters.read(p)) for name, p in chapters.notebooks_in(EXECUTED).items()}
    print(f"{len(pages)} pages, {sum(map(len, made.values()))} numbers from cells")
    return prose.wrong_verdicts(pages) + prose.wrong_numbers(pages, SOURCES, made)


def cached() -> list[str]:
    taken = (BUILD / "book.log").read_text(encoding="utf-8").count("Using cached notebook")
    wanted = len(chapters.notebooks_in(SOURCES))
    return [] if taken == wanted else [f"the book took the outputs of {taken} chapters, not of {wanted}"]


STEPS = {"stale": stale, "keep": keep, "judge": judge, "export": write, "prose": check, "cached": cached}

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in STEPS:
        sys.exit(__doc__)
    if complaints := STEPS[sys.argv[1]]():
        sys.exit("\n".join(complaints))
