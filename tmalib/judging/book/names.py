"""Names of the library in sentences are links to the reference: ``tma.fit``, ``find_ghosts``.

Those in code cells are linked by sphinx-codeautolink, which reads a chapter's cells as one program.
"""

import importlib
import inspect
import re

from docutils import nodes
from sphinx import addnodes

import tmalib

from ..code import import_graph
from .ledger import is_inside

NAME = re.compile(r"(tma\.|tmalib\.)?([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)(?:\([^()]*\))?")


def full_name(text):
    """Kind and place of what a literal names in the reference, ``(role, name)``; None if that is nothing."""
    match = NAME.fullmatch(text)
    if not match or not (match[1] or match[2].split(".")[0] in tmalib.__all__):
        return None
    owner = found = tmalib
    for part in match[2].split("."):
        owner, found = found, getattr(found, part, None) or _module(found, part)
    if inspect.ismodule(found):
        return "mod", found.__name__
    if inspect.isclass(owner) and not callable(found):  # a field is described with its class
        found = owner
    if not callable(found) or not str(found.__module__).startswith("tmalib."):
        return None
    return "obj", f"{found.__module__}.{found.__qualname__}"


def _module(package, name):
    try:
        return importlib.import_module(f"{package.__name__}.{name}")
    except (ImportError, AttributeError):
        return None


def link_names(app, doctree):
    """Make links of literals that are a name, outside the reference itself, titles and links."""
    if app.env.docname.startswith("book/api"):
        return
    for literal in list(doctree.findall(nodes.literal)):
        found = full_name(literal.astext())
        if found and not is_inside(literal, (nodes.reference, addnodes.pending_xref, nodes.title)):
            target = dict(refdomain="py", reftype=found[0], reftarget=found[1], refexplicit=True)
            xref = addnodes.pending_xref("", literal.deepcopy(), refdoc=app.env.docname, **target)
            literal.replace_self(xref)


def hidden_modules():
    """Modules that a function of their package hides, which has their name: where it stands in the reference.

    Examples
    --------
    >>> hidden_modules()["tmalib.sensitivity.response"]
    'tmalib.sensitivity.response.response'
    """
    found = {}
    for module in sorted(import_graph().modules):
        package, _, name = module.rpartition(".")
        hiding = getattr(importlib.import_module(package), name, None) if package else None
        if inspect.isroutine(hiding) or inspect.isclass(hiding):
            found[module] = f"{hiding.__module__}.{hiding.__qualname__}"
    return found


def name_in_code(app, config):
    """In code, a name that a function and a module share means the function, as in Python."""
    config.codeautolink_inventory_map.update(hidden_modules())
