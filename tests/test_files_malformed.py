"""What cannot be saved, and files that are not loaded."""

import dataclasses
import json
import re

import numpy as np
import pytest

import tmalib as tma
from tmalib.files.encoding import encode


class Own(tma.Bearing):
    coordinates = ("x", "y", "vx", "vy")


@dataclasses.dataclass(frozen=True)
class Bearing:  # not the library's
    pass


@pytest.mark.parametrize(("thing", "message"), [
    (Own(), "content is a Own, which cannot be saved"),
    (Bearing(), "content is a Bearing, which cannot be saved"),
    ({"a": [1, {2: 3}]}, "content['a'][1] is a dict, which cannot be saved"),
    ((1, 2j), "content[1] is a complex"),
    (np.array([1j]), "content is an array of complex128"),
    (np.array([None]), "content is an array of object"),
    ([lambda: 1], "content[0] is a function"),
    (tma.Biased(Own(), "bias"), "content.model is a Own"),
])  # fmt: skip
def test_what_cannot_be_saved(tmp_path, thing, message):
    path = tmp_path / "own.json"
    with pytest.raises(ValueError, match=re.escape(message)):
        tma.save(path, thing)
    assert not path.exists()


def array(type="float64", shape=(2,), values=(1.0, 2.0), **more):
    return {"array": {"type": type, "shape": list(shape), "values": list(values), **more}}


