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
DATA = (".toml", ".csv")


@cache
def import_graph():
    """All modules of tmalib and their imports, a `grimp.ImportGraph`."""
    return grimp.build_graph(PACKAGE.name, cache_dir=None)


def code_of_modules(*names):
    """Files that modules of tmalib use, themselves included; names of other modules do not count."""
    modules = {name for name in names if name in import_graph().modules}
    modules |= {used for name in modules for used in import_graph().find_upstream_modules(name)}
    return {file for name in modules for file in [_file_of(name), *_data_beside(name)]}


def _file_of(module):
    path = PACKAGE.parent.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def _is_package(module):
    return module in import_graph().modules and _file_of(module).name == "__init__.py"


def _data_beside(module):
    return [file for file in _file_of(module).parent.iterdir() if file.suffix in DATA]


@cache
def _passed_on(package):
    """The names that a package's own file imports, each with the module that has it."""
    nodes = [n for n in ast.parse(_file_of(package).read_text("utf-8")).body if isinstance(n, ast.ImportFrom)]
    found = {}
    for node in nodes:
        module = ".".join(filter(None, (package, node.module)))
        found |= {alias.asname or alias.name: module_of(module, alias.name) for alias in node.names}
    return found


def module_of(module, name):
    """The module that ``from module import name`` leads to."""
    if f"{module}.{name}" in import_graph().modules:
        return f"{module}.{name}"
    return _passed_on(module).get(name, module) if _is_package(module) else module


def code_of_source(source):
    """Files that a text of Python uses: modules that it imports, and what it names of packages."""
    tree, bound, found = ast.parse(source), {}, set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            bound |= {alias.asname or alias.name: alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                module = module_of(node.module, alias.name)
                if module == f"{node.module}.{alias.name}":
                    bound[alias.asname or alias.name] = module
                else:
                    found.add(module)
    packages = {name: module for name, module in bound.items() if _is_package(module)}
    found |= set(bound.values()) - set(packages.values())
    inside = {id(n.value): n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id in packages:
            module = packages[node.id]
            found.add(module_of(module, inside[id(node)]) if id(node) in inside else module)
    return code_of_modules(*found)


def hash_of(files, *texts):
    """A hash of the contents of files, of Python code its syntax tree, and of further texts."""
    digest = hashlib.sha256()
    for part in [*map(_content, sorted(files)), *(text.encode() for text in texts)]:
        digest.update(len(part).to_bytes(8))
        digest.update(part)
    return digest.hexdigest()


def _content(path):
    content = path.read_bytes()
    return ast.dump(ast.parse(content)).encode() if path.suffix == ".py" else content
