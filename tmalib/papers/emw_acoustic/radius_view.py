"""`emw-acoustic`: the live view of the radius of the observer's turn against the 48 printed bounds."""

import numpy as np

from ...figures import colour
from ...judging.live import Axis, Curve, Frames, Panel, Slider, fixed, live
from . import scenarios as emw

SMALLEST = 0.01  # units of the last digit: a deviation that is smaller is drawn here
POWERS = tuple((10.0**k, f"{10.0**k:g}") for k in range(-2, 5))


def radius_slider(at_7):
    """Radii for the slider, m: from 50 m to that of a turn at 7 m/s, ``at_7``, finer about 200 m."""
    fine = [np.arange(11) / 50, np.arange(3, 11) / 10, np.arange(3, 10) / 2]
    aside = np.concatenate([*fine, np.arange(5, 20), np.arange(20, 151, 10)])
    return np.concatenate([200 - aside[:0:-1], 200 + aside, np.arange(400, 1201, 100), [at_7]])


def radius_view(radii, deviations, start, instead):
    """Show the view.

    Parameters
    ----------
    radii : ndarray, shape (R,)
        In metres.
    deviations : ndarray, shape (R, 6, 8)
        Of the four bounds of each scenario, then the four of BOTMA, in units of the last digit.
    start : int
        Which radius is shown at first.
    instead : str
        As for `tmalib.judging.live.live`.
    """
    live(
        "The radius of the turn and the 48 printed bounds",
        [Slider("Radius", tuple(radii), "m", 2, start)],
        [_deviations(np.abs(deviations)), _map(radii)],
        Frames((0,), tuple(map(in_words, radii, deviations))),
        instead,
        buttons=[("200 m", [emw.TURN_RADIUS]), ("A turn at 7 m/s", [radii[-1]])],
        digits=3,
    )


def in_words(radius, deviations):
    """What is to be seen at a radius: speed in the turn, how many bounds agree, the worst of them."""
    off = np.abs(deviations)
    return (
        f"A circle of {radius:.2f} m, which makes {radius * emw.TURN_RATE:.2f} m/s in the turn: "
        f"{np.sum(off < 1)} of {off.size} bounds within one unit of the last printed digit, "
        f"the worst {off.max():.3g} units off."
    )


def _deviations(off):
    """A row of eight marks for each scenario; ``off`` has the shape ``(R, 6, 8)``."""
    rows = np.arange(1, 7)[:, None] + np.linspace(-0.3, 0.3, 8)

    def marks(label, mark, hue, part):
        drawn = np.maximum(off[:, :, part], SMALLEST)
        return Curve(label, mark, hue, Frames((0,), tuple((x.ravel(), rows[:, part].ravel()) for x in drawn)))

    curves = (
        marks("bound", "circle", colour("platform"), slice(0, 4)),
        marks("bound of BOTMA", "square", None, slice(4, 8)),
        Curve("one unit", "dashed", None, fixed([1, 1], [0, 7])),
    )
    across = Axis("Deviation (units of the last digit)", (0.8 * SMALLEST, 4e4), POWERS, log=True)
    numbers = tuple((n, str(n)) for n in range(1, 7))
    alt = "Deviation of the 48 bounds from the printed ones, a row of eight marks for each scenario."
    return Panel(alt, across, Axis("Scenario", (6.6, 0.4), numbers), curves)


def course_line(course):
    """East and north, in kilometres, of scenario 1: the ends of its legs, and its turn."""
    times = np.array([0, *range(199, 599, 16), 599, 600, 1199])
    return tuple(course.position_at(times).T / 1e3)


def _map(radii):
    of_radius = tuple(course_line(emw.course_as_computed(1, radius=radius)) for radius in radii)
    printed = fixed(*course_line(emw.course_as_printed(1)))
    curves = (
        Curve("as printed", "dashed", colour("printed"), printed),
        Curve("with this radius", "line", colour("platform"), Frames((0,), of_radius)),
    )
    alt = "Map of the observer's course in scenario 1 with this radius, and as printed."
    return Panel(alt, Axis("East (km)", (-1.6, 3)), Axis("North (km)", (-0.3, 5.3)), curves, equal=True)
