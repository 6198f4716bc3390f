"""Which files of this project a module or a notebook uses, and a hash of them.

Imports are followed in the source, also those inside functions; nothing is executed. A name that a package
only passes on (``tma.fit``) leads to the module that has it. A module brings the data files beside it, so one
of a paper brings manifest and ledger. Comments and layout of Python code do not count.
"""

import ast
import hashlib
from functools import cache
from pathlib import Path

import grimp

PACKAGE = Path(__file__).parent.parent  # the folder of tmalib


@cache
def import_graph():
    """All modules of tmalib and their imports, a `grimp.ImportGraph`."""
    return grimp.build_graph(PACKAGE.name, cache_dir=None)


def data_in(folder):
    """Manifest and ledger, or other data, in a folder; not ``contents.toml``, which only the book reads."""
    files = (path for kind in ("toml", "csv", "json") for path in folder.glob(f"*.{kind}"))
    return [path for path in files if path.name != "contents.toml"]


def code_of_modules(*names):
    """Files that modules of tmalib use, themselves included; names of other modules do not count."""
    modules = {name for name in names if name in import_graph().modules}
    modules |= {used for name in modules for used in import_graph().find_upstream_modules(name)}
    files = {_file_of(name) for name in modules}
    return files.union(*(data_in(file.parent) for file in files))


def _file_of(module):
    path = PACKAGE.parent.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def _is_package(module):
    return module in import_graph().modules and _file_of(module).name == "__init__.py"


@cache
def _passed_on(package):
    """The names that a package's own file imports, each with the module that has it."""
    return {
        alias.asname or alias.name: module_of(".".join(filter(None, (package, node.module))), alias.name)
        for node in ast.parse(_file_of(package).read_text("utf-8")).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def module_of(module, name):
    """The module that ``from module import name`` leads to."""
    if f"{module}.{name}" in import_graph().modules:
        return f"{module}.{name}"
    return _passed_on(module).get(name, module) if _is_package(module) else module


def code_of_source(source):
    """Files that a text of Python uses: modules that it imports, and what it names of packages."""
    tree, packages, found = ast.parse(source), {}, set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            package = getattr(node, "module", None)
            for alias in node.names:
                path = f"{package}.{alias.name}" if package else alias.name
                if _is_package(path):
                    packages[alias.asname or alias.name] = path
                else:
                    found.add(module_of(package, alias.name) if package else path)
    attributes = {id(node.value): node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id in packages:
            found.add(module_of(packages[node.id], attributes.get(id(node), "")))
    return code_of_modules(*found)


def hash_of(files, *texts):
    """A hash of the contents of files, of Python code its syntax tree, and of further texts."""
    contents = {path: path.read_bytes() for path in sorted(files)}
    parts = [ast.dump(ast.parse(text)) if path.suffix == ".py" else text for path, text in contents.items()]
    return hashlib.sha256(repr((parts, texts)).encode()).hexdigest()
