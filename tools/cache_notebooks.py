"""Hand the executed notebooks to the book.

Usage: cache_notebooks.py EXECUTED CACHE

Refuses a notebook that wrote to stderr (nbmake does not look at it), drops nbmake's timings, which would
change the cache's key, and fills a fresh jupyter-cache, from which the book takes every output.
"""

import shutil
import sys
from pathlib import Path

import nbformat
from jupyter_cache import get_cache
from jupyter_cache.base import CacheBundleIn


def stderr(notebook: nbformat.NotebookNode) -> list[str]:
    """What the cells wrote to stderr, a text a cell."""
    outputs = [o for cell in notebook.cells for o in cell.get("outputs", [])]
    return [o.text for o in outputs if o.output_type == "stream" and o.name == "stderr"]


def main(executed: Path, cache: Path) -> None:
    fresh = cache.with_name(cache.name + ".tmp")
    shutil.rmtree(fresh, ignore_errors=True)
    bundles, complaints = [], []
    for path in sorted(executed.rglob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        name = path.relative_to(executed)
        complaints += [f"{name} wrote to stderr:\n{text}" for text in stderr(notebook)]
        for cell in notebook.cells:
            cell.metadata.pop("execution", None)
        nbformat.write(notebook, path)
        bundles.append(CacheBundleIn(notebook, str(name)))
    if complaints:
        sys.exit("\n".join(complaints))
    store = get_cache(str(fresh))
    for bundle in bundles:
        store.cache_notebook_bundle(bundle, check_validity=False, overwrite=True)
    shutil.rmtree(cache, ignore_errors=True)
    fresh.rename(cache)
    print(f"{len(bundles)} notebooks in {cache}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
