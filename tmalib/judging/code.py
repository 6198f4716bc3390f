"""Which files of this project a module or a notebook uses, and a hash of them.

Imports are followed in the source, also those inside functions; nothing is executed. A module brings the data
files beside it, so a module of a paper brings manifest and ledger.
"""

import ast
import hashlib
from functools import cache
from pathlib import Path

import grimp

PACKAGE = Path(__file__).parent.parent  # the folder of tmalib
DATA = (".toml", ".csv")


@cache
def import_graph():
    """All modules of tmalib and their imports, a `grimp.ImportGraph`."""
    return grimp.build_graph(PACKAGE.name, cache_dir=None)


def code_of_modules(*names):
    """Files that modules of tmalib use, themselves included; names of other modules do not count."""
    modules = {name for name in names if name in import_graph().modules}
    modules |= {used for name in modules for used in import_graph().find_upstream_modules(name)}
    return {file for name in modules for file in _files_of(name)}


def _files_of(module):
    path = PACKAGE.parent.joinpath(*module.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return [path, *(file for file in path.parent.iterdir() if file.suffix in DATA)]


def code_of_source(source):
    """Files that a text of Python uses, by its imports."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            members = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= {member if member in import_graph().modules else node.module for member in members}
    return code_of_modules(*names)


def hash_of(files, *texts):
    """A hash of the contents of files and of further texts."""
    digest = hashlib.sha256()
    for part in [*(path.read_bytes() for path in sorted(files)), *(text.encode() for text in texts)]:
        digest.update(len(part).to_bytes(8))
        digest.update(part)
    return digest.hexdigest()
