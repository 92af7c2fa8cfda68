"""Kinematics from the URDF text against scipy's rotations."""

import numpy as np
import pytest
import viz_synthetic
from scipy.spatial.transform import Rotation

from fv_viz import robot, shapes


@pytest.mark.parametrize("seed", range(5))
def test_a_planar_chain_stands_where_trigonometry_says(seed):
    angles = np.random.default_rng(seed).uniform(-2, 2, 3)
    poses = robot.RobotShapes(viz_synthetic.urdf()).link_poses({f"j{k}": a for k, a in enumerate(angles)})
    turned = np.cumsum(angles)
    expected = np.array([0.3 * np.cos(turned[:2]).sum(), 0.3 * np.sin(turned[:2]).sum(), 0.3])
    np.testing.assert_allclose(poses["l2"][:3, 3], expected, atol=1e-12)
    np.testing.assert_allclose(
        poses["l2"][:3, :3], Rotation.from_euler("z", turned[2]).as_matrix(), atol=1e-12
    )


@pytest.mark.parametrize("seed", range(20))
def test_quaternions_turn_back_into_their_matrix(seed):
    R = Rotation.random(random_state=seed).as_matrix()
    np.testing.assert_allclose(shapes.rotations(robot.quaternion(R)[None])[0], R, atol=1e-12)


def test_half_turns_have_quaternions():
    for axis in np.eye(3):
        R = Rotation.from_rotvec(np.pi * axis).as_matrix()
        np.testing.assert_allclose(shapes.rotations(robot.quaternion(R)[None])[0], R, atol=1e-12)


def test_origins_limits_of_types_and_mimics():
    text = """<robot name="r"><link name="a"/><link name="b"><visual><origin rpy="0.1 0.2 0.3"/><geometry>
    <mesh filename="package://x/y.stl" scale="2 2 2"/></geometry></visual></link><link name="c"/>
    <joint name="s" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="1 0 0" rpy="0 0 1.5"/>
    <axis xyz="0 0 2"/></joint><joint name="m" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
    <mimic joint="s" multiplier="-2" offset="0.5"/></joint></robot>"""
    model = robot.RobotShapes(text)
    poses = model.link_poses({"s": 0.25})
    np.testing.assert_allclose(poses["b"][:3, 3], [1, 0, 0.25])
    np.testing.assert_allclose(poses["c"][:3, 3], [1, 0, 0.25], atol=1e-12)
    np.testing.assert_allclose(
        model.visuals[0].T_link_shape[:3, :3], Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix()
    )
    assert model.visuals[0].size == (2, 2, 2)
    assert model.moved_by(["s"]) == {"b", "c"}


def test_only_moved_links_become_ghosts():
    assert robot.RobotShapes(viz_synthetic.urdf()).moved_by(["j1"]) == {"l1", "l2"}


@pytest.mark.parametrize(
    "text", ["<robot", "<robot name='x'/>", "<robot><link name='a'/><link name='b'/></robot>"]
)
def test_broken_descriptions_are_refused(text):
    with pytest.raises(ValueError, match="robot description"):
        robot.RobotShapes(text)
