"""Find out where every figure and judged table comes from, by reading the notebooks' code.

Usage: trace_notebooks.py EXECUTED PROVENANCE_JSON

For each figure (a cell with the metadata `mystnb.figure.name`) and each judged table (a cell whose output
carries claims) the statements it depends on are followed backwards through the notebook. What they call of
`tmalib`, and the random streams that they name, is its provenance. Nothing is executed and nothing typed by
hand; a statement that may matter is taken to matter.
"""

import ast
import inspect
import json
import re
import sys
import textwrap
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import nbformat

from tmalib.montecarlo import SEED, STREAMS

MIMETYPE = "application/vnd.tmalib.claims+json"
DRAWING = "tmalib.figures."  # style and colours: they make no number

VALUE_FIRST = {  # the fields of these nodes as Python evaluates them, not as it writes them
    ast.Assign: ("value", "targets"),
    ast.NamedExpr: ("value", "target"),
    ast.For: ("iter", "target", "body", "orelse"),
    ast.comprehension: ("iter", "target", "ifs"),
    ast.ListComp: ("generators", "elt"),
    ast.SetComp: ("generators", "elt"),
    ast.GeneratorExp: ("generators", "elt"),
    ast.DictComp: ("generators", "key", "value"),
}


@dataclass
class Statement:
    """A top-level statement: the names it needs, those it binds or changes, those it binds anew."""

    cell: int
    tree: ast.stmt
    needs: set
    binds: set
    replaces: set


def root(node):
    """The name at the root of ``a``, ``a.b``, ``a[...]``, or None."""
    while isinstance(node, ast.Attribute | ast.Subscript | ast.Starred):
        node = node.value
    return node.id if isinstance(node, ast.Name) else None


def in_order(node):
    """All nodes below one, a value before the name it is given to."""
    for name in VALUE_FIRST.get(type(node), node._fields):
        children = getattr(node, name)
        for child in children if isinstance(children, list) else [children]:
            if isinstance(child, ast.AST):
                yield from in_order(child)
    yield node


def statement(cell, tree):
    nodes = list(in_order(tree))
    names = [n for n in nodes if isinstance(n, ast.Name)]
    first = {n.id: n for n in reversed(names)}.values()
    needs = {n.id for n in first if isinstance(n.ctx, ast.Load)}
    binds = {n.id for n in names if isinstance(n.ctx, ast.Store)}
    # x[k] = ..., x.y = ..., x += ... and, as in x.append(...), a method called for its effect.
    stored = (ast.Attribute, ast.Subscript)
    binds |= {root(n) for n in nodes if isinstance(n, stored) and isinstance(n.ctx, ast.Store)}
    effects = [n.value.func for n in nodes if isinstance(n, ast.Expr) and isinstance(n.value, ast.Call)]
    binds |= {root(f) for f in effects if isinstance(f, ast.Attribute)}
    needs |= {root(n.target) for n in nodes if isinstance(n, ast.AugAssign)}
    # The variables of loops and functions stay there.
    loops = [n.target for n in nodes if isinstance(n, ast.For | ast.comprehension)]
    local = {n.id for target in loops for n in ast.walk(target) if isinstance(n, ast.Name)}
    local |= {n.arg for n in nodes if isinstance(n, ast.arg)}
    if isinstance(tree, ast.FunctionDef | ast.ClassDef):
        local |= binds
    needs, binds = needs - local, binds - local
    if isinstance(tree, ast.FunctionDef | ast.ClassDef):
        binds = {tree.name}
    plain = isinstance(tree, ast.Assign) and all(isinstance(t, ast.Name) for t in tree.targets)
    replaces = {t.id for t in tree.targets} if plain else set()
    return Statement(cell, tree, needs, (binds | replaces) - {None}, replaces)


def statements(notebook):
    return [
        statement(index, tree)
        for index, cell in enumerate(notebook.cells)
        if cell.cell_type == "code"
        for tree in ast.parse(cell.source).body
    ]


def imports(found):
    """Names that stand for modules or their members: ``{"tma": "tmalib", "claims": "tmalib.claims"}``."""
    names = {}
    for s in found:
        if isinstance(s.tree, ast.Import):
            names |= {a.asname or a.name: a.name for a in s.tree.names}
        elif isinstance(s.tree, ast.ImportFrom):
            names |= {a.asname or a.name: f"{s.tree.module}.{a.name}" for a in s.tree.names}
    return names


