"""PCD files: their header, their three kinds of bodies, LZF."""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fv_common.cloud_layout import SAMPLE, other_order_fits
from fv_exploration.recordings.errors import RecordingError, Warn, is_unit, matrix_from_quaternion
from fv_exploration.returns import SENSIBLE_M

Array = NDArray[np.float64]

MAX_HEADER = 100_000
KINDS = {"F": ("f", (4, 8)), "I": ("i", (1, 2, 4, 8)), "U": ("u", (1, 2, 4, 8))}
NO_COMPRESSED_POINTS = bytes(8)  # their two sizes
PADDING = "_"
KEYS = ("FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")
NO_NUMBER = re.compile(rb"[+-]?(1\.#\w+|nan\(\w*\))", re.IGNORECASE)
"""Other libraries' words for numbers that are none."""


@dataclass(frozen=True)
class Field:
    """A column of a PCD file, or ``count`` of them side by side; ``kind`` as FIELDS, TYPE and SIZE have it."""

    name: str
    kind: str
    size: int
    count: int

    @property
    def bytes(self) -> int:
        """Of one point."""
        return self.size * self.count


@dataclass(frozen=True)
class Header:
    """What a PCD file says of itself; ``first_line`` counts lines of the body from there."""

    fields: tuple[Field, ...]
    points: int
    data: str
    T_map_sensor: Array
    first_line: int


