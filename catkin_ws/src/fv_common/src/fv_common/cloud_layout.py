"""The x, y and z of a sensor_msgs/PointCloud2, rospy's or rosbags' alike: needs no ROS."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fv_common.errors import MessageError

Rows = NDArray[np.void]
Points = NDArray[np.floating[Any]]
Magnitudes = tuple[float, float]
KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""numpy's names of sensor_msgs/PointField's datatypes."""
SAMPLE = 4096
"""Points by which the byte order is judged."""


def cloud_points(msg: Any, warn: Callable[[str], None], sensible_m: Magnitudes) -> Points:
    """The points of a cloud in its own frame, row by row.

    A byte order in which hardly a point makes sense, while nearly all do in the other, is taken for the other.

    :param warn: called with one line for what was replaced or left out.
    :param sensible_m: between which two magnitudes a coordinate lies that a sensor gives, unless it is 0.
    :return: (height * width, 3) float32 or float64 [m]; rows with NaN had no return.
    :raises MessageError: without x, y and z, or with sizes that do not match the data.
    """
    point = _point(msg)
    if msg.width * msg.height == 0:
        if len(msg.data):
            warn(f"cloud of {msg.width} x {msg.height} points holds {len(msg.data)} bytes: not read")
        return np.zeros((0, 3))
    _require_sizes(msg)
    surplus = len(msg.data) - msg.row_step * msg.height
    if surplus:
        warn(f"cloud holds {surplus} bytes after its {msg.width} x {msg.height} points: not read")
    rows: Rows = np.ndarray(
        (msg.height, msg.width), point, _bytes(msg.data), strides=(msg.row_step, msg.point_step)
    )
    if any(point[name].kind != "f" for name in "xyz"):
        warn("x, y and z of a cloud are not all floating-point numbers: taken as metres as they stand")
    elif _is_in_other_order(rows, sensible_m):
        warn(
            f"is_bigendian of a cloud is {bool(msg.is_bigendian)}, but only the other order makes sense: read in that"
        )
        rows = rows.view(point.newbyteorder())
    return _stacked(rows)


def _point(msg: Any) -> np.dtype[np.void]:
    """One point as numpy sees it."""
    fields = [field for name in "xyz" for field in msg.fields if field.name == name]
    if [field.name for field in fields] != list("xyz"):
        raise MessageError(f"cloud fields are {[f.name for f in msg.fields]}; needs x, y and z once each")
    for field in fields:
        if field.datatype not in KINDS or field.count > 1:  # some leave the count of single numbers 0
            raise MessageError(
                f"cloud field {field.name} is {field.count} of datatype {field.datatype}; "
                "valid: 1 of datatype 1 to 8, such as 7 (FLOAT32)"
            )
    order = ">" if msg.is_bigendian else "<"
    formats = [np.dtype(order + KINDS[field.datatype]) for field in fields]
    spans = sorted((f.offset, f.offset + kind.itemsize) for f, kind in zip(fields, formats, strict=True))
    if any(end > begin for (_, end), (begin, _) in pairwise(spans)):
        raise MessageError(f"cloud fields x, y and z overlap: they lie in bytes {spans}")
    if msg.point_step < spans[-1][1]:
        raise MessageError(
            f"cloud has point_step {msg.point_step}; valid: {spans[-1][1]} or more, where its fields end"
        )
    offsets = [field.offset for field in fields]
    return np.dtype(
        {"names": list("xyz"), "formats": formats, "offsets": offsets, "itemsize": msg.point_step}
    )


def _require_sizes(msg: Any) -> None:
    row_is_whole = msg.row_step >= msg.point_step * msg.width
    if not row_is_whole or len(msg.data) < msg.row_step * msg.height:
        raise MessageError(
            f"cloud of {msg.width} x {msg.height} points has point_step {msg.point_step}, row_step {msg.row_step} "
            f"and {len(msg.data)} bytes; these do not fit together"
        )


def _bytes(data: Any) -> NDArray[np.uint8]:
    return np.array(data, np.uint8) if isinstance(data, list | tuple) else np.frombuffer(data, np.uint8)


def _stacked(rows: Rows) -> Points:
    """(N, 3) floating-point numbers of the machine's byte order, of the fields' precision."""
    columns = [rows[name].ravel() for name in "xyz"]
    kind = np.result_type(np.float32, *(column.dtype for column in columns))
    return np.asarray(np.stack(columns, axis=1), kind)


def _is_in_other_order(rows: Rows, sensible_m: Magnitudes) -> bool:
    sample = rows[:, :: max(1, rows.size // SAMPLE)]
    other = sample.view(sample.dtype.newbyteorder())
    return other_order_fits(_stacked(sample), _stacked(other), sensible_m)


def other_order_fits(points: Points, other: Points, sensible_m: Magnitudes) -> bool:
    """Whether hardly one of the points (N, 3) makes sense, but nearly all do as ``other`` byte order has them."""
    return _sensible_share(points, sensible_m) < 0.5 and _sensible_share(other, sensible_m) > 0.9


def _sensible_share(points: Points, sensible_m: Magnitudes) -> float:
    """Share of the points with numbers whose coordinates a sensor can give; 1 without any."""
    points = np.abs(points[np.isfinite(points).all(axis=1)])
    sensible = (points == 0) | ((points >= sensible_m[0]) & (points <= sensible_m[1]))
    return float(sensible.all(axis=1).mean()) if len(points) else 1.0
