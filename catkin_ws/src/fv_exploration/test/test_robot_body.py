"""The robot in its own map: what it holds, and the views of a group that has no capability map."""

import itertools

import numpy as np
import pytest
from fv_msgs.msg import AttachedObject, AttachedObjects
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from scipy.spatial.transform import Rotation

from fv_common.errors import MessageError
from fv_exploration.robot_body import CarriedCamera, RobotBody, clearance_voxels
from fv_exploration.ros.conversions import held_objects
from fv_exploration.strategy.reachable_views import CameraFit, DrawnViews
from fv_robot_model import LinkFilterConfig, SelfFilter, SelfFilterConfig
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
    views = DrawnViews(
        lambda count, random: body.random_views(group, count, random),
        lambda: np.empty((0, 3)),
        lambda positions, directions: np.ones(len(positions), dtype=bool),
    )
    positions, directions = views.sample(500, np.random.default_rng(3))
    assert np.allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.all(np.abs(positions - T_MAP_ROOT[:3, 3] - [0, 0, 1.65]) <= [4.2, 4.2, 1.7])
    assert np.ptp(positions, axis=0) == pytest.approx([8.0, 8.0, 3.0], abs=0.5)
    assert views.within_reach(positions).mean() > 0.98
    assert not views.within_reach(positions + np.array([20.0, 0.0, 0.0])).any()
    assert set(views.reachability(positions, directions)) <= {0.0, 1.0}


@pytest.mark.parametrize("name", ["hubo", "kuka_iiwa", "free_camera"])
def test_rays_that_meet_a_link_are_hidden_as_samples_along_them_say(name):
    body, robot = body_of(name), load_robot(name)
    camera = robot.sensors[robot.config.exploration.camera]
    group = robot.config.exploration.group
    bare = SelfFilterConfig(padding_m=0.0, links={camera.link: LinkFilterConfig(ignore=True)})
    samples = SelfFilter(body.model, bare)
    random = np.random.default_rng(4)
    carried = CarriedCamera(body, group)
    rays = random.uniform([-0.5, -0.4, 1.0], [0.5, 0.4, 1.0], (40, 3))
    lengths = np.linspace(0.0, 1.0, 600)
    differing = hidden_ones = 0
    for _ in range(12):
        q = {j: random.uniform(-2.0, 2.0) for j in body.model.group(group).joint_names}
        T = np.linalg.inv(T_MAP_ROOT) @ carried.camera_pose(q)
        points = (rays[:, None] * lengths[None, :, None]).reshape(-1, 3) @ T[:3, :3].T + T[:3, 3]
        expected = samples.is_robot(points, body.joint_vector(q)).reshape(len(rays), -1).any(axis=1)
        hidden = carried.hides(rays, q)
        differing += (expected != hidden).sum()
        hidden_ones += hidden.sum()
    assert differing <= 0.01 * 12 * len(rays), "samples may miss what a ray only touches"
    assert hidden_ones > 0 or name != "hubo"


def test_what_the_hand_holds_before_the_lens_hides_the_view():
    body = body_of("hubo")
    group = load_robot("hubo").config.exploration.group
    rays = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 0.2]])
    joints = {"RSR": -0.6, "REP": -1.0}
    before = body.hides(group, rays, joints)
    body.hold(held_objects(held(body.model.group(group).tip_link)))
    assert body.hides(group, rays, joints).tolist() == [True, bool(before[1])], (
        "it begins 0.35 m before the lens"
    )


