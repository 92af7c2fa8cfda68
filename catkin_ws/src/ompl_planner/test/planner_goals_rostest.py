#!/usr/bin/env python3
"""Goals at the worst moments, and senseless ones: each gets one answer that says what came of it."""

import collections
import math
import random
import signal
import struct
import sys
import time
from pathlib import Path
from typing import Any

import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from fv_msgs.msg import (
    AttachedObject,
    ExecuteMotionActionResult,
    ExecuteMotionResult,
    MapUpdate,
    PlanAndExecuteActionResult,
    PlanAndExecuteResult,
    PlanMotionActionResult,
    PlannedPath,
)
from fv_msgs.srv import SetAttachedObjects
from geometry_msgs.msg import Vector3
from sensor_msgs.msg import JointState

sys.path.insert(0, str(Path(__file__).resolve().parent))
from planner_case import PATIENCE_S, Plan, PlannerCase, Status, answer, pose, wait_for

RESULTS = {
    "plan": PlanMotionActionResult,
    "execute": ExecuteMotionActionResult,
    "plan_and_execute": PlanAndExecuteActionResult,
}


class GoalsTest(PlannerCase):
    def reach(self, rng: random.Random) -> dict[str, Any]:
        """A goal near the start."""
        q = {joint: value + rng.uniform(-0.3, 0.3) for joint, value in self.ready.items()}
        joints = JointState(name=list(q), position=list(q.values()))
        return {"goal_type": Plan.GOAL_JOINTS, "goal_joints": joints}

    def assert_stands(self) -> None:
        before = self.robot.positions()
        time.sleep(0.1)
        self.assertEqual(before, self.robot.positions())

    def test_each_goal_of_a_burst_gets_one_answer_with_a_status(self) -> None:
        answers: collections.Counter = collections.Counter()
        subscribers = [
            rospy.Subscriber(
                f"/ompl_planner/{name}/result", kind, lambda m: answers.update([m.status.goal_id.id])
            )
            for name, kind in RESULTS.items()
        ]
        rng = random.Random(1)
        plan = self.plan(**self.reach(rng))
        sent, cancelled = [], []
        for _ in range(6):
            for _ in range(5):
                kind = rng.choice(["plan", "execute", "both"])
                if kind == "plan":
                    handle = self.planner.send_goal(self.goal(**self.reach(rng)))
                else:
                    handle = self.start(plan) if kind == "execute" else self.start_both(**self.reach(rng))
                sent.append(handle)
                if rng.random() < 0.4:
                    handle.cancel()
                    cancelled.append(handle)
                time.sleep(rng.choice([0.0, 0.0, rng.uniform(0.0, 0.2)]))
            for handle in sent:
                answer(handle)
            self.assert_stands()
            self.robot.place(self.ready)
        for handle in sent:
            result, state = handle.get_result(), handle.get_terminal_state()
            self.assertEqual(result.status == result.SUCCESS, state == GoalStatus.SUCCEEDED)
            if (
                result.status == result.NO_RESULT
            ):  # actionlib's own answer to a cancel that has overtaken its goal
                self.assertEqual(state, GoalStatus.RECALLED)
                self.assertIn(handle, cancelled)
            else:
                self.assertTrue(result.message)
        ids = [handle.comm_state_machine.action_goal.goal_id.id for handle in sent]
        self.assertEqual([answers[name] for name in ids], [1] * len(sent))
        for subscriber in subscribers:
            subscriber.unregister()

    def test_empty_results_are_no_success(self) -> None:
        for kind in (PlanAndExecuteResult(), ExecuteMotionResult(), PlanAndExecuteResult().plan):
            self.assertEqual(kind.status, kind.NO_RESULT)
            self.assertNotEqual(kind.status, kind.SUCCESS)
        result = answer(self.start_both(goal_name="dance"))
        self.assertEqual(result.execution.status, ExecuteMotionResult.NO_RESULT)

    def test_plan_and_execute_waits_for_the_motion_that_it_replaces(self) -> None:
        self.robot.slowdown = 6.0
        moving = self.start(self.plan(goal_name="home"))
        self.wait_until_moving()
        self.robot.slowdown = 1.0
        back = JointState(name=list(self.ready), position=list(self.ready.values()))
        result = answer(self.start_both(goal_type=Plan.GOAL_JOINTS, goal_joints=back))
        self.assertEqual(result.status, PlanAndExecuteResult.SUCCESS, result.message)
        self.assertEqual(answer(moving).status, ExecuteMotionResult.CANCELLED)

    def test_a_path_is_shown_when_it_is_planned_and_again_when_it_begins(self) -> None:
        shown: list[PlannedPath] = []
        subscriber = rospy.Subscriber("/ompl_planner/path", PlannedPath, shown.append)
        wait_for(lambda: shown, "the last path")
        shown.clear()
        plan = self.plan(goal_name="home")
        wait_for(lambda: shown, "the planned path")
        self.assertFalse(shown[-1].executing)
        self.assertEqual(shown[-1].map_sequence, plan.map_sequence)
        self.assertEqual(shown[-1].header.frame_id, "world")
        self.assertEqual(len(shown[-1].tip_poses), len(plan.trajectory.points))
        self.assertEqual(answer(self.start(plan)).status, ExecuteMotionResult.SUCCESS)
        wait_for(lambda: shown[-1].executing, "the path that began")
        self.assertEqual(shown[-1].trajectory.points, plan.trajectory.points)
        self.assertEqual(shown[-1].tip_poses, shown[0].tip_poses)
        subscriber.unregister()

    def test_senseless_plans_are_refused_with_value_and_range(self) -> None:
        far = JointState(name=["REP"], position=[9.0])
        nan = JointState(name=["REP"], position=[math.nan])
        crooked = pose(0.4, -0.2, 1.1, (0.0, 0.0, 0.0, 2.0))
        cases = [
            ({"group": ""}, ("''", "right_arm")),
            ({"group": "x" * 1_000_000}, ("right_arm",)),
            ({"time_budget": -1.0}, ("time_budget", "-1")),
            ({"time_budget": 1e300}, ("time_budget", "86400")),
            ({"max_map_age": math.nan}, ("max_map_age", "nan")),
            ({"start": far}, ("REP", "9.0", "limits")),
            ({"start": nan}, ("REP", "finite")),
            ({"goal_type": Plan.GOAL_JOINTS, "goal_joints": nan}, ("REP", "finite")),
            ({"goal_type": Plan.GOAL_JOINTS, "goal_joints": far}, ("REP", "9.0", "limits")),
            ({"goal_type": Plan.GOAL_JOINTS, "goal_joints": JointState(name=["REP"] * 2)}, ("2 names",)),
            ({"goal_name": ""}, ("home",)),
        ]
        for fields, words in cases:
            result = self.plan(**{"goal_name": "home" if "goal_joints" not in fields else "", **fields})
            self.assert_status(result, Status.INVALID_REQUEST, *words)
            self.assertLess(len(result.message), 2000)
        self.assert_status(self.plan_poses([crooked]), Status.INVALID_REQUEST, "norm 2.0")
        self.assert_status(self.plan_poses([]), Status.INVALID_REQUEST, "goal_poses")

    def test_senseless_motions_are_refused_with_value_and_range(self) -> None:
        plan = self.plan(goal_name="home")

        def changed(change) -> ExecuteMotionResult:
            goal = self.plan(goal_name="home")
            change(goal.trajectory)
            return answer(self.start(goal))

        def late(trajectory) -> None:
            trajectory.points[-1].time_from_start = rospy.Duration(10**9)

        def fast(trajectory) -> None:
            trajectory.points[1].velocities = [1e30] * len(trajectory.joint_names)

        def far(trajectory) -> None:
            trajectory.points[-1].positions = [1e30] * len(trajectory.joint_names)

        def short(trajectory) -> None:
            trajectory.points[-1].positions = trajectory.points[-1].positions[:-1]

        def strange(trajectory) -> None:
            trajectory.joint_names[0] = "tail"

        joint = plan.trajectory.joint_names[0]
        cases = [
            (late, ("3600",)),
            (fast, (joint, "velocity", "limit")),
            (far, (joint, "limits")),
            (short, ("position",)),
            (strange, ("tail", joint)),
        ]
        for change, words in cases:
            result = changed(change)
            self.assertEqual(result.status, ExecuteMotionResult.INVALID_REQUEST, result.message)
            for word in words:
                self.assertIn(word, result.message)

    def test_senseless_objects_are_refused_and_cost_no_plan(self) -> None:
        hold = rospy.ServiceProxy("/ompl_planner/set_attached_objects", SetAttachedObjects)
        here = pose(0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 1.0))
        small, huge = Vector3(0.01, 0.01, 0.01), Vector3(1e3, 0.01, 0.01)
        cases = [
            ({"dimensions": huge}, ("1000", "10")),
            ({"dimensions": Vector3(math.nan, 1.0, 1.0)}, ("nan",)),
            ({"pose": pose(1e300, 0.0, 0.0, (0.0, 0.0, 0.0, 1.0))}, ("1e+300", "10")),
            ({"kind": 9}, ("9", "BOX")),
            ({"link": "tail"}, ("tail", "Body_RWP")),
        ]
        for fields, words in cases:
            given = {"name": "thing", "link": "Body_RWP", "dimensions": small, "pose": here} | fields
            answered = hold([AttachedObject(**given)])
            self.assertFalse(answered.success, fields)
            for word in words:
                self.assertIn(word, answered.message)
        self.assert_status(self.plan(goal_name="home"), Status.SUCCESS)

    def test_full_maps_are_read_and_broken_ones_do_no_harm(self) -> None:
        told: list[MapUpdate] = []
        subscriber = rospy.Subscriber("/fv_exploration/map", MapUpdate, told.append)
        update = wait_for(lambda: told, "the map")[-1]
        subscriber.unregister()
        update.octomap.binary = False
        leaf = list(struct.pack("<fb", -1.0, 0))  # free, no children: all of space
        for data, status in (
            (leaf, Status.SUCCESS),
            (leaf * 2, Status.NO_MAP),
            ([-1] * 100_000, Status.NO_MAP),
        ):
            self.map.sequence += 1
            update.sequence = self.map.sequence
            update.octomap.data = [byte if byte < 128 else byte - 256 for byte in data]
            self.map.pub.publish(update)
            fields = {"goal_name": "home", "min_map_sequence": 0}
            wait_for(lambda s=status, f=fields: self.plan(**f).status == s, f"status {status}")

    def test_z_ending_the_node_stops_the_arm_and_answers(self) -> None:  # the last: it ends the node
        self.robot.slowdown = 10.0
        handle = self.start(self.plan(goal_name="home"))
        self.wait_until_moving()
        self.node.send_signal(signal.SIGTERM)
        self.assertEqual(answer(handle).status, ExecuteMotionResult.CANCELLED)
        self.assert_stands()
        self.assertEqual(self.node.wait(PATIENCE_S), 0)


if __name__ == "__main__":
    rospy.init_node("planner_goals_rostest")
    rostest.rosrun("ompl_planner", "planner_goals", GoalsTest)
