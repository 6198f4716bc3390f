"""The book's Sphinx extension; it reads what the build has collected, and types nothing.

`tables` shows the ledger, `score` counts it, `graph` draws what its statements rest on, `errata` lists the
errata, `concordance` leads from the papers to the book and back, `roles` writes the ledger into sentences,
`names` and `terms` link the library's names and the field's words, `provenance` gives a chapter the outputs
of its execution and a list of where they come from, `downloads` the notebook that a reader
takes along, `launch` the links that start it elsewhere; `pdf` arranges the whole for paper.
"""

from . import (
    cards,
    concordance,
    downloads,
    errata,
    graph,
    launch,
    names,
    pdf,
    provenance,
    roles,
    score,
    tables,
    terms,
    tested,
)


def setup(app):
    """Add all directives, roles and events."""
    for find in (roles.printed, roles.ours, roles.verdict, roles.count, roles.tested, roles.version):
        app.add_role(find.__name__, roles.LedgerRole(find))
    app.add_directive("judged-table", tables.JudgedTable)
    app.add_directive("ledger-table", tables.LedgerTable)
    app.add_directive("score", score.Score)
    app.add_directive("statement-graph", graph.StatementGraph)
    app.add_directive("concordance", concordance.Concordance)
    app.add_directive("numbered-items", concordance.NumberedItems)
    app.add_directive("errata-table", errata.ErrataTable)
    app.connect("source-read", provenance.take_outputs)
    app.connect("doctree-read", provenance.add_provenance)
    app.connect("doctree-read", concordance.add_box)
    app.connect("doctree-read", names.link_names)
    app.connect("doctree-resolved", terms.link_terms)
    app.connect("config-inited", names.name_in_code)
    app.connect("config-inited", launch.set_theme_options)
    app.connect("html-page-context", launch.add_first_cell, priority=600)  # after the theme
    app.connect("autodoc-process-docstring", tested.add_tests, priority=900)  # after its sections
    app.connect("html-collect-pages", tested.pages)
    app.connect("build-finished", downloads.write_downloads)
    app.connect("html-page-context", cards.load_mathjax, priority=300)  # before Sphinx decides on it
    app.connect("build-finished", cards.write_cards)
    app.connect("config-inited", pdf.name_version)
    app.connect("doctree-read", pdf.keep_captions)
    app.connect("doctree-read", pdf.mark_live_views)
    app.connect("doctree-resolved", pdf.arrange)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
