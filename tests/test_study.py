"""The study with recorded tracks: its machinery on a made-up harbour, and what is stored of it."""

import importlib.util
import io
import re
import tarfile
import zipfile
from dataclasses import asdict, replace
from datetime import UTC, date, datetime
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pyproj import Geod

import tmalib as tma
from tmalib.montecarlo import SEED
from tmalib.study import results, shares
from tmalib.study.cases import CASES, SOLENT, Case
from tmalib.study.encounters import Rules, best_line, covering, encounters, largest_departure
from tmalib.study.records import read_ais, without_jumps
from tmalib.study.trials import lost_runs, nearest_line, outcomes, watch_of

ROOT = Path(__file__).parent.parent
EARTH, HARBOUR, MIDNIGHT = Geod(ellps="WGS84"), (50.0, -1.0), datetime(2024, 1, 1, tzinfo=UTC).timestamp()
RULES = Rules(
    length=600.0, step=600.0, every=20.0, sigma=0.01, lead=0.0, gap=60.0, fastest=40.0, bend=300.0,
    slowest=1.0, nearest=1e3, farthest=20e3, targets=5, draws=20,
)  # fmt: skip
TIMES = np.arange(0.0, 1201.0, 20.0)


def at(xy, times=TIMES):
    """Reports ``(N, 3)`` of places that are given in metres east and north of the harbour, by geodesics."""
    azimuth = np.degrees(np.arctan2(*xy.T))
    start = np.broadcast_to(np.array(HARBOUR)[:, None], (2, len(xy)))
    longitude, latitude, _ = EARTH.fwd(start[1], start[0], azimuth, np.hypot(*xy.T))
    return np.column_stack([MIDNIGHT + times, latitude, longitude])


def straight(start, velocity):
    return np.array(start) + TIMES[:, None] * np.array(velocity)


@pytest.fixture(scope="module")
def harbour():
    """Five ships: one turns at 300, 600 and 900 s; others run straight, lie still, are far, have a gap."""
    leg = np.where(TIMES % 600 <= 300, TIMES % 600, 600 - TIMES % 600)
    dogleg = np.column_stack([5.0 * TIMES, 5.0 * leg])
    gap = straight((0, 5e3), (3, 0))[(TIMES < 700) | (TIMES > 800)]
    return {
        "bends": at(dogleg),
        "straight": at(straight((2e3, 6e3), (-4, 1))),
        "still": at(straight((3e3, 4e3), (0.1, 0))),
        "far": at(straight((0, 30e3), (5, 0))),
        "gap": at(gap, TIMES[(TIMES < 700) | (TIMES > 800)]),
    }


def table_of(tracks):
    rows = ["Time,MMSI,Latitude_degrees,Longitude_degrees,SOG_knots"]
    for name, track in tracks.items():
        for time, latitude, longitude in track:
            stamp = datetime.fromtimestamp(time, UTC).replace(tzinfo=None).isoformat(" ", "milliseconds")
            rows.append(f"{stamp},{name},{float(latitude)!r},{float(longitude)!r},1.0")
    return "\n".join([rows[0], *sorted(rows[1:])]).encode()


def test_a_table_of_reports_gives_back_its_tracks(harbour):
    read = read_ais(table_of(harbour))
    assert read.keys() == harbour.keys()
    for name, track in harbour.items():
        np.testing.assert_allclose(read[name], track, rtol=0, atol=1e-9)


def test_who_watches_whom(harbour):
    """By hand: one ship bends; of the others one lies still, one is too far, one has a gap in the end."""
    met = encounters(harbour, RULES, np.random.default_rng(1))
    named = [(one.start - MIDNIGHT, one.own, one.target) for one in met]
    assert named == [(0, "bends", "straight"), (0, "bends", "gap"), (600, "bends", "straight")]


def test_targets_are_drawn_where_there_are_more(harbour):
    few = replace(RULES, targets=1)
    drawn = {encounters(harbour, few, np.random.default_rng(seed))[0].target for seed in range(20)}
    assert drawn == {"straight", "gap"}
    assert all(len(encounters(harbour, few, np.random.default_rng(seed))) == 2 for seed in range(3))


def test_the_plane_has_the_distances_and_bearings_of_the_earth(harbour):
    one = encounters(harbour, RULES, np.random.default_rng(1))[0]
    assert one.platform.position_at(0.0) == pytest.approx([0, 0], abs=1e-6), "the own ship's first fix"
    for row in (0, 15, 30):
        here, there = harbour["bends"][row], harbour["straight"][row]
        azimuth, _, distance = EARTH.inv(here[2], here[1], there[2], there[1])
        gap = one.motion.position_at(TIMES[row]) - one.platform.position_at(TIMES[row])
        assert np.hypot(*gap) == pytest.approx(distance, rel=1e-6)
        frame = tma.Frame(latitude=harbour["bends"][0, 1], longitude=harbour["bends"][0, 2])
        north = frame.true_north(one.platform.position_at(TIMES[row]))
        assert np.degrees(np.arctan2(*gap) - north) == pytest.approx(azimuth, abs=1e-4)


