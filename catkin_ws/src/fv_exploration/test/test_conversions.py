"""Messages from and to arrays."""

import numpy as np
import pytest
from sensor_msgs.msg import PointField
from std_msgs.msg import Header

from fv_exploration.ros.conversions import (
    MessageError,
    cloud_msg,
    matrix_from_pose,
    points_from_cloud,
    pose_from_matrix,
)

POINTS = np.array([[1.0, -2.0, 3.5], [np.nan] * 3, [0.25, 0.0, -1.0]], np.float32)


def cloud():
    return cloud_msg(POINTS, Header(frame_id="world"))


def test_a_cloud_survives_its_message():
    message = cloud()
    assert (message.header.frame_id, message.width, message.is_dense) == ("world", 3, False)
    assert np.array_equal(points_from_cloud(message), POINTS, equal_nan=True)
    assert points_from_cloud(cloud_msg(np.zeros((0, 3)), Header())).shape == (0, 3)


def test_organised_clouds_with_padding_and_of_the_other_byte_order_are_read():
    message = cloud()
    rows = np.zeros((1, 3), np.dtype({"names": ["x", "y", "z"], "formats": [">f4"] * 3, "itemsize": 20}))
    for k, name in enumerate("xyz"):
        rows[name] = POINTS[:, k]
    message.is_bigendian, message.point_step, message.row_step = True, 20, 60 + 4
    message.data = rows.tobytes() + bytes(4)
    assert np.array_equal(points_from_cloud(message), POINTS, equal_nan=True)


def _rename(message):
    message.fields[2].name = "depth"


def _retype(message):
    message.fields[0].datatype = PointField.FLOAT64


def _squeeze(message):
    message.point_step = 8


def _move(message):
    message.fields[2].offset = 12


def _cut(message):
    message.data = message.data[:-1]


def _lengthen(message):
    message.row_step = 12


@pytest.mark.parametrize("spoil", [_rename, _retype, _squeeze, _move, _cut, _lengthen])
def test_clouds_whose_fields_or_sizes_do_not_fit_are_refused(spoil):
    message = cloud()
    spoil(message)
    with pytest.raises(MessageError, match="cloud"):
        points_from_cloud(message)


def test_a_pose_survives_its_message():
    matrix = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    assert np.allclose(matrix_from_pose(pose_from_matrix(matrix)), matrix)
