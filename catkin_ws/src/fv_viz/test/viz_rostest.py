#!/usr/bin/env python3
"""Behaviours that need nodes: markers for late listeners, pictures, and an RViz that dies."""

import os
import shutil
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rospkg
import rospy
import rostest
import viz_synthetic
from fv_msgs.srv import Screenshot, ScreenshotRequest
from geometry_msgs.msg import TransformStamped, Vector3
from PIL import Image as Picture
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import ColorRGBA, Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from fv_viz.config import ScreenshotConfig
from fv_viz.offscreen.camera import Camera

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
            msg = rospy.wait_for_message(f"/fv_viz/{name}", MarkerArray, timeout=120)
            self.assertEqual(msg.markers[0].action, Marker.DELETEALL, name)
            self.assertGreater(len(msg.markers), 1, name)
        self.assertGreater(rospy.wait_for_message("/fv_viz/void", PointCloud2, timeout=120).width, 10)


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
        command += ["_height:=480", "_timeout_s:=20.0"]
        cls.node = subprocess.Popen(command, env=environment)
        rospy.wait_for_service("/fv_viz/screenshot", timeout=240)
        cls.take = rospy.ServiceProxy("/fv_viz/screenshot", Screenshot)

    @classmethod
    def tearDownClass(cls):
        cls.node.terminate()
        cls.node.wait(60)
        cls.folder.cleanup()

    def test_a_picture_shows_the_scene_and_no_display_complains(self):
        reply = self.take(ScreenshotRequest(path="sub/a.png", title="first", facts=["x"], map_sequence=1))
        self.assertTrue(reply.success, reply.message)
        self.assertEqual(list(reply.display_errors), [])
        picture = Picture.open(os.path.join(self.folder.name, "sub", "a.png"))
        self.assertGreater(picture.height, 480)
        self.assertGreater(len(picture.crop((0, 100, 640, 480)).convert("RGB").getcolors(1 << 20)), 200)

    def test_a_decision_is_in_the_picture_until_the_next_evaluation(self):
        evaluation = viz_synthetic.evaluation(viz_synthetic.scan(0.1, [(0.2, -0.2, 0.5, 0.1)]))
        views, now = viz_synthetic.views(evaluation), rospy.Time.now()
        views.header = Header(frame_id="world", stamp=now)
        evaluation.header = Header(frame_id="world", stamp=now + rospy.Duration(1.0))
        evaluation.map_sequence = 2
        topics = {"/fv_exploration/views": views, "/fv_exploration/evaluation": evaluation}
        out = {
            name: rospy.Publisher(name, type(msg), latch=True, queue_size=1) for name, msg in topics.items()
        }
        listeners = {"/fv_exploration/views": 2, "/fv_exploration/evaluation": 1}
        while any(out[name].get_num_connections() < count for name, count in listeners.items()):
            rospy.sleep(0.05)
        magenta = []
        for name, sequence in (("/fv_exploration/views", 1), ("/fv_exploration/evaluation", 2)):
            out[name].publish(topics[name])
            reply = self.take(
                ScreenshotRequest(
                    path="n.png", show=["Chosen view"], hide=["*"], map_sequence=sequence, no_legend=True
                )
            )
            self.assertTrue(reply.success, reply.message)
            magenta.append(_magenta_pixels(os.path.join(self.folder.name, "n.png")))
        self.assertGreater(magenta[0], 100)
        self.assertEqual(magenta[1], 0)

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

    def test_a_marker_that_came_before_its_frame_is_shown_all_the_same(self):
        picture_path = os.path.join(self.folder.name, "late.png")
        order = {
            "grab": picture_path,
            "show": ["Contacts"],
            "hide": ["*"],
            "camera": [3.0, 0.0, 0.3, 0, 0, 0],
        }
        drawing = rospy.Publisher("/late_drawing", MarkerArray, latch=True, queue_size=1)
        drawing.publish([_red_ball("late_frame")])
        displays = Path(rospkg.RosPack().get_path("fv_viz"), "rviz", "planning.rviz").read_text()
        config = Path(self.folder.name, "late.rviz")
        config.write_text(displays.replace("/fv_viz/contacts", "/late_drawing"))
        camera = Camera(ScreenshotConfig(config=str(config), width=320, height=240))
        try:
            camera.take(order)
            self.assertEqual(_red_pixels(picture_path), 0)
            frames = rospy.Publisher("/tf", TFMessage, queue_size=1)
            timer = rospy.Timer(rospy.Duration(0.1), lambda _: frames.publish([_frame("late_frame")]))
            self.addCleanup(timer.shutdown)
            rospy.sleep(1.0)
            self.assertEqual(camera.take(order)["errors"], [])
        finally:
            camera.close()
        self.assertGreater(_red_pixels(picture_path), 100)

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


def _red_ball(frame):
    ball = Marker(header=Header(frame_id=frame), ns="ball", type=Marker.SPHERE)
    ball.scale = Vector3(1.0, 1.0, 1.0)
    ball.color = ColorRGBA(1.0, 0.0, 0.0, 1.0)
    ball.pose.orientation.w = 1.0
    return ball


def _frame(name):
    place = TransformStamped(header=Header(frame_id="world", stamp=rospy.Time.now()), child_frame_id=name)
    place.transform.rotation.w = 1.0
    return place


def _red_pixels(path):
    colors = np.asarray(Picture.open(path).convert("RGB")).astype(int)
    return int(((colors[..., 0] > 100) & (colors[..., 1:].max(axis=2) < 60)).sum())


def _magenta_pixels(path):
    colors = np.asarray(Picture.open(path).convert("RGB")).astype(int)
    return int(((colors[..., 0] > 150) & (colors[..., 1] < 60) & (colors[..., 2] > 70)).sum())


def suite():
    """All of the above in one run."""
    loader = unittest.TestLoader()
    return unittest.TestSuite(map(loader.loadTestsFromTestCase, (LateListeners, Pictures)))


if __name__ == "__main__":
    rospy.init_node("viz_rostest")
    rostest.rosrun("fv_viz", "viz_rostest", "viz_rostest.suite")
