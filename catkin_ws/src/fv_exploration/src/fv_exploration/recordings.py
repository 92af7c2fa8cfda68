"""Recorded clouds without ROS: PCD files, OctoMap scan graphs, rosbags with TF."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fv_exploration.bag_clouds import bag_clouds
from fv_exploration.recording_error import RecordingError, matrix_from_quaternion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RecordedScan:
    """One recorded cloud.

    :param points_sensor: (N, 3) [m], sensor frame; NaN rows had no return.
    :param T_map_sensor: (4, 4), takes sensor-frame points to the frame of the recording.
    """

    points_sensor: Array
    T_map_sensor: Array


def read_scans(path: Path | str, topic: str = "", map_frame: str = "") -> Iterator[RecordedScan]:
    """All scans of a file, by its ending: .pcd, .graph, .bag or a folder that is a bag.

    :param topic: of the clouds in a bag; empty: its only cloud topic.
    :param map_frame: of a bag's TF; empty: the root of the tree that the cloud's frame is in.
    :raises RecordingError: naming the file and what is wrong with it.
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f"{path}: there is no such file")
    if path.suffix == ".pcd":
        yield read_pcd(path)
    elif path.suffix == ".graph":
        yield from read_graph(path)
    elif path.suffix in (".bag", ".mcap", ".db3") or path.is_dir():
        for points, transform in bag_clouds(path, topic, map_frame):
            yield RecordedScan(points, transform)
    else:
        raise RecordingError(f"{path}: unknown ending; valid: .pcd, .graph, .bag")


def read_pcd(path: Path) -> RecordedScan:
    """A PCD file (ascii, binary or binary_compressed) with the viewpoint of its header.

    :raises RecordingError: for files that are cut off or damaged, or have no x, y and z.
    """
    try:
        return _pcd_scan(path, path.read_bytes())
    except RecordingError as error:
        if str(path) in str(error):
            raise
        raise RecordingError(f"{path}: {error}") from error
    except (ValueError, KeyError, IndexError, TypeError, OverflowError, MemoryError) as error:
        raise RecordingError(f"{path}: is no PCD file that can be read: {error}") from error


def _pcd_scan(path: Path, data: bytes) -> RecordedScan:
    header, body = _pcd_header(path, data)
    fields = header["FIELDS"]
    if not {"x", "y", "z"} <= set(fields):
        raise RecordingError(f"{path}: fields are {fields}; needs x, y and z")
    counts = [int(c) for c in header.get("COUNT", ["1"] * len(fields))]
    formats = [f"<{_pcd_kind(t)}{s}" for t, s in zip(header["TYPE"], header["SIZE"], strict=True)]
    count = int(header["POINTS"][0])
    if count < 0 or min(counts) < 1:
        raise RecordingError(
            f"{path}: has {count} points with fields of {counts} numbers; valid: 0 or more, 1 or more"
        )
    kind = header["DATA"][0]
    if kind == "ascii":
        columns = _ascii_columns(path, body, fields, counts, count)
    else:
        row = np.dtype(
            {"names": fields, "formats": [(f, (c,)) for f, c in zip(formats, counts, strict=True)]}
        )
        columns = _binary_columns(path, body, row, count, kind)
    points = np.stack([np.asarray(columns[name], dtype=float).reshape(count) for name in "xyz"], axis=1)
    x, y, z, qw, qx, qy, qz = (float(v) for v in header.get("VIEWPOINT", ["0", "0", "0", "1", "0", "0", "0"]))
    return RecordedScan(points, matrix_from_quaternion([x, y, z], [qx, qy, qz, qw]))


def _pcd_kind(letter: str) -> str:
    return {"F": "f", "U": "u", "I": "i"}[letter]