def test_own_ship_is_as_the_reader_of_files_reads_it(harbour, tmp_path):
    rows = [f"{t - MIDNIGHT:.0f},{a:.15g},{b:.15g}" for t, a, b in harbour["bends"][:31]]
    (tmp_path / "ship.csv").write_text("\n".join(["time,latitude,longitude", *rows]), encoding="utf-8")
    one = encounters(harbour, RULES, np.random.default_rng(1))[0]
    np.testing.assert_allclose(
        tma.read_track(tmp_path / "ship.csv").positions, one.platform.positions, atol=1e-5
    )


@pytest.mark.parametrize("seed", range(5))
def test_covering_is_what_a_slow_search_finds(seed):
    rng = np.random.default_rng(seed)
    track = np.column_stack([np.unique(rng.uniform(0, 100, 30)), *np.zeros((2, 30))])
    for first, last, gap in rng.uniform([-10, 40, 2], [60, 110, 20], (200, 3)):
        part, times = covering(track, first, last, gap), track[:, 0]
        if first < times[0] or last > times[-1] or first >= last:
            assert first >= last or part is None
            continue
        inside = times[max(times[times <= first]) <= times]
        inside = inside[inside <= min(times[times >= last])]
        if np.all(np.diff(inside) <= gap):
            np.testing.assert_array_equal(part[:, 0], inside)
        else:
            assert part is None


def test_jumps_are_left_out_and_nothing_else(harbour):
    track = harbour["straight"].copy()
    track[10, 1] += 0.5  # 55 km in 20 s
    np.testing.assert_array_equal(without_jumps(track, 40.0), np.delete(track, 10, axis=0))
    twice = np.insert(track, 5, track[5], axis=0)
    assert len(without_jumps(twice, 40.0)) == len(track) - 1


def test_best_line_leaves_residuals_without_a_line():
    rng = np.random.default_rng(3)
    motion = tma.SampledCourse(TIMES, rng.normal(0, 500, (len(TIMES), 2)) + TIMES[:, None] * [3, -2])
    line = best_line(motion, TIMES)
    off = motion.positions - line.position_at(TIMES)
    np.testing.assert_allclose(np.stack([np.ones_like(TIMES), TIMES / 1e3]) @ off, 0, atol=1e-6)
    assert largest_departure(motion, TIMES) == pytest.approx(max(np.hypot(x, y) for x, y in off))


def test_a_target_on_a_line_is_refused_and_covered_as_chance_has_it(harbour):
    """The geometry of the first encounter, its target on its line: level, ellipse and bound hold."""
    one = encounters(harbour, RULES, np.random.default_rng(1))[0]
    watch = watch_of(one, RULES, tma.Bearing())
    line = best_line(one.motion, RULES.times)
    state, misfit = nearest_line(watch, watch.with_target(line).measure(), line.state(600.0))
    assert misfit < 1e-12
    np.testing.assert_allclose(state, line.state(600.0), atol=1e-3)
    angles = watch.with_target(line).simulate(2000, seed=5)
    found = outcomes(watch, angles, line.position_at(600.0), [line.state(600.0)])
    assert (found["converged"], found["lost"], found["none"]) == (2000, 0, 0)
    assert abs(found["refused_5"] - 100) < 4 * np.sqrt(95)
    assert abs(found["refused_1"] - 20) < 4 * np.sqrt(19.8)
    assert abs(found["inside"] - 1800) < 4 * np.sqrt(180)
    bound = np.sqrt(np.trace(tma.crlb(watch.with_target(line))[:2, :2]))
    assert found["rms_error"] == pytest.approx(bound, rel=0.1)
    assert found["stated"] == pytest.approx(bound, rel=0.05)


def test_refusals_are_those_of_bearings_with_a_misfit():
    """Normal numbers with the mean of a misfit, squared and added, against the formula."""
    from scipy.stats import chi2

    rng, freedom = np.random.default_rng(4), 57
    for misfit in (0.0, 10.0, 40.0):
        shift = np.sqrt(misfit / freedom)
        refused = np.sum((rng.standard_normal((20000, freedom)) + shift) ** 2, axis=1) > chi2.ppf(
            0.99, freedom
        )
        expected = shares.expected_refusals(misfit, freedom)
        assert abs(refused.mean() - expected) < 4 * np.sqrt(expected * (1 - expected) / 20000)


def test_lost_runs_by_hand():
    """Found, found elsewhere, not found, nobody finds, better than known, one known start fails."""
    found = SimpleNamespace(converged=np.array([1, 1, 0, 0, 1, 1], bool), cost=np.array([5, 9, 9, 9, 4, 5.0]))
    known = SimpleNamespace(converged=np.array([1, 1, 1, 0, 1, 0], bool), cost=np.array([5, 5, 5, 5, 5, 1.0]))
    lost, none = lost_runs(found, [known])
    assert lost.tolist() == [False, True, True, False, False, False]
    assert none.tolist() == [False, False, False, True, False, False]