def test_a_flying_camera_is_not_sent_where_it_has_no_room():
    body = body_of("free_camera")
    group = load_robot("free_camera").config.exploration.group
    balls = body.tip_balls(group, 0.02)
    assert balls[:, 3].max() <= 0.02 + 1e-9
    assert balls[:, 2].min() < -0.1, "the hull lies behind the lens"
    assert balls[:, 2].max() < 0.05
    # free space: a tunnel along x, 0.24 m wide
    fit = CameraFit(balls, lambda p: np.where(np.abs(p[:, 1:]).max(axis=1) < 0.12, 0, -1).astype(np.int8))
    along, across = np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]])
    centre, edge = np.zeros((1, 3)), np.array([[0.0, 0.1, 0.0]])
    assert fit(centre, along)[0]
    assert not fit(edge, along)[0]
    assert not fit(centre, across)[0], "lens in the middle, hull in the wall"
    assert fit(edge, across)[0], "lens at one wall, hull in the middle"


def test_half_of_the_drawn_views_look_from_known_free_space():
    body = body_of("free_camera")
    group = load_robot("free_camera").config.exploration.group
    free = np.array([[1.05, -2.05, 1.55], [1.15, -2.05, 1.55], [99.0, 0.0, 0.0]])
    views = DrawnViews(
        lambda count, random: body.random_views(group, count, random),
        lambda: free,
        lambda positions, directions: positions[:, 0] < 1.1,
    )
    positions, directions = views.sample(100, np.random.default_rng(1))
    assert all(any(np.array_equal(p, voxel) for voxel in free[:2]) for p in positions[:50])
    assert set(views.reachability(positions, directions)[:50]) == {0.0, 1.0}


def test_random_views_follow_the_seed():
    body = body_of("hubo")
    drawn = [body.random_views("right_arm", 20, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert np.array_equal(drawn[0], drawn[1])
    assert not np.array_equal(drawn[0], drawn[2])


def corners_within(clearance, T, resolution_m):
    """Voxels whose eight corners all lie within a box or sphere, looked for in a cube about the origin."""
    axis = (np.arange(-20, 20) + 0.5) * resolution_m
    centres = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = centres[:, None] + resolution_m / 2 * np.array(list(itertools.product((-1, 1), repeat=3)))
    local = (corners - T[:3, 3]) @ T[:3, :3]
    inside = np.zeros(len(centres), bool)
    for box in clearance["boxes"]:
        inside |= (np.abs(local - box["center_m"]) <= np.array(box["size_m"]) / 2).all(axis=(1, 2))
    for sphere in clearance["spheres"]:
        inside |= (np.linalg.norm(local - sphere["center_m"], axis=2) <= sphere["radius_m"]).all(axis=1)
    return {tuple(row) for row in np.rint(centres[inside] / resolution_m - 0.5).astype(int)}


@pytest.mark.parametrize("seed", range(4))
def test_clearance_is_what_lies_wholly_within_boxes_and_spheres(seed):
    random = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.random(random_state=seed).as_matrix(), random.uniform(-0.3, 0.3, 3)
    clearance = {
        "boxes": [{"frame": "a", "center_m": [0.1, 0.0, -0.1], "size_m": list(random.uniform(0.3, 0.8, 3))}],
        "spheres": [{"frame": "a", "center_m": [0.0, 0.2, 0.0], "radius_m": random.uniform(0.2, 0.5)}],
    }
    found = clearance_voxels(clearance, lambda frame: T, 0.05)
    assert {tuple(row) for row in np.rint(found / 0.05 - 0.5).astype(int)} == corners_within(
        clearance, T, 0.05
    )


def test_clearance_that_no_memory_holds_is_refused_before_it_is_taken():
    box = {"frame": "a", "center_m": [0.0] * 3, "size_m": [700.0, 700.0, 600.0]}
    with pytest.raises(ValueError, match=r"700 x 700 x 600 m hold 2.4e.12 voxels"):
        clearance_voxels({"boxes": [box]}, lambda frame: np.eye(4), 0.05)
    with pytest.raises(ValueError, match="Is it in metres"):
        clearance_voxels(
            {"spheres": [{"frame": "a", "center_m": [0.0] * 3, "radius_m": 1e300}]}, lambda _: np.eye(4), 0.05
        )
