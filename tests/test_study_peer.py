"""Stone Soup on the sample data: its stored answers, and how lines of code are counted."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from tmalib.study import peer, results

ROOT = Path(__file__).parent.parent


def test_lines_of_code_by_hand():
    source = (
        '"""Text."""\nimport os\n\ndef f(a,\n      b):\n    """What."""\n    # why\n    return (a +\n b)\n'
    )
    source += "\nx = 1\n"
    assert peer.lines_of_code(source) == 3
    assert peer.lines_of_code(source, ("f",)) == 2
    with pytest.raises(ValueError, match="no \\['g'\\]"):
        peer.lines_of_code(source, ("f", "g"))


def test_the_script_that_is_counted_runs(capsys):
    runpy.run_path(str(ROOT / "tools/study/same_here.py"))
    assert re.search(r"status +converged", capsys.readouterr().out)


def test_stone_soup_ran_as_the_scripts_and_locks_say():
    told = results.about()
    assert told["lines"] == peer.counted_lines(ROOT / "tools/study")
    lock = (ROOT / "tools/study/environment.txt").read_text(encoding="utf-8")
    version = re.search(r"(?m)^stonesoup==(\S+)", lock)[1]
    assert told["archives"]["stonesoup"]["file"] == f"stonesoup-{version}.tar.gz"
    assert re.search(rf"(?m)^stonesoup=={version}$", (ROOT / "tools/study/environment.in").read_text("utf-8"))


def test_answers_are_of_every_filter_prior_and_model():
    answers = peer.read_answers()
    cases = {(one["filter"], one["delayed"], one["range"]) for one in answers}
    assert len(cases) == len(answers) == 3 * 2 * 3
    for one in answers:
        np.testing.assert_allclose(one["covariance"], one["covariance"].T, rtol=1e-4)
        assert np.all(np.linalg.eigvalsh(one["covariance"]) > 0)
