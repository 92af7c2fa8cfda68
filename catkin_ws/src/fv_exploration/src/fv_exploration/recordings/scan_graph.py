"""OctoMap scan graphs, read without OctoMap."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fv_exploration.recordings.errors import RecordingError, Warn, is_unit, matrix_from_quaternion

Array = NDArray[np.float64]


def graph_scans(data: bytes, warn: Warn) -> Iterator[tuple[Array, Array]]:
    """(points_sensor (N, 3), T_map_sensor (4, 4)) of each scan of an OctoMap scan graph; edges are passed over.

    :raises RecordingError: when the file is cut off or no scan graph.
    """
    point = np.dtype([("size", "<u4"), ("xyz", "<f8", 3)])

    def take(kind: np.dtype | str, count: int, start: int) -> NDArray:
        need = start + np.dtype(kind).itemsize * count
        if need > len(data):
            raise RecordingError(f"is cut off: {len(data)} bytes, needs {need}")
        return np.frombuffer(data, kind, count, start)

    scans, at = int(take("<u4", 1, 0)[0]), 4
    for number in range(scans):
        count = int(take("<u4", 1, at)[0])
        points = take(point, count, at + 4)
        at += 4 + count * point.itemsize
        position = take(point, 1, at)[0]
        quaternion = take("<f8", 4, at + point.itemsize + 4)  # after its size: w, x, y, z
        at += point.itemsize + 4 + 32 + 4  # and the number of the scan
        if position["size"] != 3 or (points["size"] != 3).any():
            raise RecordingError("is no scan graph of points with three coordinates")
        w, x, y, z = quaternion
        transform = matrix_from_quaternion(position["xyz"], [x, y, z, w])
        if not is_unit(quaternion):
            warn(f"the quaternion of scan {number} is {quaternion.tolist()}: brought to length 1")
        yield points["xyz"].copy(), transform
