"""Clouds of a rosbag with the transforms of its TF, read by the ``rosbags`` library: no ROS needed."""

from __future__ import annotations

import bisect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fv_exploration.recording_error import RecordingError, matrix_from_quaternion

CLOUD = "sensor_msgs/msg/PointCloud2"
FLOAT32, FLOAT64 = 7, 8

Array = NDArray[np.float64]


class TransformTree:
    """All transforms of a recording; each edge keeps its history."""

    def __init__(self) -> None:
        self._edges: dict[str, tuple[str, list[float], list[tuple[Array, Array]]]] = {}

    def add(
        self, parent: str, child: str, stamp_s: float, translation: Array, quaternion_xyzw: Array
    ) -> None:
        """A transform that takes child-frame points to the parent frame at a time."""
        known = self._edges.setdefault(child, (parent, [], []))
        at = bisect.bisect(known[1], stamp_s)
        known[1].insert(at, stamp_s)
        known[2].insert(at, (translation, quaternion_xyzw))

    def root(self, frame: str) -> str:
        """The frame that is nobody's child."""
        seen = set()
        while frame in self._edges and frame not in seen:
            seen.add(frame)
            frame = self._edges[frame][0]
        return frame

    def lookup(self, target: str, source: str, stamp_s: float) -> Array:
        """(4, 4) that takes source-frame points to an ancestor frame; between samples it is interpolated.

        :raises RecordingError: when the frames are not connected.
        """
        matrix = np.eye(4)
        frame = source
        while frame != target:
            if frame not in self._edges:
                raise RecordingError(f"TF does not lead from {source!r} to {target!r}; it ends at {frame!r}")
            parent, stamps, poses = self._edges[frame]
            matrix = _interpolated(stamps, poses, stamp_s) @ matrix
            frame = parent
        return matrix


def _interpolated(stamps: list[float], poses: list[tuple[Array, Array]], stamp_s: float) -> Array:
    after = bisect.bisect_left(stamps, stamp_s)
    if after == 0 or after == len(stamps):  # static, or beyond what was recorded
        return matrix_from_quaternion(*poses[min(after, len(stamps) - 1)])
    share = (stamp_s - stamps[after - 1]) / (stamps[after] - stamps[after - 1])
    (p, q), (r, s) = poses[after - 1], poses[after]
    if np.dot(q, s) < 0:
        s = -s
    return matrix_from_quaternion(p + share * (r - p), q + share * (s - q))  # near samples: nlerp does


def cloud_points(msg: Any) -> Array:
    """(N, 3) of a PointCloud2-like message. :raises RecordingError: for fields or sizes that do not fit."""
    fields = {field.name: field for field in msg.fields}
    kinds = {FLOAT32: "f4", FLOAT64: "f8"}
    for name in "xyz":
        if name not in fields or fields[name].datatype not in kinds:
            raise RecordingError(f"cloud fields are {sorted(fields)}; needs float x, y and z")
    order = ">" if msg.is_bigendian else "<"
    formats = [order + kinds[fields[name].datatype] for name in "xyz"]
    last = max(
        fields[name].offset + np.dtype(kind).itemsize for name, kind in zip("xyz", formats, strict=True)
    )
    enough = msg.row_step >= msg.point_step * msg.width and len(msg.data) >= msg.row_step * msg.height
    if msg.point_step < last or not enough:
        raise RecordingError(
            f"cloud of {msg.width} x {msg.height} points has point_step {msg.point_step}, row_step {msg.row_step} "
            f"and {len(msg.data)} bytes; these do not fit together"
        )
    offsets = [fields[name].offset for name in "xyz"]
    point = np.dtype(
        {"names": ["x", "y", "z"], "formats": formats, "offsets": offsets, "itemsize": msg.point_step}
    )
    data = np.ascontiguousarray(msg.data)
    rows = np.ndarray((msg.height, msg.width), point, data, strides=(msg.row_step, msg.point_step))
    return np.stack([rows[name].ravel() for name in "xyz"], axis=1).astype(float)


def _read_tf(reader: Any) -> TransformTree:
    tree = TransformTree()
    for connection, _, raw in reader.messages(
        [c for c in reader.connections if c.topic in ("/tf", "/tf_static")]
    ):
        for item in reader.deserialize(raw, connection.msgtype).transforms:
            t, r = item.transform.translation, item.transform.rotation
            tree.add(
                item.header.frame_id.lstrip("/"),
                item.child_frame_id.lstrip("/"),
                _seconds(item.header.stamp),
                np.array([t.x, t.y, t.z]),
                np.array([r.x, r.y, r.z, r.w]),
            )
    return tree


def _seconds(stamp: Any) -> float:
    return stamp.sec + 1e-9 * stamp.nanosec


def bag_clouds(path: Path, topic: str, map_frame: str) -> Iterator[tuple[Array, Array]]:
    """(points_sensor (N, 3), T_map_sensor (4, 4)) of every cloud of a bag, in its order.

    :raises RecordingError: for a bag that cannot be read, without such a topic, or whose TF has a gap.
    """
    from rosbags.highlevel import AnyReader, AnyReaderError
    from rosbags.typesys import Stores, get_typestore

    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS1_NOETIC)) as reader:
            clouds = [c for c in reader.connections if c.msgtype == CLOUD]
            topics = sorted({c.topic for c in clouds})
            if topic not in topics and (topic or len(topics) != 1):
                raise RecordingError(
                    f"{path}: cloud topic {topic!r}; valid: {', '.join(topics) or 'it has none'}"
                )
            tree = _read_tf(reader)
            for connection, _, raw in reader.messages([c for c in clouds if not topic or c.topic == topic]):
                msg = reader.deserialize(raw, connection.msgtype)
                frame = msg.header.frame_id.lstrip("/")
                target = map_frame or tree.root(frame)
                yield cloud_points(msg), tree.lookup(target, frame, _seconds(msg.header.stamp))
    except AnyReaderError as error:
        raise RecordingError(f"{path}: cannot be read as a bag: {error}") from error
