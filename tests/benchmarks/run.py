"""`make bench`: every comparison in one run on one processor; prints ratios and goals, writes a dated JSON.

Usage: run.py FOLDER
"""

import datetime
import json
import platform
import sys
from importlib.metadata import version
from pathlib import Path

from comparisons import GROUPS, importing, processes
from measure import pin
from scaling import series

import tmalib
from tmalib.speed import is_met, processor

PEERS = ("numpy", "scipy", "numba", "jax", "filterpy", "stonesoup")


def show(row):
    goal = "" if row["goal"] is None else f"goal {row['goal'][0]} {row['goal'][1]}"
    word = "" if is_met(row) else "MISS"
    middle = f"{row['ratio']:8.2f} [{row['low']:.2f}, {row['high']:.2f}]"
    print(f"{row['what']:32s} {row['peer']:22s} {middle:28s} {row['of']:28s} {goal:12s} {word}", flush=True)


def main(folder):
    rows = []
    unpinned = (importing, processes)
    for group in (*[g for g in GROUPS if g in unpinned], None, *[g for g in GROUPS if g not in unpinned]):
        if group is None:
            core = pin()
        else:
            rows += [found | {"group": group.__name__} for found in group()]
            for found in rows:
                if found["group"] == group.__name__:
                    show(found)
    found, flat = series()
    rows.append(flat | {"group": "scaling"})
    show(rows[-1])
    today = datetime.date.today().isoformat()
    about = {
        "date": today,
        "processor": processor(),
        "pinned": core is not None,
        "system": platform.system(),
        "versions": {"tmalib": tmalib.__version__, "python": platform.python_version()}
        | {name: version(name) for name in PEERS},
    }
    path = Path(folder) / f"{today}.json"
    path.write_text(json.dumps(about | {"rows": rows, "series": found}, indent=1) + "\n", encoding="utf-8")
    missed = [row for row in rows if not is_met(row)]
    goals = sum(row["goal"] is not None for row in rows)
    print(f"{len(rows)} ratios, {goals} with a goal, {len(missed)} missed")


if __name__ == "__main__":
    main(sys.argv[1])
