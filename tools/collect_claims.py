"""Collect the judged numbers from the executed notebooks into one ledger, and print the score.

Usage: collect_claims.py EXECUTED CLAIMS_JSON

A claim travels in the output of the notebook that computed it, so page and ledger cannot disagree. Refused:
a claim that is not a row of the published values, one judged twice, one with an unknown verdict, and a
published value that nothing judges.
"""

import csv
import json
import sys
from collections import Counter
from pathlib import Path

import nbformat

MIMETYPE = "application/vnd.tmalib.claims+json"
LEDGER = Path(__file__).parent.parent / "tmalib" / "data" / "published.csv"
KEY = ("paper", "table", "row", "column")
VERDICTS = {"reproduced", "reproduced after correction", "not reproduced", "inconclusive", "unspecified"}


def key(row: dict) -> tuple[str, ...]:
    return tuple(str(row.get(name, "")) for name in KEY)


def claims_of(path: Path, executed: Path) -> list[dict]:
    """The claims in the outputs of one notebook, each with the notebook's path in the repository."""
    notebook = nbformat.read(path, as_version=4)
    payloads = [
        output.data[MIMETYPE]
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if MIMETYPE in output.get("data", {})
    ]
    name = path.relative_to(executed).as_posix()
    return [{**claim, "notebook": name} for payload in payloads for claim in payload]


def problems(claims: list[dict], published: dict) -> list[str]:
    """What is wrong with the claims, a line each: every published value has exactly one verdict."""
    counts = Counter(map(key, claims))
    found = [f"unjudged: {' | '.join(k)}" for k in published if not counts[k]]
    found += [f"judged {n} times: {' | '.join(k)}" for k, n in counts.items() if n > 1]
    for claim in claims:
        where = f"{' | '.join(key(claim))} ({claim['notebook']})"
        if key(claim) not in published:
            found.append(f"not a published value: {where}")
        elif str(claim.get("printed")) != published[key(claim)]["printed"]:
            found.append(f"printed value differs from the ledger's: {where}")
        if claim.get("verdict") not in VERDICTS:
            found.append(f"unknown verdict {claim.get('verdict')!r}: {where}")
    return found


def published_values() -> dict:
    """The rows of the ledger by key."""
    with LEDGER.open(newline="", encoding="utf-8") as file:
        return {key(row): row for row in csv.DictReader(file)}


def collect(executed: Path, published: dict) -> list[dict]:
    """All claims of the executed notebooks, in the order of the ledger; those not in it come last."""
    claims = [c for path in sorted(executed.rglob("*.ipynb")) for c in claims_of(path, executed)]
    order = {k: position for position, k in enumerate(published)}
    return sorted(claims, key=lambda claim: order.get(key(claim), len(order)))


def write(claims: list[dict], target: Path) -> None:
    temporary = target.with_suffix(".tmp")
    text = json.dumps(claims, indent=1, ensure_ascii=False, allow_nan=False)
    temporary.write_text(text + "\n", encoding="utf-8")
    temporary.replace(target)


def main(executed: Path, target: Path) -> None:
    published = published_values()
    claims = collect(executed, published)
    if found := problems(claims, published):
        sys.exit("\n".join(found))
    write(claims, target)

    total = Counter(row["paper"] for row in published.values())
    judged = Counter(claim["paper"] for claim in claims)
    verdicts = Counter((claim["paper"], claim["verdict"]) for claim in claims)
    for paper in total:
        score = ", ".join(f"{verdicts[paper, v]} {v}" for v in sorted(VERDICTS) if verdicts[paper, v])
        print(f"{paper}: {judged[paper]} of {total[paper]} judged" + (f" ({score})" if score else ""))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
