"""The robot in its own map: what it holds, and the views of a group that has no capability map."""

import numpy as np
import pytest
from fv_msgs.msg import AttachedObject, AttachedObjects
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3

from fv_exploration.conversions import MessageError, held_objects
from fv_exploration.reachable_views import DrawnViews
from fv_exploration.robot_body import RobotBody
from hubo_description import load_robot

T_MAP_ROOT = np.eye(4)
T_MAP_ROOT[:3, 3] = [1.0, -2.0, 0.5]


def body_of(name: str) -> RobotBody:
    robot = load_robot(name)
    return RobotBody(robot.urdf_xml, robot.srdf_xml, T_MAP_ROOT, padding_m=0.02)


def held(link: str, kind: int = AttachedObject.SPHERE, name: str = "ball") -> AttachedObjects:
    pose = Pose(Point(0.0, 0.0, 0.4), Quaternion(0.0, 0.0, 0.0, 1.0))
    return AttachedObjects(objects=[AttachedObject(name, link, [], kind, Vector3(0.1, 0.1, 0.1), pose)])


@pytest.mark.parametrize("kind", [AttachedObject.BOX, AttachedObject.CYLINDER, AttachedObject.SPHERE])
def test_points_on_what_the_hand_holds_are_the_robots_own_while_it_holds_it(kind):
    body = body_of("hubo")
    link = body.model.group("right_arm").tip_link
    T_map_link = T_MAP_ROOT @ body.model.forward(body.joint_vector({}))[body.model.link_names.index(link)]
    point = np.array([[0.0, 0.0, 0.4]])  # before the camera, in its optical frame
    assert not body.is_robot(point, T_map_link, {}).any()
    before = len(body.voxels({}, 0.05, 0.0))
    body.hold(held_objects(held(link, kind)))
    assert body.is_robot(point, T_map_link, {}).all()
    assert len(body.voxels({}, 0.05, 0.0)) > before
    body.hold([])
    assert not body.is_robot(point, T_map_link, {}).any()


def test_a_held_object_on_no_link_or_of_no_kind_is_refused():
    body = body_of("hubo")
    with pytest.raises(ValueError, match="no_such_link"):
        body.hold(held_objects(held("no_such_link")))
    with pytest.raises(MessageError, match="kind is 9"):
        held_objects(held("base_link", kind=9))


def test_views_of_a_flying_camera_are_within_its_joint_limits():
    body = body_of("free_camera")
    group = load_robot("free_camera").config.exploration.group
    views = DrawnViews(lambda count, random: body.random_views(group, count, random))
    positions, directions = views.sample(500, np.random.default_rng(3))
    assert np.allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.all(np.abs(positions - T_MAP_ROOT[:3, 3] - [0, 0, 1.65]) <= [4.2, 4.2, 1.7])
    assert np.ptp(positions, axis=0) == pytest.approx([8.0, 8.0, 3.0], abs=0.5)
    assert views.within_reach(positions).mean() > 0.98
    assert not views.within_reach(positions + np.array([20.0, 0.0, 0.0])).any()
    assert set(views.reachability(positions, directions)) <= {0.0, 1.0}


def test_random_views_follow_the_seed():
    body = body_of("hubo")
    drawn = [body.random_views("right_arm", 20, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert np.array_equal(drawn[0], drawn[1])
    assert not np.array_equal(drawn[0], drawn[2])
