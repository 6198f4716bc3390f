"""The verdicts under other seeds; `make reseed` calls it.

Usage: reseed.py SEED... [CHAPTER...], from the root of the repository, after `make claims`

Executes the chapters, by default all whose claims rest on random numbers, once for each seed, into
build/reseed/SEED, and writes which verdicts change to book/verdicts/other_seeds.csv, a line a seed. Lines of
other seeds stay.
"""

import sys
from datetime import date
from pathlib import Path

from tmalib.judging import collect, reseed

OUT, TABLE = Path("build/reseed"), Path("book/verdicts/other_seeds.csv")


def main(seeds: list[int], names: list[str]) -> None:
    claims = collect.read_claims("build/claims.json")
    names = names or reseed.random_chapters(claims)
    for seed in seeds:
        words, count = [], 0
        for name in names:
            before = [claim for claim in claims if claim.notebook == name]
            path = Path("notebooks") / name
            after = reseed.claims_with_seed(path, name, seed, OUT / str(seed) / name)
            found = reseed.changes(before, after)
            words, count = words + found, count + len(before)
            print(f"seed {seed}, {name}: {len(found)} of {len(before)} verdicts change", *found, sep="\n  ")
        on = date.today().isoformat()
        reseed.add_seed(TABLE, (seed, on, len(names), count, len(words), "; ".join(words)))


if __name__ == "__main__":
    seeds = [int(word) for word in sys.argv[1:] if word.isdigit()]
    if not seeds:
        sys.exit(__doc__)
    main(seeds, [word for word in sys.argv[1:] if not word.isdigit()])
