"""The book's Sphinx extension; it reads what the build has collected, and types nothing.

`tables` shows the ledger, `score` counts it, `graph` draws what its statements rest on, `errata` lists the
errata, `roles` writes it into sentences, `provenance` gives a chapter the outputs of its execution and a list
of where they come from.
"""

from . import errata, graph, provenance, roles, score, tables


def setup(app):
    """Add all directives, roles and events."""
    for find in (roles.printed, roles.ours, roles.verdict, roles.count, roles.deviation):
        app.add_role(find.__name__, roles.LedgerRole(find))
    app.add_directive("judged-table", tables.JudgedTable)
    app.add_directive("ledger-table", tables.LedgerTable)
    app.add_directive("score", score.Score)
    app.add_directive("statement-graph", graph.StatementGraph)
    app.add_directive("errata-table", errata.ErrataTable)
    app.connect("source-read", provenance.take_outputs)
    app.connect("doctree-read", provenance.add_provenance)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
