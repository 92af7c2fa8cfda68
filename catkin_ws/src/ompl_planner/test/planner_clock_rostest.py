#!/usr/bin/env python3
"""The planner node under a simulated clock that starts late, stands still, and jumps back."""

import subprocess
import sys
import threading
import time
import unittest
from collections.abc import Callable
from pathlib import Path
from typing import Any

import actionlib
import rospy
import rostest
from actionlib import CommState
from fv_msgs.msg import (
    ExecuteMotionAction,
    ExecuteMotionGoal,
    ExecuteMotionResult,
    PlanMotionAction,
    PlanMotionGoal,
    PlanMotionResult,
)
from rosgraph_msgs.msg import Clock

from hubo_description import load_robot

sys.path.insert(0, str(Path(__file__).resolve().parent))
from fakes import FakeMap, FakeRobot

GROUP = "torso_right_arm"
PATIENCE_S = 30.0


class FakeClock:
    """/clock at 100 Hz and wall speed from when it is started; may be set or held."""

    def __init__(self) -> None:
        self._pub = rospy.Publisher("/clock", Clock, queue_size=10)
        self.now_s = 0.0
        self.runs = False
        threading.Thread(target=self._tick_forever, daemon=True).start()

    def _tick_forever(self) -> None:
        while not rospy.is_shutdown():
            if self.runs:
                self.now_s += 0.01
                self._pub.publish(Clock(rospy.Time.from_sec(self.now_s)))
            time.sleep(0.01)


def wait_for(condition: Callable[[], Any], what: str) -> Any:
    """What the condition gives once it is true; waits on the wall clock, for ROS time may stand still."""
    deadline = time.monotonic() + PATIENCE_S
    while not (value := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"{what} did not happen")
        time.sleep(0.01)
    return value


class ClockTest(unittest.TestCase):
    """One test: its parts build on each other, for a clock starts only once."""

    def setUp(self) -> None:
        robot = load_robot("hubo")
        wait_for(lambda: rospy.has_param("/controller_list"), "the upload of the robot")
        start = dict.fromkeys(robot.model.moving_joints, 0.0)
        for states in robot.group_states.values():
            start |= states.get("home", {})
        self.ready = robot.group_states[GROUP]["ready"]
        controllers = {c["name"]: c["joints"] for c in rospy.get_param("/controller_list")}
        self.clock = FakeClock()
        self.robot = FakeRobot(controllers, start | self.ready)
        self.map = FakeMap()
        self.node = subprocess.Popen(["rosrun", "ompl_planner", "planner_node"])
        self.planner = actionlib.ActionClient("/ompl_planner/plan", PlanMotionAction)
        self.executor = actionlib.ActionClient("/ompl_planner/execute", ExecuteMotionAction)
        for client in (self.planner, self.executor):
            wait_for(lambda c=client: c.pub_goal.get_num_connections() > 0, "the planner's start")

    def tearDown(self) -> None:
        self.node.terminate()
        self.node.wait(10)

    def result(self, handle: actionlib.ClientGoalHandle) -> Any:
        wait_for(lambda: handle.get_comm_state() == CommState.DONE, "an answer")
        return handle.get_result()

    def plan(self, **fields) -> actionlib.ClientGoalHandle:
        goal = PlanMotionGoal(group=GROUP, goal_type=PlanMotionGoal.GOAL_NAMED, goal_name="home", seed=1)
        goal.min_map_sequence = self.map.sequence
        for name, value in fields.items():
            setattr(goal, name, value)
        return self.planner.send_goal(goal)

    def execute(self, plan: PlanMotionResult) -> actionlib.ClientGoalHandle:
        return self.executor.send_goal(ExecuteMotionGoal(plan.trajectory, plan.map_sequence))

    def test_late_start_stand_still_and_jump_back(self) -> None:
        self._plans_before_the_clock_starts()
        self._a_wait_for_a_map_lasts_as_long_as_the_clock_says()
        self._a_jump_back_stops_a_motion_and_the_next_one_is_done()

    def _plans_before_the_clock_starts(self) -> None:
        self.map.publish()
        time.sleep(0.5)
        plan = self.result(self.plan())
        self.assertEqual(plan.status, PlanMotionResult.SUCCESS, plan.message)
        self.clock.now_s = 1000.0  # joint states that came at time 0 are old now; new ones come soon
        self.clock.runs = True
        wait_for(lambda: rospy.get_time() > 1000.0, "the clock's start")
        time.sleep(0.3)
        plan = self.result(self.plan())
        self.assertEqual(plan.status, PlanMotionResult.SUCCESS, plan.message)

    def _a_wait_for_a_map_lasts_as_long_as_the_clock_says(self) -> None:
        self.clock.runs = False
        handle = self.plan(min_map_sequence=self.map.sequence + 1)
        time.sleep(3.0)  # of wall time, more than map_wait_s
        self.assertNotEqual(handle.get_comm_state(), CommState.DONE)
        self.clock.runs = True
        result = self.result(handle)
        self.assertEqual(result.status, PlanMotionResult.MAP_TOO_OLD, result.message)
        handle = self.plan(min_map_sequence=self.map.sequence + 1)
        self.map.publish()  # in time
        self.assertEqual(self.result(handle).status, PlanMotionResult.SUCCESS)

    def _a_jump_back_stops_a_motion_and_the_next_one_is_done(self) -> None:
        self.robot.slowdown = 20.0
        handle = self.execute(self.result(self.plan()))
        moved = lambda: abs(self.robot.positions()["REP"] - self.ready["REP"]) > 0.02  # noqa: E731
        wait_for(moved, "the motion's begin")
        self.clock.now_s = 5.0
        result = self.result(handle)
        self.assertEqual(result.status, ExecuteMotionResult.CONTROLLER_FAILED, result.message)
        self.assertIn("clock", result.message)
        self.robot.slowdown = 1.0
        self.robot.place(self.ready)
        self.map.publish()
        result = self.result(self.execute(self.result(self.plan())))
        self.assertEqual(result.status, ExecuteMotionResult.SUCCESS, result.message)


if __name__ == "__main__":
    rospy.init_node("planner_clock_rostest")
    rostest.rosrun("ompl_planner", "planner_clock", ClockTest)
