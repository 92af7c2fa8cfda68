#!/usr/bin/env python3
"""The simulator as its users meet it: HUBO in the office, in lockstep."""

import math
import sys
import threading
import unittest

import actionlib
import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryResult,
)
from control_msgs.srv import QueryTrajectoryState
from fv_msgs import srv
from fv_msgs.msg import Contacts
from sensor_msgs.msg import JointState, PointCloud2
from sim_helpers import ARM, BOX, PATIENCE_S, READY, arm_goal, call, points_of, pose_at, wait_until
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from fv_common.transforms import apply
from hubo_sim.config import SimConfig
from hubo_sim.ground_truth import TrueWorld
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.simulator import Simulator
from hubo_sim.worlds import load_world


class SimTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.arm = actionlib.SimpleActionClient(
            "/huboplus/right_hand_controller/follow_joint_trajectory", FollowJointTrajectoryAction
        )
        assert cls.arm.wait_for_server(rospy.Duration(60)), "no action server"
        rospy.wait_for_service("/hubo_sim/get_world_properties", PATIENCE_S)
        cls.trigger = rospy.ServiceProxy("/camera/trigger", srv.TakeScan)

    def setUp(self):
        call("unpause_physics", Empty)
        call("reset_simulation", Empty)

    def positions(self):
        state = rospy.wait_for_message("/joint_states", JointState, PATIENCE_S)
        return np.array([state.position[state.name.index(name)] for name in ARM])

    def run_goal(self, goal):
        self.arm.send_goal_and_wait(goal, rospy.Duration(20))
        return self.arm.get_result().error_code

    def scan(self):
        """A triggered scan, with the joint states that came under the same stamp before it."""
        states, clouds, arrived = {}, [], threading.Event()
        joints = rospy.Subscriber("/joint_states", JointState, lambda m: states.update({m.header.stamp: m}))
        cloud = rospy.Subscriber(
            "/camera/depth/points", PointCloud2, lambda m: (clouds.append(m), arrived.set())
        )
        while not (joints.get_num_connections() and cloud.get_num_connections()):
            rospy.sleep(0.02)
        answer = self.trigger()
        self.assertTrue(answer.success, answer.message)
        self.assertTrue(arrived.wait(PATIENCE_S))
        wait_until(lambda: clouds[0].header.stamp in states)
        for subscriber in (joints, cloud):
            subscriber.unregister()
        self.assertEqual(answer.stamp, clouds[0].header.stamp)
        return clouds[0], states.get(clouds[0].header.stamp)

    def test_trajectory_is_executed_within_tolerance(self):
        target = [0.2, -0.6, 0.3, -1.0, 0.4, -0.3]
        self.assertEqual(self.run_goal(arm_goal(target, 2.0)), FollowJointTrajectoryResult.SUCCESSFUL)
        self.assertLess(np.abs(self.positions() - target).max(), 0.01)

    def test_cloud_points_lie_on_true_surfaces(self):
        cloud, state = self.scan()
        self.assertIsNotNone(state, "no joint states at the scan's stamp")
        self.assertEqual(
            (cloud.width, cloud.height, cloud.header.frame_id), (320, 240, "hand_camera_optical_frame")
        )
        spec, world = load_robot_spec("hubo"), load_world("office")
        sim = Simulator(spec, world, SimConfig(renderer="tiny", noise=False))
        sim.robot.set_positions(dict(zip(state.name, state.position, strict=True)))
        camera = sim.cameras["hand_camera"]
        points = points_of(cloud).reshape(-1, 3)
        points = points[np.isfinite(points).all(1)]
        self.assertGreater(len(points), 30000)
        distance = TrueWorld(world).distance_to_surface(apply(camera.pose(), points.astype(float)))
        sigma = 0.0012 + 0.0019 * np.square(points[:, 2] - 0.4)
        sim.close()
        self.assertLess(np.median(distance), 0.01)
        self.assertGreater((distance < 3 * sigma + 0.002).mean(), 0.97)

    def test_cancel_stops_and_holds(self):
        self.arm.send_goal(arm_goal([0.5, -1.0, 0.5, -0.5, 0.5, 0.0], 300.0))
        moving = wait_until(lambda: np.abs(self.positions() - READY).max() > 1e-3)
        self.assertTrue(moving, "it never moved")
        self.arm.cancel_goal()
        self.assertTrue(self.arm.wait_for_result(rospy.Duration(50)))
        self.assertEqual(self.arm.get_state(), GoalStatus.PREEMPTED)
        self.trigger()  # comes back at rest
        held = self.positions()
        rospy.sleep(0.5)
        self.assertLess(np.abs(self.positions() - held).max(), 2e-3)

    def test_newer_goal_preempts_the_active_one(self):
        first = actionlib.ActionClient(self.arm.action_client.ns, FollowJointTrajectoryAction)
        self.assertTrue(first.wait_for_server(rospy.Duration(10)))
        old = first.send_goal(arm_goal([0.5, -1.0, 0.5, -0.5, 0.5, 0.0], 300.0))
        self.assertTrue(wait_until(lambda: old.get_goal_status() == GoalStatus.ACTIVE))
        self.assertEqual(self.run_goal(arm_goal(READY, 1.0)), FollowJointTrajectoryResult.SUCCESSFUL)
        self.assertEqual(old.get_goal_status(), GoalStatus.PREEMPTED)

    def test_wrong_joints_and_nan_are_rejected_with_codes(self):
        for goal, code in (
            (arm_goal([0.0] * 5, 1.0, ARM[:5]), FollowJointTrajectoryResult.INVALID_JOINTS),
            (arm_goal([math.nan] + [0.0] * 5, 1.0), FollowJointTrajectoryResult.INVALID_GOAL),
            (arm_goal([0.0] * 5, 1.0), FollowJointTrajectoryResult.INVALID_GOAL),
        ):
            self.assertEqual(self.run_goal(goal), code)
            self.assertEqual(self.arm.get_state(), GoalStatus.REJECTED)

    def test_pause_stops_time_and_refuses_goals_until_unpause(self):
        call("pause_physics", Empty)
        before = call("get_world_properties", srv.GetWorldProperties).sim_time
        self.arm.send_goal(arm_goal(READY, 1.0))
        self.assertTrue(wait_until(lambda: self.arm.get_state() == GoalStatus.REJECTED))
        self.assertIn("paused", self.arm.get_goal_status_text())
        self.assertEqual(call("get_world_properties", srv.GetWorldProperties).sim_time, before)
        stepped = call("step_physics", srv.StepPhysics, steps=24)
        self.assertAlmostEqual(stepped.sim_time - before, 0.1, places=6)
        self.assertFalse(self.trigger().success)
        call("unpause_physics", Empty)
        self.assertFalse(call("step_physics", srv.StepPhysics, steps=1).success)
        self.assertEqual(self.run_goal(arm_goal(READY, 1.0)), FollowJointTrajectoryResult.SUCCESSFUL)

    def test_spawned_model_is_listed_seen_moved_and_deleted(self):
        spawn = {"model_name": "box", "model_xml": BOX, "fixed": True}
        self.assertTrue(
            call("spawn_urdf_model", srv.SpawnModel, initial_pose=pose_at(1, -0.8, 1), **spawn).success
        )
        taken = call("spawn_urdf_model", srv.SpawnModel, initial_pose=pose_at(1, -0.8, 1), **spawn)
        self.assertFalse(taken.success)
        self.assertIn("exists", taken.status_message)
        self.assertIn("box", call("get_world_properties", srv.GetWorldProperties).model_names)
        self.assertTrue(
            call("set_model_state", srv.SetModelState, model_name="box", pose=pose_at(1, 1, 2)).success
        )
        state = call("get_model_state", srv.GetModelState, model_name="box")
        self.assertAlmostEqual(state.pose.position.z, 2.0, places=6)
        self.assertTrue(call("delete_model", srv.DeleteModel, model_name="box").success)
        self.assertFalse(call("delete_model", srv.DeleteModel, model_name="box").success)

    def test_spawn_inside_the_robot_or_of_broken_xml_is_refused(self):
        inside = call(
            "spawn_urdf_model", srv.SpawnModel, model_name="in", model_xml=BOX, initial_pose=pose_at(0, 0, 1)
        )
        self.assertFalse(inside.success)
        self.assertIn("inside", inside.status_message)
        for xml in ("<robot", "<robot name='x'/>", ""):
            answer = call(
                "spawn_urdf_model",
                srv.SpawnModel,
                model_name="bad",
                model_xml=xml,
                initial_pose=pose_at(1, 1, 1),
            )
            self.assertFalse(answer.success)
            self.assertTrue(answer.status_message)
        self.assertNotIn("bad", call("get_world_properties", srv.GetWorldProperties).model_names)

    def test_moving_without_touching_counts_no_contact_and_tf_ties_the_base(self):
        self.run_goal(arm_goal(READY, 1.0))
        contacts = rospy.wait_for_message("/hubo_sim/contacts", Contacts, PATIENCE_S)
        self.assertEqual((contacts.total, contacts.pairs), (0, []))
        static = rospy.wait_for_message("/tf_static", TFMessage, PATIENCE_S).transforms[0]
        self.assertEqual((static.header.frame_id, static.child_frame_id), ("world", "base_link"))
        self.assertGreater(static.transform.translation.z, 0.8)

    def test_query_state_tells_the_trajectory(self):
        self.run_goal(arm_goal(READY, 1.0))
        query = rospy.ServiceProxy("/huboplus/right_hand_controller/query_state", QueryTrajectoryState)
        answer = query(rospy.Time.now())
        self.assertEqual(answer.name, ARM)
        self.assertLess(np.abs(np.array(answer.position) - READY).max(), 1e-6)


if __name__ == "__main__":
    rospy.init_node("sim_rostest")
    rostest.rosrun("hubo_sim", "sim", SimTest, sys.argv)
