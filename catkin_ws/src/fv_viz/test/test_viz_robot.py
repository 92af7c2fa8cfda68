"""Kinematics from the URDF text against scipy's rotations."""

import numpy as np
import pytest
import viz_synthetic
from scipy.spatial.transform import Rotation

from fv_viz.drawing import robot


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


LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
SLIDES = f"""<robot name="r"><link name="a"/><link name="b"><visual><origin rpy="0.1 0.2 0.3"/><geometry>
<mesh filename="package://x/y.stl" scale="2 2 2"/></geometry></visual><visual><geometry>
<cylinder radius="0.1" length="3"/></geometry></visual></link><link name="c"/><link name="d"/>
<joint name="late" type="prismatic"><parent link="b"/><child link="d"/><axis xyz="0 0 1"/>{LIMIT}
<mimic joint="m" multiplier="3"/></joint>
<joint name="m" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>{LIMIT}
<mimic joint="s" multiplier="-0.5" offset="0.125"/></joint>
<joint name="s" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="1 0 0" rpy="0 0 1.5"/>
<axis xyz="0 0 2"/>{LIMIT}</joint></robot>"""


def test_origins_visuals_and_mimics_of_mimics_that_come_later():
    model = robot.RobotShapes(SLIDES)
    poses = model.link_poses({"s": 0.25})
    np.testing.assert_allclose(poses["b"][:3, 3], [1, 0, 0.25])
    np.testing.assert_allclose(poses["c"][:3, 3], [1, 0, 0.25], atol=1e-12)
    poses = model.link_poses({"s": -0.05})
    np.testing.assert_allclose(poses["d"][:3, 3], [1, 0, -0.05 + 3 * (0.125 + 0.025)], atol=1e-12)
    (link, mesh), (_, tube) = model.visuals
    assert link == "b" and mesh.mesh == "package://x/y.stl"
    np.testing.assert_allclose(
        mesh.T_link_visual[:3, :3], Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix()
    )
    assert robot.marker_size(mesh) == (2, 2, 2)
    assert robot.marker_size(tube) == (0.2, 0.2, 3)
    assert model.moved_by(["s", "of another robot"]) == {"b", "c", "d"}


def test_only_moved_links_become_ghosts():
    assert robot.RobotShapes(viz_synthetic.urdf()).moved_by(["j1"]) == {"l1", "l2"}


@pytest.mark.parametrize(
    "text", ["<robot", "<robot name='x'/>", "<robot><link name='a'/><link name='b'/></robot>"]
)
def test_broken_descriptions_are_refused(text):
    with pytest.raises(ValueError, match="robot description"):
        robot.RobotShapes(text)