def _pcd_header(path: Path, data: bytes) -> tuple[dict[str, list[str]], bytes]:
    header: dict[str, list[str]] = {}
    start = 0
    while "DATA" not in header:
        end = data.find(b"\n", start)
        if end < 0 or start > 10_000:
            raise RecordingError(f"{path}: has no header of a PCD file")
        words = data[start:end].decode("ascii", "replace").split()
        if words and not words[0].startswith("#"):
            header[words[0]] = words[1:]
        start = end + 1
    missing = {"FIELDS", "SIZE", "TYPE", "POINTS"} - set(header)
    if missing:
        raise RecordingError(f"{path}: the header lacks {', '.join(sorted(missing))}")
    return header, data[start:]


def _ascii_columns(
    path: Path, body: bytes, fields: list[str], counts: list[int], count: int
) -> dict[str, Array]:
    numbers = np.array(body.split(), dtype=float)
    if numbers.size != count * sum(counts):
        raise RecordingError(f"{path}: has {numbers.size} numbers; its header says {count * sum(counts)}")
    table = numbers.reshape(count, sum(counts))
    starts = np.cumsum([0, *counts])
    return {name: table[:, start] for name, start in zip(fields, starts, strict=False)}


def _binary_columns(path: Path, body: bytes, row: np.dtype, count: int, kind: str) -> dict[str, Array]:
    names = row.names or ()
    if kind == "binary":
        _require_bytes(path, len(body), count * row.itemsize)
        table = np.frombuffer(body, row, count)
        return {name: table[name][:, 0] for name in names}
    if kind != "binary_compressed":
        raise RecordingError(f"{path}: data is {kind!r}; valid: ascii, binary, binary_compressed")
    _require_bytes(path, len(body), 8)
    packed, size = (int(v) for v in np.frombuffer(body, "<u4", 2))
    _require_bytes(path, len(body), 8 + packed)
    plain = decompress_lzf(body[8 : 8 + packed], size)
    _require_bytes(path, len(plain), count * row.itemsize)
    columns, start = {}, 0
    for name in names:  # one field after the other
        field = row[name]
        columns[name] = np.frombuffer(plain, field.base, count * field.shape[0], start)[:: field.shape[0]]
        start += count * field.itemsize
    return columns


def _require_bytes(path: Path, have: int, need: int) -> None:
    if have < need:
        raise RecordingError(f"{path}: is cut off: {have} bytes of points, needs {need}")


def decompress_lzf(data: bytes, size: int) -> bytes:
    """Bytes of an LZF stream: runs of literals (control below 32) and copies of what came before.

    :raises RecordingError: when the stream is damaged.
    """
    out = bytearray()
    at = 0
    try:
        while at < len(data):
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


def read_graph(path: Path) -> Iterator[RecordedScan]:
    """The scans of an OctoMap scan graph; edges are passed over.

    :raises RecordingError: when the file is cut off or no scan graph.
    """
    data = path.read_bytes()
    point = np.dtype([("size", "<u4"), ("xyz", "<f8", 3)])

    def take(kind: np.dtype | str, count: int, start: int) -> NDArray:
        need = start + np.dtype(kind).itemsize * count
        if need > len(data):
            raise RecordingError(f"{path}: is cut off: {len(data)} bytes, needs {need}")
        return np.frombuffer(data, kind, count, start)

    scans, at = int(take("<u4", 1, 0)[0]), 4
    for _ in range(scans):
        count = int(take("<u4", 1, at)[0])
        points = take(point, count, at + 4)
        at += 4 + count * point.itemsize
        position = take(point, 1, at)[0]
        quaternion = take("<f8", 4, at + point.itemsize + 4)  # after its size: w, x, y, z
        at += point.itemsize + 4 + 32 + 4  # and the number of the scan
        if position["size"] != 3 or (points["size"] != 3).any():
            raise RecordingError(f"{path}: is no scan graph of points with three coordinates")
        w, x, y, z = quaternion
        yield RecordedScan(points["xyz"].copy(), matrix_from_quaternion(position["xyz"], [x, y, z, w]))
