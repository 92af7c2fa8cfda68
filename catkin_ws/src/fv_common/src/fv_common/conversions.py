"""ROS messages of poses, clouds and pictures from and to arrays. Pure: no node, no topic, no clock."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Transform, Vector3
from numpy.typing import NDArray
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import Header

from fv_common.errors import MessageError
from fv_common.transforms import Array, quaternion_of, require_poses, transform


def matrices_from_poses(poses: Sequence[Pose]) -> Array:
    """(N, 4, 4) matrices of geometry_msgs/Pose.

    :raises MessageError: a number is not finite, or a quaternion not of unit length; names the pose.
    """
    return _matrices([pose.position for pose in poses], [pose.orientation for pose in poses])


def matrix_from_pose(pose: Pose) -> Array:
    """(4, 4) matrix of a geometry_msgs/Pose. Errors as matrices_from_poses."""
    return np.asarray(matrices_from_poses([pose])[0])


def matrix_from_transform(move: Transform) -> Array:
    """T_target_source (4, 4) of a geometry_msgs/Transform. Errors as matrices_from_poses."""
    return np.asarray(_matrices([move.translation], [move.rotation])[0])


def _matrices(positions: Sequence[Point | Vector3], turns: Sequence[Quaternion]) -> Array:
    p = np.array([[m.x, m.y, m.z] for m in positions], float).reshape(-1, 3)
    q = np.array([[m.x, m.y, m.z, m.w] for m in turns], float).reshape(-1, 4)
    try:
        require_poses(p, q)
    except ValueError as error:
        raise MessageError(str(error)) from error
    return transform(p, q) if len(p) else np.zeros((0, 4, 4))  # scipy knows no empty rotations


def pose_from_matrix(T: Array) -> Pose:
    """geometry_msgs/Pose of a (4, 4) matrix."""
    return Pose(Point(*T[:3, 3]), Quaternion(*quaternion_of(T)))


def transform_from_matrix(T: Array) -> Transform:
    """geometry_msgs/Transform of a (4, 4) matrix."""
    return Transform(Vector3(*T[:3, 3]), Quaternion(*quaternion_of(T)))


def pose_array(matrices: Array, header: Header) -> PoseArray:
    """geometry_msgs/PoseArray of (N, 4, 4) matrices."""
    return PoseArray(header, [pose_from_matrix(matrix) for matrix in matrices])


def cloud_msg(
    points: NDArray[np.floating[Any]], header: Header, rgba: NDArray[np.uint8] | None = None
) -> PointCloud2:
    """A cloud of points (N, 3), or (H, W, 3) for an organised one, as float32 [m]; NaN: no return.

    :param rgba: colours (..., 4) of the points.
    """
    width, height = points.shape[-2], points.shape[0] if points.ndim == 3 else 1
    names = "xyz" if rgba is None else ("x", "y", "z", "rgb")
    step = 4 * len(names)
    data = bytearray(step * height * width)  # filled in place: a copy of it would take as long
    values: NDArray[np.float32] = np.ndarray((*points.shape[:-1], len(names)), "<f4", data)
    values[..., :3] = points
    if rgba is not None:
        np.right_shift(rgba.view(">u4")[..., 0], 8, out=values.view("<u4")[..., 3])  # 0x00rrggbb
    return PointCloud2(
        header=header,
        height=height,
        width=width,
        fields=[PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate(names)],
        is_bigendian=False,
        point_step=step,
        row_step=step * width,
        data=data,
        is_dense=points.ndim == 2 and bool(np.isfinite(points).all()),  # a whole image is not looked through
    )


def image_msg(pixels: NDArray[np.generic], header: Header) -> Image:
    """An rgb8 image of (H, W, 3 or 4) uint8, or a 32FC1 one of depth (H, W) [m], NaN: no return (REP 118)."""
    is_depth = pixels.ndim == 2
    data = (
        np.ascontiguousarray(pixels, "<f4") if is_depth else np.ascontiguousarray(pixels[..., :3], np.uint8)
    )
    height, width = pixels.shape[:2]
    return Image(
        header=header,
        height=height,
        width=width,
        encoding="32FC1" if is_depth else "rgb8",
        step=data.nbytes // max(height, 1),
        data=data.tobytes(),
    )
