"""The command as a user meets it: files in, a table or one line of complaint out, an exit code."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pyproj import Geod

import tmalib as tma
from tmalib.command import main

TURNING = "time,x,y\n0,0,0\n600,0,3000\n1200,3000,3000\n"
STRAIGHT = "time,x,y\n0,0,0\n1200,0,6000\n"
GEOGRAPHIC = """time,latitude,longitude
2024-05-01T12:00:00Z,60,-5
2024-05-01T12:10:00Z,60.03,-5
2024-05-01T12:20:00Z,60.03,-4.95
"""
TARGET = "--target", "5000,6000,6,280"
PLAN = "--every", "10", "--sigma", "0.5"
NUMBER = re.compile(r"-?\d+\.?\d*")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder with three tracks, where the commands run."""
    monkeypatch.chdir(tmp_path)
    for name, text in (("turning", TURNING), ("straight", STRAIGHT), ("geographic", GEOGRAPHIC)):
        Path(f"{name}.csv").write_text(text, encoding="utf-8")
    return tmp_path


def run(*arguments):
    """The command in a process of its own."""
    command = [sys.executable, "-m", "tmalib", *arguments]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8")


def table(text):
    """Rows of a printed table, broken lines put together."""
    rows = {}
    for line in text.splitlines():
        name, _, said = line.partition("  ")
        if name:
            last = name
            rows[name] = said.strip()
        else:
            rows[last] += " " + said.strip()
    return rows


def numbers(text):
    return [float(number) for number in NUMBER.findall(text)]


def simulate(*arguments):
    assert main(["simulate", *arguments]) == 0


# -- fit -------------------------------------------------------------------------------------------


def test_a_good_run_finds_the_target_and_keeps_it():
    """Bearings by hand, not by the command: sine and cosine of a target on a straight course."""
    times = np.arange(0, 1201, 10.0)
    heading = np.radians(280)
    target = np.array([5000, 6000]) + 6 * times[:, None] * [np.sin(heading), np.cos(heading)]
    ship = np.stack([np.interp(times, [0, 600, 1200], [0, 0, 3000]), np.minimum(5 * times, 3000)], axis=-1)
    noise = np.random.default_rng(5).normal(scale=0.5, size=len(times))
    degrees = (np.degrees(np.arctan2(*(target - ship).T)) + noise) % 360
    rows = "".join(f"{t},{b}\n" for t, b in zip(times, degrees, strict=True))
    Path("bearings.csv").write_text("time,bearing\n" + rows, encoding="utf-8")
    done = run("fit", "bearings.csv", "--ownship", "turning.csv", "--sigma", "0.5", "--figure", "out.svg",
               "--save", "result.json")  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    said = table(done.stdout)
    assert said["status"] == "converged"
    kept = tma.load("result.json")
    miss = target[-1] - kept.state[:2]
    inside = miss @ np.linalg.solve(kept.covariance[:2, :2], miss)
    assert inside < -2 * np.log(1e-4)  # the ellipse of 0.9 is counted in the round trip
    assert numbers(said["x"])[0] == pytest.approx(kept.state[0], abs=1)
    value, sigma = numbers(said["course"])
    assert abs(value - 280) < 4 * sigma
    picture = Path("out.svg").read_text(encoding="utf-8")
    assert picture.count("<path") > 100
    assert "</svg>" in picture


def test_straight_on_is_not_observable():
    simulate("--ownship", "straight.csv", *PLAN, *TARGET, "--out", "bearings.csv")
    done = run("fit", "bearings.csv", "--ownship", "straight.csv")
    assert (done.returncode, done.stderr) == (1, "")
    said = table(done.stdout)
    assert said["status"].startswith("not observable: rank 3 of 4")
    assert "A manoeuvre of the platform" in said["status"]
    assert "x" not in said
    bound = run("bound", "--ownship", "straight.csv", *PLAN, *TARGET)
    assert bound.returncode == 1
    assert table(bound.stdout)["status"].startswith("not observable: rank 3 of 4")


