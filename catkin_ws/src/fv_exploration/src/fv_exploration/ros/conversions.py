"""ROS messages from and to arrays. Pure: no node, no topic, no clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from fv_msgs.msg import (
    AttachedObject,
    AttachedObjects,
    Box,
    Ellipsoid,
    ExplorationVolume,
    FrontierVoid,
    MapUpdate,
    View,
    Views,
)
from fv_msgs.msg import Evaluation as EvaluationMsg
from geometry_msgs.msg import Point, Quaternion, Vector3
from numpy.typing import NDArray
from octomap_msgs.msg import Octomap
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from fv_common.cloud_layout import cloud_points
from fv_common.conversions import matrix_from_pose, pose_from_matrix
from fv_common.errors import MessageError
from fv_exploration import Evaluation, OccupancyMap, Utility
from fv_exploration.bounds import Bounds
from fv_exploration.recordings.errors import python_warning
from fv_exploration.returns import SENSIBLE_M
from fv_exploration.robot_body import HeldObject
from fv_exploration.strategy import Candidates
from fv_robot_model import Shape

Array = NDArray[np.float64]


def points_from_cloud(cloud: PointCloud2, warn: Callable[[str], None] = python_warning) -> NDArray:
    """The x, y, z of a cloud in its own frame; see fv_common.cloud_layout. Errors as that."""
    return cloud_points(cloud, warn, SENSIBLE_M)


def box_msg(minimum: Array, maximum: Array) -> Box:
    """fv_msgs/Box of two corners (3,) [m]."""
    return Box(Point(*minimum), Point(*maximum))


def octomap_msg(occupancy_map: OccupancyMap, header: Header, binary: bool) -> Octomap:
    """octomap_msgs/Octomap of the map: classes only when ``binary``, else with probabilities."""
    data = occupancy_map.binary_data() if binary else occupancy_map.full_data()
    return Octomap(
        header, binary, "OcTree", occupancy_map.resolution_m, np.frombuffer(data, np.int8).tolist()
    )


def map_update_msg(occupancy_map: OccupancyMap, octomap: Octomap) -> MapUpdate:
    """fv_msgs/MapUpdate with the map's sequence number and bounds."""
    return MapUpdate(
        octomap.header,
        occupancy_map.sequence,
        Point(*occupancy_map.bounds_min),
        Point(*occupancy_map.bounds_max),
        octomap,
    )


def volume_msg(
    bounds: Bounds, boxes: list[Bounds], spheres: list[tuple[Array, float]], header: Header
) -> ExplorationVolume:
    """fv_msgs/ExplorationVolume of the bounds and the clearance: boxes, and spheres by centre and radius [m]."""
    return ExplorationVolume(
        header,
        box_msg(*bounds),
        [box_msg(*box) for box in boxes],
        [Point(*centre) for centre, _ in spheres],
        [radius for _, radius in spheres],
    )


def views_msg(candidates: Candidates, chosen: int, header: Header) -> Views:
    """fv_msgs/Views of ``strategy.Candidates``; camera and counters are left for the caller."""
    rows = zip(
        candidates.poses,
        candidates.utility,
        candidates.void_gain,
        candidates.unknown_gain,
        candidates.frontier_gain,
        candidates.scores,
        candidates.reachability,
        strict=True,
    )
    views = [View(pose_from_matrix(pose), *map(float, figures)) for pose, *figures in rows]
    return Views(header=header, views=views, chosen=chosen)


def ellipsoid_msg(ellipsoid: Any) -> Ellipsoid:
    """fv_msgs/Ellipsoid of an evaluation's ellipsoid (centre, axes as columns, semi-axes)."""
    axes = np.array(ellipsoid["axes"], dtype=float)
    if np.linalg.det(axes) < 0:  # eigenvectors are signless: make them a rotation
        axes[:, 2] *= -1
    return Ellipsoid(
        Point(*ellipsoid["center"]),
        Quaternion(*Rotation.from_matrix(axes).as_quat()),
        Vector3(*ellipsoid["semi_axes"]),
        int(ellipsoid["count"]),
        float(ellipsoid["fit"]),
    )


def evaluation_msg(
    occupancy_map: OccupancyMap, evaluation: Evaluation, utility: Utility | None, header: Header
) -> EvaluationMsg:
    """fv_msgs/Evaluation of everything that was found in the map."""
    message = EvaluationMsg(
        header=header,
        map_sequence=occupancy_map.sequence,
        resolution=occupancy_map.resolution_m,
        occupied=_flat(occupancy_map.voxels("occupied")),
        free=_flat(occupancy_map.voxels("free")),
        frontier=_flat(evaluation.frontier),
        frontier_cluster=np.asarray(evaluation.frontier_cluster, dtype=np.uint32),
        void=_flat(evaluation.void),
        void_ellipsoid=np.asarray(evaluation.void_ellipsoid, dtype=np.uint32),
        ellipsoids=[ellipsoid_msg(ellipsoid) for ellipsoid in evaluation.ellipsoids],
        frontier_voids=[
            FrontierVoid(int(ellipsoid), np.asarray(clusters, dtype=np.uint32))
            for ellipsoid, clusters in evaluation.frontier_voids
        ],
    )
    if utility is not None:
        message.utility_points = _flat(utility.points)
        message.utility = np.asarray(utility.utility, dtype=np.float32)
        message.utility_direction = _flat(utility.direction)
    return message


def held_objects(msg: AttachedObjects) -> list[HeldObject]:
    """What the robot holds, as the planning node tells.

    :raises MessageError: for a kind of shape that does not exist.
    """
    return [
        HeldObject(item.name, item.link, tuple(item.touch_links), _held_shape(item)) for item in msg.objects
    ]


def _held_shape(item: AttachedObject) -> Shape:
    sizes, T_link_shape = item.dimensions, matrix_from_pose(item.pose)
    if item.kind == AttachedObject.BOX:
        return Shape.box([sizes.x, sizes.y, sizes.z], T_link_shape)
    if item.kind == AttachedObject.CYLINDER:
        return Shape.cylinder(sizes.x, sizes.y, T_link_shape)
    if item.kind == AttachedObject.SPHERE:
        return Shape.sphere(sizes.x, T_link_shape)
    raise MessageError(f"object {item.name!r}: kind is {item.kind}; valid: 0 (BOX), 1 (CYLINDER), 2 (SPHERE)")


def _flat(points: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.ascontiguousarray(points, dtype=np.float32).ravel()
