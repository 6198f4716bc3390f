"""Beyond the papers: what their open questions need, a module a chapter (`notebooks/beyond`).

A module holds the scenarios, the Monte-Carlo task and its named stream, and what the chapter's figures need.
What a person with own bearings would use is in the library, not here. Unlike the papers' modules, these may
use all three papers; they have no ledger, for nothing is printed.
"""
