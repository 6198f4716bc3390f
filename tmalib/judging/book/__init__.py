"""Sphinx extensions of the book; they read what the build has collected, and type nothing.

`tables` and `roles` show the ledger, `score` the front page's bars, `provenance` the list at the end of a
chapter, `architecture` the house drawn from the import contract; `offline_math` serves MathJax from the site.
"""
