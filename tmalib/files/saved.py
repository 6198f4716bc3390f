"""Saving and loading scenarios, results and measurements."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from ..types import FilePath
from .encoding import decode, encode
from .text import MAX_BYTES, read_text, refuse

VERSION = 1


def save(path: FilePath, thing: Any) -> None:
    """Write a thing to a text file, JSON in UTF-8, from which `load` makes it again.

    Parameters
    ----------
    path : str or path
        Is overwritten.
    thing : object
        A scenario, a platform or target, a sensor, a model of the library; a `Fit`, `Estimate`, `Track` or
        `ParticleTrack`, a `Prior` or `Cloud`; a number, text or array; a list, tuple or dict of such.

    Raises
    ------
    ValueError
        For what cannot be saved (a model of your own, for instance), saying where in the thing it is, and for
        more than `MAX_BYTES` bytes; no file is written then.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np, tmalib as tma
    >>> ship = tma.Course((0, 0), 5, 0.0, [tma.Straight(300), tma.Turn(60, 0.02), tma.Straight(np.inf)])
    >>> ear = tma.Sensor(tma.Bearing(), times=np.arange(0, 600, 5.0), sigma=0.01)
    >>> watch = tma.Scenario(ship, [ear], reference_time=595)
    >>> angles = watch.with_target(tma.Target((2e3, 4e3), speed=6, heading=1.5)).simulate(runs=1, seed=1)[0]
    >>> path = pathlib.Path(tempfile.mkdtemp(), "watch.json")
    >>> tma.save(path, {"scenario": watch, "angles": angles})
    >>> again = tma.load(path)
    >>> bool(np.all(again["angles"] == angles)), again["scenario"].platform.legs[-1]
    (True, Leg(duration=inf, rate=0.0, speed=None, heading=None))
    """
    content = {"format": "tmalib", "version": VERSION, "content": encode(thing)}
    text = json.dumps(content, allow_nan=False) + "\n"
    if len(text) > MAX_BYTES:
        raise ValueError(f"thing takes {len(text)} bytes in a file, and at most {MAX_BYTES} are read")
    Path(path).write_text(text, encoding="utf-8")


def load(path: FilePath) -> Any:
    """The thing that `save` wrote to a file.

    Every finite float is the same bit for bit. Nothing in the file is executed; the objects are made, and
    checked, by the constructors of this library's dataclasses.

    Raises
    ------
    ValueError
        For a file that `save` has not written so, saying what is wrong and where; for another version.
    """
    text = read_text(path)
    try:
        content = json.loads(
            text, parse_constant=_no_constant, parse_float=_finite, object_pairs_hook=_each_key_once
        )
        if not isinstance(content, dict) or content.get("format") != "tmalib":
            raise ValueError("not a file that tmalib has saved")
        if set(content) != {"format", "version", "content"}:
            raise ValueError(f"format, version and content are wanted, got {list(content)[:5]}")
        if type(content["version"]) is not int or content["version"] != VERSION:
            raise ValueError(f"version {content['version']!r:.50}; this library reads version {VERSION}")
        return decode(content["content"])
    except json.JSONDecodeError as error:
        refuse(f"not JSON: {error.msg}", path, error.lineno)
    except RecursionError:
        refuse("nested too deeply", path)
    except ValueError as error:
        refuse(error, path)


def _no_constant(word):
    raise ValueError(f"{word} is no number of JSON")


def _finite(text):
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {text:.50} is beyond the floats")
    return value


def _each_key_once(pairs):
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError(f"an object has a key twice: {[key for key, _ in pairs][:10]}")
    return found
