"""Messages from and to arrays: what goes in comes out."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from fv_common import transforms
from fv_common.cloud_layout import cloud_points
from fv_common.conversions import (
    cloud_msg,
    image_msg,
    matrices_from_poses,
    matrix_from_pose,
    matrix_from_transform,
    pose_array,
    pose_from_matrix,
    transform_from_matrix,
)
from fv_common.errors import MessageError

HEAD = Header(frame_id="camera")
SENSIBLE = (1e-6, 1e5)


def random_poses(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3], T[:, :3, 3] = (
        Rotation.random(count, random_state=seed).as_matrix(),
        rng.normal(size=(count, 3)),
    )
    return T


@pytest.mark.parametrize("seed", range(3))
def test_poses_survive_their_messages(seed):
    poses = random_poses(50, seed)
    assert np.allclose(matrices_from_poses(pose_array(poses, HEAD).poses), poses, atol=1e-12)
    for T in poses[:5]:
        assert np.allclose(matrix_from_pose(pose_from_matrix(T)), T, atol=1e-12)
        assert np.allclose(matrix_from_transform(transform_from_matrix(T)), T, atol=1e-12)
    assert matrices_from_poses([]).shape == (0, 4, 4)


def test_half_turns_survive_too():
    for axis in np.vstack([np.eye(3), -np.eye(3)]):
        T = np.eye(4)
        T[:3, :3] = Rotation.from_rotvec(np.pi * axis).as_matrix()
        assert np.allclose(matrix_from_pose(pose_from_matrix(T)), T, atol=1e-12)


@pytest.mark.parametrize(
    ("position", "turn"),
    [
        ((0, 0, math.nan), (0, 0, 0, 1)),
        ((0, 0, 0), (0, 0, 0, 0)),
        ((0, 0, 0), (0, 0, 0, 1.1)),
        ((0, 0, 0), (math.inf,) * 4),
    ],
)
def test_what_is_no_pose_is_named(position, turn):
    poses = [Pose(orientation=Quaternion(w=1.0)), Pose(Point(*position), Quaternion(*turn))]
    with pytest.raises(MessageError, match=r"pose 1: position .*; valid: finite, of unit length"):
        matrices_from_poses(poses)
    with pytest.raises(MessageError, match=r"pose 0: "):
        matrix_from_transform(Transform(Vector3(*position), Quaternion(*turn)))


def test_quaternions_are_rounded_to_a_digit_or_two_in_many_files():
    half = 0.707
    assert np.allclose(matrix_from_pose(Pose(Point(), Quaternion(0, 0, half, half)))[:3, 0], [0, 1, 0])


@pytest.mark.parametrize("shape", [(5,), (0,), (4, 6)])
@pytest.mark.parametrize("coloured", [False, True])
def test_clouds_survive_their_messages(shape, coloured):
    rng = np.random.default_rng(0)
    points = rng.normal(size=(*shape, 3)).astype(np.float32)
    points[..., :1, :] = np.nan
    rgba = rng.integers(0, 256, (*shape, 4), np.uint8) if coloured else None
    msg = cloud_msg(points, HEAD, rgba)
    assert (msg.height, msg.width, msg.header.frame_id) == (*((1,) * (2 - len(shape))), *shape, "camera")
    assert msg.is_dense == (shape == (0,))
    out = cloud_points(msg, pytest.fail, SENSIBLE)
    assert np.array_equal(out, points.reshape(-1, 3), equal_nan=True)
    if coloured and out.size:
        rgb = np.frombuffer(msg.data, "<u4").reshape(-1, 4)[:, 3]
        red, green, blue, _ = rgba.reshape(-1, 4).astype(np.uint32).T
        assert np.array_equal(rgb, red << 16 | green << 8 | blue)


def test_pictures_survive_their_messages():
    rng = np.random.default_rng(0)
    pixels = rng.integers(0, 256, (3, 5, 4), np.uint8)
    msg = image_msg(pixels, HEAD)
    assert (msg.encoding, msg.height, msg.width, msg.step) == ("rgb8", 3, 5, 15)
    assert np.array_equal(np.frombuffer(msg.data, np.uint8).reshape(3, 5, 3), pixels[..., :3])
    assert image_msg(pixels[..., :3], HEAD).data == msg.data
    depth = rng.normal(size=(3, 5))
    msg = image_msg(depth, HEAD)
    assert (msg.encoding, msg.height, msg.width, msg.step) == ("32FC1", 3, 5, 20)
    assert np.array_equal(np.frombuffer(msg.data, "<f4").reshape(3, 5), depth.astype(np.float32))


@pytest.mark.parametrize("seed", range(3))
def test_transforms_hold_together(seed):
    one, other = random_poses(2, seed)
    points = np.random.default_rng(seed).normal(size=(7, 3))
    assert np.allclose(transforms.inverse(one), np.linalg.inv(one))
    assert np.allclose(
        transforms.apply(one, transforms.apply(other, points)), transforms.apply(one @ other, points)
    )
    assert np.allclose(transforms.transform(one[:3, 3], transforms.quaternion_of(one)), one)
    # URDF: R = Rz(yaw) Ry(pitch) Rx(roll)
    roll, pitch, yaw = angles = np.random.default_rng(seed).uniform(-1, 1, 3)
    turn = Rotation.from_euler("z", yaw) * Rotation.from_euler("y", pitch) * Rotation.from_euler("x", roll)
    assert np.allclose(transforms.from_rpy([1, 2, 3], angles)[:3], np.c_[turn.as_matrix(), [1, 2, 3]])
