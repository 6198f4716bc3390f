"""The same task in Stone Soup: its stored answers, and how much code it takes there and here."""

from __future__ import annotations

import ast
import csv

import numpy as np

from .results import FOLDER


def lines_of_code(source, names=None):
    """Lines of some functions and classes of a text of Python, or of all but its imports.

    Comments, docstrings and line breaks within a statement do not count: each definition is written anew.

    Examples
    --------
    >>> lines_of_code("import os" + chr(10) + "x = [1," + chr(10) + "2]  # two")
    1
    """
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            node.body = node.body[1:] or [ast.Pass()]
    body = [node for node in tree.body if not isinstance(node, ast.Import | ast.ImportFrom)]
    if names is not None:
        body = [node for node in body if getattr(node, "name", None) in names]
        if missing := set(names) - {node.name for node in body}:
            raise ValueError(f"names must be of definitions, but there is no {sorted(missing)}")
    return sum(len(ast.unparse(node).splitlines()) for node in body)


def counted_lines(folder):
    """Lines of code of the same task in Stone Soup and here; ``folder`` holds both scripts.

    ``filter`` is what one Kalman filter of Stone Soup needs, ``delay`` the model of late bearings on top.
    """
    peer, ours = ((folder / name).read_text(encoding="utf-8") for name in ("stone_soup.py", "same_here.py"))
    return {
        "filter": lines_of_code(peer, ("read", "detections", "prior", "track")),
        "delay": lines_of_code(peer, ("DelayedBearing",)),
        "ours": lines_of_code(ours),
    }


def read_answers():
    """Stone Soup's answers from ``stone_soup.csv``, a list of dicts.

    ``filter``, whether bearings were ``delayed``, ``range`` of the prior in metres, ``state (4,)`` and
    ``covariance (4, 4)`` of x, y, vx, vy at the last bearing.
    """
    with open(FOLDER / "stone_soup.csv", encoding="utf-8", newline="") as file:
        _, *rows = csv.reader(file)
    return [
        {
            "filter": name,
            "delayed": delayed == "1",
            "range": float(distance),
            "state": np.array(numbers[:4], dtype=float),
            "covariance": np.array(numbers[4:], dtype=float).reshape(4, 4),
        }
        for name, delayed, distance, *numbers in rows
    ]
