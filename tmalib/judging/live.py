"""Live pages: a view that the reader moves by sliders, in a page that needs no server and no library.

A cell calls `live` with sliders and panels. A `Slider` is a list of values; a `Panel` has axes and curves; a
`Curve` has its points for every position of the sliders that it depends on, computed here, by the library.
All of it travels as JSON in one output of the cell, and ``book/_static/live.js`` draws the points that belong
to the positions of the sliders. A view with a name computes points in the browser; then the output brings its
data, and a test compares the browser's numbers with the library's (`tmalib.judging.live_bearings`). Without
JavaScript a sentence stands there that leads to the figure with the same content.
"""

import json
import math
from dataclasses import asdict, dataclass
from html import escape
from itertools import product

import numpy as np

MARKS = ("line", "thin", "dashed", "circle", "square", "ring", "cross")


@dataclass(frozen=True)
class Slider:
    """One slider: its values in order, the digits after the point and the unit that are read out."""

    label: str
    values: tuple
    unit: str
    digits: int = 0
    start: int = 0  # position at first


@dataclass(frozen=True)
class Axis:
    """Label with its unit, limits, and ticks ``(value, text)`` where round numbers will not do."""

    label: str
    limits: tuple
    ticks: tuple = ()
    log: bool = False


@dataclass(frozen=True)
class Frames:
    """What is shown for every position of the sliders ``by``, the last one running fastest."""

    by: tuple
    of: tuple


@dataclass(frozen=True)
class Curve:
    """A line or marks in one colour (`None`: that of the text); its points, two arrays x and y a frame.

    NaN interrupts a line. Without `frames` the view computes its points in the browser. A label that is empty
    is not in the legend.
    """

    label: str
    mark: str
    colour: str | None = None
    frames: Frames | None = None

    def __post_init__(self):
        if self.mark not in MARKS:
            raise ValueError(f"mark must be one of {MARKS}, got {self.mark!r}")


@dataclass(frozen=True)
class Panel:
    """Axes with curves; ``alt`` says what is drawn; ``equal`` gives both axes one scale, as a map has."""

    alt: str
    x: Axis
    y: Axis
    curves: tuple
    equal: bool = False


def fixed(*points):
    """Frames of what depends on no slider."""
    return Frames((), (points,))


def frames(function, sliders, by):
    """``function(value, ...)`` for all values of the sliders number ``by``."""
    return Frames(tuple(by), tuple(function(*values) for values in product(*(sliders[k].values for k in by))))


def live(title, sliders, panels, says, instead, *, name="frames", buttons=(), data=None, digits=4):
    """Show a live view as the output of a cell.

    Parameters
    ----------
    title : str
    sliders : sequence of Slider
    panels : sequence of Panel
    says : Frames or None
        A sentence a frame, which is also spoken; `None` if the view computes it.
    instead : str
        The sentence for who has no JavaScript.
    name : str
        Of the view in ``live.js``: "frames" has its points from here.
    buttons : sequence of (str, sequence of float)
        A label, and the values that it sets, one a slider.
    data : dict, optional
        What a view that computes needs.
    digits : int
        Significant digits of all numbers but those of sliders and buttons.
    """
    from IPython.display import display

    sliders, panels = list(map(asdict, sliders)), list(map(asdict, panels))
    shown = rounded({"panels": panels, "says": says and asdict(says), "data": data}, digits)
    text = page(
        name, title, instead, shown | {"sliders": rounded(sliders, 12), "buttons": rounded(buttons, 12)}
    )
    display({"text/html": text, "text/plain": f"{title}. {instead}"}, raw=True)


def page(name, title, instead, view):
    """The output: the sentence for who has no JavaScript, and the view as JSON for who has."""
    content = json.dumps(view, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    content, title = content.replace("</", "<\\/"), escape(title)  # "</script>" would end the element
    return (
        f'<div class="live" data-live="{name}" role="group" aria-label="{title}">'
        f'<p class="live-title">{title}</p><p class="live-instead">{escape(instead)}</p>'
        f'<script type="application/json">{content}</script></div>'
    )


def rounded(value, digits):
    """For JSON: lists for arrays, numbers with so many significant digits, `None` for what is not finite.

    Examples
    --------
    >>> rounded({"x": np.array([1234.567, np.nan, 2.0])}, 5)
    {'x': [1234.6, None, 2]}
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, dict):
        return {key: rounded(part, digits) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(part, digits) for part in value]
    if value is None or isinstance(value, str | bool | int):
        return value
    if not math.isfinite(value):
        return None
    short = float(f"{value:.{digits}g}")
    return int(short) if short.is_integer() else short
