"""Tasks that a worker in another process can import."""

import os
import time
import uuid

import numpy as np

import tmalib as tma
from tmalib.papers.emw_acoustic import scenarios as emw


def table(seed, runs):
    """Fits without a start of scenario 1."""
    scenario = emw.scenario(1)
    found = tma.fit(scenario, scenario.simulate(runs, seed=seed))
    return {"state": found.state, "status": found.status}


def draw(seed, runs):
    return {"x": np.random.default_rng(seed).normal(size=(runs, 2))}


def slow(notes, seed, runs):
    """`draw`, with a note of each call, and slow enough that a worker can be killed meanwhile."""
    open(os.path.join(notes, f"{seed.spawn_key[-1]}-{uuid.uuid4()}"), "w").close()
    time.sleep(0.5)
    return draw(seed, runs)
