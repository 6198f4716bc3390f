"""Chapters that are executed only when they must be.

The outputs of a chapter depend on its code cells, on the files of this project that they import (see
`tmalib.judging.code`), on the manifest and ledger of its paper, on the lock file and on Python. A hash of
all these is the chapter's *key*. It is kept in the executed notebook; while the source has the same key its
outputs are those of the executed one, whatever has happened to its prose.
"""

import os
import platform
import shutil
from pathlib import Path

import nbformat

from .code import DATA, PACKAGE, code_of_source, hash_of

KEY = "tmalib_key"  # in the metadata of an executed notebook


def read(path):
    """The notebook in a file."""
    return nbformat.read(path, as_version=4)


def notebooks_in(folder):
    """Notebooks below a folder, by name relative to it, in order."""
    paths = sorted(Path(folder).rglob("*.ipynb"))
    return {p.relative_to(folder).as_posix(): p for p in paths if ".ipynb_checkpoints" not in p.parts}


def code_cells(notebook):
    """The sources of the code cells."""
    return [cell.source for cell in notebook.cells if cell.cell_type == "code"]


def key_of(path, lock):
    """What the outputs of the notebook in ``path`` depend on, as a hash; ``lock`` is the lock file."""
    sources = code_cells(read(path))
    files = code_of_source("\n".join(sources)) | {Path(lock)}
    own = PACKAGE / "papers" / Path(path).parent.name
    files |= {file for file in own.glob("*") if file.suffix in DATA}
    return hash_of(files, platform.python_version(), *sources)


def stale(sources, executed, lock):
    """Names of the notebooks below ``sources`` whose outputs below ``executed`` are missing or too old."""
    done = notebooks_in(executed)
    return [
        name
        for name, path in notebooks_in(sources).items()
        if name not in done or read(done[name]).metadata.get(KEY) != key_of(path, lock)
    ]


def prepare(sources, executed, scratch, lock):
    """Copy the stale notebooks to an empty folder ``scratch``, for execution; returns their names."""
    shutil.rmtree(scratch, ignore_errors=True)
    names = stale(sources, executed, lock)
    for name in names:
        notebook = read(Path(sources) / name)
        notebook.metadata[KEY] = key_of(Path(sources) / name, lock)
        write(notebook, Path(scratch) / name)
    return names


def keep(sources, executed, scratch):
    """Take over what was executed in ``scratch``, and bring all prose up to date.

    Returns
    -------
    list of str
        What is wrong, a text each: a notebook that did not run to its end, wrote to stderr, or changed its
        source meanwhile. Such a notebook is not taken over.
    """
    found = []
    for name, path in notebooks_in(scratch).items():
        complaint = _complaint(read(path))
        if complaint:
            found.append(f"{name} {complaint}")
        else:
            (Path(executed) / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(path, Path(executed) / name)
    known = notebooks_in(sources)
    for name, path in notebooks_in(executed).items():
        if name not in known:
            path.unlink()
        elif not _weave(known[name], path):
            found.append(f"{name} has changed its code since it was executed")
    return found + [f"{name} was not executed" for name in known if not (Path(executed) / name).is_file()]


def _complaint(notebook):
    """Why an executed notebook cannot be used, or None."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    outputs = [output for cell in cells for output in cell.outputs]
    if any(o.output_type == "error" for o in outputs) or any(
        cell.source.strip() and cell.execution_count is None for cell in cells
    ):
        return "did not run to its end"
    written = [o.text for o in outputs if o.output_type == "stream" and o.name == "stderr"]
    return f"wrote to stderr:\n{written[0]}" if written else None


def _weave(source_path, executed_path):
    """Give the executed notebook the prose and metadata of its source; False if the code differs."""
    source, executed = read(source_path), read(executed_path)
    if code_cells(source) != code_cells(executed):
        return False
    done = iter([cell for cell in executed.cells if cell.cell_type == "code"])
    for cell in source.cells:
        if cell.cell_type == "code":
            run = next(done)
            cell.outputs, cell.execution_count = run.outputs, run.execution_count
    source.metadata[KEY] = executed.metadata[KEY]
    write(source, executed_path)
    return True


def write(notebook, path):
    """Write a notebook at once, so that no half of one is ever found."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(".tmp")
    nbformat.write(notebook, temporary)
    temporary.replace(path)


def fill_cache(executed, cache):
    """A fresh jupyter-cache with all executed notebooks, from which the book takes every output."""
    from jupyter_cache import get_cache
    from jupyter_cache.base import CacheBundleIn

    fresh = Path(cache).with_suffix(".tmp")
    shutil.rmtree(fresh, ignore_errors=True)
    store = get_cache(str(fresh))
    for name, path in notebooks_in(executed).items():
        store.cache_notebook_bundle(CacheBundleIn(read(path), name), check_validity=False, overwrite=True)
    shutil.rmtree(cache, ignore_errors=True)
    fresh.rename(cache)
