"""Robot, controllers and contacts in physics, without ROS."""

import pickle

import numpy as np
import pytest

from fv_common.transforms import from_rpy
from hubo_description import list_robots
from hubo_sim.config import SimConfig
from hubo_sim.control.trajectory_goal import Code, TrajectoryGoal
from hubo_sim.errors import SimError
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.robot_spec import RobotSpec
from hubo_sim.sim_robot import SimRobot
from hubo_sim.simulator import Simulator
from hubo_sim.worlds import load_world, parse_object
from hubo_sim.worlds.models import urdf_for_bullet
from hubo_sim.worlds.scene import Scene

ARM = "huboplus/right_hand_controller"
INERTIAL = (
    '<inertial><origin xyz="0.1 -0.2 0.3" rpy="0.4 0.5 0.6"/><mass value="3"/>'
    '<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>'
)
OFFSET = f"""<robot name="r"><link name="root">{INERTIAL}</link><link name="arm">{INERTIAL}</link>
  <joint name="j" type="revolute"><parent link="root"/><child link="arm"/><origin xyz="0 0 1"/>
  <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="80" velocity="2"/></joint></robot>"""


@pytest.fixture
def hubo():
    sim = Simulator(load_robot_spec("hubo"), load_world("empty"), SimConfig(renderer="tiny"))
    yield sim
    sim.close()


def goal_to(controller, target, seconds):
    zero = [[0.0] * len(target)]
    return TrajectoryGoal(controller.names, [seconds], [list(target)], zero, zero)


def steps(sim, seconds):
    for _ in range(round(240 * seconds)):
        sim.step()


def test_a_process_apart_gets_a_robot_that_it_can_read_itself():
    spec = load_robot_spec("hubo")
    sent = pickle.loads(pickle.dumps(spec if spec.model.link_names else None))  # with the model read already
    assert sent == spec
    assert sent.model.link_names == spec.model.link_names


def test_links_are_where_the_urdf_says_whatever_the_inertial_frames():
    T = from_rpy([1.0, 2.0, 3.0], [0.1, 0.2, 0.3])
    with Scene(egl=False) as scene:
        robot = SimRobot(scene, RobotSpec(OFFSET), T)
        assert robot.link_pose("root") == pytest.approx(T, abs=1e-6)
        assert robot.link_pose("arm") == pytest.approx(T @ from_rpy([0, 0, 1], [0, 0, 0]), abs=1e-6)
        robot.set_positions({"j": 0.5})
        assert robot.link_pose("arm") == pytest.approx(T @ from_rpy([0, 0, 1], [0, 0.5, 0]), abs=1e-6)
        robot.move_base(np.eye(4))
        assert robot.link_pose("root") == pytest.approx(np.eye(4), abs=1e-6)


def test_hubo_stands_still_in_its_start_pose(hubo):
    start = hubo.robot.state()[0]
    steps(hubo, 1.0)
    assert np.abs(hubo.robot.state()[0] - start).max() < 1e-3
    assert hubo.at_rest
    assert hubo.contacts.total == 0


def test_effort_arm_follows_closely_and_does_not_overshoot(hubo):
    """Half of the maximum speed: RMS below 0.01 rad, no more than 0.02 rad beyond the goal (issue 5)."""
    arm, rows = hubo.controllers[ARM], hubo.robot.joint_rows(hubo.controllers[ARM].names)
    steps(hubo, 0.1)
    start, target = hubo.robot.state()[0][rows], np.array([0.2, -0.7, 0.4, -1.0, 0.6, -0.4])
    speed = np.array([joint.max_velocity for joint in arm.joints]) / 2.0
    seconds = float(np.max(1.875 * np.abs(target - start) / speed))
    arm.start(goal_to(arm, target, seconds), hubo.now_s, "goal")
    errors, beyond = [], []
    for _ in range(round(240 * (seconds + 0.5))):
        hubo.step()
        position = hubo.robot.state()[0][rows]
        errors.append(arm.sample(hubo.now_s).position - position)
        beyond.append((position - target) * np.sign(target - start))
    assert [o.code for o in arm.ended()] == [Code.SUCCESSFUL]
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 0.01
    assert np.max(beyond) < 0.02


