"""The study with recorded tracks: from downloaded archives to the tables in tmalib/study, for `make study`.

Usage: study.py FOLDER, with the archives of tools/study/archives.txt
The archives are unpacked, nothing in them is imported.
"""

import hashlib
import platform
import sys
import tarfile
import zipfile
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from tmalib.montecarlo import SEED
from tmalib.study import peer, results
from tmalib.study.cases import CASES


def member(path: Path, ending: str) -> bytes:
    """The one file of an archive, a wheel or a source archive, whose name ends so."""
    if path.suffix == ".whl":
        with zipfile.ZipFile(path) as archive:
            (name,) = (name for name in archive.namelist() if name.endswith(ending))
            return archive.read(name)
    with tarfile.open(path) as archive:
        (name,) = (name for name in archive.getnames() if name.endswith(ending))
        return archive.extractfile(name).read()


def main(folder: Path) -> None:
    told = {
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "seed": SEED,
        "versions": {name: version(name) for name in ("tmalib", "numpy", "scipy", "pyproj")}
        | {"python": platform.python_version()},
        "lines": peer.counted_lines(Path(__file__).parent / "study"),
        "archives": {},
        "cases": {},
    }
    for name, case in CASES.items():
        (path,) = folder.glob(f"{case.sample.archive}*")
        tracks = case.sample.read(member(path, case.sample.member))
        rows, about = results.run_case(case, tracks)
        results.write_rows(results.FOLDER / f"{name}.csv", rows)
        key = case.sample.archive.rstrip("-")
        told["archives"][key] = {
            "file": path.name,
            "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            "member": case.sample.member,
        }
        told["cases"][name] = about
        print(f"{name}: {about['encounters']} encounters, {about['jumps']} fixes left out")
    text = "# written by `make study`; see tmalib/study/results.py\n" + results.as_toml(told) + "\n"
    (results.FOLDER / "study.toml").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
