"""A million runs of Table I of `emw-acoustic` on a cluster: bias and efficiency of the batch estimate.

Usage: million.py FOLDER [RUNS]

Finished chunks are kept in FOLDER/chunks: after an interrupt the same command goes on. What is counted is
written to FOLDER/million.json.
"""

import json
import sys
import time
from datetime import date
from pathlib import Path

import numpy as np
from cluster import commands, on_loopback
from distributed import Client

import tmalib as tma
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.speed import processor

WORKERS, STREAM = 2, "a million"


def errors(seed, runs):
    """Errors of the batch estimate from the paper's start, scenario 1; and whether it converged."""
    scenario = emw.scenario(1)
    angles = scenario.simulate(runs, seed=seed)
    found = tma.fit(scenario, angles, tma.along_first_bearing(scenario, angles, 10e3))
    return {"error": found.state - scenario.state, "converged": found.converged}


def summary(found):
    """Bias and efficiency, with standard errors, and the mean NEES with its own."""
    scenario = emw.scenario(1)
    told = tma.statistics(found["error"], used=found["converged"])
    sigma = tma.crlb_sigma(scenario)
    good = found["error"][found["converged"]]
    nees = tma.nees(good, np.zeros(4), tma.crlb(scenario))
    return {
        "components": list(scenario.coordinates),
        "used": told.used,
        "left_out": told.left_out,
        "sigma": sigma.tolist(),
        "bias": told.bias.tolist(),
        "bias_se": told.bias_se().tolist(),
        "efficiency": (told.std / sigma).tolist(),
        "efficiency_se": (told.std_se() / sigma).tolist(),
        "nees": float(nees.mean()),
        "nees_se": float(nees.std() / np.sqrt(len(nees))),
    }


def main(folder, runs=1_000_000):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    # Workers import the task by the name of this file, not of the program.
    from million import errors as task

    with on_loopback(folder / "workers", WORKERS, [Path(__file__).parent]) as (address, _):
        client = Client(address, timeout=60)
        client.wait_for_workers(WORKERS, timeout=60)
        with client, client.get_executor() as executor:
            begin = time.perf_counter()
            found = tma.monte_carlo(
                task, runs, STREAM, executor=executor, progress=tma.ProgressLine(), keep=folder / "chunks"
            )
            took = time.perf_counter() - begin
    start, work, *_ = commands("tcp://SCHEDULER:8786", 1, "FOLDER")
    about = {
        "date": date.today().isoformat(),
        "processor": processor(),
        "workers": WORKERS,
        "seconds": took,
        "runs": runs,
        "source": str(found.source),
        "commands": [" ".join(command) for command in (start, work)],
    }
    text = json.dumps(about | summary(found), indent=1)
    (folder / "million.json").write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
