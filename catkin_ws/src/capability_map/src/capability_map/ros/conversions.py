"""Between ROS messages and numpy: the only place of this package where both meet."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Point, Pose, Transform, Vector3
from sensor_msgs.msg import Image
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker


def matrices_from_poses(poses: list[Pose]) -> np.ndarray:
    """(N,) poses to (N, 4, 4).

    :raises ValueError: a quaternion (x, y, z, w) is not of unit length, or a number is not finite; names the pose.
    """
    p = np.array([[m.position.x, m.position.y, m.position.z] for m in poses], float).reshape(-1, 3)
    q = [[m.orientation.x, m.orientation.y, m.orientation.z, m.orientation.w] for m in poses]
    return _matrices(p, np.array(q, float).reshape(-1, 4))


def matrix_from_transform(transform: Transform) -> np.ndarray:
    """T_target_source (4, 4) of a TF lookup. Errors as matrices_from_poses."""
    t, q = transform.translation, transform.rotation
    return _matrices(np.array([[t.x, t.y, t.z]]), np.array([[q.x, q.y, q.z, q.w]]))[0]


def _matrices(positions: np.ndarray, quaternions: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(quaternions, axis=1, keepdims=True)
    good = np.isfinite(positions).all(axis=1) & (np.abs(lengths[:, 0] - 1.0) < 1e-3)
    if not good.all():
        i = int(np.argmin(good))
        raise ValueError(
            f"pose {i}: position {positions[i].tolist()}, quaternion x y z w {quaternions[i].tolist()}; valid: finite, "
            "of unit length"
        )
    x, y, z, w = (quaternions / lengths).T
    T = np.tile(np.eye(4), (len(positions), 1, 1))
    T[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=1)
    T[:, 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=1)
    T[:, 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1)
    T[:, :3, 3] = positions
    return T


def marker_from_points(
    kind: int,
    points: np.ndarray,
    colors: np.ndarray,
    scale_m: tuple[float, float, float],
    namespace: str,
    header: Header,
) -> Marker:
    """A list marker (SPHERE_LIST, LINE_LIST, TRIANGLE_LIST). points (N, 3) [m], colors (N, 4) 0..1."""
    marker = Marker(header=header, ns=namespace, id=0, type=kind, action=Marker.ADD)
    marker.frame_locked = (
        True  # RViz then finds the frame again: a latched marker may come before its transform
    )
    marker.pose.orientation.w = 1.0
    marker.scale = Vector3(*scale_m)
    marker.points = [Point(*row) for row in points.tolist()]
    marker.colors = [ColorRGBA(*row) for row in colors.tolist()]
    return marker


def image_from_pixels(pixels: np.ndarray) -> Image:
    """An rgb8 image of (H, W, 3) uint8."""
    height, width, _ = pixels.shape
    return Image(height=height, width=width, encoding="rgb8", step=3 * width, data=pixels.tobytes())
