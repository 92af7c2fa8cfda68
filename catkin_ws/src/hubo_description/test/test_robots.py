"""What holds for every robot that comes with the package."""

import subprocess
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from hubo_description import list_robots, load_robot
from hubo_description.check import check_explorer
from hubo_description.collision import SelfCollision
from hubo_description.disabled_pairs import adjacent_pairs, checked_pairs, solid_links, start_pose
from hubo_description.urdf import NEUTRAL, load_urdf


def test_hubo_and_the_others_are_listed():
    assert list_robots() == ["franka_panda", "free_camera", "hubo", "kuka_iiwa", "youbot_arm"]


def test_check_urdf_passes(robot, tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(robot.urdf_xml, encoding="utf-8")
    done = subprocess.run(["check_urdf", str(path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"root Link: {robot.config.base_link}" in done.stdout


def test_every_mesh_exists_as_absolute_file(robot):
    assert "package://" not in robot.urdf_xml
    assert 'filename="meshes' not in robot.urdf_xml


COLORLESS = """<robot name="plain">
<link name="base_link"><visual><geometry><box size="1 1 1"/></geometry></visual>
  <visual><geometry><sphere radius="1"/></geometry><material name="nobody"/></visual></link>
<link name="tip"><visual><geometry><box size="1 1 1"/></geometry><material name="mine"/></visual>
  <visual><geometry><mesh filename="colored.dae"/></geometry></visual></link>
<joint name="j" type="fixed"><parent link="base_link"/><child link="tip"/></joint>
<material name="mine"><color rgba="1 0 0 1"/></material></robot>"""


def test_shapes_without_a_colour_become_grey_and_others_stay(tmp_path):
    (tmp_path / "plain.urdf").write_text(COLORLESS, encoding="utf-8")
    (tmp_path / "colored.dae").touch()
    root = ET.fromstring(load_urdf("plain.urdf", None, tmp_path, tmp_path))
    materials = [visual.find("material") for visual in root.iter("visual")]
    assert materials[0].find("color").get("rgba") == NEUTRAL
    assert [m.get("name") for m in materials[1:3]] == ["nobody", "mine"]
    assert materials[3] is None  # the mesh brings its own
    defined = {m.get("name"): m.find("color").get("rgba") for m in root.findall("material")}
    assert defined == {"mine": "1 0 0 1", "nobody": NEUTRAL}


def test_optical_frame_is_the_camera_link_turned(robot, kinematics):
    frames, _ = kinematics.frames(start_pose(robot))
    for sensor in robot.sensors.values():
        T_link_optical = np.linalg.inv(frames[sensor.link]) @ frames[sensor.optical_frame]
        x_right, y_down, z_forward = T_link_optical[:3, :3].T
        assert z_forward == pytest.approx([1, 0, 0], abs=1e-9)
        assert x_right == pytest.approx([0, -1, 0], abs=1e-9)
        assert y_down == pytest.approx([0, 0, -1], abs=1e-9)


def test_start_pose_looks_level_and_upright(robot, kinematics):
    frames, _ = kinematics.frames(start_pose(robot))
    T = frames[robot.sensors[robot.config.exploration.camera].optical_frame]
    assert abs(T[2, 2]) < 0.05
    assert T[2, 1] < -0.9


def test_all_that_nodes_build_of_it_can_be_built(robot):
    check_explorer(robot)


def test_exploring_group_ends_in_the_camera(robot):
    exploration = robot.config.exploration
    camera = robot.sensors[exploration.camera]
    assert robot.groups[exploration.group].tip_link == camera.optical_frame
    assert {"home", "ready", "stow"} <= set(robot.group_states[exploration.group])


def test_disabled_pairs_name_solid_links_and_hold_all_neighbours(robot):
    solid = solid_links(robot)
    assert robot.disabled_pairs
    for pair in robot.disabled_pairs:
        assert set(pair) <= set(solid)
    assert adjacent_pairs(robot.model, solid) <= robot.disabled_pairs


def test_named_poses_are_free_of_self_collision(robot):
    with SelfCollision(robot) as body:
        for group, poses in robot.group_states.items():
            for name, pose in poses.items():
                body.set_joints(start_pose(robot) | pose)
                assert body.colliding_pairs(checked_pairs(robot)) == [], (group, name)


def test_straight_arms_hang_free():
    hubo = load_robot("hubo")
    with SelfCollision(hubo) as body:
        body.set_joints(dict.fromkeys(hubo.model.joint_names, 0.0))
        assert body.colliding_pairs(checked_pairs(hubo)) == []


def test_pairs_never_checked_never_touch_in_fresh_samples(robot):
    rng = np.random.default_rng(99)
    ignored = sorted(robot.disabled_pairs - adjacent_pairs(robot.model, solid_links(robot)))
    start = start_pose(robot)
    with SelfCollision(robot) as body:
        body.set_joints(start)
        touching_at_start = body.colliding_pairs(ignored)
        never = [pair for pair in ignored if pair not in touching_at_start]
        for _ in range(200):
            body.set_joints(
                {
                    name: rng.uniform(max(limit.lower, -np.pi), min(limit.upper, np.pi))
                    for name, limit in zip(robot.model.joint_names, robot.model.limits, strict=True)
                }
            )
            assert body.colliding_pairs(never) == []


def test_planning_limits_do_not_exceed_the_urdf(robot):
    for joint in robot.model.joints:
        if joint.name in robot.joint_limits:
            assert robot.joint_limits[joint.name].max_velocity <= joint.limits.velocity + 1e-9, joint.name


def test_every_moving_joint_of_the_exploring_group_has_a_controller(robot):
    driven = {joint for entry in robot.controllers["controller_list"] for joint in entry["joints"]}
    assert set(robot.groups[robot.config.exploration.group].joint_names) <= driven


def test_hubo_groups_are_the_agreed_ones():
    groups = load_robot("hubo").groups
    arm = ["RSP", "RSR", "RSY", "REP", "RWY", "RWP"]
    assert groups["right_arm"].joint_names == arm
    assert groups["torso_right_arm"].joint_names == ["WST", *arm]
    assert groups["left_arm"].joint_names == ["LSP", "LSR", "LSY", "LEP", "LWY", "LWP"]
    assert set(groups) == {"right_arm", "left_arm", "legs", "head", "torso_right_arm"}