def depends_on(found, cell, modules):
    """The statements that the cell's own statements depend on, those included."""
    wanted, used = set(), []
    for s in reversed([s for s in found if s.cell <= cell]):
        if s.cell == cell or s.binds & wanted:
            wanted = (wanted - s.replaces) | (s.needs - modules)
            used.append(s)
    return used[::-1]


def resolve(node, modules):
    """Full name of an attribute chain that starts at an import, ``tma.fit`` -> ``tmalib.fit``, or None."""
    parts = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name) or node.id not in modules:
        return None
    return ".".join([modules[node.id], *reversed(parts)])


def look_up(name):
    """The object with this full name, or None if there is none."""
    parts = name.split(".")
    for split in range(len(parts), 0, -1):
        try:
            value = import_module(".".join(parts[:split]))
        except ModuleNotFoundError:
            continue
        for part in parts[split:]:
            value = getattr(value, part, None)
        return value
    return None


def has_source(value):
    """Whether this is a function, method or class written in Python."""
    value = inspect.unwrap(value) if callable(value) else value
    return inspect.isfunction(value) or inspect.ismethod(value) or inspect.isclass(value)


def functions(used, modules):
    """The functions and classes of tmalib that the statements name, in order of appearance."""
    nodes = [n for s in used for n in ast.walk(s.tree) if isinstance(n, ast.Attribute | ast.Name)]
    names = dict.fromkeys(filter(None, (resolve(n, modules) for n in nodes)))
    return [
        n for n in names if n.startswith("tmalib.") and not n.startswith(DRAWING) and has_source(look_up(n))
    ]


def streams(used, modules):
    """The named random streams: texts, f-strings (any number fits a gap), constants of tmalib, and the texts
    in the source of the functions called."""
    found = set()
    for node in (n for s in used for n in ast.walk(s.tree)):
        if isinstance(node, ast.Constant) and node.value in STREAMS:
            found.add(node.value)
        elif isinstance(node, ast.JoinedStr):
            parts = [re.escape(p.value) if isinstance(p, ast.Constant) else r"\d+" for p in node.values]
            found |= {name for name in STREAMS if re.fullmatch("".join(parts), name)}
        elif isinstance(node, ast.Attribute) and (name := resolve(node, modules)):
            value = look_up(name)
            found |= {value} if isinstance(value, str) and value in STREAMS else set()
    sources = [inspect.getsource(look_up(name)) for name in functions(used, modules)]
    nodes = [n for source in sources for n in ast.walk(ast.parse(textwrap.dedent(source)))]
    found |= {n.value for n in nodes if isinstance(n, ast.Constant) and n.value in STREAMS}
    return sorted(found, key=STREAMS.get)


def computing_cell(used, cell):
    """The cell that computes what a cell without a computation of its own only shows."""
    own = [s for s in used if s.cell == cell]
    if any(s.binds for s in own):
        return cell
    return max((s.cell for s in used if s.cell < cell and s.binds & own[-1].needs), default=cell)


def trace(path, name):
    """Provenance of the figures and tables of one notebook; ``name`` is its path in the repository."""
    notebook = nbformat.read(path, as_version=4)
    found = statements(notebook)
    modules = imports(found)
    for index, cell in enumerate(notebook.cells):
        figure = cell.metadata.get("mystnb", {}).get("figure", {}).get("name")
        claims = [c for o in cell.get("outputs", []) for c in o.get("data", {}).get(MIMETYPE, [])]
        tables = sorted({(c["paper"], c["table"]) for c in claims})
        for what in ([{"figure": figure}] if figure else []) + [{"paper": p, "table": t} for p, t in tables]:
            used = depends_on(found, index, modules.keys())
            names = streams(used, modules)
            yield {
                **what,
                "notebook": name,
                "cell": computing_cell(used, index) if tables else index,
                "functions": functions(used, modules),
                "streams": names,
                "seed": SEED if names else None,
            }


def main(executed: Path, target: Path) -> None:
    paths = sorted(executed.rglob("*.ipynb"))
    rows = [row for path in paths for row in trace(path, path.relative_to(executed).as_posix())]
    target.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    print(f"{len(rows)} figures and tables traced in {len(paths)} notebooks")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
