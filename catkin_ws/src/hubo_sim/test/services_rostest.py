#!/usr/bin/env python3
"""Services and topics of the simulator under bad and hasty input: every answer is true and the simulation goes on."""

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
    JointTrajectoryControllerState,
)
from fv_msgs import srv
from geometry_msgs.msg import Vector3
from sim_helpers import (
    BOX,
    PATIENCE_S,
    READY,
    arm_goal,
    call,
    collect,
    model,
    pose_at,
    trajectory,
    wait_until,
)
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory

CONTROLLER = "/huboplus/right_hand_controller"
SDF = (
    "<sdf version='1.6'><model name='m'><link name='l'>{inertial}<visual name='v'>{shape}</visual>"
    "<collision name='c'>{shape}</collision></link></model></sdf>"
)
SDF_BOX = SDF.format(inertial="", shape="<geometry><box><size>0.2 0.2 0.2</size></box></geometry>")
SDF_NO_MESH = SDF.format(inertial="", shape="<geometry><mesh><uri>/no/such.obj</uri></mesh></geometry>")


def spawn(xml, name="thing", kind="urdf", pose=None, **fields):
    pose = pose or pose_at(-1.5, 1.5, 1.0)
    return call(
        f"spawn_{kind}_model", srv.SpawnModel, model_name=name, model_xml=xml, initial_pose=pose, **fields
    )


def names():
    return call("get_world_properties", srv.GetWorldProperties).model_names


class ServicesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.arm = actionlib.SimpleActionClient(
            f"{CONTROLLER}/follow_joint_trajectory", FollowJointTrajectoryAction
        )
        assert cls.arm.wait_for_server(rospy.Duration(60)), "no action server"
        rospy.wait_for_service("/hubo_sim/ground_truth", PATIENCE_S)
        cls.command = rospy.Publisher(f"{CONTROLLER}/command", JointTrajectory, queue_size=5)
        while not cls.command.get_num_connections():
            rospy.sleep(0.02)

    def setUp(self):
        call("unpause_physics", Empty)
        call("reset_simulation", Empty)

    def assert_it_goes_on(self):
        self.arm.send_goal_and_wait(arm_goal(READY, 0.3), rospy.Duration(20))
        self.assertEqual(self.arm.get_result().error_code, FollowJointTrajectoryResult.SUCCESSFUL)

    def desired(self):
        """Where the controller wants the arm."""
        return collect(f"{CONTROLLER}/state", JointTrajectoryControllerState, 1)[0].desired.positions

    def test_broken_models_and_missing_meshes_are_refused_and_not_spawned(self):
        mesh = model('<mesh filename="package://no_such_package/a.stl"/>')
        for kind, xml, word in (
            ("urdf", "<robot", "broken URDF"),
            ("urdf", mesh, "no_such_package"),
            ("urdf", model('<mesh filename="/no/such.stl"/>'), "no such file"),
            ("urdf", "", "model_file"),
            ("sdf", "<sdf", "broken SDF"),
            ("sdf", "<sdf version='1.6'/>", "one model"),
            ("sdf", SDF_NO_MESH, "no such file"),
        ):
            answer = spawn(xml, "bad", kind)
            self.assertFalse(answer.success, xml)
            self.assertIn(word, answer.status_message)
            self.assertNotIn("\n", answer.status_message)
        self.assertNotIn("bad", names())
        self.assert_it_goes_on()

    def test_sdf_from_string_and_urdf_from_file_are_spawned_where_asked(self):
        self.assertTrue(spawn(SDF_BOX, "sdf", "sdf", fixed=True).success)
        answer = spawn("", "drake", model_file="pybullet_data:duck_vhacd.urdf", fixed=True)
        self.assertTrue(answer.success, answer.status_message)
        for name in ("sdf", "drake"):
            at = call("get_model_state", srv.GetModelState, model_name=name).pose.position
            self.assertLess(np.abs(np.array([at.x, at.y, at.z]) - [-1.5, 1.5, 1.0]).max(), 1e-6)

    def test_poses_and_twists_that_are_not_numbers_are_refused(self):
        self.assertIn("finite", spawn(BOX, pose=pose_at(math.nan, 0, 1)).status_message)
        self.assertTrue(spawn(BOX).success)
        for fields in (
            {"pose": pose_at(0, math.inf, 1)},
            {"pose": type(pose_at(0, 0, 0))()},  # a quaternion of zeros
        ):
            self.assertFalse(call("set_model_state", srv.SetModelState, model_name="thing", **fields).success)
        request = srv.SetModelStateRequest(model_name="thing", pose=pose_at(0, 2, 1))
        request.twist.linear = Vector3(math.nan, 0, 0)
        self.assertFalse(rospy.ServiceProxy("/hubo_sim/set_model_state", srv.SetModelState)(request).success)
        self.assert_it_goes_on()

    def test_unknown_models_are_named_with_the_valid_ones(self):
        for name, kind in (("get_model_state", srv.GetModelState), ("delete_model", srv.DeleteModel)):
            answer = call(name, kind, model_name="nothing")
            self.assertFalse(answer.success)
            self.assertIn("hubo", answer.status_message)
        self.assertFalse(call("get_model_state", srv.GetModelState, model_name="hubo::nose").success)

    def test_true_pose_of_a_link_and_of_the_moved_base(self):
        before = call("get_model_state", srv.GetModelState, model_name="hubo::hand_camera_optical_frame").pose
        base = call("get_model_state", srv.GetModelState, model_name="hubo").pose
        base.position.y += 0.5
        self.assertTrue(call("set_model_state", srv.SetModelState, model_name="hubo", pose=base).success)
        after = call("get_model_state", srv.GetModelState, model_name="hubo::hand_camera_optical_frame").pose
        self.assertAlmostEqual(after.position.y - before.position.y, 0.5, places=6)
        tied = collect("/tf_static", TFMessage, 1)[0].transforms[0].transform.translation
        self.assertAlmostEqual(tied.y, base.position.y, places=6)

    def test_services_during_resets_are_answered_and_the_simulation_goes_on(self):
        wrong, stop = [], threading.Event()

        def hammer(number):
            name = f"thing_{number}"
            while not stop.is_set():
                pose = pose_at(-1.0 - 0.3 * number, 1.5, 1.0)
                made = spawn(BOX, name, pose=pose, fixed=True)
                state = call("get_model_state", srv.GetModelState, model_name=name)
                gone = call("delete_model", srv.DeleteModel, model_name=name)
                if not made.success:
                    wrong.append(made.status_message)
                for answer in (state, gone):  # a reset in between took it away: then that is the answer
                    if not answer.success and "no model" not in answer.status_message:
                        wrong.append(answer.status_message)

        threads = [threading.Thread(target=hammer, args=(i,)) for i in range(3)]
        for thread in threads:
            thread.start()
        for _ in range(10):
            call("reset_simulation", Empty)
        stop.set()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])
        self.assertFalse([name for name in names() if name.startswith("thing")])
        self.assert_it_goes_on()

    def test_goal_that_a_reset_interrupts_is_aborted_and_says_so(self):
        self.arm.send_goal(arm_goal([0.5, -1.0, 0.5, -0.5, 0.5, 0.0], 300.0))
        self.assertTrue(wait_until(lambda: self.arm.get_state() == GoalStatus.ACTIVE))
        wait_until(lambda: np.abs(np.subtract(self.desired(), READY)).max() > 1e-3)
        call("reset_simulation", Empty)
        self.assertTrue(wait_until(lambda: self.arm.get_state() == GoalStatus.ABORTED))
        self.assertIn("reset", self.arm.get_goal_status_text())

    def test_steps_that_an_unpause_interrupts_are_told_truly(self):
        call("pause_physics", Empty)
        begin = call("get_world_properties", srv.GetWorldProperties).sim_time
        answers = []
        worker = threading.Thread(
            target=lambda: answers.append(call("step_physics", srv.StepPhysics, steps=4_000_000_000))
        )
        worker.start()
        moved = wait_until(
            lambda: call("get_world_properties", srv.GetWorldProperties).sim_time > begin + 0.1
        )
        self.assertTrue(moved, "no other service is answered while steps are taken")
        call("unpause_physics", Empty)
        worker.join(PATIENCE_S)
        self.assertFalse(answers[0].success)
        self.assertRegex(answers[0].status_message, r"unpaused after \d+ of 4000000000 steps")
        self.assert_it_goes_on()

    def test_command_topic_moves_the_arm_and_replaces_the_goal(self):
        self.arm.send_goal(arm_goal([0.5, -1.0, 0.5, -0.5, 0.5, 0.0], 300.0))
        self.assertTrue(wait_until(lambda: self.arm.get_state() == GoalStatus.ACTIVE))
        target = [-0.4, -0.3, 0.1, -1.5, 0.1, 0.5]
        self.command.publish(trajectory(target, 1.0))
        self.assertTrue(wait_until(lambda: self.arm.get_state() == GoalStatus.PREEMPTED))
        self.assertTrue(wait_until(lambda: np.abs(np.subtract(self.desired(), target)).max() < 1e-6))

    def test_command_that_is_not_a_number_is_refused_and_the_arm_stays(self):
        before = self.desired()
        self.command.publish(trajectory([math.nan, *READY[1:]], 1.0))
        self.command.publish(trajectory(READY, math.pi, ["RSP"] * 6))
        self.assert_it_goes_on()
        self.assertLess(np.abs(np.subtract(self.desired(), before)).max(), 1e-6)

    def test_state_comes_at_its_rate_in_simulated_time(self):
        self.arm.send_goal(arm_goal([-0.2, -0.4, 0.1, -1.2, 0.2, 0.3], 3.0))
        states = collect(f"{CONTROLLER}/state", JointTrajectoryControllerState, 60)
        self.arm.wait_for_result(rospy.Duration(20))
        gaps = np.diff([m.header.stamp.to_sec() for m in states])
        self.assertAlmostEqual(np.median(gaps), 1.0 / 50.0, delta=1.0 / 240.0)
        for state in states:
            error = np.subtract(state.desired.positions, state.actual.positions)
            self.assertLess(np.abs(error - state.error.positions).max(), 1e-9)

    def test_truth_holds_what_was_spawned_and_bad_questions_are_refused(self):
        before = call("ground_truth", srv.GroundTruth, what="occupied", resolution=0.05)
        self.assertTrue(spawn(BOX, pose=pose_at(-0.3, 0.6, 0.6), fixed=True).success)
        after = call("ground_truth", srv.GroundTruth, what="occupied", resolution=0.05)
        self.assertTrue(before.success and after.success, after.status_message)
        self.assertAlmostEqual(after.voxels - before.voxels, 4**3, delta=5**3 - 4**3)
        self.assertEqual(after.map.header.frame_id, "world")
        for what, resolution in (("colour", 0.05), ("solid", 0.0), ("solid", math.nan), ("solid", 1e-4)):
            answer = call("ground_truth", srv.GroundTruth, what=what, resolution=resolution)
            self.assertFalse(answer.success)
            self.assertTrue(answer.status_message)


if __name__ == "__main__":
    rospy.init_node("services_rostest")
    rostest.rosrun("hubo_sim", "services", ServicesTest, sys.argv)
