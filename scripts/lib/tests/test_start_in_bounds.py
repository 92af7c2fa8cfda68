"""The robots that come with the workspace can start in the worlds that come with it."""

import numpy as np
import pytest

from fv_exploration import start_checks
from fv_exploration.robot_body import RobotBody, clearance_voxels
from hubo_description import list_robots, load_robot
from hubo_sim.worlds import load_world

WORLDS = ("office", "shelf", "rubble", "cabinet", "empty", "monastery", "tabletop:1", "room:1")


@pytest.mark.parametrize("name", list_robots())
def test_arm_camera_and_clearance_lie_within_the_bounds_of_every_world(name):
    robot = load_robot(name)
    exploring = robot.config.exploration
    for world in map(load_world, WORLDS):
        T_map_root = np.eye(4)
        T_map_root[:3, 3] = world.robot.position_m
        T_map_root[2, 3] += robot.config.base_height_m
        body = RobotBody(robot.urdf_xml, robot.srdf_xml, T_map_root, 0.0)
        names = body.model.group(exploring.group).joint_names
        start = body.model.named_states(exploring.group)[exploring.start_pose]
        joints = dict(zip(names, start, strict=True))
        bounds = np.array(world.bounds.min_m), np.array(world.bounds.max_m)
        poses = body.model.forward(body.joint_vector(joints))

        def pose_of(frame, body=body, poses=poses, T_map_root=T_map_root):
            return T_map_root @ poses[body.model.link_names.index(frame)]

        clearance = {kind: list(map(vars, shapes)) for kind, shapes in vars(exploring.clearance).items()}
        voxels = clearance_voxels(clearance, pose_of, 0.05)
        camera = body.camera_pose(exploring.group, joints)[:3, 3]
        assert start_checks.body_outside(body.moved_balls(exploring.group, joints, 0.02), bounds) == ""
        assert start_checks.camera_outside(camera, bounds) == ""
        assert start_checks.clearance_outside(voxels, bounds) == ""
