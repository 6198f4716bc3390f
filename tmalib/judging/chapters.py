"""Chapters that are executed only when they must be.

The outputs of a chapter depend on its code cells, on the files of this project that they import (see
`tmalib.judging.code`), on the manifest and ledger of its paper, on the lock file and on Python. A hash of all
these, its *key*, is kept in the executed notebook; while it is the same so are the outputs, not the prose.
"""

import platform
import shutil
from pathlib import Path

import nbformat

from .code import PACKAGE, code_of_source, data_in, hash_of

KEY = "tmalib_key"  # in the metadata of an executed notebook


def read(path):
    """The notebook in a file."""
    return nbformat.read(path, as_version=4)


def write(notebook, path):
    """Write a notebook at once, so that no half of one is ever found."""
    path.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook, path.with_suffix(".tmp"))
    path.with_suffix(".tmp").replace(path)


def notebooks_in(folder):
    """Notebooks below a folder, by name relative to it, in order."""
    paths = sorted(Path(folder).rglob("*.ipynb"))
    return {p.relative_to(folder).as_posix(): p for p in paths if ".ipynb_checkpoints" not in p.parts}


def prepare(sources, executed, scratch, lock):
    """Copy the notebooks whose outputs are missing or too old to an empty ``scratch``; returns which."""
    shutil.rmtree(scratch, ignore_errors=True)
    stale = list(keep(sources, executed, scratch, lock))
    for name in stale:
        write(_with_key(Path(sources) / name, lock), Path(scratch) / name)
    return stale


def keep(sources, executed, scratch, lock):
    """Take over the outputs of what was executed in ``scratch``, and bring all prose up to date.

    Returns why of a notebook nothing could be taken over: it was not executed or not to its end, it wrote to
    stderr, or its code, or what that depends on, has changed meanwhile.
    """
    done, wrong = notebooks_in(executed) | notebooks_in(scratch), {}
    for name, path in notebooks_in(sources).items():
        notebook = _with_key(path, lock)
        made = read(done.pop(name)) if name in done else None
        if complaint := _complaint(made, notebook):
            wrong[name] = complaint
        else:
            for cell, run in zip(_code_cells(notebook), _code_cells(made), strict=True):
                cell.outputs, cell.execution_count = run.outputs, run.execution_count
            write(notebook, Path(executed) / name)
    for path in done.values():
        path.unlink()
    return wrong


def _code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def _with_key(path, lock):
    """The notebook in a file, with its key."""
    notebook = read(path)
    code = [cell.source for cell in _code_cells(notebook)]
    files = {Path(lock), *code_of_source("\n".join(code)), *data_in(PACKAGE / "papers" / path.parent.name)}
    notebook.metadata[KEY] = hash_of(files, platform.python_version(), *code)
    return notebook


def _complaint(executed, source):
    """Why an executed notebook cannot be used for its source, or None."""
    if executed is None:
        return "was not executed"
    if executed.metadata.get(KEY) != source.metadata[KEY]:
        return "has changed its code since it was executed"
    cells = [cell for cell in _code_cells(executed) if cell.source.strip()]
    outputs = [output for cell in cells for output in cell.outputs]
    if any(o.output_type == "error" for o in outputs) or any(cell.execution_count is None for cell in cells):
        return "did not run to its end"
    written = [o.text for o in outputs if o.output_type == "stream" and o.name == "stderr"]
    return f"wrote to stderr:\n{written[0]}" if written else None
