"""Chapters that are executed only when they must be.

The outputs of a chapter depend on its code cells, on the files of this project that they import (see
`tmalib.judging.code`), on the manifest and ledger of its paper, on the lock file and on Python. A hash of all
these is the chapter's *key*. It is kept in the executed notebook; while the source has the same key its
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


def write(notebook, path):
    """Write a notebook at once, so that no half of one is ever found."""
    path.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook, path.with_suffix(".tmp"))
    path.with_suffix(".tmp").replace(path)


def notebooks_in(folder):
    """Notebooks below a folder, by name relative to it, in order."""
    paths = sorted(Path(folder).rglob("*.ipynb"))
    return {p.relative_to(folder).as_posix(): p for p in paths if ".ipynb_checkpoints" not in p.parts}


def code_cells(notebook):
    """The code cells."""
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def key_of(path, lock):
    """What the outputs of the notebook in ``path`` depend on, as a hash; ``lock`` is the lock file."""
    sources = [cell.source for cell in code_cells(read(path))]
    own = (PACKAGE / "papers" / path.parent.name).glob("*")
    files = {Path(lock), *code_of_source("\n".join(sources)), *(file for file in own if file.suffix in DATA)}
    return hash_of(files, platform.python_version(), *sources)


def prepare(sources, executed, scratch, lock):
    """Copy the notebooks whose outputs are missing or too old to an empty ``scratch``; returns which."""
    shutil.rmtree(scratch, ignore_errors=True)
    done, stale = notebooks_in(executed), []
    for name, path in notebooks_in(sources).items():
        key = key_of(path, lock)
        if name not in done or read(done[name]).metadata.get(KEY) != key:
            notebook = read(path)
            notebook.metadata[KEY] = key
            write(notebook, Path(scratch) / name)
            stale.append(name)
    return stale


def keep(sources, executed, scratch):
    """Take over what was executed in ``scratch``, and bring all prose up to date.

    Returns what is wrong, a text each. A notebook that did not run to its end or wrote to stderr is not taken
    over; nor is one whose code has changed meanwhile.
    """
    found, known = [], notebooks_in(sources)
    for name, path in notebooks_in(scratch).items():
        if complaint := _complaint(read(path)):
            found.append(f"{name} {complaint}")
        else:
            (Path(executed) / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(path, Path(executed) / name)
    for name, path in notebooks_in(executed).items():
        if name not in known:
            path.unlink()
        elif not _weave(known[name], path):
            found.append(f"{name} has changed its code since it was executed")
    return found + [f"{name} was not executed" for name in known if not (Path(executed) / name).is_file()]


def _complaint(notebook):
    """Why an executed notebook cannot be used, or None."""
    cells = [cell for cell in code_cells(notebook) if cell.source.strip()]
    outputs = [output for cell in cells for output in cell.outputs]
    if any(o.output_type == "error" for o in outputs) or any(cell.execution_count is None for cell in cells):
        return "did not run to its end"
    written = [o.text for o in outputs if o.output_type == "stream" and o.name == "stderr"]
    return f"wrote to stderr:\n{written[0]}" if written else None


def _weave(source_path, executed_path):
    """Give the executed notebook the prose and metadata of its source; False if the code differs."""
    source, executed = read(source_path), read(executed_path)
    cells, done = code_cells(source), code_cells(executed)
    if [cell.source for cell in cells] != [cell.source for cell in done]:
        return False
    for cell, run in zip(cells, done, strict=True):
        cell.outputs, cell.execution_count = run.outputs, run.execution_count
    source.metadata[KEY] = executed.metadata[KEY]
    write(source, executed_path)
    return True


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
