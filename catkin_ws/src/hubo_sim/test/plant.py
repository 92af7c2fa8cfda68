"""Joints that do what a controller tells them, for the tests of controllers without physics."""

import numpy as np
import pytest

from hubo_sim.control.trajectory_controller import ControllerConfig, TrajectoryController
from hubo_sim.control.trajectory_goal import Refusal, TrajectoryGoal
from hubo_sim.sim_robot import JointInfo

STEP_S = 1.0 / 240.0


def joint(name, lower=-2.0, upper=2.0, velocity=10.0, continuous=False):
    return JointInfo(name, 0, lower, upper, velocity, 50.0, 0.0, continuous)


class Plant:
    """A controller and joints that do what they are told, but for a disturbance."""

    def __init__(self, joints=None, position=(0.0, 0.0), **config):
        joints = joints or [joint("a"), joint("b")]
        entries = {
            "type": "position_controllers/JointTrajectoryController",
            "joints": [j.name for j in joints],
        }
        self.controller = TrajectoryController(
            ControllerConfig(**(entries | config)), joints, np.array(position)
        )
        self.position, self.velocity = np.array(position), np.zeros(len(joints))
        self.now, self.disturbance = 0.0, np.zeros(len(joints))
        self.outcomes, self.log = [], []

    def start(self, goal, handle="goal"):
        self.controller.check(goal, self.now)
        self.controller.start(goal, self.now, handle)

    def run(self, seconds):
        for _ in range(round(seconds / STEP_S)):
            measured = self.position + self.disturbance
            point = self.controller.update(self.now, STEP_S, measured, self.velocity)
            self.position, self.velocity = point.position, point.velocity
            self.now += STEP_S
            self.outcomes += self.controller.ended()
            self.log.append((self.now, self.position, self.velocity))
        return self

    @property
    def codes(self):
        return [(o.handle, o.status, o.code) for o in self.outcomes]


def goal(times=(1.0,), positions=((1.0, -1.0),), velocities=None, names=("a", "b"), **more):
    rows = velocities if velocities is not None else [[]] * len(times)
    return TrajectoryGoal(
        list(names), list(times), [list(p) for p in positions], rows, [[]] * len(times), **more
    )


def refusal(wanted, plant=None, now=0.0):
    plant = plant or Plant()
    plant.now = now
    with pytest.raises(Refusal) as err:
        plant.start(wanted)
    return err.value
