"""Plants each defect of mutants.toml in a copy of the repository and runs the tests that must find it.

Usage: run.py [SAMPLE | WORD...]

All, so many drawn with a fixed seed, or those in whose name is one of the words.

Exit code 1 if a mutant survives that is not marked equivalent, or if what runs is not what should.
"""

import os
import random
import shutil
import signal
import sys
import tempfile
import tomllib
from collections import Counter
from pathlib import Path

import matplotlib.pyplot
import nbformat
import pytest
import scipy.optimize
import scipy.stats

ROOT = Path(__file__).parents[2]
LIST = Path(__file__).with_name("mutants.toml")
SEED = 2016
LOADED = matplotlib.pyplot, nbformat, scipy.optimize, scipy.stats  # by most tests
LONGEST = 1200  # seconds of one run
KILLED, SURVIVED, EQUIVALENT, ERROR = "killed", "SURVIVED", "equivalent", "ERROR"
LEFT_BEHIND = (".git", ".venv*", "build", "figures", "__pycache__", ".*_cache")


def mutants():
    """All mutants: dicts of `name`, `file`, `text`, `becomes`, `tests`, `why` and maybe `equivalent`."""
    return tomllib.loads(LIST.read_text(encoding="utf-8"))["mutant"]


def chosen(words):
    """The mutants that the arguments name."""
    found = mutants()
    if words and words[0].isdigit():
        return random.Random(SEED).sample(found, min(int(words[0]), len(found)))
    return [mutant for mutant in found if not words or any(word in mutant["name"] for word in words)]


def tests_fail(copy, tests):
    """Whether some of the tests fail in the copy; `ValueError` if they cannot be run, or do not end.

    In a fork of this process, which has loaded what most tests load: that halves the time.
    """
    with tempfile.TemporaryFile() as said:
        if not (child := os.fork()):
            for stream in (1, 2):
                os.dup2(said.fileno(), stream)
            signal.alarm(LONGEST)  # ends the fork
            os.environ["PYTHONPATH"] = str(copy)
            sys.path[0] = str(copy)
            os.chdir(copy)
            os._exit(pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-m", "not book", *tests]))
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        if code in (0, 1):
            return code == 1
        said.seek(0)
        raise ValueError(f"pytest ended with {code}:\n{said.read().decode()[-2000:]}")


def write(path, text):
    """Write a source without what was compiled from it: a change within a second is not seen by its date."""
    path.write_text(text, encoding="utf-8")
    for compiled in path.parent.glob(f"__pycache__/{path.stem}.*"):
        compiled.unlink()


def outcome(copy, mutant):
    """What became of a mutant, and a remark."""
    path = copy / mutant["file"]
    before = path.read_text(encoding="utf-8")
    if before.count(mutant["text"]) != 1:
        return ERROR, f"its text is {before.count(mutant['text'])} times in the file"
    try:
        write(path, before.replace(mutant["text"], mutant["becomes"]))
        if tests_fail(copy, mutant["tests"]):
            return (ERROR, "killed, and said to be equivalent") if "equivalent" in mutant else (KILLED, "")
    except ValueError as error:
        return ERROR, str(error)
    finally:
        write(path, before)
    return (EQUIVALENT, mutant["equivalent"]) if "equivalent" in mutant else (SURVIVED, mutant["why"])


def main(words):
    with tempfile.TemporaryDirectory() as folder:
        copy, some = Path(folder, "copy"), chosen(words)
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(*LEFT_BEHIND))
        for test in sorted({test for mutant in some for test in mutant["tests"]}):
            if tests_fail(copy, [test]):
                sys.exit(f"{test} fails without any mutant")
        counts = Counter()
        for mutant in some:
            what, remark = outcome(copy, mutant)
            counts[what] += 1
            print(f"{what:10} {mutant['file']:40} {mutant['name']}{f': {remark}' * bool(remark)}", flush=True)
    print(f"{len(some)} mutants:", ", ".join(f"{count} {what}" for what, count in sorted(counts.items())))
    sys.exit(bool(counts[SURVIVED] or counts[ERROR] or not some))


if __name__ == "__main__":
    main(sys.argv[1:])
