"""The book's Sphinx extension; it reads what the build has collected, and types nothing.

`tables` and `roles` show the ledger, `score` the front page's bars, `provenance` a chapter's last list.
"""


def setup(app):
    """Add all directives, roles and events."""
    from . import provenance, roles, score, tables

    for part in (provenance, roles, score, tables):
        part.setup(app)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
