"""The house: floors from the import contract in pyproject.toml, arrows from the imports that there are.

Papers and judging may use all below them, and the lowest floor is used by all: these arrows are left out.
"""

import tomllib
from pathlib import Path

import matplotlib.pyplot as plt

from .. import figures
from .code import PACKAGE, import_graph

NAME = "fig-house"
FLOORS = {"papers": "#E0EDF6", "judging": "#FDF0D5"}  # the others are the library


def read_layers(pyproject):
    """The layers of the contract "house", from the top: a list of lists of modules."""
    found = tomllib.loads(Path(pyproject).read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in found if contract["id"] == "house")
    return [layer.replace("|", ":").replace(" ", "").split(":") for layer in layers]


def direct_imports(names):
    """Pairs ``(importing, imported)`` of these modules or packages of tmalib, what is below them included."""
    graph, inside, imported = import_graph(), {}, {}
    for name in names:
        module = f"{PACKAGE.name}.{name}"
        inside[name] = {module} | graph.find_descendants(module)
        imported[name] = set().union(*map(graph.find_modules_directly_imported_by, inside[name]))
    return {(a, b) for a in names for b in names if a != b and imported[a] & inside[b]}


def without_detours(pairs):
    """The pairs that no longer way through other pairs stands for."""
    ways = set(pairs)
    while longer := {(a, d) for a, b in ways for c, d in ways if b == c} - ways:
        ways |= longer
    return {
        (a, c) for a, c in pairs if not any((a, b) in ways and (b, c) in ways for b in {b for _, b in ways})
    }


def draw_house(pyproject, folder):
    """Write the drawing, SVG and PDF, to ``folder``; returns its name."""
    figures.use_style()
    layers = read_layers(pyproject)
    places = {
        name: ((k + 0.5 + (len(row) > 1) * 0.12 * (-1) ** level) / len(row), -level)
        for level, row in enumerate(layers)
        for k, name in enumerate(row)
    }
    library = [name for row in layers[:-1] for name in row if row[0] not in FLOORS]
    figure, ax = plt.subplots(figsize=(7.4, 6.0))
    for level, row in enumerate(layers):
        ax.axhspan(-level - 0.4, -level + 0.4, color=FLOORS.get(row[0], "#EEF5F0"), linewidth=0)
    for a, b in sorted(without_detours(direct_imports(library))):
        line = dict(arrowstyle="-|>", color="#777777", linewidth=0.9, shrinkA=9, shrinkB=9)
        bend = {"connectionstyle": "arc3,rad=-0.25"} if places[a][1] == places[b][1] else {}
        ax.annotate("", places[b], places[a], arrowprops=line | bend)
    for name, (x, y) in places.items():
        box = dict(boxstyle="round,pad=0.35", facecolor="white", edgecolor="#555555", linewidth=0.8)
        ax.text(x, y, name, ha="center", va="center", fontsize=9, bbox=box)
    ax.set(xlim=(0, 1), ylim=(0.5 - len(layers), 0.5))
    ax.axis("off")
    figures.save(figure, Path(folder) / NAME)
    return NAME
