"""Lists of points, lines and triangles as markers."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker


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
