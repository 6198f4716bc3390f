"""Things of the library as JSON and back, exactly.

JSON has null, truth values, texts, numbers and lists; all else is an object with one key, its kind::

    {"float": "nan"}                                        "nan", "inf" or "-inf": JSON has no such numbers
    {"array": {"type": "float64", "shape": [2, 3], "values": [...]}}
    {"scalar": {"type": "float64", "shape": [], "values": [...]}}    a number of numpy
    {"tuple": [...]}    {"dict": {...}}    {"date": "2024-05-01T12:00:00+00:00"}
    {"Sensor": {"model": ..., "times": ...}}                a dataclass of `CLASSES`, its fields by name

A float is written with the fewest digits that give it back bit for bit. Of a NaN only that it is one is kept.

Reading runs nothing but the constructors of `CLASSES`, with their checks, and looks no name up elsewhere;
then every field must be what its annotation says. A field that is missing takes its default, so files from
before it was there can be read. Fields that a constructor computes are stored too: what was saved is put back
if it agrees with what is computed, else it is refused.
"""

from __future__ import annotations

import dataclasses
import math
import re
import types
import typing
from datetime import datetime
from typing import Any

import numpy as np

from ..bearings import Bearing, DelayedBearing
from ..biased import Biased
from ..checks import set_fields
from ..clouds import Cloud
from ..cones import ConicalAngle, RayPath
from ..consistency import Consistency
from ..curved import AcceleratedBearing, TurningBearing
from ..doppler import DopplerFrequency
from ..ellipse import Ellipse
from ..estimate import Estimate, Fit
from ..known import KnownComponent
from ..motion import Course, Leg, SampledCourse, Target
from ..particles import ParticleTrack
from ..priors import FilterState, Prior
from ..process_noise import ProcessNoise
from ..ranges import Range
from ..recursive import Track
from ..scenario import Scenario
from ..sensors import Sensor
from ..sound_speed import DelayedBearingUnknownSpeed
from .frame import Frame
from .tracks import RecordedCourse

CLASSES = {
    cls.__name__: cls
    for cls in (
        Target, Leg, Course, SampledCourse, RecordedCourse, Frame,
        Bearing, DelayedBearing, DelayedBearingUnknownSpeed, AcceleratedBearing, TurningBearing,
        RayPath, ConicalAngle, DopplerFrequency, Range, Biased, KnownComponent, Sensor, Scenario,
        Fit, Estimate, Ellipse, Consistency, Prior, FilterState, ProcessNoise, Track, Cloud, ParticleTrack,
    )
}  # fmt: skip

NUMBER_TYPES = ["bool", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
                "float16", "float32", "float64"]  # fmt: skip
TEXT_TYPE = re.compile(r"U[1-9]\d{0,3}", re.ASCII)
NOT_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}
AGREE = 1e-9  # relative, of what a constructor computes


# -- to JSON ------------------------------------------------------------------------------------


def encode(thing: Any, where: str = "content") -> Any:
    """What `json` can write of a thing; `ValueError` that says where a thing is that cannot be saved."""
    kind = type(thing)
    if thing is None or kind in (bool, int, str):
        return thing
    if kind is float:
        return thing if math.isfinite(thing) else {"float": str(thing)}
    if isinstance(thing, np.ndarray | np.generic):
        key = "array" if isinstance(thing, np.ndarray) else "scalar"
        return {key: _encode_array(np.asarray(thing), where)}
    if kind is list:
        return [encode(part, f"{where}[{i}]") for i, part in enumerate(thing)]
    if kind is tuple:
        return {"tuple": encode(list(thing), where)}
    if kind is dict and all(type(key) is str for key in thing):
        return {"dict": {key: encode(part, f"{where}[{key!r}]") for key, part in thing.items()}}
    if kind is datetime:
        return {"date": thing.isoformat()}
    if CLASSES.get(kind.__name__) is kind:
        fields = dataclasses.fields(thing)
        return {kind.__name__: {f.name: encode(getattr(thing, f.name), f"{where}.{f.name}") for f in fields}}
    raise ValueError(
        f"{where} is a {kind.__name__}, which cannot be saved; numbers, texts, arrays, lists, tuples, dicts "
        f"with texts as keys, and {', '.join(CLASSES)} can"
    )


def _encode_array(array, where):
    name = f"U{array.dtype.itemsize // 4}" if array.dtype.kind == "U" else array.dtype.name
    if name not in NUMBER_TYPES and not TEXT_TYPE.fullmatch(name):
        raise ValueError(f"{where} is an array of {array.dtype}, which cannot be saved")
    values = np.ravel(array).tolist()
    if array.dtype.kind == "f":
        values = [value if math.isfinite(value) else str(value) for value in values]
    return {"type": name, "shape": list(array.shape), "values": values}


# -- from JSON ----------------------------------------------------------------------------------


