"""The tool that measures how long chapters take: its groups, and what it reads of a report."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
REPORT = """<testsuites><testsuite>
<testcase classname="build.executing.conical_angles.theorem_2.ipynb" name="x" time="3.25">{}</testcase>
<testcase classname="build.executing.use.speed.ipynb" name="y" time="0.5"/>
</testsuite></testsuites>"""


@pytest.fixture
def times(monkeypatch):
    monkeypatch.chdir(ROOT)
    spec = importlib.util.spec_from_file_location("times", ROOT / "tools/times.py")
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_every_chapter_is_in_one_group(times):
    folders = [name for group in times.groups().values() for name in group]
    assert sorted(folders) == sorted(
        p.name for p in (ROOT / "notebooks").iterdir() if p.is_dir() and p.name[0] != "."
    )


def test_times_by_name(times, tmp_path):
    (tmp_path / "x.xml").write_text(REPORT.format(""))
    assert times.times_in(tmp_path / "x.xml") == {"conical_angles/theorem_2": 3.25, "use/speed": 0.5}


def test_a_chapter_that_failed_has_no_time(times, tmp_path):
    (tmp_path / "x.xml").write_text(REPORT.format("<failure>no</failure>"))
    with pytest.raises(ValueError, match="theorem_2"):
        times.times_in(tmp_path / "x.xml")
