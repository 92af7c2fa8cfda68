#!/usr/bin/env python3
"""Behaviours that need the node: vectorised queries in any frame, refusals, markers for late listeners."""

import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from fv_msgs.srv import QueryCapability, QueryCapabilityRequest
from geometry_msgs.msg import Pose, TransformStamped
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray

from capability_map import CapabilityMap, check
from capability_map.commands import build_command


def poses_looking(positions, directions):
    """Poses with z along the directions."""
    poses = []
    for p, d in zip(positions, directions, strict=True):
        # The shortest turn from z to d: quaternion (z x d, 1 + z . d), normalised.
        q = np.array([-d[1], d[0], 0.0, 1.0 + d[2]])
        q /= np.linalg.norm(q)
        pose = Pose()
        pose.position.x, pose.position.y, pose.position.z = p
        pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w = q
        poses.append(pose)
    return poses


class CapabilityService(unittest.TestCase):
    """The node on a coarse map of HUBO."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        path = Path(cls.folder.name) / "map.h5"
        build_command(
            ["--robot", "hubo", "--radius", "0.08", "--points", "60", "--roll-step", "30", "--out", str(path)]
        )
        while not rospy.has_param("/robot_description"):
            rospy.sleep(0.1)
        cls.map = CapabilityMap.load(path)
        cls.node = subprocess.Popen(["rosrun", "capability_map", "capability_node", f"_map:={path}"])
        rospy.wait_for_service("/capability_map/query", timeout=240)
        cls.ask = rospy.ServiceProxy("/capability_map/query", QueryCapability)

    @classmethod
    def tearDownClass(cls):
        cls.node.terminate()
        cls.node.wait(timeout=120)
        cls.folder.cleanup()

    def request(self, frame, interpolate=True, group=""):
        self.views = check.random_views(self.map, 500, 0)
        request = QueryCapabilityRequest(
            group=group, interpolate=interpolate, poses=poses_looking(*self.views)
        )
        request.header.frame_id = frame
        return request

    def test_answers_equal_those_of_the_library(self):
        for interpolate in (True, False):
            response = self.ask(self.request(self.map.base_frame, interpolate))
            self.assertTrue(response.success, response.message)
            expected = self.map.query(*self.views, interpolate)
            np.testing.assert_allclose(response.reachability, expected, atol=1e-4)
            self.assertEqual(
                list(response.reachable), list(np.array(response.reachability) >= self.map.threshold)
            )
            self.assertGreater(max(response.reachability), 0.2)

    def test_poses_of_another_frame_go_through_tf(self):
        broadcaster = tf2_ros.StaticTransformBroadcaster()
        shift = TransformStamped(child_frame_id="elsewhere")
        shift.header.frame_id = self.map.base_frame
        shift.transform.translation.x = 0.1
        shift.transform.rotation.w = 1.0
        broadcaster.sendTransform(shift)
        response = self.ask_until_the_frame_is_known(self.request("elsewhere"))
        self.assertTrue(response.success, response.message)
        positions, directions = self.views
        expected = self.map.query(positions + np.array([0.1, 0.0, 0.0]), directions)
        np.testing.assert_allclose(response.reachability, expected, atol=1e-4)

    def ask_until_the_frame_is_known(self, request):
        """A frame takes its time to get to the node; how long depends on the machine."""
        deadline = rospy.Time.now() + rospy.Duration(120.0)
        response = self.ask(request)
        while not response.success and rospy.Time.now() < deadline:
            response = self.ask(request)
        return response

    def test_what_cannot_be_answered_is_refused_in_words(self):
        unknown_frame = self.ask(self.request("no_such_frame"))
        self.assertFalse(unknown_frame.success)
        self.assertIn("no_such_frame", unknown_frame.message)
        wrong_group = self.ask(self.request(self.map.base_frame, group="left_leg"))
        self.assertFalse(wrong_group.success)
        self.assertIn("left_leg", wrong_group.message)
        request = self.request(self.map.base_frame)
        request.poses[3].orientation.w = float("nan")
        broken = self.ask(request)
        self.assertFalse(broken.success)
        self.assertIn("pose 3", broken.message)

    def test_no_poses_is_a_valid_question(self):
        request = self.request(self.map.base_frame)
        request.poses = []
        response = self.ask(request)
        self.assertTrue(response.success)
        self.assertEqual(len(response.reachability), 0)

    def test_late_listeners_get_the_markers(self):
        for name in ("spheres", "index_cuts", "shapes"):
            message = rospy.wait_for_message(f"/capability_map/{name}", MarkerArray, timeout=120)
            self.assertGreater(len(message.markers[0].points), 10, name)
            self.assertEqual(message.markers[0].header.frame_id, self.map.base_frame)
            self.assertTrue(message.markers[0].frame_locked, name)  # RViz may meet it before its transform

    def test_late_listeners_get_the_legend(self):
        image = rospy.wait_for_message("/capability_map/legend", Image, timeout=120)
        self.assertEqual(len(image.data), image.height * image.step)
        pixels = np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3)
        self.assertGreater(len(np.unique(pixels.reshape(-1, 3), axis=0)), 100)  # the scale's steps


if __name__ == "__main__":
    rospy.init_node("capability_rostest")
    rostest.rosrun("capability_map", "capability", CapabilityService)