def decode(content: Any, where: str = "content") -> Any:
    """The thing that `encode` wrote; `ValueError` that says where the content is none."""
    if isinstance(content, list):
        return [decode(part, f"{where}[{i}]") for i, part in enumerate(content)]
    if not isinstance(content, dict):
        return content
    if len(content) != 1:
        raise ValueError(f"{where} must be an object with one key, got {list(content)[:5]}")
    ((key, value),) = content.items()
    if key == "float":
        if not isinstance(value, str) or value not in NOT_FINITE:
            raise ValueError(f"{where} must be one of {list(NOT_FINITE)}, got {value!r:.50}")
        return NOT_FINITE[value]
    if key in ("array", "scalar"):
        array = _decode_array(value, where)
        if key == "scalar" and array.shape:
            raise ValueError(f"{where} is a scalar with the shape {array.shape}")
        return array if key == "array" else array[()]
    if key == "tuple" and isinstance(value, list):
        return tuple(decode(value, where))
    if key == "dict" and isinstance(value, dict):
        return {name: decode(part, f"{where}[{name!r}]") for name, part in value.items()}
    if key == "date" and isinstance(value, str):
        try:
            return datetime.fromisoformat(value)
        except ValueError:
            raise ValueError(f"{where} is no date: {value!r:.50}") from None
    if key in CLASSES and isinstance(value, dict):
        return _decode_object(CLASSES[key], value, where)
    raise ValueError(f"{where} is of the unknown kind {key!r:.50}, or has no fitting content")


def _decode_array(content, where):
    if not isinstance(content, dict) or set(content) != {"type", "shape", "values"}:
        raise ValueError(f"{where} must have type, shape and values")
    name, shape, values = content["type"], content["shape"], content["values"]
    if not isinstance(name, str) or not (name in NUMBER_TYPES or TEXT_TYPE.fullmatch(name)):
        raise ValueError(f"{where} has the unknown type {name!r:.50}")
    if not isinstance(shape, list) or not all(type(n) is int and 0 <= n < 2**31 for n in shape):
        raise ValueError(f"{where} has no shape: {shape!r:.50}")
    if not isinstance(values, list) or len(values) != math.prod(shape):
        raise ValueError(f"{where} does not have the values of an array of the shape {tuple(shape)}")
    kind = np.dtype(name).kind
    wanted = {"b": (bool,), "i": (int,), "u": (int,), "f": (int, float), "U": (str,)}[kind]
    if kind == "f":
        values = [NOT_FINITE.get(value, value) if isinstance(value, str) else value for value in values]
    wrong = [value for value in values if type(value) not in wanted]
    if wrong:
        raise ValueError(f"{where} has the value {wrong[0]!s:.50} in an array of {name}")
    try:
        with np.errstate(over="ignore"):  # found below
            array = np.array(values, dtype=name)
    except (OverflowError, ValueError) as error:
        raise ValueError(f"{where} is no array of {name}: {error}") from None
    if kind == "f":
        kept = np.array_equal(array.astype(float), np.array(values, dtype=float), equal_nan=True)
    else:
        kept = array.tolist() == values
    if not kept:
        raise ValueError(f"{where} has values that an array of {name} cannot hold")
    return array.reshape(shape)


def _decode_object(cls, content, where):
    """An object of a dataclass from its fields, made by its constructor."""
    fields = {field.name: field for field in dataclasses.fields(cls)}
    unknown = [name for name in content if name not in fields]
    if unknown:
        known = ", ".join(fields) or "none"
        raise ValueError(f"{where}: a {cls.__name__} has no field {unknown[0]!r:.50}; its fields: {known}")
    values = {name: decode(part, f"{where}.{name}") for name, part in content.items()}
    try:
        thing = cls(**{name: value for name, value in values.items() if fields[name].init})
    except Exception as error:  # whatever a constructor says to what is in a file
        raise ValueError(f"{where} is no {cls.__name__}: {error}") from None
    _check_by_annotations(thing, where)
    for name in (name for name in values if not fields[name].init):
        _put_back(thing, name, values[name], where)
    return thing


def _check_by_annotations(thing, where):
    """`ValueError` for a field that is not what its annotation says; not every class checks this itself."""
    hints = typing.get_type_hints(type(thing))
    for name in (field.name for field in dataclasses.fields(thing)):
        value, hint = getattr(thing, name), hints[name]
        parts = value if name == "legs" else ()
        if not _is_a(value, hint) or not all(isinstance(part, Leg) for part in parts):
            kind = type(thing).__name__
            raise ValueError(f"{where}.{name} of a {kind} is {value!r:.50}, and {hint} is wanted")


def _is_a(value, hint):
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        return any(_is_a(value, part) for part in typing.get_args(hint) if part is not typing.Any)
    hint = typing.get_origin(hint) or hint
    if hasattr(hint, "__value__"):  # a newer NumPy names its arrays by an alias
        hint = typing.get_origin(hint.__value__) or hint.__value__
    # One run has numbers of numpy for arrays; where a number stands, there may be one for each measurement.
    numeric = {float: (float, int, np.number, np.ndarray), int: (int, np.integer), bool: (bool, np.bool_),
               np.ndarray: (np.ndarray, np.generic)}  # fmt: skip
    if hint in (float, int) and isinstance(value, bool):
        return False
    return isinstance(value, numeric.get(hint, hint))


def _put_back(thing, name, value, where):
    """Set a field that the constructor has computed to what was saved, if the two agree."""
    computed = getattr(thing, name)
    fits = isinstance(value, np.ndarray) and value.shape == computed.shape and value.dtype == computed.dtype
    largest = np.max(np.abs(computed), initial=0.0)
    if not fits or not np.all(np.abs(value - computed) <= AGREE * largest):
        raise ValueError(f"{where}.{name} is {value!r:.80}, but the other fields give {computed!r:.80}")
    value.flags.writeable = computed.flags.writeable
    set_fields(thing, **{name: value})
