"""The line that says how far an experiment is, with a clock of its own."""

import io

import numpy as np
import pytest

import tmalib as tma


def toss(seed, runs):
    return {"heads": np.random.default_rng(seed).random(runs) < 0.5}


def lines(calls):
    """What is written for ``[(seconds, finished, total), ...]``, line by line, each over the one before."""
    clock = iter([when for when, *_ in calls])
    file = io.StringIO()
    line = tma.ProgressLine(file, clock=lambda: next(clock))
    for _, *numbers in calls:
        line(*numbers)
    return [text.rstrip() for text in file.getvalue().split("\r")[1:]]


def test_rate_and_time_left():
    found = lines([(10, 500, 2000), (12, 1000, 2000), (14, 1500, 2000), (16, 2000, 2000)])
    assert found == [
        "500 of 2000 runs",
        "1000 of 2000 runs, 250 a second, 4 s left",
        "1500 of 2000 runs, 250 a second, 2 s left",
        "2000 of 2000 runs, 250 a second",
    ]


@pytest.mark.parametrize(("seconds", "words"), [(99, "99 s"), (240, "4 min"), (7200, "2.0 h")])
def test_time_left_in_words(seconds, words):
    assert lines([(0, 500, 1500), (seconds, 1000, 1500)])[-1].endswith(f" {words} left")


def test_kept_chunks_that_are_only_read_are_no_fast_runs():
    """The first call brings 500 runs of 3000 at once; from then on 100 a second."""
    found = lines([(0, 500, 3000), (5, 1000, 3000)])
    assert "100 a second, 20 s left" in found[-1]


def test_two_lines_a_second_and_always_the_last():
    calls = [(k / 10, 500 * (k + 1), 15_000) for k in range(30)]
    found = lines(calls)
    assert len(found) == 7
    assert found[-1].startswith("15000 of 15000 runs")


def test_a_shorter_line_covers_a_longer_one():
    file, clock = io.StringIO(), iter([0.0, 10.0, 20.0])
    line = tma.ProgressLine(file, clock=lambda: next(clock))
    for finished in (500, 1000, 1500):
        line(finished, 1500)
    _, *texts = file.getvalue().rstrip("\n").split("\r")
    assert len(texts[2]) >= len(texts[1].rstrip())


def test_a_second_experiment_begins_anew():
    clock = iter([0.0, 5.0, 100.0, 101.0])
    file = io.StringIO()
    line = tma.ProgressLine(file, clock=lambda: next(clock))
    for finished in (500, 1000, 500, 1000):
        line(finished, 1000)
    assert "500 a second" in file.getvalue().split("\r")[-1]


def test_it_is_a_progress_of_monte_carlo(capsys):
    tma.monte_carlo(toss, 1200, "coins", progress=tma.ProgressLine())
    assert capsys.readouterr().err.split("\r")[-1].startswith("1200 of 1200 runs")


@pytest.mark.parametrize("numbers", [(-1, 10), (0.5, 10), (1, "many")])
def test_numbers_of_runs(numbers):
    with pytest.raises(ValueError, match="must be"):
        tma.ProgressLine(io.StringIO())(*numbers)
