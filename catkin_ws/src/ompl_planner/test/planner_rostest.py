#!/usr/bin/env python3
"""Plans of the planner node, without a simulator: tests named after what a user sees."""

import math
import sys
import time
from pathlib import Path

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from fv_msgs.msg import AttachedObject, AttachedObjects, MapUpdate
from fv_msgs.srv import SetAttachedObjects
from geometry_msgs.msg import Vector3
from sensor_msgs.msg import JointState

sys.path.insert(0, str(Path(__file__).resolve().parent))
from planner_case import GROUP, HOME_BOX, PATIENCE_S, Plan, PlannerCase, Status, answer, pose, wait_for


class PlannerTest(PlannerCase):
    # --- planning ---

    def test_named_pose_is_planned_and_ends_there(self) -> None:
        result = self.plan(goal_name="home")
        self.assert_status(result, Status.SUCCESS)
        end = dict(zip(result.trajectory.joint_names, result.trajectory.points[-1].positions, strict=True))
        for joint, value in self.home.items():
            self.assertAlmostEqual(end[joint], value, places=6)
        self.assertEqual(result.map_sequence, self.map.sequence)
        self.assertGreater(result.duration, 0.5)

    def test_joint_goal_moves_only_the_named_joint(self) -> None:
        result = self.plan(goal_type=Plan.GOAL_JOINTS, goal_joints=JointState(name=["RWP"], position=[0.2]))
        self.assert_status(result, Status.SUCCESS)
        end = dict(zip(result.trajectory.joint_names, result.trajectory.points[-1].positions, strict=True))
        self.assertAlmostEqual(end["RWP"], 0.2, places=6)
        self.assertAlmostEqual(end["REP"], self.ready["REP"], places=6)

    def test_one_of_many_poses_is_reached(self) -> None:
        far = pose(5.0, 0.0, 1.0)
        near = pose(0.40, -0.25, 1.10)
        result = self.plan_poses([far, near])
        self.assert_status(result, Status.SUCCESS)
        self.assertEqual(result.goal_index, 1)
        self.assertEqual((result.poses_tried, result.poses_reachable), (2, 1))

    def test_equal_requests_give_equal_plans(self) -> None:
        wall = [0.46, -0.6, 0.8, 0.50, -0.1, 1.2]
        self.map.publish(occupied=[wall])
        plans = [self.plan_poses([pose(0.35, -0.3, 1.25), pose(0.2, -0.5, 1.2)], seed=7) for _ in range(2)]
        self.assert_status(plans[0], Status.SUCCESS)
        self.assertEqual(plans[0].trajectory.points, plans[1].trajectory.points)

    def test_an_unreachable_pose_has_no_ik_solution(self) -> None:
        self.assert_status(self.plan_poses([pose(3.0, 0.0, 1.0)]), Status.NO_IK_SOLUTION, "1 poses")

    def test_a_goal_inside_a_box_is_in_collision(self) -> None:
        result = self.plan(goal_name="home")  # without the box
        self.map.publish(occupied=[HOME_BOX])
        blocked = self.plan(goal_name="home")
        self.assert_status(result, Status.SUCCESS)
        self.assert_status(blocked, Status.GOALS_IN_COLLISION, "occupied voxel", "link")

    def test_unknown_space_is_an_obstacle_unless_told_otherwise(self) -> None:
        self.map.publish(unknown=[[-0.2, -0.5, 0.5, 0.2, -0.2, 0.75]])
        self.assert_status(self.plan(goal_name="home"), Status.GOALS_IN_COLLISION, "unknown voxel")
        self.assert_status(self.plan(goal_name="home", unknown_space=Plan.UNKNOWN_IS_FREE), Status.SUCCESS)

    def test_a_start_in_a_box_names_link_and_voxel(self) -> None:
        self.map.publish(occupied=[[0.1, -0.4, 0.9, 0.4, -0.1, 1.3]])
        self.assert_status(self.plan(goal_name="home"), Status.START_IN_COLLISION, "link", "occupied voxel")

    def test_a_start_in_unknown_space_says_so(self) -> None:
        self.map.publish(unknown=[[0.1, -0.4, 0.9, 0.4, -0.1, 1.3]])
        self.assert_status(self.plan(goal_name="home"), Status.START_IN_UNKNOWN, "unknown voxel")

    def slow_goal(self) -> Plan:
        """Thousands of poses that can be reached and lie in an obstacle: seconds of looking for one that is free."""
        self.map.publish(occupied=[[0.46, -0.6, 0.8, 0.8, -0.1, 1.2]])
        goal = Plan(group=GROUP, goal_type=Plan.GOAL_POSES, free_roll=True, time_budget=60.0)
        goal.goal_poses.header.frame_id = "world"
        goal.goal_poses.poses = [pose(0.52 + 1e-5 * i, -0.3, 1.0) for i in range(8000)]
        goal.min_map_sequence = self.map.sequence
        return goal

    def send_slow_goal(self) -> actionlib.ClientGoalHandle:
        """A plan that is under way."""
        handle = self.planner.send_goal(self.slow_goal())
        wait_for(lambda: handle.get_goal_status() == GoalStatus.ACTIVE, "the goal's acceptance")
        return handle

    def test_cancel_ends_planning_at_once(self) -> None:
        handle = self.send_slow_goal()
        time.sleep(0.3)
        handle.cancel()
        cancelled = time.monotonic()
        self.assertEqual(answer(handle).status, Status.CANCELLED)
        self.assertLess(time.monotonic() - cancelled, 20.0)  # of a budget of 60

    def test_a_second_goal_replaces_the_first(self) -> None:
        handle = self.send_slow_goal()
        result = self.plan(goal_type=Plan.GOAL_JOINTS, goal_joints=JointState(name=["RWP"], position=[0.2]))
        self.assertNotEqual(result.status, Status.CANCELLED, result.message)
        self.assertEqual(answer(handle).status, Status.CANCELLED)

    def refusal_of(self, msg: MapUpdate) -> str:
        """Why there is no map once this one has come."""

        def refused() -> str:
            result = self.plan(goal_name="home", min_map_sequence=0)
            return result.message if result.status == Status.NO_MAP else ""

        self.map.publish_raw(msg)
        return wait_for(refused, "the refusal of the map")

    def test_a_map_without_voxels_is_no_map_and_one_of_another_resolution_is_taken(self) -> None:
        msg = MapUpdate(sequence=self.map.sequence + 1)
        msg.header.frame_id = "world"
        msg.octomap.id, msg.octomap.binary, msg.octomap.resolution = "OcTree", True, 0.02
        msg.octomap.data = [0, 0]
        self.assertIn("there are no voxels", self.refusal_of(msg))
        self.map.sequence += 1
        self.map.publish(resolution=0.05)
        self.assert_status(self.plan(goal_name="home"), Status.SUCCESS)

    def test_a_map_older_than_allowed_is_refused(self) -> None:
        time.sleep(1.2)
        self.assert_status(self.plan(goal_name="home", max_map_age=1.0), Status.MAP_TOO_OLD, "s old")
        self.assert_status(self.plan(goal_name="home", max_map_age=100.0), Status.SUCCESS)

    # --- what the robot holds ---

    def hold(self, *objects: AttachedObject) -> tuple[bool, str]:
        rospy.wait_for_service("/ompl_planner/set_attached_objects", PATIENCE_S)
        answer = rospy.ServiceProxy("/ompl_planner/set_attached_objects", SetAttachedObjects)(list(objects))
        return answer.success, answer.message

    def test_what_the_hand_holds_collides_and_is_told(self) -> None:
        told = []
        subscriber = rospy.Subscriber("/ompl_planner/attached_objects", AttachedObjects, told.append)
        balloon = AttachedObject(name="balloon", link="Body_RWP", kind=AttachedObject.SPHERE)
        balloon.dimensions = Vector3(0.5, 0.0, 0.0)
        balloon.pose.orientation.w = 1.0
        self.assertTrue(self.hold(balloon)[0])
        try:
            self.assert_status(self.plan(goal_name="home"), Status.START_IN_COLLISION, "balloon")
        finally:
            self.assertTrue(self.hold()[0])
        self.assert_status(self.plan(goal_name="home"), Status.SUCCESS)
        wait_for(lambda: told and not told[-1].objects, "the news of empty hands")
        self.assertIn(["balloon"], [[o.name for o in msg.objects] for msg in told])
        subscriber.unregister()

    def test_objects_that_are_none_are_refused(self) -> None:
        box = AttachedObject(name="box", link="tail", dimensions=Vector3(0.1, 0.1, 0.1))
        box.pose.orientation.w = 1.0
        success, message = self.hold(box)
        self.assertFalse(success)
        self.assertIn("Body_RWP", message)  # the valid ones
        box.link = "Body_RWP"
        for field, value in (("kind", 9), ("dimensions", Vector3(-1.0, 0.1, 0.1)), ("name", "Body_RWP")):
            broken = AttachedObject(box.name, box.link, [], box.kind, box.dimensions, box.pose)
            setattr(broken, field, value)
            self.assertFalse(self.hold(broken)[0], field)
        self.assert_status(self.plan(goal_name="home"), Status.SUCCESS)

    # --- bad input ---

    def test_unknown_names_are_refused_with_the_valid_ones(self) -> None:
        self.assert_status(self.plan(group="third_arm", goal_name="home"), Status.INVALID_REQUEST, GROUP)
        self.assert_status(self.plan(goal_name="dance"), Status.INVALID_REQUEST, "home", "ready")
        self.assert_status(self.plan(goal_name="home", planner="Magic"), Status.INVALID_REQUEST, "RRTConnect")
        goal = Plan()
        goal.goal_poses.header.frame_id = "mars"
        goal.goal_poses.poses = [pose(0.4, -0.2, 1.0)]
        result = self.plan(goal_type=Plan.GOAL_POSES, goal_poses=goal.goal_poses)
        self.assert_status(result, Status.INVALID_REQUEST, "mars", "base_link")

    def test_values_that_are_none_are_refused(self) -> None:
        self.assert_status(self.plan_poses([pose(math.nan, 0.0, 1.0)]), Status.INVALID_REQUEST, "not finite")
        skewed = pose(0.4, -0.2, 1.0, q=(0.0, 0.0, 0.0, 0.5))
        self.assert_status(self.plan_poses([skewed]), Status.INVALID_REQUEST, "norm")
        self.assert_status(self.plan_poses([]), Status.INVALID_REQUEST, "empty")
        self.assert_status(
            self.plan(goal_name="home", time_budget=-1.0), Status.INVALID_REQUEST, "time_budget"
        )
        joints = JointState(name=["RWP"], position=[9.0])
        result = self.plan(goal_type=Plan.GOAL_JOINTS, goal_joints=joints)
        self.assert_status(result, Status.INVALID_REQUEST, "RWP", "limits")

    def test_goals_of_two_kinds_are_refused(self) -> None:
        joints = JointState(name=["RWP"], position=[0.0])
        self.assert_status(
            self.plan(goal_name="home", goal_joints=joints), Status.INVALID_REQUEST, "contradictory"
        )

    def test_a_map_that_is_too_old_is_refused(self) -> None:
        result = self.plan(goal_name="home", min_map_sequence=self.map.sequence + 5)
        self.assert_status(result, Status.MAP_TOO_OLD, str(self.map.sequence))

    def test_a_broken_map_is_no_map(self) -> None:
        for change in ({"frame_id": "mars"}, {"id": "ColorOcTree"}, {"resolution": -1.0}, {"data": []}):
            msg = MapUpdate(sequence=self.map.sequence + 1)
            msg.header.frame_id = msg.octomap.header.frame_id = change.pop("frame_id", "world")
            msg.octomap.id = "OcTree"
            msg.octomap.binary = True
            msg.octomap.resolution = 0.02
            msg.octomap.data = [0, 0]
            for name, value in change.items():
                setattr(msg.octomap, name, value)
            self.refusal_of(msg)
            self.map.sequence += 1
            self.publish_map()

    def test_joint_states_that_stop_are_noticed(self) -> None:
        self.robot.publishing = False
        try:
            time.sleep(1.5)
            self.assert_status(self.plan(goal_name="home"), Status.NO_JOINT_STATES, "old")
        finally:
            self.robot.publishing = True
            time.sleep(0.1)

    def test_joint_states_that_say_nothing_certain_are_named(self) -> None:
        publisher = rospy.Publisher("/joint_states", JointState, queue_size=5)
        wait_for(lambda: publisher.get_num_connections() > 0, "the node")
        cases = [
            ({"name": ["REP", "RWP"], "position": [math.nan, math.inf]}, ("'REP'", "'RWP'", "is not finite")),
            (
                {"name": ["REP", "WST", "REP"], "position": [0.1, 0.0, 0.2]},
                ("'REP' is named more than once",),
            ),
            ({"name": ["REP", "WST"], "position": [0.1]}, ("'REP'", "'WST'", "2 names and 1 positions")),
        ]
        for fields, words in cases:
            self.robot.publishing = False
            try:
                time.sleep(0.1)
                publisher.publish(JointState(**fields))
                time.sleep(0.2)
                self.assert_status(
                    self.plan(goal_name="home"), Status.NO_JOINT_STATES, "/joint_states", *words
                )
            finally:
                self.robot.publishing = True
            self.robot.place(self.ready)
        # Velocities alone, joints of others, and no velocities at all do no harm.
        publisher.publish(JointState(name=["REP", "RWP"], velocity=[0.1, 0.2]))
        publisher.publish(JointState(name=["gripper"], position=[math.nan]))
        time.sleep(0.1)
        self.assert_status(self.plan(goal_name="home"), Status.SUCCESS)


if __name__ == "__main__":
    rospy.init_node("planner_rostest")
    rostest.rosrun("ompl_planner", "planner", PlannerTest)
