"""Sample data: a ship's track and the bearings that it took of a target, as tables that the readers take.

``ownship.csv`` and ``bearings.csv``: 24 minutes, two legs, a sonar that hears the target late and now and
then not at all, and a receiver of its radar. They are simulated, so the truth is known: `true_target`.
"""

from importlib.resources import files
from pathlib import Path

import numpy as np

from ..motion import Target


def sample(name: str) -> Path:
    """Path of a file of the sample data.

    Examples
    --------
    >>> sample("ownship.csv").name
    'ownship.csv'
    >>> sample("others.csv")
    Traceback (most recent call last):
    ...
    ValueError: name must be one of ['bearings.csv', 'ownship.csv'], got 'others.csv'
    """
    folder = Path(str(files(__name__)))
    names = sorted(path.name for path in folder.glob("*.csv"))
    if name not in names:
        raise ValueError(f"name must be one of {names}, got {name!r}")
    return folder / name


def true_target() -> Target:
    """The target of the sample data; times are seconds since the first fix of the ship."""
    return Target((4200.0, 5600.0), speed=6.0, heading=np.radians(265))
