"""Arms that cannot follow, are cancelled or are sent elsewhere, in physics: they stop from the speed that they have."""

import numpy as np
import pytest
from plant import STEP_S, Plant, goal

from hubo_sim.config import SimConfig
from hubo_sim.control.trajectory_goal import Code, TrajectoryGoal
from hubo_sim.robot_spec import RobotSpec
from hubo_sim.simulator import Simulator
from hubo_sim.worlds import load_world

LINK = """<link name="{name}"><inertial><origin xyz="0.15 0 0"/><mass value="1.5"/>
  <inertia ixx="0.005" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{joint}" type="revolute"><parent link="{parent}"/><child link="{name}"/><origin xyz="{x} 0 0"/>
  <axis xyz="0 1 0"/><limit lower="-1.5" upper="2.0" effort="{effort}" velocity="10"/></joint>"""
URDF = (
    '<robot name="arm"><link name="base"/>'
    + LINK.format(name="upper", joint="j1", parent="base", x=0, effort=20)
    + LINK.format(name="fore", joint="j2", parent="upper", x=0.3, effort=7)
    + "</robot>"
)
NAMES = ["j1", "j2"]
TOLERANCE = 0.1
ACCELERATION = 6.0
TOO_FAST = ([0.5, 0.6, 2.0], [[0.05, 0.0], [0.65, 0.4], [0.2, 0.0]])


class Arm:
    """Two joints that gravity pulls at, and what happens to them, step by step."""

    def __init__(self, kind):
        content = {
            "type": f"{kind}_controllers/JointTrajectoryController",
            "joints": NAMES,
            "constraints": {
                "goal_time": 0.5,
                **{name: {"trajectory": TOLERANCE, "goal": 0.02} for name in NAMES},
            },
        }
        if kind == "effort":
            content["gains"] = {name: {"p": 150.0, "d": 12.0, "i": 50.0, "i_clamp": 10.0} for name in NAMES}
        limit = {"has_acceleration_limits": True, "max_acceleration": ACCELERATION}
        spec = RobotSpec(URDF, controllers={"arm": content}, joint_limits=dict.fromkeys(NAMES, limit))
        self.sim = Simulator(spec, load_world("empty"), SimConfig(renderer="tiny"))
        self.controller = self.sim.controllers["arm"]
        self.outcomes = []
        self.run(0.1)

    @property
    def state(self):
        return self.sim.robot.state()[:2]

    def send(self, times, positions, handle, velocities=None):
        rows = velocities or [[]] * len(times)
        goal = TrajectoryGoal(NAMES, list(times), positions, rows, [[]] * len(times))
        self.controller.check(goal, self.sim.now_s)
        self.controller.start(goal, self.sim.now_s, handle)

    def run(self, seconds, until=lambda: False):
        """Positions and velocities (N, 2, 2) of the steps."""
        log = []
        for _ in range(round(240 * seconds)):
            self.sim.step()
            self.outcomes += self.controller.ended()
            log.append(self.state)
            if until():
                break
        return np.array(log)

    def assert_stops_and_serves(self, handle):
        """From now on: no further than braking takes, then held; the next goal is served."""
        position, velocity = self.state
        braking_s = np.abs(velocity).max() / ACCELERATION
        log = self.run(braking_s + 1.5)
        way = np.abs(velocity) * (braking_s / 2.0 + 2.0 / 240.0) + 0.5 * TOLERANCE
        assert np.all(np.abs(log[:, 0] - position) <= way)
        assert np.abs(log[-120:, 0] - log[-1, 0]).max() < 0.01
        target = np.clip(log[-1, 0] + [0.2, -0.2], -1.4, 1.9)
        self.send([1.5], [target.tolist()], handle, [[0.0, 0.0]])
        self.run(2.0)
        assert [(o.handle, o.status) for o in self.outcomes][-1] == (handle, "succeeded")
        assert self.state[0] == pytest.approx(target, abs=0.02)


@pytest.fixture(params=["position", "effort"])
def arm(request):
    arm = Arm(request.param)
    yield arm
    arm.sim.close()


class Stuck(Plant):
    """Joints that something holds, or carries along, whatever they are told."""

    def __init__(self, velocity=(0.0, 0.0), **more):
        super().__init__(**more)
        self.carried = np.array(velocity)

    def run(self, seconds):
        for _ in range(round(seconds / STEP_S)):
            self.point = self.controller.update(self.now, STEP_S, self.position, self.carried)
            self.position = self.position + self.carried * STEP_S
            self.now += STEP_S
            self.outcomes += self.controller.ended()
        return self