def test_efforts_stay_within_the_joints_limits(hubo):
    arm, rows = hubo.controllers[ARM], hubo.robot.joint_rows(hubo.controllers[ARM].names)
    arm.start(goal_to(arm, [0.5, -1.0, 0.5, -0.5, 0.5, 0.0], 0.2), hubo.now_s, "too fast")
    limits = np.array([joint.max_effort for joint in arm.joints])
    for _ in range(240):
        hubo.step()
        assert np.all(np.abs(hubo.robot.state()[2][rows]) <= limits + 1e-9)


def test_moving_one_joint_leaves_the_others_where_they_are(hubo):
    head = hubo.controllers["huboplus/head_controller"]
    others = np.setdiff1d(np.arange(len(hubo.robot.joints)), hubo.robot.joint_rows(head.names))
    before = hubo.robot.state()[0][others]
    head.start(goal_to(head, [0.5] + [0.0] * (len(head.names) - 1), 1.0), hubo.now_s, "look")
    steps(hubo, 1.5)
    assert np.abs(hubo.robot.state()[0][others] - before).max() < 2e-3


def test_same_calls_give_the_same_states():
    finals = []
    for _ in range(2):
        sim = Simulator(load_robot_spec("hubo"), load_world("shelf"), SimConfig(renderer="tiny", seed=3))
        arm = sim.controllers[ARM]
        arm.start(goal_to(arm, [0.0, -0.5, 0.2, -1.2, 0.3, 0.2], 0.8), 0.0, "goal")
        steps(sim, 1.0)
        scan = sim.cameras["hand_camera"].scan(sim.scene, 0)
        finals.append((sim.robot.state(), scan.depth, sim.clock_ns))
        sim.close()
    for a, b in zip(finals[0][0], finals[1][0], strict=True):
        assert np.array_equal(a, b)
    assert np.array_equal(finals[0][1], finals[1][1], equal_nan=True)
    assert finals[0][2] == finals[1][2] == 10**9


def test_touching_an_object_is_counted_and_named(hubo):
    pose = hubo.robot.link_pose("hand_camera_link")
    hubo.scene.add_object(
        parse_object({"name": "thing", "sphere": {"radius_m": 0.05}, "position_m": pose[:3, 3].tolist()}, "x")
    )
    steps(hubo, 0.05)
    assert hubo.contacts.total == 12
    assert any(pair.endswith("|thing") for pair in hubo.contacts.pairs)
    assert max(hubo.contacts.depths) > 0.0
    hubo.scene.remove_object("thing")
    hubo.reset()
    steps(hubo, 0.05)
    assert (hubo.contacts.total, hubo.contacts.pairs) == (0, [])


def test_reset_puts_the_robot_back_and_never_the_clock(hubo):
    arm, start = hubo.controllers[ARM], hubo.robot.state()[0]
    arm.start(goal_to(arm, [0.0] * 6, 1.0), hubo.now_s, "goal")
    steps(hubo, 0.5)
    before = hubo.clock_ns
    hubo.reset()
    assert hubo.clock_ns == before
    assert [o.status for o in arm.ended()] == ["aborted"]
    assert hubo.robot.state()[0] == pytest.approx(start, abs=1e-6)
    steps(hubo, 0.5)
    assert hubo.robot.state()[0] == pytest.approx(start, abs=1e-3)


def test_clock_counts_physics_steps_without_drift_and_never_runs_back(hubo):
    steps(hubo, 2.0)
    assert hubo.clock_ns == 2 * 10**9
    hubo.sleep_until(10**9)
    assert hubo.clock_ns == 2 * 10**9


@pytest.mark.parametrize("name", list_robots())
def test_every_robot_starts_moves_and_sees(name):
    sim = Simulator(load_robot_spec(name), load_world("office"), SimConfig(renderer="tiny"))
    steps(sim, 0.5)
    assert sim.at_rest and sim.contacts.total == 0
    spec = sim.spec.config["exploration"]
    camera = sim.cameras[spec["camera"]]
    before, first = camera.scan(sim.scene, 0), camera.pose()
    assert np.isfinite(before.depth).mean() > 0.3
    joint = sim.spec.groups[spec["capability_group"] or spec["group"]][-2]
    (controller,) = [c for c in sim.controllers.values() if joint in c.names]
    target = controller.set_point.position.copy()
    target[controller.names.index(joint)] += 0.2
    controller.start(goal_to(controller, target, 1.0), sim.now_s, "goal")
    steps(sim, 1.5)
    assert [o.code for o in controller.ended()] == [Code.SUCCESSFUL]
    assert np.abs(camera.pose() - first).max() > 0.02
    after = camera.scan(sim.scene, 1)
    assert np.nanmean(np.abs(after.depth - before.depth)) > 0.005
    sim.close()


