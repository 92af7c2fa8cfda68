"""Space that robot.yaml vouches for."""

import numpy as np
from std_msgs.msg import Header

from fv_exploration.robot_body import clearance_boxes, clearance_spheres
from fv_exploration.ros.conversions import volume_msg

CLEARANCE = {
    "boxes": [{"frame": "base", "center_m": [0.1, 0.0, 0.5], "size_m": [0.4, 0.2, 0.6]}],
    "spheres": [{"frame": "base", "center_m": [0.0, 0.3, 0.2], "radius_m": 0.25}],
}


def pose_of(frame: str) -> np.ndarray:
    """A quarter turn about z, one metre ahead."""
    assert frame == "base"
    return np.array([[0.0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def test_boxes_and_spheres_are_told_to_who_draws_them():
    boxes, spheres = clearance_boxes(CLEARANCE, pose_of), clearance_spheres(CLEARANCE, pose_of)
    bounds = np.zeros(3), np.ones(3)
    message = volume_msg(bounds, boxes, spheres, Header(frame_id="world"))
    (box,), (centre,), (radius,) = (
        message.clearance_boxes,
        message.clearance_centers,
        message.clearance_radii,
    )
    assert np.allclose([box.min.x, box.min.y, box.min.z], [0.9, -0.1, 0.2])
    assert np.allclose([box.max.x, box.max.y, box.max.z], [1.1, 0.3, 0.8])
    assert np.allclose([centre.x, centre.y, centre.z, radius], [0.7, 0.0, 0.2, 0.25])
