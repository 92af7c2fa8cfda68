#!/usr/bin/env python3
"""Every kind of sensor on a mast before a wall, running free: contents, stamps and rates in simulated time."""

import math
import sys
import unittest

import actionlib
import numpy as np
import rospy
import rostest
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryResult
from fv_msgs import srv
from geometry_msgs.msg import WrenchStamped
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, Imu, JointState, LaserScan, PointCloud2
from sim_helpers import PATIENCE_S, arm_goal, call, collect, points_of

STEP_S = 1.0 / 240.0
RATES = [
    ("/front/depth/points", PointCloud2, 8.0, "front_optical"),
    ("/down/depth/points", PointCloud2, 5.0, "down_optical"),
    ("/front/depth/image_raw", Image, 8.0, "front_optical"),
    ("/front/rgb/image_raw", Image, 8.0, "front_optical"),
    ("/down/rgb/camera_info", CameraInfo, 5.0, "down_optical"),
    ("/scan", LaserScan, 10.0, "head"),
    ("/points", PointCloud2, 4.0, "head"),
    ("/imu", Imu, 60.0, "tip"),
    ("/wrench", WrenchStamped, 30.0, "tip"),
]


class SensorsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.arm = actionlib.SimpleActionClient(
            "/mast/arm_controller/follow_joint_trajectory", FollowJointTrajectoryAction
        )
        assert cls.arm.wait_for_server(rospy.Duration(60)), "no action server"
        rospy.wait_for_service("/hubo_sim/ground_truth", PATIENCE_S)
        cls.turn_to(0.0, 0.5)

    @classmethod
    def turn_to(cls, angle, seconds):
        goal = arm_goal([angle, 0.0], seconds, ["turn", "tilt"])
        cls.arm.send_goal_and_wait(goal, rospy.Duration(30))
        assert cls.arm.get_result().error_code == FollowJointTrajectoryResult.SUCCESSFUL

    def test_every_sensor_keeps_its_rate_and_frame_in_simulated_time(self):
        for topic, kind, rate_hz, frame in RATES:
            count = max(int(rate_hz), 6)
            messages = collect(topic, kind, count)
            stamps = np.array([m.header.stamp.to_sec() for m in messages])
            self.assertEqual({m.header.frame_id for m in messages}, {frame}, topic)
            gaps = np.diff(stamps)
            self.assertLess(np.abs(gaps - 1.0 / rate_hz).max(), 1.01 * STEP_S, topic)
            self.assertAlmostEqual(gaps.mean() * rate_hz, 1.0, delta=0.05, msg=topic)

    def test_joint_states_keep_their_rate_and_no_moment_comes_twice(self):
        gaps = np.diff([m.header.stamp.to_sec() for m in collect("/joint_states", JointState, 60)])
        self.assertLess(gaps.max(), 1.0 / 50.0 + 1.01 * STEP_S)
        self.assertGreater(gaps.min(), 0.0)  # those at the scans' stamps come in between

    def test_clock_never_runs_back_and_is_ahead_of_no_sensor(self):
        ticks = [m.clock.to_sec() for m in collect("/clock", Clock, 100)]
        self.assertTrue(np.all(np.diff(ticks) > 0.0))
        scan = collect("/scan", LaserScan, 1)[0].header.stamp
        self.assertLess(scan.to_sec(), collect("/clock", Clock, 1)[0].clock.to_sec() + 0.05)

    def test_both_cameras_see_what_is_before_them(self):
        for topic, distance in (("/front", 1.5), ("/down", 1.0)):
            points = points_of(collect(f"{topic}/depth/points", PointCloud2, 1)[0])
            info = collect(f"{topic}/depth/camera_info", CameraInfo, 1)[0]
            self.assertEqual((points.shape[:2], info.width), ((60, 80), 80))
            self.assertAlmostEqual(float(np.nanmedian(points[..., 2])), distance, delta=2e-3)
            u = points[..., 0] / points[..., 2] * info.K[0] + info.K[2]
            columns = np.broadcast_to(np.arange(80.0), u.shape)
            self.assertLess(np.nanmax(np.abs(u - columns)), 1e-3)

    def test_lidars_measure_the_wall(self):
        scan = collect("/scan", LaserScan, 1)[0]
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        self.assertEqual(len(scan.ranges), 181)
        self.assertLess(np.abs(np.array(scan.ranges) - 2.0 / np.cos(angles)).max(), 2e-3)
        points = points_of(collect("/points", PointCloud2, 1)[0])
        self.assertEqual(points.shape, (8, 60, 3))
        self.assertLess(np.abs(points[..., 0] - 2.0).max(), 3e-3)

    def test_inertial_unit_and_wrench_at_rest_feel_gravity(self):
        imu = collect("/imu", Imu, 1)[0]
        self.assertAlmostEqual(imu.linear_acceleration.z, 9.81, delta=0.05)
        self.assertEqual(imu.orientation_covariance[0], -1.0)
        force = collect("/wrench", WrenchStamped, 1)[0].wrench.force
        self.assertAlmostEqual(abs(force.z), 9.81 * 0.501, delta=0.05)

    def test_inertial_unit_feels_the_turn(self):
        self.arm.send_goal(arm_goal([2.4, 0.0], 2.4, ["turn", "tilt"]))
        rates = [m.angular_velocity.z for m in collect("/imu", Imu, 150)]
        self.arm.wait_for_result(rospy.Duration(20))
        self.assertAlmostEqual(max(rates), 1.5, delta=0.1)  # a cubic's largest velocity is 1.5 of its mean
        self.turn_to(0.0, 2.0)

    def test_continuous_joint_takes_the_short_way_round(self):
        self.turn_to(3.0, 2.5)
        self.turn_to(-3.0, 0.6)
        state = collect("/joint_states", JointState, 1)[0]
        turned = state.position[state.name.index("turn")]
        self.assertAlmostEqual(turned, 2.0 * math.pi - 3.0, delta=0.02)
        self.turn_to(0.0, 2.5)

    def test_observable_set_of_the_camera_is_answered_by_service(self):
        answer = call("ground_truth", srv.GroundTruth, what="observable", resolution=0.25)
        self.assertTrue(answer.success, answer.status_message)
        self.assertTrue(answer.settled)
        self.assertGreaterEqual(answer.samples, 400)
        self.assertGreater(answer.voxels, 100)
        self.assertEqual((answer.map.id, answer.map.binary, answer.map.resolution), ("OcTree", True, 0.25))
        again = call("ground_truth", srv.GroundTruth, what="observable", resolution=0.25)  # from the cache
        self.assertEqual((again.voxels, again.samples), (answer.voxels, answer.samples))


if __name__ == "__main__":
    rospy.init_node("sensors_rostest")
    rostest.rosrun("hubo_sim", "sensors", SensorsTest, sys.argv)
