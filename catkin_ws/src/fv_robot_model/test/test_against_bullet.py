"""Kinematics and self-collision against pybullet, which reads the same URDF by itself."""

import numpy as np
import pytest

from fv_robot_model import SelfCollision

pytest.importorskip("pybullet")
from bullet import BulletRobot

CONFIGURATIONS_FK = 200
CONFIGURATIONS_COLLISION = 2000
TOUCHING_M = 2e-3  # two margins of 1 mm, which pybullet lays around hulls


def test_forward_kinematics_agree(robot) -> None:
    bullet = BulletRobot(robot.urdf_file)
    model = robot.model
    q = robot.random_q(CONFIGURATIONS_FK, seed=1)
    for values, poses in zip(q, model.forward(q), strict=True):
        bullet.set(model.joint_names, values)
        for link, T_root_link in zip(model.link_names, poses, strict=True):
            expected = bullet.T_root_link(model.root_link, link)
            np.testing.assert_allclose(T_root_link, expected, atol=1e-6, err_msg=link)


def test_self_contacts_agree_unless_just_touching(robot) -> None:
    bullet = BulletRobot(robot.urdf_file)
    checker = SelfCollision(robot.model)
    pairs = checker.checked_pairs
    contacts = 0
    for values in robot.random_q(CONFIGURATIONS_COLLISION, seed=2):
        bullet.set(robot.model.joint_names, values)
        ours = set(checker.contacts(values))
        contacts += len(ours)
        for pair in pairs:
            distance_m = bullet.distance(*pair, within_m=0.01)
            if abs(distance_m) > TOUCHING_M:
                assert (pair in ours) == (distance_m < 0.0), (pair, distance_m, values.tolist())
    assert contacts > 0, "the random configurations met no contact: nothing was compared"
