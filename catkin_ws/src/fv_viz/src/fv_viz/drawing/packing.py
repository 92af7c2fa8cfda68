"""Messages with a million points, serialised from numpy buffers without one Python object per point.

`PackedMarkers` travels as visualization_msgs/MarkerArray (same type, same MD5), its markers are ready-made bytes.
"""

from __future__ import annotations

import struct

import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from fv_common.conversions import cloud_msg


class PackedMarkers(MarkerArray):
    """A MarkerArray whose markers are bytes already; rospy can publish it, nobody can read its fields."""

    __slots__ = ["blobs"]

    def __init__(self, blobs: list[bytes]) -> None:
        super().__init__()
        self.blobs = blobs

    def serialize(self, buff) -> None:
        """Write the array as genpy would: a count and the markers."""
        buff.write(struct.pack("<I", len(self.blobs)))
        for blob in self.blobs:
            buff.write(blob)


def pack_marker(marker: Marker, points: np.ndarray | None = None, colors: np.ndarray | None = None) -> bytes:
    """Serialise a marker whose long lists are given as arrays.

    points (N, 3) [m] and colors (N or N/3, 4) RGBA 0..1 replace the marker's own, which must be empty then.
    """
    points = np.empty((0, 3)) if points is None else np.ascontiguousarray(points, dtype="<f8")
    colors = np.empty((0, 4)) if colors is None else np.ascontiguousarray(colors, dtype="<f4")
    head = marker.header
    frame, namespace = head.frame_id.encode(), marker.ns.encode()
    text, mesh = marker.text.encode(), marker.mesh_resource.encode()
    pose, scale, color = marker.pose, marker.scale, marker.color
    position, turn = pose.position, pose.orientation
    parts = [
        struct.pack(f"<3II{len(frame)}s", head.seq, head.stamp.secs, head.stamp.nsecs, len(frame), frame),
        struct.pack(
            f"<I{len(namespace)}s3i", len(namespace), namespace, marker.id, marker.type, marker.action
        ),
        struct.pack("<7d", position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w),
        struct.pack("<3d4f", scale.x, scale.y, scale.z, color.r, color.g, color.b, color.a),
        struct.pack("<2iB", marker.lifetime.secs, marker.lifetime.nsecs, marker.frame_locked),
        struct.pack("<I", len(points)),
        points.tobytes(),
        struct.pack("<I", len(colors)),
        colors.tobytes(),
        struct.pack(f"<I{len(text)}sI{len(mesh)}s", len(text), text, len(mesh), mesh),
        struct.pack("<B", marker.mesh_use_embedded_materials),
    ]
    return b"".join(parts)


def cloud(header: Header, points: np.ndarray, colors: np.ndarray) -> PointCloud2:
    """An x y z rgb cloud from points (N, 3) [m] and colours (N, 3) or (3,) in 0..1."""
    rgba = np.zeros((len(points), 4), np.uint8)
    rgba[:, :3] = np.clip(colors, 0.0, 1.0) * 255.0
    return cloud_msg(points, header, rgba)