def test_after_an_abort_the_joint_is_held_where_it_is_not_where_it_should_have_been():
    plant = Stuck(constraints={"a": {"trajectory": 0.1}})
    plant.start(goal((0.5,), ((1.5, 0.0),)))
    plant.run(0.6)
    assert [o.code for o in plant.outcomes] == [Code.PATH_TOLERANCE_VIOLATED]
    assert plant.point.position == pytest.approx([0.0, 0.0])
    plant.start(goal((1.0,), ((0.05, 0.0),)), "next")  # within its tolerance from where the joint is
    assert plant.run(0.9).outcomes[1:] == []


def test_a_joint_that_is_carried_along_is_braked_from_its_own_speed():
    plant = Stuck(velocity=(1.0, 0.0), constraints={"a": {"trajectory": 0.1}})
    plant.start(goal((1.0,), ((-1.0, 0.0),)))
    plant.run(0.2)
    assert [o.status for o in plant.outcomes] == ["aborted"]
    end = plant.controller.sample(10.0).position[0]
    assert plant.position[0] - 0.2 < end - 1.0**2 / (2 * 5.0) < plant.position[0]


def test_a_drive_that_sags_a_little_is_not_let_down_by_every_stop():
    plant = Plant()
    plant.disturbance = np.array([-0.01, 0.0])
    plant.run(0.1)
    for i in range(20):
        plant.start(TrajectoryGoal(["a", "b"], [], [], [], []), i)
        plant.run(0.05)
    assert plant.position == pytest.approx([0.0, 0.0])


def test_an_arm_that_cannot_follow_is_aborted_stops_and_serves_the_next_goal(arm):
    arm.send(*TOO_FAST, "too fast")
    arm.run(3.0, until=lambda: arm.outcomes)
    assert [(o.handle, o.code) for o in arm.outcomes] == [("too fast", Code.PATH_TOLERANCE_VIOLATED)]
    assert np.abs(arm.state[1]).max() > 1.0
    arm.assert_stops_and_serves("next")


def test_a_cancel_in_mid_motion_stops_within_the_acceleration_limit(arm):
    arm.send([0.8], [[1.0, -0.8]], "cancelled", [[0.0, 0.0]])
    arm.run(0.4)
    arm.controller.cancel(arm.sim.now_s, "cancelled")
    arm.assert_stops_and_serves("next")
    assert [o.status for o in arm.outcomes] == ["canceled", "succeeded"]


def test_goals_that_come_while_the_arm_is_stopping_are_served(arm):
    arm.send(*TOO_FAST, "too fast")
    arm.run(3.0, until=lambda: arm.outcomes)
    arm.run(0.02)
    assert np.abs(arm.state[1]).max() > 1.0
    arm.send([2.0], [[0.3, 0.1]], "next")
    arm.run(2.6)
    assert [o.status for o in arm.outcomes] == ["aborted", "succeeded"]
    assert arm.state[0] == pytest.approx([0.3, 0.1], abs=0.02)


@pytest.mark.parametrize("seed", range(4))
def test_whatever_goals_and_cancels_come_limits_hold_and_the_arm_ends_at_rest(arm, seed):
    random = np.random.default_rng(seed)
    sent, log = [], []
    for i in range(12):
        times = np.cumsum(random.uniform(0.05, 0.8, random.integers(1, 4)))
        positions = random.uniform([-1.5, -1.5], [2.0, 2.0], (len(times), 2)).tolist()
        smooth = [[0.0, 0.0]] * len(times) if random.random() < 0.5 else None
        arm.send(times, positions, i, smooth)
        sent.append(i)
        log.append(arm.run(random.uniform(0.02, 1.0)))
        if random.random() < 0.5:
            arm.controller.cancel(arm.sim.now_s, i)
            log.append(arm.run(random.uniform(0.0, 0.3)))
    arm.controller.cancel(arm.sim.now_s)
    arm.assert_stops_and_serves("last")
    positions = np.concatenate([rows for rows in log if len(rows)])[:, 0]
    assert positions.min() > -1.5 - TOLERANCE and positions.max() < 2.0 + TOLERANCE
    assert sorted(o.handle for o in arm.outcomes if o.handle != "last") == sent