def test_a_case_is_the_same_again(harbour):
    case = Case(SOLENT, RULES, tma.Bearing(), tma.Stream("test", 21))
    (rows, about), (again, _) = (results.run_case(case, harbour) for _ in range(2))
    assert rows == again
    assert [row["start"] for row in rows] == [0, 0, 600]
    assert (about["tracks"], about["own"], about["targets"], about["encounters"]) == (5, 1, 2, 3)
    assert about["jumps"] == 0
    other, _ = results.run_case(replace(case, stream=tma.Stream("test", 22)), harbour)
    assert [row["misfit"] for row in other] == [row["misfit"] for row in rows], "no noise in it"
    assert [row["rms_error"] for row in other] != [row["rms_error"] for row in rows]


def test_the_script_unpacks_both_kinds_of_archive(tmp_path):
    spec = importlib.util.spec_from_file_location("study", ROOT / "tools/study.py")
    spec.loader.exec_module(script := importlib.util.module_from_spec(spec))
    with zipfile.ZipFile(tmp_path / "one.whl", "w") as archive:
        archive.writestr("package/data.csv", "wheel")
        archive.writestr("package/other.csv", "other")
    with tarfile.open(tmp_path / "one.tar.gz", "w:gz") as archive:
        entry = tarfile.TarInfo("package-1/docs/data.csv")
        entry.size = 6
        archive.addfile(entry, io.BytesIO(b"source"))
    assert script.member(tmp_path / "one.whl", "/data.csv") == b"wheel"
    assert script.member(tmp_path / "one.tar.gz", "docs/data.csv") == b"source"
    with pytest.raises(ValueError, match="unpack"):
        script.member(tmp_path / "one.whl", ".csv")


def test_shares_by_hand():
    """Two encounters of ten draws, one of them chosen or both."""
    names = ("lost", "none", "converged", "refused_1", "inside", "inside_accepted", "rms_error")
    rows = dict(
        zip(names, np.array([[0, 1], [2, 0], [8, 9], [0, 3], [8, 1], [8, 1], [3.0, 8.0]]), strict=True)
    )
    rows |= {"bound": np.array([2.0, 2.0]), "draws": np.array([10, 10])}
    both, second = shares.counted(rows), shares.counted(rows, np.array([False, True]))
    assert (both["encounters"], both["draws"], both["ratio"]) == (2, 20, 2.75)
    assert (both["lost"]["share"], both["none"]["share"]) == (5, 10)
    assert second["refused"]["share"] == pytest.approx(100 / 3)
    assert second["inside_accepted"]["share"] == pytest.approx(100 / 6)
    assert second["inside"]["low"] < 100 / 9 < second["inside"]["high"]


# -- what is stored ------------------------------------------------------------------------------


def test_what_is_stored_says_where_it_is_from():
    told = results.about()
    assert date(2026, 1, 1) < date.fromisoformat(told["date"])
    assert told["seed"] == SEED
    assert {"tmalib", "numpy", "scipy", "pyproj", "python"} <= told["versions"].keys()
    pins = dict(re.findall(r"(?m)^(\w+)==\S+ --hash=sha256:(\w{64})$",
                           (ROOT / "tools/study/archives.txt").read_text(encoding="utf-8")))  # fmt: skip
    assert {name: archive["sha256"] for name, archive in told["archives"].items()} == pins
    assert told["cases"].keys() == CASES.keys()


@pytest.mark.parametrize("name", CASES)
def test_what_is_stored_is_of_the_rules_that_stand_here(name):
    told, case = results.about()["cases"][name], CASES[name]
    assert told["rules"] == asdict(case.rules)
    assert (told["stream"], told["model"]) == (case.stream.number, repr(case.model))


@pytest.mark.parametrize("name", CASES)
def test_stored_counts_add_up(name):
    rows, told, rules = results.read_rows(name), results.about()["cases"][name], CASES[name].rules
    assert len(rows["own"]) == told["encounters"] > 100
    assert len(np.unique(rows["own"])) == told["own"]
    assert len(np.unique(rows["target"])) == told["targets"]
    assert np.all(rows["own"] != rows["target"])
    assert np.all(rows["start"] % rules.step == 0)
    assert np.all(rows["draws"] == rules.draws)
    pairs = np.stack([rows["start"], rows["own"]])
    assert np.unique(pairs, axis=1, return_counts=True)[1].max() <= rules.targets
    for line in ("", "line_"):
        converged, none, lost = (rows[line + key] for key in ("converged", "none", "lost"))
        assert np.all(converged + none <= rows["draws"])
        assert np.all(rows["draws"] - converged - none <= lost), "what nobody finds is not lost"
        assert np.all(rows[line + "refused_1"] <= rows[line + "refused_5"])
        assert np.all(rows[line + "refused_5"] <= converged)
        assert np.all(rows[line + "inside_accepted"] <= rows[line + "inside"])
        assert np.all(rows[line + "inside_accepted"] <= converged - rows[line + "refused_1"])
        assert np.all(np.isnan(rows[line + "rms_error"]) == (converged == 0))
    assert np.all(np.isfinite(rows["bound"]) & (rows["bound"] > 0))
    assert np.all((rules.nearest <= rows["distance"]) & (rows["distance"] <= rules.farthest))