def test_latitudes_come_back_as_latitudes(capsys):
    """Place, bearing and range as geodesics have them; within twice the ellipse, outside of which is 1e-4."""
    earth = Geod(ellps="WGS84")
    simulate("--ownship", "geographic.csv", *PLAN, "--target", "60.06,-4.9,6,280", "--out", "bearings.csv")
    capsys.readouterr()
    assert main(["fit", "bearings.csv", "--ownship", "geographic.csv"]) == 0
    said = table(capsys.readouterr().out)
    assert said["reference time"] == "2024-05-01T12:20:00Z"
    latitude, longitude = numbers(said["latitude, longitude"])
    true_longitude, true_latitude, _ = earth.fwd(-4.9, 60.06, 280, 6 * 1200)
    _, _, miss = earth.inv(longitude, latitude, true_longitude, true_latitude)
    assert miss < 2 * numbers(said["90 % ellipse"])[0]
    azimuth, _, distance = earth.inv(-4.95, 60.03, longitude, latitude)
    assert numbers(said["bearing"])[0] == pytest.approx(azimuth % 360, abs=0.06)
    length, sigma = numbers(said["range"])
    assert length == pytest.approx(distance, abs=0.1 * sigma)
    begin, x, y = numbers(said["x and y from"]), numbers(said["x"])[0], numbers(said["y"])[0]
    assert begin == [60, -5]
    there, here, _ = earth.fwd(begin[1], begin[0], np.degrees(np.arctan2(x, y)), np.hypot(x, y))
    assert (here, there) == pytest.approx((latitude, longitude), abs=1e-4)


def test_a_track_in_metres_says_nothing_of_a_place(capsys):
    assert main(["bound", "--ownship", "turning.csv", *PLAN, *TARGET]) == 0
    assert "x and y from" not in table(capsys.readouterr().out)
    assert main(["bound", "--ownship", "geographic.csv", *PLAN, "--target", "60.06,-4.9,6,280"]) == 0
    assert numbers(table(capsys.readouterr().out)["x and y from"]) == [60, -5]


def test_a_window_and_a_reference_time(capsys):
    simulate("--ownship", "geographic.csv", *PLAN, "--target", "60.06,-4.9,6,280", "--out", "bearings.csv")
    capsys.readouterr()
    fit = ["fit", "bearings.csv", "--ownship", "geographic.csv"]
    main([*fit, "--between", "2024-05-01T12:05:00Z", "1714565700"])  # 12:15
    said = table(capsys.readouterr().out)
    assert said["reference time"] == "2024-05-01T12:15:00Z"
    assert said["measurements"] == "61 of 1 sensor"
    main([*fit, "--reference", "2024-05-01T14:07:30.5+02:00"])
    said = table(capsys.readouterr().out)
    assert said["reference time"] == "2024-05-01T12:07:30.5Z"
    assert said["measurements"] == "121 of 1 sensor"


def test_a_hardly_known_range_has_a_region(capsys):
    simulate("--ownship", "turning.csv", "--every", "60", "--sigma", "2", "--target", "20000,30000,6,280",
             "--out", "far.csv")  # fmt: skip
    capsys.readouterr()
    assert main(["fit", "far.csv", "--ownship", "turning.csv"]) == 0
    said = table(capsys.readouterr().out)
    assert "90 % ellipse" not in said
    assert "m to" in said["90 % region"]


# -- bound and simulate ----------------------------------------------------------------------------


@pytest.mark.slow
def test_round_trip():
    """Twenty simulated files: each component within four sigma; of the ellipses at least 13 hold the target.

    One number in 16 000 is beyond four sigma; with nine ellipses in ten that hold it, fewer than 13 of 20 do
    once in 2000 tests.
    """
    simulate("--ownship", "turning.csv", *PLAN, *TARGET, "--runs", "20", "--seed", "7", "--out", "many.csv")
    heading, reached, inside = np.radians(280), np.empty((20, 4)), 0
    speed = 6 * np.array([np.sin(heading), np.cos(heading)])
    truth = np.concatenate([[5000, 6000] + 1200 * speed, speed])
    for k in range(20):
        arguments = ["fit", f"many-{k + 1}.csv", "--ownship", "turning.csv", "--save", "one.json"]
        assert main(arguments) == 0
        found = tma.load("one.json")
        reached[k] = (found.state - truth) / found.sigma
        miss = found.state[:2] - truth[:2]
        inside += miss @ np.linalg.solve(found.covariance[:2, :2], miss) < -2 * np.log(1 - 0.9)
    assert np.abs(reached).max() < 4
    assert inside >= 13
    assert len(np.unique(reached.round(9))) == 80  # each with noise of its own


