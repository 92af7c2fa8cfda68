"""Clouds of a rosbag with the transforms of its TF, read by the ``rosbags`` library: no ROS needed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fv_common.cloud_layout import cloud_points
from fv_common.errors import MessageError
from fv_exploration.recordings.errors import RecordingError, Warn, one_line
from fv_exploration.recordings.transforms import OutsideSpan, TransformTree, quoted
from fv_exploration.returns import SENSIBLE_M

CLOUD = "sensor_msgs/msg/PointCloud2"
TF_TOPICS = {"tf": False, "tf_static": True}
"""Whether the transforms of a topic hold always."""

Array = NDArray[np.float64]


def bag_scans(path: Path, topic: str, map_frame: str, warn: Warn) -> Iterator[tuple[Array, Array]]:
    """(points_sensor (N, 3), T_map_sensor (4, 4)) of every cloud of a bag, in its order.

    :raises RecordingError: for a bag that cannot be read, without such a topic, or whose TF does not say where its
        clouds were taken.
    """
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS1_NOETIC)) as reader:
            yield from _scans(reader, topic, map_frame, warn)
    except (RecordingError, OSError, MemoryError):
        raise
    except Exception as error:  # the library lets through whatever a damaged byte makes of its parsers
        raise RecordingError(f"cannot be read as a bag: {one_line(error)}") from error


def _scans(reader: Any, topic: str, map_frame: str, warn: Warn) -> Iterator[tuple[Array, Array]]:
    connections = _cloud_connections(reader, topic)
    poses = _Poses(_read_tf(reader), map_frame.lstrip("/"), warn)
    told: set[str] = set()

    def warn_once(text: str) -> None:
        if text not in told:
            told.add(text)
            warn(text)

    for connection, _, raw in reader.messages(connections):
        msg = reader.deserialize(raw, connection.msgtype)
        transform = poses.of(msg.header)
        if transform is None:
            continue
        try:
            yield cloud_points(msg, warn_once, SENSIBLE_M).astype(float), transform
        except MessageError as error:
            raise RecordingError(str(error)) from error
    poses.finish()


def _cloud_connections(reader: Any, topic: str) -> list[Any]:
    clouds = [c for c in reader.connections if c.msgtype == CLOUD]
    topics = sorted({c.topic for c in clouds})
    if topic and topic not in topics:
        raise RecordingError(f"cloud topic {topic!r}; valid: {', '.join(topics) or 'it has none'}")
    if not topics:
        raise RecordingError(f"has no clouds; needs a topic of {CLOUD.replace('/msg', '')}")
    if not topic and len(topics) > 1:
        raise RecordingError(f"has several cloud topics; choose one: {', '.join(topics)}")
    return [c for c in clouds if not topic or c.topic == topic]


def _read_tf(reader: Any) -> TransformTree:
    tree = TransformTree()
    connections = [c for c in reader.connections if c.topic.lstrip("/") in TF_TOPICS]
    for topic in sorted({c.topic for c in reader.connections if c.topic.endswith(("/tf", "/tf_static"))}):
        if topic.lstrip("/") not in TF_TOPICS:
            tree.note(f"{topic} was not read, only /tf and /tf_static are")
    if not connections:
        return tree  # without any, the library would give all messages
    for connection, _, raw in reader.messages(connections):
        static = TF_TOPICS[connection.topic.lstrip("/")]
        for item in reader.deserialize(raw, connection.msgtype).transforms:
            t, r = item.transform.translation, item.transform.rotation
            tree.add(
                item.header.frame_id.lstrip("/"),
                item.child_frame_id.lstrip("/"),
                _nanoseconds(item.header.stamp),
                (t.x, t.y, t.z),
                (r.x, r.y, r.z, r.w),
                static,
            )
    return tree


def _nanoseconds(stamp: Any) -> int:
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


class _Poses:
    """Where each cloud was taken; counts those of which nobody knows."""

    def __init__(self, tree: TransformTree, map_frame: str, warn: Warn) -> None:
        self._tree = tree
        self._map_frame = map_frame
        self._warn = warn
        self._clouds = 0
        self._own = 0  # clouds without a transform
        self._dropped: list[OutsideSpan] = []
        self._stamps_s: list[float] = []  # of these

    def of(self, header: Any) -> Array | None:
        """(4, 4) of a cloud; None when its stamp lies outside of TF's span."""
        self._clouds += 1
        frame = header.frame_id.lstrip("/")
        if frame == self._map_frame and frame:
            return np.eye(4)
        if frame not in self._tree and not self._map_frame:
            return self._own_frame(frame)
        if not frame:
            raise RecordingError("the frame_id of a cloud is empty; valid: a frame of TF")
        stamp_ns = _nanoseconds(header.stamp)
        try:
            return self._tree.lookup(self._map_frame or self._root(frame), frame, stamp_ns)
        except OutsideSpan as error:
            self._dropped.append(error)
            self._stamps_s.append(stamp_ns / 1e9)
            return None

    def _own_frame(self, frame: str) -> Array:
        self._own += 1
        if self._own > 1:
            noted = f" ({self._tree.noted()})" if self._tree.noted() else ""
            raise RecordingError(
                f"has several clouds in frame {frame!r} and no TF of it{noted}, so that nobody knows where they were "
                "taken; valid: one cloud, TF, or that frame as the frame of the map"
            )
        self._warn(f"has no TF of frame {frame!r}: its cloud is in its own frame")
        return np.eye(4)

    def _root(self, frame: str) -> str:
        root = self._tree.root(frame)
        if root == frame and self._clouds == 1:
            self._warn(f"clouds are in frame {frame!r}, the root of TF: all their rays start at its origin")
        if self._clouds == 1 and (others := self._tree.unconnected(frame)):
            self._warn(f"TF does not connect {frame!r} with {quoted(others)}: the map is in frame {root!r}")
        return root

    def finish(self) -> None:
        """Tell of what was left out.

        :raises RecordingError: when no cloud was left.
        """
        if self._tree.noted():
            self._warn(f"TF: {self._tree.noted()}")
        if not self._dropped:
            return
        nearest, farthest = (f(e.beyond_s for e in self._dropped) for f in (min, max))
        stamps = f"{min(self._stamps_s):.3f} to {max(self._stamps_s):.3f} s"
        text = f"stamps {stamps} lie outside of {self._dropped[0]}, by {nearest:.3f} to {farthest:.3f} s"
        if len(self._dropped) == self._clouds:
            raise RecordingError(
                f"all {self._clouds} clouds are useless: their {text}; are they of another clock?"
            )
        self._warn(f"{len(self._dropped)} of {self._clouds} clouds were left out: their {text}")
