"""From a paper to the book and back, made from the papers' contents.

``{concordance} paper`` lists what the sections of a paper hold: every item with its places in the book, its
errata and its verdicts. ``{numbered-items}`` leads from the numbers of all papers (Theorem 2, Table V) to
their places. A box at the head of a chapter says what of the paper it treats, with links to the concordance;
theorems, tables and figures are entries of the index, where the search finds them.
"""

from collections import Counter
from itertools import groupby

from docutils import nodes
from sphinx import addnodes
from sphinx.util.docutils import SphinxDirective

from ..paper import read_papers
from ..statements import TABLE as STATEMENTS
from . import ledger
from .tables import LedgerDirective, body_of

HEAD = ["section", "item", "in the book", "errata", "verdict"]
ONE_BY_ONE = 3  # so many verdicts of an item, at most
ONE_LOOK = ("theorem", "proposition", "table", "figure")  # what a reader comes with
NUMBERED = (*ONE_LOOK, "remark", "equation")


class Concordance(LedgerDirective):
    """A row an item, in the order of the paper."""

    def shown(self, key, paper, found):
        listed = [(section, item) for section in paper.contents.sections for item in section.items]
        body = [self.row(section, item, covered(item, found)) for section, item in listed]
        table = self.make_table(f"{paper.title}: from the paper to the book.", HEAD, body, ["ledger-table"])
        table["ids"].append(ledger.table_id(paper.key))
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


class NumberedItems(SphinxDirective):
    """A paragraph a paper: its theorems, tables and so on, each a link."""

    def run(self):
        found = []
        for paper in read_papers().values():
            claims = [claim for claim in ledger.claims_of(self.env) if claim.paper == paper.key]
            items = [item for section in paper.contents.sections for item in section.items]
            for kind in ONE_LOOK:
                named = [(item, first_place(item, claims)) for item in items if item.kind == kind]
                links = [ledger.link(self.env, label, item.name) for item, label in named if label]
                found += [(paper, link) for link in links]
        return [
            nodes.paragraph(
                "", "", nodes.strong("", paper.title), nodes.Text(": "), *separated(link for _, link in group)
            )
            for paper, group in groupby(found, key=lambda part: part[0])
        ]


def first_place(item, claims):
    """The label to which the name of an item leads: where it is seen, or else judged; None if nowhere."""
    judged = covered(item, claims)
    return next(iter([*item.see, *map(place_of_verdict, judged)]), None)


def place_of_verdict(claim):
    """The label of the judged table of a number; of a statement, which has none, that of its cell."""
    if claim.table == STATEMENTS:
        return ledger.cell_label(claim.notebook, claim.cell)
    return ledger.label_of(claim.paper, claim.table)


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


def separated(links):
    """Links with commas between them."""
    return [part for link in links for part in (nodes.Text(", "), link)][1:]


def in_a_row(links):
    """The content of a cell: links, with commas between them."""
    parts = separated(links)
    return [nodes.paragraph("", "", *parts)] if parts else ""


def verdicts(env, claims):
    """Links to the cells; where there are many, to the judged table, with how many have which verdict."""
    if len(claims) <= ONE_BY_ONE:
        words = [(ledger.cell_label(c.notebook, c.cell), ledger.written(c)[2]) for c in claims]
        return [ledger.link(env, *link) for link in dict.fromkeys(words)]
    label, count = place_of_verdict(claims[0]), Counter(c.verdict for c in claims)
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