def test_the_bound_is_that_of_the_library(capsys):
    ship = tma.SampledCourse([0, 600, 1200], [(0, 0), (0, 3000), (3000, 3000)])
    ear = tma.Sensor(tma.DelayedBearing(1480.0), np.arange(0, 1201, 10.0), np.radians(0.5))
    target = tma.Target((-5000, 6000), 6, np.radians(280))
    sigma = tma.crlb_sigma(tma.Scenario(ship, [ear], 1200, target))
    plan = ["--ownship", "turning.csv", *PLAN, "--target", "-5000,6000,6,280", "--sound-speed", "1480"]
    assert main(["bound", *plan]) == 0
    said = table(capsys.readouterr().out)
    assert [numbers(said[name])[1] for name in ("x", "y")] == pytest.approx(sigma[:2], rel=0.05)
    tma.save("scenario.json", tma.Scenario(ship, [ear], 1200))
    assert main(["bound", "scenario.json", "--target", "-5000,6000,6,280"]) == 0
    assert table(capsys.readouterr().out) == said


@pytest.mark.parametrize("person", [True, False])
def test_long_work_is_told_to_a_person_only(person, capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: person, raising=False)
    simulate("--ownship", "turning.csv", *PLAN, *TARGET, "--out", "x.csv", "--runs", "101")
    told = capsys.readouterr()
    count = len(Path("x-101.csv").read_text(encoding="utf-8").splitlines()) - 1
    lines = [
        f"simulating 101 times {count} bearings ...",
        "50 of 101 files written ...",
        "100 of 101 files written ...",
    ]
    assert told.err.splitlines() == (lines if person else [])
    assert told.out.startswith(f"{count} bearings in x-1.csv, x-101.csv")


def test_a_seed_makes_the_same_file():
    plan = ["--ownship", "turning.csv", *PLAN, *TARGET, "--out"]
    for name, seed in (("a.csv", "1"), ("b.csv", "1"), ("c.csv", "2")):
        simulate(*plan, name, "--seed", seed)
    one, same, other = (Path(f"{name}.csv").read_bytes() for name in "abc")
    assert one == same != other


# -- refused ---------------------------------------------------------------------------------------

