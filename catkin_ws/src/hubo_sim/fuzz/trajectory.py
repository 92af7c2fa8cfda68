"""Trajectory goals from the bytes of the wire, as a controller of two joints takes them. Accepted, or a Refusal."""

import contextlib

from control_msgs.msg import FollowJointTrajectoryGoal
from genpy import DeserializationError

from hubo_sim.control.trajectory_goal import Refusal, check_goal
from hubo_sim.ros.conversions import goal_from_action
from hubo_sim.sim_robot import JointInfo

JOINTS = [
    JointInfo(name, i, -2.0, 2.0, max_velocity=1.0, max_effort=10.0, damping=0.1, continuous=False)
    for i, name in enumerate(("a", "b"))
]


def one_input(data: bytes) -> None:
    """Take the goal."""
    msg = FollowJointTrajectoryGoal()
    with contextlib.suppress(DeserializationError, Refusal):
        msg.deserialize(data)
        check_goal(goal_from_action(msg), JOINTS, 10.0, allow_partial=bool(data[:1] > b"a"))