TARGET = encode(tma.Target((0, 0), 5, 1.0))["Target"]
SENSOR = encode(tma.Sensor(tma.Bearing(), [0.0, 1.0], 0.1))["Sensor"]
COURSE = encode(tma.Course((0, 0), 5, 1.0, [tma.Straight(5)]))["Course"]
FRAME = {"epoch": None, "latitude": None, "longitude": None}
MALFORMED = {
    "a class that is not known": ({"Popen": {"args": "true"}}, "unknown kind 'Popen'"),
    "a class of Python": ({"object": {}}, "unknown kind 'object'"),
    "two keys": (
        {"Bearing": {}, "Range": {}},
        "content must be an object with one key, got ['Bearing', 'Range']",
    ),
    "no key": ({}, "an object with one key"),
    "fields that are none": ({"Bearing": [1]}, "has no fitting content"),
    "unknown field": ({"Bearing": {"c": 1500}}, "a Bearing has no field 'c'; its fields: none"),
    "missing field": ({"Sensor": {k: v for k, v in SENSOR.items() if k != "sigma"}}, "content is no Sensor:"),
    "a check of the class": ({"Sensor": {**SENSOR, "sigma": -1.0}}, "content is no Sensor: sigma must be"),
    "times backwards": ({"Sensor": {**SENSOR, "times": array(values=[2.0, 1.0])}}, "must not go back"),
    "a text for a number": (
        {"Biased": {"model": {"Bearing": {}}, "name": "b", "true_bias": "0.5"}},
        "content is no Biased: true_bias must be a number, got '0.5'",
    ),
    "a number for a model": ({"Biased": {"model": 3, "name": "b", "true_bias": 0.0}}, "content is no Biased"),
    "a text for a leg": (
        {"Course": {**COURSE, "legs": {"tuple": ["a"]}}},
        "content is no Course: each of legs",
    ),
    "a number for a platform": (
        {
            "Scenario": {
                "platform": 3,
                "sensors": {"tuple": [{"Sensor": SENSOR}]},
                "reference_time": 0.0,
                "target": None,
            }
        },
        "content is no Scenario",
    ),
    "a text for an array": (
        {"Estimate": {"time": 0.0, "coordinates": {"tuple": []}, "state": "x", "covariance": array()}},
        "content.state of a Estimate is 'x'",
    ),
    "a velocity that is another": (
        {"Target": {**TARGET, "velocity": array(values=[1.0, 2.0])}},
        "content.velocity is array([1., 2.]), but the other fields give",
    ),
    "a velocity of another shape": (
        {"Target": {**TARGET, "velocity": array(shape=[1], values=[1.0])}},
        "content.velocity is",
    ),
    "a velocity of NaN": (
        {"Target": {**TARGET, "velocity": array(values=["nan", 2.0])}},
        "content.velocity is",
    ),
    "latitude 95": (
        {"Frame": {**FRAME, "latitude": 95.0, "longitude": 0.0}},
        "content is no Frame: latitude",
    ),
    "no date": ({"Frame": {**FRAME, "epoch": {"date": "noon"}}}, "content.epoch is no date: 'noon'"),
    "no time zone": ({"Frame": {**FRAME, "epoch": {"date": "2024-05-01"}}}, "epoch must be a datetime with"),
    "float": ({"float": "1.5"}, "must be one of ['nan', 'inf', '-inf'], got '1.5'"),
    "float of a list": ({"float": [1]}, "must be one of"),
    "array of objects": (array(type="object"), "unknown type 'object'"),
    "array of records": (array(type="f8,f8"), "unknown type"),
    "array of long texts": (array(type="U99999"), "unknown type"),
    "array without type": (
        {"array": {"shape": [], "values": []}},
        "content must have type, shape and values",
    ),
    "array with more": (array(order="F"), "content must have type, shape and values"),
    "shape and values": (array(shape=[3]), "does not have the values of an array of the shape (3,)"),
    "negative shape": (array(shape=[-1, -2]), "has no shape"),
    "shape of floats": (array(shape=[2.0]), "has no shape"),
    "huge shape": (array(shape=[10**6, 10**6], values=[]), "does not have the values"),
    "text in numbers": (array(values=[1.0, "2"]), "has the value 2 in an array of float64"),
    "null in numbers": (array(values=[1.0, None]), "has the value None in an array"),
    "truth in numbers": (array(values=[1.0, True]), "has the value True in an array"),
    "list in numbers": (array(values=[1.0, [2.0]]), "has the value [2.0] in an array"),
    "half in integers": (array(type="int64", values=[1, 2.5]), "has the value 2.5 in an array of int64"),
    "too large": (array(type="int8", values=[1, 300]), "array of int8"),
    "too large a float32": (array(type="float32", values=[1.0, 1e300]), "an array of float32 cannot hold"),
    "too long a text": (array(type="U1", values=["a", "bc"]), "an array of U1 cannot hold"),
    "scalar with a shape": ({"scalar": array()["array"]}, "is a scalar with the shape (2,)"),
}
TEXTS = {
    "empty": ("", "the file is empty"),
    "no JSON": ("scenario = 1\n", ", line 1: not JSON"),
    "cut off": ('{"format": "tmalib",\n"version": 1, "content": [1', ", line 2: not JSON"),
    "something else": ("[1, 2]", "not a file that tmalib has saved"),
    "another format": ('{"format": "other", "version": 1, "content": 1}', "not a file that tmalib has saved"),
    "another version": (
        '{"format": "tmalib", "version": 2, "content": 1}',
        "version 2; this library reads version 1",
    ),
    "no version": ('{"format": "tmalib", "content": 1}', "format, version and content are wanted"),
    "a true version": ('{"format": "tmalib", "version": true, "content": 1}', "version True"),
    "NaN": ('{"format": "tmalib", "version": 1, "content": NaN}', "NaN is no number of JSON"),
    "-Infinity": (
        '{"format": "tmalib", "version": 1, "content": -Infinity}',
        "-Infinity is no number of JSON",
    ),
    "overflow": (
        '{"format": "tmalib", "version": 1, "content": 1e999}',
        "the number 1e999 is beyond the floats",
    ),
    "a key twice": (
        '{"format": "tmalib", "version": 1, "content": {"dict": {"a": 1, "a": 2}}}',
        "has a key twice",
    ),
    "too deep": (
        '{"format": "tmalib", "version": 1, "content": ' + "[" * 100_000 + "]" * 100_000 + "}",
        "too deeply",
    ),
    "long integer": ('{"format": "tmalib", "version": 1, "content": ' + "1" * 5000 + "}", "integer string"),
    "binary": ("\0\1\2", "not a text in UTF-8"),
}


@pytest.mark.parametrize(("content", "message"), MALFORMED.values(), ids=MALFORMED)
def test_malformed_content(tmp_path, content, message):
    path = tmp_path / "bad.json"
    path.write_text(json.dumps({"format": "tmalib", "version": 1, "content": content}))
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        tma.load(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(("content", "message"), TEXTS.values(), ids=TEXTS)
def test_malformed_text(tmp_path, content, message):
    path = tmp_path / "bad.json"
    path.write_text(content)
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        tma.load(path)
    assert str(caught.value).startswith(str(path))


def test_a_field_that_was_not_there_yet_takes_its_default(tmp_path):
    content = {"Sensor": {key: SENSOR[key] for key in ("model", "times", "sigma")}}
    path = tmp_path / "old.json"
    path.write_text(json.dumps({"format": "tmalib", "version": 1, "content": content}))
    assert tma.load(path).name == "Bearing"


def test_saving_what_could_not_be_loaded(tmp_path, monkeypatch):
    monkeypatch.setattr("tmalib.files.saved.MAX_BYTES", 1000)
    with pytest.raises(ValueError, match="and at most 1000 are read"):
        tma.save(tmp_path / "large.json", np.arange(1000.0))
    assert not (tmp_path / "large.json").exists()
