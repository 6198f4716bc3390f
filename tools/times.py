"""How long the chapters take from nothing, for `make times`, which has prepared all without stored runs.

Usage: times.py WORKERS, from the root of the repository

Executes them in build/executing: the papers' first, then those beyond them, then the others; runs that one
stores the later ones find. Writes tmalib/speed/chapters.json.
"""

import json
import subprocess
import sys
import time
from datetime import date
from pathlib import Path
from xml.etree import ElementTree

from tmalib.judging import read_papers
from tmalib.speed import processor

FOLDER, TARGET = Path("build/executing"), Path("tmalib/speed/chapters.json")


def groups() -> dict[str, list[str]]:
    """Folders of notebooks, by group."""
    papers = [paper.folder.name for paper in read_papers().values()]
    others = sorted(path.name for path in Path("notebooks").iterdir() if any(path.glob("*.ipynb")))
    return {
        "papers": papers,
        "beyond": [name for name in others if name == "beyond"],
        "others": [name for name in others if name not in (*papers, "beyond")],
    }


def times_in(report: Path) -> dict[str, float]:
    """Seconds of each notebook, by name, from pytest's report; `ValueError` for one that failed."""
    cases = list(ElementTree.parse(report).iter("testcase"))
    if failed := [case.get("classname", "") for case in cases if len(case)]:
        raise ValueError(f"these chapters failed: {failed}")
    return {case.get("classname", "").split("executing.")[-1].removesuffix(".ipynb").replace(".", "/"):
            float(case.get("time", "nan")) for case in cases}  # fmt: skip


def main(workers: str) -> None:
    found = {}
    for name, folders in groups().items():
        report, begin = Path(f"build/{name}.xml"), time.perf_counter()
        command = [
            "-m",
            "pytest",
            "-q",
            "--nbmake",
            "--nbmake-timeout=900",
            "-n",
            workers,
            "--dist",
            "worksteal",
        ]
        command += ["-p", "no:cacheprovider", "-W", "default", f"--junitxml={report}"]
        places = [str(FOLDER / folder) for folder in folders]
        subprocess.run([sys.executable, *command, *places], check=True)
        found[name] = {"seconds": round(time.perf_counter() - begin, 1), "chapters": times_in(report)}
    about = {"date": date.today().isoformat(), "processor": processor(), "workers": int(workers)}
    TARGET.write_text(json.dumps(about | {"groups": found}, indent=1) + "\n", encoding="utf-8")
    print(*(f"{name}: {group['seconds']:.0f} s" for name, group in found.items()), sep="\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
