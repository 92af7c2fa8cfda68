"""The planner node among fakes: what its tests share."""

from __future__ import annotations

import math
import subprocess
import time
import unittest
from typing import Any

import actionlib
import rospy
from fakes import FakeMap, FakeRobot
from fv_msgs.msg import (
    ExecuteMotionAction,
    ExecuteMotionGoal,
    PlanAndExecuteAction,
    PlanAndExecuteGoal,
    PlanMotionAction,
    PlanMotionGoal,
    PlanMotionResult,
)
from geometry_msgs.msg import Pose

from hubo_description import load_robot

GROUP = "torso_right_arm"
Plan = PlanMotionGoal
Status = PlanMotionResult
FORWARDS = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))
PATIENCE_S = 60.0  # of a machine that is slow and shared; what is waited for comes much sooner
PATIENT = ["_controller_wait_s:=20.0", "_settle_s:=20.0"]  # the same for the node
HOME_BOX = [-0.2, -0.5, 0.55, 0.15, -0.2, 0.7]
"""An obstacle where the hand is at home, and not at the start; min x y z, max x y z [m]."""


def pose(x: float, y: float, z: float, q=FORWARDS) -> Pose:
    """Pose whose z axis looks along world x unless told otherwise; q is x, y, z, w."""
    msg = Pose()
    msg.position.x, msg.position.y, msg.position.z = x, y, z
    msg.orientation.x, msg.orientation.y, msg.orientation.z, msg.orientation.w = q
    return msg


def wait_for(condition, what: str) -> Any:
    """What the condition gives once it is true; waits on the wall clock, for ROS time may stand still."""
    deadline = time.monotonic() + PATIENCE_S
    while not (value := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"{what} did not come")
        time.sleep(0.01)
    return value


def is_connected(client: actionlib.ActionClient) -> bool:
    """Do goals reach the server, and its results the client? Needs no clock, as the server's status does."""
    ends = (client.pub_goal, client.pub_cancel, client.feedback_sub, client.result_sub)
    return all(end.get_num_connections() > 0 for end in ends)


def answer(handle: actionlib.ClientGoalHandle) -> Any:
    """The result of a goal, polled: SimpleActionClient loses answers faster than its send_goal.

    The handle's state will not do: a cancel that crosses the answer takes it back from DONE for ever.
    """
    return wait_for(handle.get_result, "an answer")


def start_positions() -> dict[str, float]:
    """HUBO at home, its exploring group at the pose `ready` [rad]."""
    robot = load_robot("hubo")
    start = dict.fromkeys(robot.model.joint_names, 0.0)
    for states in robot.group_states.values():
        start |= states.get("home", {})
    return start | robot.group_states[GROUP]["ready"]


class PlannerCase(unittest.TestCase):
    """One node for all tests of a class; each begins with the arm at `ready` and an open map."""

    @classmethod
    def setUpClass(cls) -> None:
        wait_for(lambda: rospy.has_param("/controller_list"), "the upload of the robot")
        states = load_robot("hubo").group_states[GROUP]
        cls.ready, cls.home = states["ready"], states["home"]
        controllers = {c["name"]: c["joints"] for c in rospy.get_param("/controller_list")}
        cls.robot = FakeRobot(controllers, start_positions())
        cls.map = FakeMap()
        cls.node = subprocess.Popen(["rosrun", "ompl_planner", "planner_node", *PATIENT])
        cls.planner = actionlib.ActionClient("/ompl_planner/plan", PlanMotionAction)
        cls.executor = actionlib.ActionClient("/ompl_planner/execute", ExecuteMotionAction)
        cls.both = actionlib.ActionClient("/ompl_planner/plan_and_execute", PlanAndExecuteAction)
        for client in (cls.planner, cls.executor, cls.both):
            wait_for(lambda c=client: is_connected(c), "the node")

    @classmethod
    def tearDownClass(cls) -> None:
        cls.node.terminate()
        cls.node.wait(PATIENCE_S)

    def setUp(self) -> None:
        self.robot.slowdown = 1.0
        self.robot.refuse = ""
        self.robot.place(self.ready)
        self.publish_map()

    def publish_map(self, **boxes) -> None:
        """A new map, once the planner has it."""
        sequence = self.map.publish(**boxes)
        wait_for(lambda: self.plan(goal_name="home").map_sequence == sequence, "the map")

    def goal(self, **fields) -> PlanMotionGoal:
        goal = Plan(group=GROUP, goal_type=Plan.GOAL_NAMED, seed=1, min_map_sequence=self.map.sequence)
        for name, value in fields.items():
            setattr(goal, name, value)
        return goal

    def plan(self, **fields) -> PlanMotionResult:
        return answer(self.planner.send_goal(self.goal(**fields)))

    def start(self, plan: PlanMotionResult, sequence: int | None = None) -> actionlib.ClientGoalHandle:
        """Begin to execute a plan."""
        goal = ExecuteMotionGoal(trajectory=plan.trajectory)
        goal.map_sequence = plan.map_sequence if sequence is None else sequence
        return self.executor.send_goal(goal)

    def start_kept(self, number: int, **fields) -> actionlib.ClientGoalHandle:
        """Begin to execute the motion that the node has planned under this number."""
        return self.executor.send_goal(ExecuteMotionGoal(plan=number, **fields))

    def start_both(self, **fields) -> actionlib.ClientGoalHandle:
        """Begin to plan and execute."""
        return self.both.send_goal(PlanAndExecuteGoal(plan=self.goal(**fields)))

    def plan_poses(self, poses, **fields) -> PlanMotionResult:
        goal = Plan()
        goal.goal_poses.header.frame_id = "world"
        goal.goal_poses.poses = poses
        return self.plan(goal_type=Plan.GOAL_POSES, goal_poses=goal.goal_poses, free_roll=True, **fields)

    def assert_status(self, result: PlanMotionResult, status: int, *words: str) -> None:
        self.assertEqual(result.status, status, result.message)
        for word in words:
            self.assertIn(word, result.message)

    def wait_until_moving(self) -> None:
        """Until the arm has left the start by a little."""
        wait_for(lambda: abs(self.robot.positions()["REP"] - self.ready["REP"]) > 0.02, "the arm's motion")
