"""The wheel: the library and the papers' scenarios, not the book's machinery; it works alone."""

import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import tmalib as tma

ROOT = Path(__file__).parent.parent
PROGRAM = """
import sys
import numpy as np
import tmalib as tma
from tmalib.papers.conical_angles import scenarios as conical
from tmalib.papers.emw_acoustic import scenarios as emw
from tmalib.papers.robustness import scenarios as paper
assert tma.__file__.startswith({folder!r}), tma.__file__
found = [tma.crlb_sigma(s)[0] for s in (emw.scenario(1), conical.section_4_2(), paper.reference().straight)]
assert not {{"matplotlib", "myst_nb", "grimp"}} & sys.modules.keys()
print(*map(float, found))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The files of the wheel, unpacked, and its metadata."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder / "site")
    (metadata,) = (folder / "site").glob("*.dist-info/METADATA")
    return folder / "site", metadata.read_text(encoding="utf-8")


def test_what_is_in_it(wheel):
    site, _ = wheel
    names = {path.relative_to(site / "tmalib").as_posix() for path in (site / "tmalib").rglob("*.*")}
    source = {path.relative_to(ROOT / "tmalib").as_posix() for path in (ROOT / "tmalib").rglob("*.py")}
    numeric = {
        name
        for name in source
        if not name.startswith(("papers/", "judging/", "study/", "speed/", "conformance/", "beyond/"))
    }
    papers = {
        name
        for name in source
        if name.startswith("papers/") and name.endswith(("scenarios.py", "__init__.py"))
    }
    assert names == numeric | papers | {"samples/bearings.csv", "samples/ownship.csv", "py.typed"}


def test_it_works_alone(wheel):
    site, _ = wheel
    program = PROGRAM.format(folder=str(site))
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=site,
        env={"PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert all(float(word) > 0 for word in done.stdout.split())


def test_the_command_is_in_it(wheel):
    site, _ = wheel
    (entries,) = site.glob("*.dist-info/entry_points.txt")
    assert "[console_scripts]\ntmalib = tmalib.command:main\n" in entries.read_text(encoding="utf-8")
    command = [sys.executable, "-m", "tmalib", "fit", "--help"]
    done = subprocess.run(command, cwd=site, env={"PYTHONPATH": str(site)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "usage: tmalib fit" in done.stdout


def test_version_and_requirements_are_said_once(wheel):
    _, metadata = wheel
    assert f"\nVersion: {tma.__version__}\n" in metadata
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert "version" not in project
    for line in project["dependencies"]:
        assert f"\nRequires-Dist: {line}\n" in metadata
        assert ">=" in line
    assert "matplotlib" not in " ".join(project["dependencies"])
