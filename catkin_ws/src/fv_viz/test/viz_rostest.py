#!/usr/bin/env python3
"""Behaviours that need nodes: markers for late listeners, pictures, and an RViz that dies."""

import os
import shutil
import signal
import subprocess
import tempfile
import unittest

import rospy
import rostest
from fv_msgs.srv import Screenshot, ScreenshotRequest
from PIL import Image as Picture
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

LAYERS = (
    "occupied",
    "frontier",
    "frontier_clusters",
    "ellipsoids",
    "frontier_voids",
    "utility",
    "views",
    "path",
    "volume",
)


class LateListeners(unittest.TestCase):
    """Who subscribes after the evaluation still gets everything."""

    def test_every_layer_arrives_whole(self):
        for name in LAYERS:
            msg = rospy.wait_for_message(f"/fv_viz/{name}", MarkerArray, timeout=20)
            self.assertEqual(msg.markers[0].action, Marker.DELETEALL, name)
            self.assertGreater(len(msg.markers), 1, name)
        self.assertGreater(rospy.wait_for_message("/fv_viz/void", PointCloud2, timeout=20).width, 10)


@unittest.skipUnless(shutil.which("Xvfb"), "no Xvfb")
class Pictures(unittest.TestCase):
    """The screenshot node with an X server of its own."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
        command = [
            "rosrun",
            "fv_viz",
            "screenshot_node",
            f"_out_dir:={cls.folder.name}",
            "_width:=640",
            "_height:=480",
        ]
        command += ["_height:=480", "_timeout_s:=15.0"]
        cls.node = subprocess.Popen(command, env=environment)
        rospy.wait_for_service("/fv_viz/screenshot", timeout=90)
        cls.take = rospy.ServiceProxy("/fv_viz/screenshot", Screenshot)

    @classmethod
    def tearDownClass(cls):
        cls.node.terminate()
        cls.node.wait(20)
        cls.folder.cleanup()

    def test_a_picture_shows_the_scene_and_no_display_complains(self):
        reply = self.take(ScreenshotRequest(path="sub/a.png", title="first", facts=["x"], map_sequence=1))
        self.assertTrue(reply.success, reply.message)
        self.assertEqual(list(reply.display_errors), [])
        picture = Picture.open(os.path.join(self.folder.name, "sub", "a.png"))
        self.assertGreater(picture.height, 480)
        self.assertGreater(len(picture.crop((0, 100, 640, 480)).convert("RGB").getcolors(1 << 20)), 200)

    def test_toggles_change_the_picture_and_last_for_one(self):
        colors = []
        for hide in ([], ["*"], []):
            reply = self.take(ScreenshotRequest(path="b.png", hide=hide, no_legend=True, map_sequence=1))
            self.assertTrue(reply.success, reply.message)
            picture = Picture.open(os.path.join(self.folder.name, "b.png")).convert("RGB")
            colors.append(len(picture.getcolors(1 << 20)))
        # Even the empty picture has the shades of its title; how many depends on the font.
        self.assertGreater(colors[0], 4 * colors[1])
        self.assertGreater(colors[2], 4 * colors[1])

    def test_wrong_names_are_answered_with_the_right_ones(self):
        self.assertIn("Overview", self.take(ScreenshotRequest(path="c.png", preset="nowhere")).message)
        self.assertIn("Frontier", self.take(ScreenshotRequest(path="c.png", hide=["nothing"])).message)
        self.assertIn("path", self.take(ScreenshotRequest()).message)

    def test_an_rviz_that_was_killed_is_started_again(self):
        os.kill(self._rviz(), signal.SIGKILL)
        reply = self.take(ScreenshotRequest(path="d.png"))
        self.assertTrue(reply.success, reply.message)

    def test_an_rviz_that_hangs_is_replaced_in_time(self):
        hanging = self._rviz()
        os.kill(hanging, signal.SIGSTOP)
        reply = self.take(ScreenshotRequest(path="e.png"))
        self.assertTrue(reply.success, reply.message)
        self.assertNotEqual(self._rviz(), hanging)

    def _rviz(self):
        children = subprocess.run(
            ["pgrep", "-f", "fv_viz.offscreen.rviz_process"], capture_output=True, text=True
        )
        mine = [int(k) for k in children.stdout.split() if self._is_mine(int(k))]
        self.assertEqual(len(mine), 1)
        return mine[0]

    def _is_mine(self, pid):
        with open(f"/proc/{pid}/environ", "rb") as file:
            return f"ROS_MASTER_URI={os.environ['ROS_MASTER_URI']}".encode() in file.read()


def suite():
    """All of the above in one run."""
    loader = unittest.TestLoader()
    return unittest.TestSuite(map(loader.loadTestsFromTestCase, (LateListeners, Pictures)))


if __name__ == "__main__":
    rospy.init_node("viz_rostest")
    rostest.rosrun("fv_viz", "viz_rostest", "viz_rostest.suite")