def test_camera_range_is_along_its_axis_and_limits_give_nan(hubo):
    camera = hubo.cameras["hand_camera"]
    depth = camera.scan(hubo.scene, 0).depth
    finite = depth[np.isfinite(depth)]
    assert finite.size and finite.min() >= 0.3 and finite.max() <= 3.0
    points = camera.points(depth)
    assert np.array_equal(points[..., 2], depth, equal_nan=True)


@pytest.mark.parametrize(
    ("urdf", "word"),
    [
        ("<robot", "URDF"),
        ("<robot name='r'/>", "root"),
        ("<robot name='r'><link name='a'/><link name='b'/></robot>", "root"),
        (
            "<robot name='r'><link name='a'><visual><geometry><mesh filename='package://no_such_pkg/a.stl'/>"
            "</geometry></visual></link></robot>",
            "no_such_pkg",
        ),
        (
            "<robot name='r'><link name='a'><visual><geometry><mesh filename='/no/such.stl'/>"
            "</geometry></visual></link></robot>",
            "such.stl",
        ),
    ],
)
def test_broken_urdf_is_one_clear_line(urdf, word):
    with pytest.raises(SimError, match=word) as err:
        urdf_for_bullet(urdf)
    assert "\n" not in str(err.value)


def test_root_link_is_found():
    assert RobotSpec(OFFSET).base_link == "root"


LINK = '<link name="{}">' + INERTIAL + "</link>"
MIMIC_LIMIT = '<limit lower="-3" upper="3" effort="80" velocity="5"/>'
MIMICS = f"""<robot name="m">{"".join(LINK.format(name) for name in ("root", "arm", "level", "late"))}
  <joint name="late" type="revolute"><parent link="level"/><child link="late"/><origin xyz="0 0 0.2"/>
  <axis xyz="0 1 0"/>{MIMIC_LIMIT}<mimic joint="level" multiplier="2"/></joint>
  <joint name="level" type="revolute"><parent link="arm"/><child link="level"/><origin xyz="0 0 0.3"/>
  <axis xyz="0 1 0"/><limit lower="-0.9" upper="3" effort="80" velocity="5"/>
  <mimic joint="j" multiplier="-1" offset="0.1"/></joint>
  <joint name="j" type="revolute"><parent link="root"/><child link="arm"/><origin xyz="0 0 1"/>
  <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="200" velocity="2"/></joint></robot>"""


@pytest.mark.parametrize("kind", ["position_controllers", "effort_controllers"])
@pytest.mark.parametrize("joints", [["j"], ["j", "level"]])
def test_mimic_joints_follow_their_leader_while_it_moves(kind, joints):
    content = {"type": f"{kind}/JointTrajectoryController", "joints": joints}
    if kind == "effort_controllers":
        content["gains"] = {name: {"p": 4000.0, "d": 200.0} for name in joints}
    spec = RobotSpec(MIMICS, controllers={"c": content})
    sim = Simulator(spec, load_world("empty"), SimConfig(renderer="tiny"))
    rows = sim.robot.joint_rows(["j", "level", "late"])
    assert sim.robot.state()[0][rows] == pytest.approx([0.0, 0.1, 0.2], abs=1e-6)
    goal = {"j": 0.8, "level": -0.7}
    sim.controllers["c"].start(
        goal_to(sim.controllers["c"], [goal[name] for name in joints], 1.0), 0.0, "goal"
    )
    worst = 0.0
    for _ in range(360):
        sim.step()
        j, level, late = sim.robot.state()[0][rows]
        worst = max(worst, abs(level - (0.1 - j)), abs(late - 2.0 * (0.1 - j)))
    assert worst < 0.03
    assert j == pytest.approx(0.8, abs=0.02)
    T = spec.model.forward([j])[spec.model.link_index("late")]
    base = sim.robot.link_pose("root")
    assert sim.robot.link_pose("late") == pytest.approx(base @ T, abs=0.03)
    sim.close()