def pcd_scan(data: bytes, warn: Warn) -> tuple[Array, Array]:
    """(points (N, 3), T_map_sensor (4, 4)) of a PCD file, ascii, binary or binary_compressed.

    :raises RecordingError: for files that are cut off, damaged or contradict themselves, or have no x, y and z.
    """
    header, body = _header(data, warn)
    columns = {"ascii": _ascii, "binary": _binary, "binary_compressed": _compressed}
    if header.data not in columns:
        raise RecordingError(f"DATA is {header.data!r}; valid: {', '.join(columns)}")
    if header.points == 0 and (header.data != "ascii" or not body.strip()):
        if len(body) > len(NO_COMPRESSED_POINTS):
            warn(f"{len(body)} bytes after its 0 points were not read")
        return np.zeros((0, 3)), header.T_map_sensor
    points = np.stack(columns[header.data](body, header, warn), axis=1)
    if header.data != "ascii" and points.dtype.kind == "f":
        some = points[:: max(1, len(points) // SAMPLE)]
        if other_order_fits(some, some.byteswap(), SENSIBLE_M):
            warn("its numbers make sense in the other byte order only: read in that")
            points = points.byteswap()
    return points.astype(float), header.T_map_sensor


def _header(data: bytes, warn: Warn) -> tuple[Header, bytes]:
    entries, body, lines = _entries(data)
    missing = {"FIELDS", "SIZE", "TYPE"} - set(entries)
    if missing:
        raise RecordingError(f"the header lacks {', '.join(sorted(missing))}")
    fields = _fields(entries, warn)
    transform = _viewpoint(entries.get("VIEWPOINT", ["0", "0", "0", "1", "0", "0", "0"]), warn)
    kind = entries["DATA"][0] if entries["DATA"] else ""
    return Header(fields, _points(entries), kind, transform, lines + 1), body


def _entries(data: bytes) -> tuple[dict[str, list[str]], bytes, int]:
    """Words by key, the body, and the number of lines before it."""
    entries: dict[str, list[str]] = {}
    start, lines = len(codecs.BOM_UTF8) if data.startswith(codecs.BOM_UTF8) else 0, 0
    while "DATA" not in entries:
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        if start >= len(data) or end > MAX_HEADER:
            raise RecordingError("has no header of a PCD file")
        key, *words = data[start:end].decode("ascii", "replace").split() or ["#"]
        key = "FIELDS" if key == "COLUMNS" else key  # its name before version 0.7
        if key in entries:
            raise RecordingError(f"the header has {key} twice")
        if key in KEYS:
            entries[key] = words
        start, lines = end + 1, lines + 1
    return entries, data[start:], lines


def _fields(entries: dict[str, list[str]], warn: Warn) -> tuple[Field, ...]:
    names = entries["FIELDS"]
    columns = [entries["TYPE"], entries["SIZE"], entries.get("COUNT", ["1"] * len(names))]
    for key, words in zip(("TYPE", "SIZE", "COUNT"), columns, strict=True):
        if len(words) != len(names):
            raise RecordingError(
                f"{key} has {len(words)} entries; valid: one for each of {len(names)} fields"
            )
    fields = tuple(
        Field(name, kind, _whole("SIZE", size), _whole("COUNT", count))
        for name, kind, size, count in zip(names, *columns, strict=True)
    )
    for name in "xyz":
        _require_coordinate([field for field in fields if field.name == name], names)
    if any(field.kind != "F" for field in fields if field.name in "xyz"):
        warn("x, y and z are not all floating-point numbers: taken as metres as they stand")
    return fields


def _require_coordinate(found: list[Field], names: list[str]) -> None:
    if len(found) != 1:
        raise RecordingError(f"FIELDS is {' '.join(names)}; needs x, y and z once each")
    (field,) = found
    if field.kind not in KINDS or field.size not in KINDS[field.kind][1]:
        raise RecordingError(
            f"field {field.name} is {field.kind}{field.size}; valid: F4, F8, or I or U of 1, 2, 4 or 8"
        )
    if field.count != 1:
        raise RecordingError(f"COUNT of field {field.name} is {field.count}; valid: 1")


def _whole(key: str, word: str) -> int:
    if not re.fullmatch(r"[0-9]{1,15}", word):
        raise RecordingError(f"{key} is {word!r}; valid: a whole number, 0 or more")
    return int(word)


def _points(entries: dict[str, list[str]]) -> int:
    said = {key: entries[key] for key in ("POINTS", "WIDTH", "HEIGHT") if key in entries}
    for key, words in said.items():
        if len(words) != 1:
            raise RecordingError(f"{key} is {' '.join(words)!r}; valid: one whole number")
    numbers = {key: _whole(key, words[0]) for key, words in said.items()}
    if "POINTS" not in numbers and "WIDTH" not in numbers:
        raise RecordingError("the header lacks POINTS")
    area = numbers["WIDTH"] * numbers.get("HEIGHT", 1) if "WIDTH" in numbers else numbers["POINTS"]
    if numbers.get("POINTS", area) != area:
        raise RecordingError(
            f"POINTS is {numbers['POINTS']}, but WIDTH times HEIGHT is {area}; valid: the same number"
        )
    return area


def _viewpoint(words: list[str], warn: Warn) -> Array:
    text = (
        f"VIEWPOINT is {' '.join(words)!r}; valid: 7 finite numbers: position, quaternion w x y z, not all 0"
    )
    try:
        x, y, z, *wxyz = (float(word) for word in words)
        w, i, j, k = wxyz
        transform = matrix_from_quaternion([x, y, z], [i, j, k, w])
    except ValueError as error:  # a RecordingError is one, too
        raise RecordingError(text) from error
    if not is_unit(wxyz):
        warn(f"the quaternion of VIEWPOINT is {' '.join(words[3:])}: brought to length 1")
    return transform


def _ascii(body: bytes, header: Header, warn: Warn) -> list[Array]:
    starts = np.cumsum([0] + [field.count for field in header.fields])
    columns = [int(starts[i]) for i in _xyz(header.fields)]
    width = int(starts[-1])
    lines = [(n, line.split()) for n, line in enumerate(body.splitlines(), header.first_line)]
    rows = [(n, words) for n, words in lines if words]
    for n, words in rows:
        if len(words) != width:
            raise RecordingError(
                f"line {n} has {len(words)} numbers; valid: {width}, as FIELDS and COUNT say"
            )
    if len(rows) != header.points:
        raise RecordingError(f"has {len(rows)} lines of points; its header says {header.points}")
    return [_numbers([(n, words[column]) for n, words in rows]) for column in columns]


def _numbers(words: list[tuple[int, bytes]]) -> Array:
    try:
        return np.array([_float(word) for _, word in words])
    except ValueError:
        return np.array([_number(n, word) for n, word in words])


def _number(line: int, word: bytes) -> float:
    try:
        return _float(word)
    except ValueError:
        if NO_NUMBER.fullmatch(word):
            return float("nan")
        raise RecordingError(
            f"line {line} has {word.decode('ascii', 'replace')[:40]!r}; valid: a number"
        ) from None


def _float(word: bytes) -> float:
    """As Python reads it, but for the underscores that it passes over: 1_5 would be 15."""
    if b"_" in word:
        raise ValueError(word)
    return float(word)


def _binary(body: bytes, header: Header, warn: Warn) -> list[NDArray]:
    row = sum(field.bytes for field in header.fields)
    need = header.points * row
    _require_bytes(len(body), need)
    if len(body) - need >= row:
        warn(f"{len(body) - need} bytes after its {header.points} points were not read")
    starts = np.cumsum([0] + [field.bytes for field in header.fields])
    return [
        np.ndarray((header.points,), _kind(header.fields[i]), body, int(starts[i]), (row,))
        for i in _xyz(header.fields)
    ]


def _compressed(body: bytes, header: Header, warn: Warn) -> list[NDArray]:
    _require_bytes(len(body), 8)
    packed, size = (int(v) for v in np.frombuffer(body, "<u4", 2))
    _require_bytes(len(body), 8 + packed)
    fields = _stored(header, size)
    plain = decompress_lzf(body[8 : 8 + packed], size)
    starts = np.cumsum([0] + [header.points * field.bytes for field in fields])  # one field after the other
    return [np.frombuffer(plain, _kind(fields[i]), header.points, int(starts[i])) for i in _xyz(fields)]


def _stored(header: Header, size: int) -> list[Field]:
    """The fields that a compressed body of this size [bytes] holds: PCL leaves padding out."""
    sizes = []
    for fields in (header.fields, tuple(f for f in header.fields if f.name != PADDING)):
        sizes.append(header.points * sum(field.bytes for field in fields))
        if sizes[-1] == size:
            return list(fields)
    raise RecordingError(f"its compressed points are {size} bytes; its header says {sizes[0]}")


def _xyz(fields: Sequence[Field]) -> list[int]:
    names = [field.name for field in fields]
    return [names.index(name) for name in "xyz"]


def _kind(field: Field) -> np.dtype:
    return np.dtype(f"<{KINDS[field.kind][0]}{field.size}")


def _require_bytes(have: int, need: int) -> None:
    if have < need:
        raise RecordingError(f"is cut off: {have} bytes of points, needs {need}")


def decompress_lzf(data: bytes, size: int) -> bytes:
    """Bytes of an LZF stream: runs of literals (control below 32) and copies of what came before.

    :raises RecordingError: when the stream is damaged, or does not give ``size`` bytes.
    """
    out = bytearray()
    at = 0
    try:
        while at < len(data) and len(out) <= size:
            control = data[at]
            at += 1
            if control < 32:
                out += data[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += data[at]
                at += 1
            start = len(out) - ((control & 31) << 8) - data[at] - 1
            at += 1
            length += 2
            if start < 0:
                raise RecordingError("compressed points refer to bytes before their begin")
            piece = out[start : start + length]
            while len(piece) < length:  # a copy may overlap itself
                piece += piece[: length - len(piece)]
            out += piece
    except IndexError:
        raise RecordingError("compressed points are cut off") from None
    if len(out) != size:
        raise RecordingError(f"compressed points unpack to {len(out)} bytes, not {size}")
    return bytes(out)
