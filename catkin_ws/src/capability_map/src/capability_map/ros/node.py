"""The node: answers QueryCapability and shows the map in RViz."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rospy
import tf2_ros
from fv_msgs.srv import QueryCapability, QueryCapabilityRequest, QueryCapabilityResponse
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from capability_map.capability_map import CapabilityMap
from capability_map.drawing import geometry
from capability_map.errors import CapabilityMapError
from capability_map.paths import default_map_path
from capability_map.ros.markers import marker_from_points
from fv_common.conversions import image_msg, matrices_from_poses, matrix_from_transform
from fv_common.ros_master import missing_parameter, wait_for_master
from fv_common.transform_buffer import TransformBuffer


class CapabilityNode:
    """`/capability_map/query`, and latched markers of spheres, index cuts and shapes, with a legend.

    Parameters: `~map` (file; default: that of the robot's capability group), `~marker_spheres` (largest number of
    spheres drawn with spikes or shapes, default 400), and the robot's `/robot` and `/robot_description`.
    """

    def __init__(self) -> None:
        path = rospy.get_param("~map", "") or self._default_path()
        self._map = CapabilityMap.load(path, urdf_xml=rospy.get_param("/robot_description"))
        self._tf_buffer = TransformBuffer()
        self._tf_listener = tf2_ros.TransformListener(self._tf_buffer)
        self._publishers = self._show_markers(int(rospy.get_param("~marker_spheres", 400)))
        self._service = rospy.Service("/capability_map/query", QueryCapability, self._on_query)
        rospy.loginfo(
            "capability map %s: %d spheres of %s", path, len(self._map.centres), self._map.data.group
        )

    @staticmethod
    def _default_path() -> Path:
        robot = rospy.get_param("/robot")
        return default_map_path(robot["name"], robot["exploration"]["capability_group"])

    def _on_query(self, request: QueryCapabilityRequest) -> QueryCapabilityResponse:
        if request.group not in ("", self._map.data.group):
            return _refused(f"this map is of group '{self._map.data.group}', not '{request.group}'")
        try:
            T_base_tips = self._to_base(request.header) @ matrices_from_poses(request.poses)
        except (tf2_ros.TransformException, ValueError) as err:
            return _refused(str(err))
        answers = self._map.query_poses(T_base_tips, request.interpolate)
        return QueryCapabilityResponse(
            success=True,
            reachability=answers.tolist(),
            reachable=(answers >= self._map.threshold).tolist(),
        )

    def _to_base(self, header: Header) -> np.ndarray:
        if header.frame_id == self._map.base_frame:
            return np.eye(4)
        lookup = self._tf_buffer.lookup_transform(
            self._map.base_frame, header.frame_id, header.stamp, rospy.Duration(0.5)
        )
        return matrix_from_transform(lookup.transform)

    def _show_markers(self, most: int) -> list[rospy.Publisher]:
        header = Header(frame_id=self._map.base_frame)
        arrays = {
            "~spheres": [_sphere_marker(self._map, header, most)],
            "~index_cuts": _cut_markers(self._map, header),
            "~shapes": [_shape_marker(self._map, header, most)],
        }
        publishers = []
        for topic, markers in arrays.items():
            publisher = rospy.Publisher(topic, MarkerArray, queue_size=1, latch=True)
            publisher.publish(MarkerArray(markers=markers))
            publishers.append(publisher)
        legend = rospy.Publisher("~legend", Image, queue_size=1, latch=True)
        legend.publish(image_msg(geometry.index_legend(float(self._map.index().max(initial=0.0))), Header()))
        return [*publishers, legend]


def _refused(why: str) -> QueryCapabilityResponse:
    return QueryCapabilityResponse(success=False, message=why)


def _spread(cap: CapabilityMap, most: int) -> np.ndarray:
    """At most so many rows of spheres, from the two layers through the shoulder, evenly."""
    rows = np.unique(np.concatenate([geometry.cut_rows(cap, 1), geometry.cut_rows(cap, 2)]))
    return rows[np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(int)] if len(rows) else rows


def _sphere_marker(cap: CapabilityMap, header: Header, most: int) -> Marker:
    points, owners = geometry.spikes(cap, _spread(cap, most))
    colors = np.repeat(geometry.index_colors(cap.index())[owners], 2, axis=0)
    return marker_from_points(
        Marker.LINE_LIST, points, colors, (0.05 * cap.radius, 0.0, 0.0), "spheres", header
    )


def _cut_markers(cap: CapabilityMap, header: Header) -> list[Marker]:
    markers = []
    colors = geometry.index_colors(cap.index())
    for axis, name in enumerate("xyz"):
        rows = geometry.cut_rows(cap, axis)
        scale = (1.6 * cap.radius,) * 3
        markers.append(
            marker_from_points(
                Marker.SPHERE_LIST, cap.centres[rows], colors[rows], scale, f"cut_{name}", header
            )
        )
    return markers


def _shape_marker(cap: CapabilityMap, header: Header, most: int) -> Marker:
    points, owners = geometry.shape_triangles(cap, _spread(cap, most))
    colors = np.repeat(geometry.index_colors(cap.index(), 0.6)[owners], 3, axis=0)
    return marker_from_points(Marker.TRIANGLE_LIST, points, colors, (1.0, 1.0, 1.0), "shapes", header)


def main() -> int:
    """Run the node until it is shut down; the exit code."""
    wait_for_master("capability_node")
    rospy.init_node("capability_map")
    try:
        _node = CapabilityNode()  # keeps its service and publishers alive
    except KeyError as err:
        rospy.logfatal("capability_node cannot start: %s", missing_parameter(err))
        return 1
    except (CapabilityMapError, ValueError, OSError) as err:
        rospy.logfatal("capability_node cannot start: %s", err)
        return 1
    rospy.spin()
    return 0
