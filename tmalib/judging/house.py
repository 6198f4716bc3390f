"""The house, drawn from the import contract in pyproject.toml: a floor a layer, a room a module."""

import tomllib
from pathlib import Path

import matplotlib.pyplot as plt

from .. import figures

NAME = "fig-house"
FLOORS = {"papers": "#E0EDF6", "judging": "#FDF0D5"}  # the others are the library


def read_layers(pyproject):
    """The layers of the contract "house", from the top: a list of lists of modules."""
    found = tomllib.loads(Path(pyproject).read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in found if contract["id"] == "house")
    return [layer.replace("|", ":").replace(" ", "").split(":") for layer in layers]


def draw_house(pyproject, folder):
    """Write the drawing, SVG and PDF, to ``folder``; returns its name."""
    figures.use_style()
    layers = read_layers(pyproject)
    figure, ax = plt.subplots(figsize=(7.4, 5.6))
    box = dict(boxstyle="round,pad=0.35", facecolor="white", edgecolor="#555555", linewidth=0.8)
    for level, row in enumerate(layers):
        ax.axhspan(-level - 0.42, -level + 0.42, color=FLOORS.get(row[0], "#EEF5F0"), linewidth=0)
        for k, name in enumerate(row):
            place = ((k + 0.5) / len(row), -level)
            ax.annotate(name, place, ha="center", va="center", fontsize=9, bbox=box)
    down = dict(arrowstyle="-|>", color="#555555", linewidth=1.4)
    ax.annotate("", (-0.04, 0.6 - len(layers)), (-0.04, 0.4), arrowprops=down, annotation_clip=False)
    ax.annotate("imports", (-0.06, -len(layers) / 2 + 0.5), rotation=90, ha="right", va="center", fontsize=9)
    ax.set(xlim=(-0.1, 1), ylim=(0.5 - len(layers), 0.5))
    ax.axis("off")
    figures.save_figure(figure, Path(folder) / NAME)
    return NAME
