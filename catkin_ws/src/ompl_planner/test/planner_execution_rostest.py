#!/usr/bin/env python3
"""Motions of the planner node, with controllers that the test plays: tests named after what a user sees."""

import sys
import time
from pathlib import Path

import rospy
import rostest
from fv_msgs.msg import ExecuteMotionResult, PlanAndExecuteResult, PlannedPath
from sensor_msgs.msg import JointState

sys.path.insert(0, str(Path(__file__).resolve().parent))
from planner_case import HOME_BOX, Plan, PlannerCase, Status, answer


class ExecutionTest(PlannerCase):
    def test_a_plan_is_executed_by_both_controllers_at_once(self) -> None:
        paths = []
        subscriber = rospy.Subscriber("/ompl_planner/path", PlannedPath, paths.append)
        goal = JointState(name=["WST", "RWP"], position=[0.3, 0.2])
        plan = self.plan(goal_type=Plan.GOAL_JOINTS, goal_joints=goal)
        result = answer(self.start(plan))
        self.assertEqual(result.status, ExecuteMotionResult.SUCCESS, result.message)
        self.assertAlmostEqual(self.robot.positions()["WST"], 0.3, places=4)
        self.assertAlmostEqual(self.robot.positions()["RWP"], 0.2, places=4)
        starts = self.robot.starts
        arm, waist = starts["huboplus/right_hand_controller"], starts["huboplus/torso_controller"]
        self.assertLess(abs(arm - waist), 0.5 * plan.duration)
        self.assertEqual(len(paths[-1].tip_poses), len(plan.trajectory.points))
        subscriber.unregister()

    def test_a_motion_that_the_node_has_planned_need_not_be_sent_back(self) -> None:
        plan = self.plan(goal_name="home")
        other = self.plan(goal_type=Plan.GOAL_JOINTS, goal_joints=JointState(name=["WST"], position=[0.3]))
        self.assertNotEqual(plan.plan, other.plan)
        result = answer(self.start_kept(plan.plan))
        self.assertEqual(result.status, ExecuteMotionResult.SUCCESS, result.message)
        for joint, position in self.home.items():
            self.assertAlmostEqual(self.robot.positions()[joint], position, places=4)

    def test_a_kept_motion_is_held_to_the_newest_map_and_to_where_the_robot_is(self) -> None:
        plan = self.plan(goal_name="home")
        self.robot.place({"REP": self.ready["REP"] + 0.4})
        result = answer(self.start_kept(plan.plan))
        self.assertEqual(result.status, ExecuteMotionResult.INVALID_REQUEST)
        self.assertIn("REP", result.message)
        self.robot.place(self.ready)
        self.publish_map(occupied=[HOME_BOX])
        result = answer(self.start_kept(plan.plan))
        self.assertEqual(result.status, ExecuteMotionResult.MAP_CHANGED, result.message)

    def test_a_number_that_no_plan_has_is_refused_and_so_is_one_beside_a_trajectory(self) -> None:
        plan = self.plan(goal_name="home")
        for number in (1, plan.plan + 1000):
            result = answer(self.start_kept(number))
            self.assertEqual(result.status, ExecuteMotionResult.INVALID_REQUEST)
            self.assertIn(f"plan {number} is not known", result.message)
        result = answer(self.start_kept(plan.plan, trajectory=plan.trajectory))
        self.assertEqual(result.status, ExecuteMotionResult.INVALID_REQUEST)
        self.assertIn("valid: one of them", result.message)
        refused = self.plan(goal_name="nowhere")
        self.assertEqual(refused.plan, 0, "what is no motion has no number")

    def test_a_plan_that_the_new_map_blocks_is_not_executed(self) -> None:
        plan = self.plan(goal_name="home")
        self.assert_status(plan, Status.SUCCESS)
        self.publish_map(occupied=[HOME_BOX])
        result = answer(self.start(plan))
        self.assertEqual(result.status, ExecuteMotionResult.MAP_CHANGED, result.message)
        self.assertIn("occupied", result.message)

    def test_a_new_map_that_leaves_the_path_free_does_not_stop_it(self) -> None:
        plan = self.plan(goal_name="home")
        self.publish_map(occupied=[[0.9, 0.9, 0.9, 1.0, 1.0, 1.0]])
        self.assertEqual(answer(self.start(plan)).status, ExecuteMotionResult.SUCCESS)

    def test_an_obstacle_seen_while_moving_stops_the_arm(self) -> None:
        plan = self.plan(goal_name="home")
        self.robot.slowdown = 6.0
        handle = self.start(plan)
        self.wait_until_moving()
        self.map.publish(occupied=[HOME_BOX])
        result = answer(handle)
        self.assertEqual(result.status, ExecuteMotionResult.STOPPED_FOR_OBSTACLE, result.message)
        self.assertGreater(abs(self.robot.positions()["REP"] - self.home["REP"]), 0.1)

    def test_cancel_stops_the_arm(self) -> None:
        plan = self.plan(goal_name="home")
        self.robot.slowdown = 6.0
        handle = self.start(plan)
        self.wait_until_moving()
        handle.cancel()
        self.assertEqual(answer(handle).status, ExecuteMotionResult.CANCELLED)
        stopped = self.robot.positions()
        time.sleep(0.2)
        self.assertEqual(stopped, self.robot.positions())

    def test_plan_and_execute_does_both(self) -> None:
        goal = JointState(name=["WST", "RWP"], position=[0.3, 0.2])
        result = answer(self.start_both(goal_type=Plan.GOAL_JOINTS, goal_joints=goal))
        self.assertEqual(result.status, PlanAndExecuteResult.SUCCESS, result.message)
        self.assertEqual(result.plan.map_sequence, self.map.sequence)
        self.assertAlmostEqual(self.robot.positions()["WST"], 0.3, places=4)

    def test_plan_and_execute_without_a_plan_moves_nothing(self) -> None:
        before = self.robot.positions()
        result = answer(self.start_both(goal_name="dance"))
        self.assertEqual(result.status, PlanAndExecuteResult.NOT_PLANNED)
        self.assertEqual(result.plan.status, Status.INVALID_REQUEST)
        self.assertIn("home", result.message)
        self.assertEqual(self.robot.positions(), before)

    def test_plan_and_execute_stops_for_an_obstacle_and_for_a_motion_of_somebody_else(self) -> None:
        self.robot.slowdown = 6.0
        handle = self.start_both(goal_name="home")
        self.wait_until_moving()
        self.map.publish(occupied=[HOME_BOX])
        result = answer(handle)
        self.assertEqual(result.status, PlanAndExecuteResult.NOT_EXECUTED, result.message)
        self.assertEqual(result.execution.status, ExecuteMotionResult.STOPPED_FOR_OBSTACLE)
        self.robot.place(self.ready)
        self.publish_map()
        handle = self.start_both(goal_name="home")
        self.wait_until_moving()
        replacing = self.start(self.plan(goal_name="home"))  # replaces it
        self.assertEqual(answer(handle).status, PlanAndExecuteResult.CANCELLED)
        replacing.cancel()
        answer(replacing)

    def test_one_failing_controller_stops_the_other(self) -> None:
        self.robot.refuse = "huboplus/torso_controller"
        plan = self.plan(goal_name="home")
        result = answer(self.start(plan))
        self.assertEqual(result.status, ExecuteMotionResult.CONTROLLER_FAILED)
        self.assertIn("torso_controller", result.message)
        self.assertGreater(abs(self.robot.positions()["REP"] - self.home["REP"]), 0.1)

    def test_a_trajectory_that_begins_elsewhere_is_refused(self) -> None:
        plan = self.plan(goal_name="home")
        self.robot.place({"REP": self.ready["REP"] + 0.4})
        result = answer(self.start(plan))
        self.assertEqual(result.status, ExecuteMotionResult.INVALID_REQUEST)
        self.assertIn("REP", result.message)


if __name__ == "__main__":
    rospy.init_node("planner_execution_rostest")
    rostest.rosrun("ompl_planner", "planner_execution", ExecutionTest)