def test_a_leader_is_held_to_the_limits_of_its_mimics():
    with Scene(egl=False) as scene:
        robot = SimRobot(scene, RobotSpec(MIMICS), np.eye(4))
        (leader,) = [joint for joint in robot.joints if joint.name == "j"]
        assert (leader.lower, leader.upper) == pytest.approx((-1.4, 1.0))  # late = 0.2 - 2 j, level = 0.1 - j


@pytest.mark.parametrize(
    ("height", "words"), [(0.0, None), (0.6, "would stand at"), (None, "has a link named")]
)
def test_a_link_of_the_worlds_name_is_the_world_or_refused(height, words):
    urdf = OFFSET.replace('"root"', '"world"') if height is not None else OFFSET.replace('"arm"', '"world"')
    spec = RobotSpec(urdf, config={"base_height_m": height or 0.0})
    if words:
        with pytest.raises(SimError, match=words):
            Simulator(spec, load_world("empty"), SimConfig(renderer="tiny"))
    else:
        Simulator(spec, load_world("empty"), SimConfig(renderer="tiny")).close()


def test_a_mesh_of_text_collides_and_is_seen(tmp_path):
    side = "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n"
    corners = [(-0.2, -0.2, -0.2), (0.4, 0, 0), (0, 0.4, 0), (0, 0, 0.4)]
    faces = [[corners[k] for k in range(4) if k != out] for out in range(4)]
    text = "".join(side.format("".join(f"vertex {x} {y} {z}\n" for x, y, z in face)) for face in faces)
    (tmp_path / "t.stl").write_text(f"solid t\n{text}endsolid t\n")
    mesh = f'<geometry><mesh filename="{tmp_path}/t.stl"/></geometry>'
    urdf = OFFSET.replace(
        '<link name="arm">', f'<link name="arm"><visual>{mesh}</visual><collision>{mesh}</collision>'
    )
    with Scene(egl=False) as scene:
        robot = SimRobot(scene, RobotSpec(urdf), np.eye(4))
        assert scene.client.rayTest([0, 0, 3], [0, 0, 0])[0][0] == robot.body
        view = scene.client.computeViewMatrix([2, 0, 1], [0, 0, 1], [0, 0, 1])
        lens = scene.client.computeProjectionMatrixFOV(60, 1, 0.1, 10)
        seen = scene.client.getCameraImage(32, 32, view, lens, renderer=scene.client.ER_TINY_RENDERER)[4]
        assert (np.array(seen) == robot.body).any()


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"joints": ["NOPE"]}, "NOPE"),
        ({"gains": {}}, "gains"),
        ({"gains": {"j": {"p": -1.0}}}, "controller c: gains: j: p is -1.0; valid: a number, 0 or more"),
        ({"gains": {"j": {"q": 1.0}}}, "q"),
        ({"type": "velocity_controllers/JointTrajectoryController", "state_publish_rate": 0.0}, None),
        ({"constraints": {"goal_tiem": 1}}, "goal_tiem"),
    ],
)
def test_bad_controllers_are_named(change, word):
    content = {
        "type": "effort_controllers/JointTrajectoryController",
        "joints": ["j"],
        "gains": {"j": {"p": 100.0}},
    }
    spec = RobotSpec(OFFSET, controllers={"c": content | change})
    if word is None:  # a type that is not ours is somebody else's controller
        Simulator(spec, load_world("empty"), SimConfig(renderer="tiny")).close()
        return
    with pytest.raises(SimError, match=word):
        Simulator(spec, load_world("empty"), SimConfig(renderer="tiny"))


def test_a_joint_belongs_to_one_controller():
    content = {"type": "position_controllers/JointTrajectoryController", "joints": ["j"]}
    spec = RobotSpec(OFFSET, controllers={"first": content, "second": content})
    with pytest.raises(SimError, match="controller second: joint j belongs to controller first"):
        Simulator(spec, load_world("empty"), SimConfig(renderer="tiny"))
