"""Functions and classes in the reference say which tests use them, with links to the tests, shown as source.

A test uses what it names, under any name that it has imported it by.
"""

import ast
import importlib
import inspect
import posixpath
from functools import cache
from pathlib import Path

from ..code import PACKAGE

TESTS = PACKAGE.parent / "tests"
MOST = 5  # tests that are named; the others are counted


def imported(tree):
    """The names that a file imports from this project: what each stands for, a dotted path."""
    found = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = {alias.asname or alias.name.partition(".")[0]: alias for alias in node.names}
            found |= {name: a.name if a.asname else name for name, a in names.items()}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {a.asname or a.name: f"{node.module}.{a.name}" for a in node.names}
    return {name: path for name, path in found.items() if path.partition(".")[0] == PACKAGE.name}


def place_of(path):
    """Where what a dotted path leads to is defined: its full name; None unless it is a function or class.

    Examples
    --------
    >>> place_of("tmalib.fit"), place_of("tmalib.ghosts.family")
    ('tmalib.batch.fit', None)
    >>> place_of("tmalib.Scenario.between")
    'tmalib.scenario.Scenario'
    """
    module, *names = path.split(".")
    found = importlib.import_module(module)
    for name in names:
        if not inspect.ismodule(found):
            break
        if not hasattr(found, name):
            try:
                importlib.import_module(f"{found.__name__}.{name}")
            except ImportError:  # a name of the test's own hides that of the import
                return None
        found = getattr(found, name)
    return f"{found.__module__}.{found.__qualname__}" if hasattr(found, "__qualname__") else None


def uses(source):
    """What a text of Python uses of this project, by full name: the lines, in order."""
    tree = ast.parse(source)
    names, found = imported(tree), {}
    inner = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute | ast.Name) and id(node) not in inner:
            root, _, rest = dotted(node).partition(".")
            if root in names and (place := place_of(f"{names[root]}.{rest}".rstrip("."))):
                found.setdefault(place, []).append(node.lineno)
    return {place: sorted(lines) for place, lines in found.items()}


def dotted(node):
    """``a.b.c`` of an attribute of a name; an empty text for an attribute of anything else."""
    if isinstance(node, ast.Attribute):
        before = dotted(node.value)
        return before and f"{before}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


@cache
def files():
    """The tests, by their path below the folder of tests: source, and what they use."""
    paths = sorted(path for path in TESTS.rglob("*.py") if path.name.startswith("test_"))
    texts = {path.relative_to(TESTS).as_posix(): path.read_text("utf-8") for path in paths}
    return {name: (text, uses(text)) for name, text in texts.items()}


def files_using(place):
    """The tests that use a function or class, those with the most uses first: ``(file, lines)``."""
    found = [(name, used[place]) for name, (_, used) in files().items() if place in used]
    return sorted(found, key=lambda each: -len(each[1]))


def add_tests(app, what, name, obj, options, lines):
    """The last line of an entry of the reference; its example is a test as well."""
    if app.builder.name != "html" or what not in ("function", "class"):
        return
    folder, found = posixpath.dirname(app.env.docname), files_using(name)
    pages = [posixpath.relpath(f"{page_of(file)}.html#line-{at[0]}", folder) for file, at in found[:MOST]]
    named = [f"`{file} <{page}>`__" for (file, _), page in zip(found, pages, strict=False)]
    if any(line.lstrip().startswith(">>>") for line in lines):
        named.insert(0, "the example above")
    if named:
        more = f" and {len(found) - MOST} more files" if len(found) > MOST else ""
        lines += ["", f"Tests: {', '.join(named)}{more}.", ""]


def page_of(file):
    return f"_tests/{Path(file).with_suffix('')}"


def pages(app):
    """A page for every test, its source with an anchor a line."""
    for file, (text, _) in files().items() if app.builder.name == "html" else ():
        source = app.builder.highlighter.highlight_block(text, "python", linespans="line")
        title = f"tests/{file}"
        yield page_of(file), {"title": title, "body": f"<h1>{title}</h1>{source}"}, "page.html"
