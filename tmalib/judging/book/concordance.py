"""From a paper to the book and back, made from the papers' contents.

``{concordance} paper`` lists what the sections of a paper hold: every item with its places in the book, its
errata and its verdicts. A box at the head of a chapter says what of the paper it treats, with links to the
concordance; theorems, tables and figures are entries of the index, where the search finds them.
"""

from collections import Counter
from itertools import groupby

from docutils import nodes
from sphinx import addnodes

from ..paper import read_papers
from ..statements import TABLE as STATEMENTS
from . import ledger
from .tables import LedgerDirective, body_of

HEAD = ["section", "item", "in the book", "errata", "verdict"]
ONE_BY_ONE = 3  # so many verdicts of an item, at most
NUMBERED = ("theorem", "proposition", "remark", "table", "figure", "equation")


class Concordance(LedgerDirective):
    """A row an item, in the order of the paper."""

    def shown(self, key, paper, found):
        listed = [(section, item) for section in paper.contents.sections for item in section.items]
        body = [self.row(section, item, covered(item, found)) for section, item in listed]
        table = self.make_table(f"{paper.title}: from the paper to the book.", HEAD, body, ["ledger-table"])
        before = None
        for (section, _), row in zip(listed, body_of(table), strict=True):
            if section is not before:
                row["ids"].append(label := section_label(paper, section))
                self.env.get_domain("std").note_hyperlink_target(label, self.env.docname, label)
            before = section
        return [table]

    def row(self, section, item, claims):
        places = [place(self.env, label) for label in item.see]
        errata = dict.fromkeys(name for c in claims for name in c.erratum.split(", ") if name)
        links = [ledger.link(self.env, name, name) for name in errata]
        cells = map(in_a_row, (places, links, verdicts(self.env, claims)))
        return [full_name(section), item.name, *cells]


def covered(item, claims):
    """The judged rows that an item covers."""
    return [claim for claim in claims if item.covers(claim.key[1:])]


def full_name(section):
    return f"{section.number} {section.title}" if section.title != section.number else section.title


def section_label(paper, section):
    """Label of a section's first row in the concordance."""
    return "concordance-" + nodes.make_id(f"{paper.key} {section.number}")


def place(env, label):
    """A link to a place of the book that writes its own text: a number of a figure, a title of a section."""
    if label.startswith(("fig-", "tab-")):
        return ledger.link(env, label, label, kind="numref")
    return addnodes.pending_xref(
        "", nodes.inline("", label), refdoc=env.docname, refdomain="", reftype="any", reftarget=label,
        refexplicit=False, refwarn=True,
    )  # fmt: skip


def in_a_row(links):
    """The content of a cell: links, with commas between them."""
    parts = [part for link in links for part in (nodes.Text(", "), link)][1:]
    return [nodes.paragraph("", "", *parts)] if parts else ""


def verdicts(env, claims):
    """Links to the cells; where there are many, to the judged table, with how many have which verdict."""
    if len(claims) <= ONE_BY_ONE:
        words = [(ledger.cell_label(c.notebook, c.cell), ledger.written(c)[2]) for c in claims]
        return [ledger.link(env, *link) for link in dict.fromkeys(words)]
    label, count = ledger.label_of(claims[0].paper, claims[0].table), Counter(c.verdict for c in claims)
    if claims[0].table == STATEMENTS:
        label = ledger.cell_label(claims[0].notebook, claims[0].cell)
    return [ledger.link(env, label, f"{ledger.ALL_SYMBOLS[v]} {v} ({n})") for v, n in count.items()]


def add_box(app, doctree):
    """The box, and the entries of the index."""
    env, (folder, _, name) = app.env, app.env.docname.partition("/")
    of_this_folder = [p for p in read_papers().values() if p.folder.name == name.partition("/")[0]]
    for paper in of_this_folder if folder == "notebooks" else ():
        here = [c for c in ledger.claims_of(env) if c.paper == paper.key and c.notebook == f"{name}.ipynb"]
        listed = [(section, item) for section in paper.contents.sections for item in section.items]
        found = [(*each, target) for each in listed if (target := target_of(env, each[1], here))]
        if found:
            section = next(node for node in doctree.children if isinstance(node, nodes.section))
            section.insert(1, [index(env, found), box(env, paper, found)])


def target_of(env, item, claims):
    """The label of this page under which an item is found; None if it is not here."""
    labels = env.get_domain("std").anonlabels
    seen = [label for label in item.see if labels.get(label, ("",))[0] == env.docname]
    judged = [ledger.cell_label(c.notebook, c.cell) for c in covered(item, claims)]
    return next(iter(seen + judged), None)


def index(env, found):
    """Entries of the index for what has a number."""
    labels = env.get_domain("std").anonlabels
    entries = [
        ("single", item.name, labels[target][1] if target in labels else "", "main", None)
        for _, item, target in found
        if item.kind in NUMBERED and item.kind != "equation"
    ]
    env.get_domain("index").entries.setdefault(env.docname, []).extend(entries)
    return addnodes.index(entries=entries, inline=False)


def box(env, paper, found):
    """What of the paper is here, a line a section."""
    items = nodes.bullet_list()
    for section, group in groupby(found, key=lambda part: part[0]):
        group = [(item, target) for _, item, target in group]
        named = [ledger.link(env, target, item.name) for item, target in group if item.kind in NUMBERED]
        others = len(group) - len(named)
        line = nodes.paragraph("", "", ledger.link(env, section_label(paper, section), full_name(section)))
        if named:
            line += [nodes.Text(": "), *in_a_row(named)[0].children]
        if others:
            line += nodes.Text(f"{'; ' if named else ': '}{others} {'claim' if others == 1 else 'claims'}")
        items += nodes.list_item("", line)
    note = nodes.admonition(classes=["in-the-paper"])
    note += [nodes.title("", "In the paper"), items]
    return note
