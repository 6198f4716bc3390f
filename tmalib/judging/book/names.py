"""Names of the library in sentences are links to the reference: ``tma.fit``, ``find_ghosts``."""

import importlib
import inspect
import re

from docutils import nodes
from sphinx import addnodes

import tmalib

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
