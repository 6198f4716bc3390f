"""Verdicts under other seeds: what is listed, and that the seed reaches every stream."""

import os
import subprocess
import sys
from dataclasses import replace

import pytest

from tmalib import judging
from tmalib.judging import reseed

PAPER = judging.read_papers()["emw-acoustic"]


def claim(row, verdict, probability=0.5, notebook="a.ipynb", stream="s"):
    printed = PAPER.printed("Table I", row, "std_mle")
    source = {"task": "t", "stream": stream, "seed": 1, "runs": 10}
    common = dict(ours=1.0, erratum="", note="", notebook=notebook, sources=(source,) if stream else ())
    return judging.Claim(**vars(printed), verdict=verdict, probability=probability, **common)


def test_changed_and_missing_verdicts_are_listed():
    before = [claim(row, judging.REPRODUCED) for row in ("xT", "yT", "vxT")]
    after = [before[0], replace(before[1], verdict=judging.NOT_REPRODUCED)]
    assert reseed.changes(before, after) == [
        f"Table I yT std_mle: {judging.REPRODUCED}, here {judging.NOT_REPRODUCED}",
        f"Table I vxT std_mle: {judging.REPRODUCED}, here missing",
    ]


def test_only_chapters_with_random_numbers_are_done_again():
    claims = [
        claim("xT", "x"),
        claim("yT", "x", notebook="b.ipynb", stream=""),
        claim("vxT", "x", notebook="0"),
    ]
    assert reseed.random_chapters(claims) == ["0", "a.ipynb"]


def test_a_seed_takes_the_place_of_its_own_row_only(tmp_path):
    path = tmp_path / "seeds.csv"
    for seed, changed in ((10, 1), (9, 2), (10, 3)):
        reseed.add_seed(path, (seed, "2026-01-01", 4, 50, changed, "one; two"))
    rows = [",".join(reseed.COLUMNS), "9,2026-01-01,4,50,2,one; two", "10,2026-01-01,4,50,3,one; two"]
    assert path.read_text(encoding="utf-8").splitlines() == rows


@pytest.mark.parametrize("seed", ["", "17"])
def test_the_seed_of_the_environment_is_that_of_every_stream(seed):
    code = "import tmalib; print(tmalib.Stream('a', 3).chunk(2).entropy, tmalib.Stream('b').source.seed)"
    env = {key: value for key, value in os.environ.items() if key != "TMALIB_SEED"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=env | ({"TMALIB_SEED": seed} if seed else {}), capture_output=True
    )
    assert done.stdout.decode().split() == [seed or "2016"] * 2, done.stderr


def test_a_notebook_is_executed_to_its_end_with_the_seed(tmp_path):
    from toy_paper import write_notebook

    made = [claim("xT", judging.REPRODUCED)]
    code = """\
        from IPython.display import display
        from dataclasses import asdict, replace
        from tmalib import Stream, judging
        row = judging.read_papers()["emw-acoustic"].printed("Table I", "xT", "std_mle")
        found = judging.Claim(**vars(row), ours=Stream("a").source.seed, verdict="v", erratum="", note="")
        judging.Verdicts((found,))"""
    path = write_notebook(tmp_path / "a.ipynb", "assert False, 'about the runs of the book'", code)
    (found,) = reseed.claims_with_seed(path, "a.ipynb", 23, tmp_path / "out/a.ipynb")
    assert (found.ours, found.notebook, found.cell) == (23, "a.ipynb", 1)
    assert "TMALIB_SEED" not in os.environ
    assert (tmp_path / "out/a.ipynb").is_file()
    (word,) = reseed.changes(made, [found])
    assert word.endswith("here v")
    for row in ((31, "then", 1, 1, 0, ""), (23, "then", 1, 1, 0, ""), (23, "today", 1, 1, 1, word)):
        reseed.add_seed(tmp_path / "x.csv", row)
    head, *lines = (tmp_path / "x.csv").read_text().splitlines()
    assert head == ",".join(reseed.COLUMNS)
    assert [line[:8] for line in lines] == ["23,today", "31,then,"]
