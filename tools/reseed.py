"""The verdicts under other seeds; `make reseed` calls it.

Usage: reseed.py SEED..., from the root of the repository, after `make claims`

Executes every chapter whose claims rest on random numbers once for each seed, into build/reseed/SEED, and
writes the verdicts that change to book/verdicts/other_seeds.csv.
"""

import sys
from pathlib import Path

from tmalib.judging import collect, reseed

OUT, TABLE = Path("build/reseed"), Path("book/verdicts/other_seeds.csv")


def main(seeds: list[int]) -> None:
    claims = collect.read_claims("build/claims.json")
    names, rows = reseed.random_chapters(claims), []
    for seed in seeds:
        for name in names:
            before = [claim for claim in claims if claim.notebook == name]
            path = Path("notebooks") / name
            after = reseed.claims_with_seed(path, name, seed, OUT / str(seed) / name)
            found = reseed.changes(seed, before, after)
            print(f"seed {seed}, {name}: {len(found)} of {len(before)} verdicts change", flush=True)
            rows += found
            reseed.write_changes(TABLE, rows)


if __name__ == "__main__":
    if not sys.argv[1:]:
        sys.exit(__doc__)
    main(list(map(int, sys.argv[1:])))
