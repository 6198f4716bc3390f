"""Peers are in `tests/benchmarks`, in a lock of their own (`make peers`); elsewhere nothing is collected."""

import sys
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
NEEDED = ("distributed", "jax", "numba", "stonesoup")
collect_ignore_glob = [] if all(map(find_spec, NEEDED)) else ["test_*.py"]
