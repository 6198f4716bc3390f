"""The text of a file, or a `ValueError` that says where it is none."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

from ..types import FilePath

MAX_BYTES = 200_000_000
MAX_ROWS = 1_000_000


def refuse(message: object, path: FilePath, line: int | None = None, column: str | None = None) -> NoReturn:
    """Raise a `ValueError` that names file, line and column."""
    place = str(path)
    place += "" if line is None else f", line {line}"
    place += "" if column is None else f", column {column!r}"
    raise ValueError(f"{place}: {message}")


def read_text(path: FilePath) -> str:
    """Content of a UTF-8 file of at most `MAX_BYTES` bytes, without byte order mark.

    Raises
    ------
    ValueError
        For a file that is too large, binary, empty, or in another encoding.
    """
    with Path(path).open("rb") as file:
        data = file.read(MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        refuse(f"the file has more than {MAX_BYTES} bytes, the most that is read", path)
    if b"\0" in data:
        line = 1 + data[: data.index(b"\0")].count(b"\n")
        refuse("not a text in UTF-8: a zero byte (a binary file, or UTF-16?)", path, line)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = 1 + data[: error.start].count(b"\n")
        refuse(f"not a text in UTF-8: byte {data[error.start]:#04x}", path, line)
    if not text.strip():
        refuse("the file is empty", path)
    return text


def check_rows(count: int, path: FilePath) -> None:
    """`ValueError` for no rows, and for more than `MAX_ROWS`."""
    if not count:
        refuse("the file has no rows", path)
    if count > MAX_ROWS:
        refuse(f"the file has more than {MAX_ROWS} rows, the most that is read", path)


def format_of(path: FilePath, format: str | None) -> str:
    """``"csv"`` or ``"rep"``: as asked for, else by the suffix of the path."""
    known = {".csv": "csv", ".txt": "csv", ".rep": "rep", ".dsf": "rep"}
    if format is None:
        suffix = Path(path).suffix
        if suffix.lower() not in known:
            refuse(f"the suffix {suffix!r} says no format; give format='csv' or format='rep'", path)
        return known[suffix.lower()]
    if format not in known.values():
        raise ValueError(f"format must be 'csv' or 'rep', got {format!r}")
    return format
