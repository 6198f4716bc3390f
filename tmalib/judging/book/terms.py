"""A word of the glossary is a link where a chapter first uses it, which says on hover what it means."""

import re

from docutils import nodes
from sphinx import addnodes

from .ledger import is_inside

BOXES = (nodes.reference, nodes.admonition, nodes.table, nodes.caption, addnodes.pending_xref)
GLOSSARY = "book/appendix/glossary"


def meanings(env):
    """Words in small letters: where they stand in the glossary, ``(label, meaning)``."""
    if GLOSSARY not in env.found_docs:
        return {}
    found = {}
    for item in env.get_doctree(GLOSSARY).findall(nodes.definition_list_item):
        meaning = item.next_node(nodes.definition).astext()
        for term in item.findall(nodes.term):
            found[term.astext().lower()] = (term["ids"][0], meaning)
    return found


def link_terms(app, doctree, docname):
    """Make the links of a chapter; not in titles, links, captions, code and formulas."""
    if not docname.startswith("notebooks/") or not (left := meanings(app.env)):
        return
    uri = app.builder.get_relative_uri(docname, GLOSSARY)
    for text in list(doctree.findall(nodes.Text)):
        if not left:
            break
        if not isinstance(text.parent, nodes.paragraph) or is_inside(text, BOXES):
            continue
        words = "|".join(sorted(map(re.escape, left), key=len, reverse=True))
        match = re.search(rf"(?<![\w-])({words})s?(?![\w-])", text.astext(), re.IGNORECASE)
        if match:
            label, meaning = left.pop(match[1].lower())
            link = nodes.reference("", match[0], internal=True, refuri=f"{uri}#{label}", reftitle=meaning)
            link["classes"].append("term")
            before, after = text.astext()[: match.start()], text.astext()[match.end() :]
            text.parent.replace(text, [nodes.Text(before), link, nodes.Text(after)])
