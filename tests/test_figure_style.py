"""The exported figures can be read: size of their text, colours to readers with each common colour vision.

A dichromat's view of a colour is simulated with the matrices of Machado, Oliveira and Fernandes (2009) for
severity 1. Two colours are told apart if their difference in one of L*, a* and b* is noticeable to half of
the observers, by the model of Stone, Szafir and Setlur (2014) for marks of a given visual angle. They
measured angles from a third of a degree on, a dot; a tenth, a line, is extrapolated, as users of it do.
"""

import re
import xml.etree.ElementTree as ET
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from tmalib import figures

FILES = sorted((Path(__file__).parents[1] / "figures").glob("*/*.svg"))
LEAST = 7.0  # points

VISIONS = {
    "common": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
XYZ = np.array(  # of linear sRGB, white point D65
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def seen(colour, vision):
    """L*, a*, b* of a colour as seen with a vision."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    x = XYZ @ np.clip(np.array(VISIONS[vision]) @ linear, 0, 1) / XYZ.sum(axis=1)
    f = np.where(x > (6 / 29) ** 3, np.cbrt(x), x / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def noticeable(degrees):
    """Difference in L*, a*, b* that half of the observers notice in marks of this visual angle."""
    return np.array([5.079, 5.339, 5.349]) + np.array([0.751, 1.541, 2.871]) / degrees


def confused(degrees):
    """Pairs of different colours that some vision cannot tell apart in marks of this visual angle."""
    different = combinations(dict.fromkeys(figures.COLOURS.values()), 2)
    return {
        frozenset(pair)
        for pair in different
        for vision in VISIONS
        if np.all(np.abs(seen(pair[0], vision) - seen(pair[1], vision)) < noticeable(degrees))
    }


def test_simulation_against_known_values():
    np.testing.assert_allclose(seen("white", "common"), [100, 0, 0], atol=1e-3)
    np.testing.assert_allclose(seen("#FF0000", "common"), [53.24, 80.09, 67.20], atol=0.02)
    for vision in VISIONS:  # grey stays grey
        np.testing.assert_allclose(seen("#808080", vision)[1:], 0, atol=0.05)
    red, green = seen("#D62728", "deuteranopia"), seen("#2CA02C", "deuteranopia")
    assert (
        abs(red[1] - green[1]) < 15 < 100 < abs(seen("#D62728", "common")[1] - seen("#2CA02C", "common")[1])
    )


def test_dots_can_be_told_apart_with_every_vision():
    assert confused(1 / 3) == set()


def test_lines_that_cannot_be_told_apart_are_known():
    assert confused(0.1) == {frozenset(map(figures.colour, pair)) for pair in figures.ALIKE}


def sizes_of_text(svg):
    """Width in inches, and the font sizes in points, of a figure whose text is drawn as paths."""
    width = float(re.search(r'<svg [^>]*?width="([\d.]+)pt"', svg)[1]) / 72
    place = r'<g (?:style="[^"]*" )?transform="translate\([^)]*\)(?: rotate\([^)]*\))? scale\(([\d.]+) -'
    return width, [100 * float(size) for size in re.findall(place, svg)]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_text_is_legible(path):
    """No text is smaller than 7 pt when the page has shrunk the figure to its width."""
    svg = path.read_text(encoding="utf-8")
    width, sizes = sizes_of_text(svg)
    assert len(sizes) >= svg.count('<g id="text_')
    assert min(sizes) * min(1, figures.PAGE_WIDTH / width) >= LEAST


def test_sizes_are_those_that_were_asked_for(tmp_path):
    with figures.plt.rc_context():
        figures.use_style()
        figure, ax = figures.plt.subplots(figsize=(5, 3))
        ax.set_title("title", fontsize=13)
        ax.text(0, 0, "$x_2$", fontsize=6.5, rotation=90)
        figures.save_figure(figure, tmp_path / "one")
    width, sizes = sizes_of_text((tmp_path / "one.svg").read_text())
    assert width == pytest.approx(5)
    assert sorted({round(size, 6) for size in sizes}) == [6.5, 10, 13]


SVG = "{http://www.w3.org/2000/svg}"


def lines_of(axes):
    """Colour, width, dashes and outline of the mark of every line drawn in the axes of an SVG figure."""
    for line in axes.findall(f"{SVG}g"):
        drawn = line.find(f"{SVG}path")
        if not line.get("id", "").startswith("line2d") or drawn is None:
            continue
        style = dict(part.split(": ") for part in drawn.get("style").split("; "))
        mark = line.find(f"{SVG}defs/{SVG}path")
        outline = (
            "" if mark is None else re.sub(r"-?[\d.]+", lambda found: f"{float(found[0]):.1f}", mark.get("d"))
        )
        width = float(style.get("stroke-width", 1))
        yield style["stroke"].upper(), width, style.get("stroke-dasharray", "solid"), outline


def mistaken(svg):
    """Pairs of lines in the same axes that differ by the colours of `ALIKE` alone; widths differ by two."""
    alike = {frozenset(map(figures.colour, pair)) for pair in figures.ALIKE}
    for axes in ET.fromstring(svg).iter(f"{SVG}g"):
        if axes.get("id", "").startswith("axes_"):
            for one, two in product(list(lines_of(axes)), repeat=2):
                if (
                    frozenset((one[0], two[0])) in alike
                    and one[1] <= two[1] < 2 * one[1]
                    and one[2:] == two[2:]
                ):
                    yield one, two


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_lines_of_colours_that_are_alike_differ_otherwise(path):
    assert list(mistaken(path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize(
    ("look", "found"),
    [({}, True), ({"linestyle": "--"}, False), ({"marker": "s"}, False), ({"linewidth": 0.7}, False)],
)
def test_a_line_that_differs_by_colour_alone_is_found(tmp_path, look, found):
    with figures.plt.rc_context():
        figures.use_style()
        figure, ax = figures.plt.subplots()
        ax.plot([0, 1], [0, 1], color=figures.colour("mle"))
        ax.plot([0, 1], [1, 0], color=figures.colour("ekf"), **look)
        ax.plot([0, 1], [2, 0], color=figures.colour("target"))
        figures.save_figure(figure, tmp_path / "one")
    assert bool(list(mistaken((tmp_path / "one.svg").read_text()))) == found