GOOD = "time,bearing,sigma\n0,10,1\n60,11,1\n"
FIT = ("fit", "bearings.csv", "--ownship", "turning.csv")
PLANNED = ("--ownship", "turning.csv", *PLAN)
REFUSED = {
    "mils": (FIT, "time,bearing,sigma\n0,10,1\n60,6390,1\n", "bearings.csv, line 3, column 'bearing'"),
    "milliseconds": (FIT, "time,bearing,sigma\n1714564800000,10,1\n", "bearings.csv, line 2, column 'time'"),
    "decimal commas": (FIT, "time,bearing,sigma\n0,10,1\n60,1,5,1\n", "bearings.csv, line 3: 4 cells"),
    "no number": (FIT, "time,bearing,sigma\n0,ten,1\n", "bearings.csv, line 2, column 'bearing'"),
    "too few without sigma": (FIT, "time,bearing\n0,10\n", "an unknown sigma needs three measurements"),
    "after the track": (FIT, "time,bearing,sigma\n0,10,1\n1300,1,1\n", "bearings.csv, line 3, column 'time'"),
    "no bearings": (("fit", "none.csv", "--ownship", "turning.csv"), GOOD, "none.csv: No such file"),
    "no track": (("fit", "bearings.csv", "--ownship", "none.csv"), GOOD, "none.csv: No such file"),
    "no own ship": (("fit", "bearings.csv"), GOOD, "--ownship"),
    "sigma": ((*FIT, "--sigma", "-1"), GOOD, "argument --sigma: -1 is not above 0 to 180 degrees"),
    "a time": ((*FIT, "--reference", "noon"), GOOD, "argument --reference: a time is a number"),
    "a date": ((*FIT, "--reference", "2024-05-01T12:00Z"), GOOD, "--reference: the track's times want plain"),
    "an empty window": ((*FIT, "--between", "100", "200"), GOOD, "no measurement between 100.0 and 200.0"),
    "an abbreviation": ((*FIT, "--fig", "a.svg"), GOOD, "unrecognized arguments"),
    "a picture of no kind": ((*FIT, "--figure", "a.xyz"), GOOD, "xyz"),
    "no folder": ((*FIT, "--save", "no/where.json"), GOOD, "no/where.json: No such file"),
    "no target": (("bound", *PLANNED), GOOD, "also give --target"),
    "half a target": (("bound", *PLANNED, "--target", "1,2,3"), GOOD, "X,Y,SPEED,COURSE"),
    "backwards": (("bound", *PLANNED, "--target", "1,2,-3,4"), GOOD, "--target: speed must be at least 0"),
    "no plan": (("bound", *TARGET), GOOD, "either SCENARIO.json or --ownship"),
    "two plans": (("bound", "a.json", *PLANNED, *TARGET), GOOD, "either SCENARIO.json or --ownship"),
    "not a scenario": (("bound", "bearings.csv", *TARGET), GOOD, "bearings.csv, line 1: not JSON"),
    "too many": (("bound", "--ownship", "turning.csv", "--every", "1e-6", "--sigma", "1", *TARGET), GOOD,
                 "--every 1e-06 s makes 1200000001 bearings"),
    "no runs": (("simulate", *PLANNED, *TARGET, "--out", "x.csv", "--runs", "0"), GOOD, "--runs"),
    "on the ship": (("simulate", *PLANNED, "--target", "0,0,1,1", "--out", "x.csv"), GOOD, "on the platform"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_used_is_told_in_a_line(name, capsys):
    arguments, bearings, message = REFUSED[name]
    Path("bearings.csv").write_text(bearings, encoding="utf-8")
    try:
        code = main(arguments)
    except SystemExit as stopped:  # what argparse refuses
        code = stopped.code
    error = capsys.readouterr().err
    assert code == 2
    assert message in error
    assert error.startswith((f"tmalib {arguments[0]}: ", "tmalib: "))
    assert error.count("\n") == 1


def test_the_process_says_the_same():
    Path("bearings.csv").write_text(REFUSED["mils"][1], encoding="utf-8")
    done = run(*FIT)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("tmalib fit: bearings.csv, line 3, column 'bearing': 6390 is not")


def test_without_matplotlib_it_says_what_to_install():
    simulate(*PLANNED, *TARGET, "--out", "bearings.csv")
    code = "import sys; sys.modules['matplotlib'] = None\nfrom tmalib.command import main\nsys.exit(main())"
    for figure, expected in ((["--figure", "a.svg"], 2), ([], 0)):
        done = subprocess.run([sys.executable, "-c", code, *FIT, *figure], capture_output=True, text=True)
        assert done.returncode == expected, done.stderr
    done = subprocess.run(
        [sys.executable, "-c", code, *FIT, "--figure", "a.svg"], capture_output=True, text=True
    )
    assert done.stderr == 'tmalib fit: --figure needs matplotlib: pip install "tmalib[figures]"\n'


@pytest.mark.parametrize("name", ["fit", "bound", "simulate"])
def test_help_ends_in_an_example_that_runs(name, capsys):
    with pytest.raises(SystemExit) as stopped:
        main([name, "--help"])
    assert stopped.value.code == 0
    (example,) = re.findall(r"^example: tmalib (.*)$", capsys.readouterr().out, re.MULTILINE)
    for needed in ("plan.csv", "track.csv"):
        Path(needed).write_text(TURNING, encoding="utf-8")
    simulate(*PLANNED, *TARGET, "--out", "bearings.csv")
    assert main(example.split()) == 0
