#!/usr/bin/env python3
"""The whole chain on simulated input: HUBO explores a part of the shelf world."""

import csv
import json
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import actionlib
import numpy as np
import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from fv_msgs.msg import Contacts, ExplorationVolume, ExploreAction, ExploreGoal, ExploreResult, MapUpdate
from geometry_msgs.msg import Point
from octomap_msgs.srv import GetOctomap

CONFIG = {
    "map": {"resolution_m": 0.05},
    "scan": {"trigger_service": "/camera/trigger"},
    "views": {"sampled": 600, "utility_voxels": 50},
}
NODES = (
    ("robot_state_publisher", "robot_state_publisher"),
    ("ompl_planner", "planner_node"),
    ("fv_exploration", "explore_node"),
)


def wait_for(condition, seconds):
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.05)
    return condition()


def goal(**values):
    message = ExploreGoal(seed=1, **values)
    message.bounds.min, message.bounds.max = Point(-0.8, -0.8, 0.0), Point(1.4, 0.8, 2.0)
    return message


class ExploreTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        assert wait_for(lambda: rospy.has_param("/robot") and rospy.has_param("/sensors"), 30)
        cls.folder = tempfile.TemporaryDirectory()
        rospy.set_param("/fv_exploration/config", CONFIG)
        rospy.set_param("/fv_exploration/out_dir", cls.folder.name)
        cls.processes = [subprocess.Popen(["rosrun", *node]) for node in NODES]
        cls.client = actionlib.SimpleActionClient("/explore", ExploreAction)
        assert wait_for(lambda: cls.client.wait_for_server(rospy.Duration(0.1)), 60)

    @classmethod
    def tearDownClass(cls):
        for process in cls.processes:
            process.terminate()
        for process in cls.processes:
            process.wait(15)
        cls.folder.cleanup()

    def send(self, message, seconds):
        shares = []
        self.client.send_goal(message, feedback_cb=lambda feedback: shares.append(feedback.known_share))
        assert wait_for(lambda: self.client.get_state() >= GoalStatus.PREEMPTED, seconds)
        return self.client.get_result(), shares

    def test_1_a_view_budget_is_explored_and_written(self):
        result, shares = self.send(goal(max_views=3), 300)
        self.assertEqual(result.status, ExploreResult.VIEW_BUDGET, result.message)
        self.assertEqual(result.views, 3)
        self.assertEqual(shares, sorted(shares))
        self.assertGreater(result.known_share, 0.2)
        self.check_files(result)
        self.check_map()
        contacts = rospy.wait_for_message("/hubo_sim/contacts", Contacts, timeout=10)
        self.assertEqual(contacts.total, 0, contacts.pairs)

    def check_files(self, result):
        folder = Path(self.folder.name)
        with (folder / "metrics.csv").open() as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["view"] for row in rows], ["0", "1", "2", "3"])
        self.assertTrue(all(float(row["expected_gain_m3"]) > 0 for row in rows[1:]))
        self.assertEqual(Path(result.map_path), folder / "map.ot")
        for name in ("map.ot", "map.bt", "views.json"):
            self.assertGreater((folder / name).stat().st_size, 100)
        with np.load(folder / "map_points.npz") as points:
            self.assertEqual(len(points["occupied"]), int(rows[-1]["occupied"]))
            self.assertEqual(len(points["free"]), int(rows[-1]["free"]))
        self.assertEqual([p.name for p in folder.iterdir() if "part" in p.name], [])

    def check_map(self):
        update = rospy.wait_for_message("/fv_exploration/map", MapUpdate, timeout=10)
        self.assertGreater(update.sequence, 3)
        self.assertEqual(update.octomap.header.frame_id, "world")
        answer = rospy.ServiceProxy("/octomap_binary", GetOctomap)()
        self.assertEqual(answer.map.data, update.octomap.data)
        self.assertTrue(answer.map.binary)
        self.assertFalse(rospy.ServiceProxy("/octomap_full", GetOctomap)().map.binary)

    def test_2_a_cancelled_exploration_ends_soon_and_says_so(self):
        self.client.send_goal(goal())
        time.sleep(3.0)
        self.client.cancel_goal()
        self.assertTrue(wait_for(lambda: self.client.get_state() == GoalStatus.PREEMPTED, 60))
        result = self.client.get_result()
        self.assertEqual(result.status, ExploreResult.CANCELLED)
        folder = Path(self.folder.name)
        with (folder / "metrics.csv").open() as file:
            views = [int(row["view"]) for row in csv.DictReader(file)]
        self.assertEqual(views, list(range(result.views + 1)), "a motion that was cut short is no view")
        if result.views:
            reached = json.loads((folder / "views.json").read_text())
            self.assertEqual([view["view"] for view in reached], views[1:])

    def test_3_bounds_inside_out_are_refused_with_the_reason(self):
        message = goal()
        message.bounds.min, message.bounds.max = message.bounds.max, message.bounds.min
        result, _ = self.send(message, 30)
        self.assertEqual(result.status, ExploreResult.FAILED)
        self.assertIn("bounds", result.message)

    def test_4_bounds_in_an_unknown_frame_are_refused_with_both_frames(self):
        message = goal()
        message.header.frame_id = "mars"
        result, _ = self.send(message, 30)
        self.assertEqual(result.status, ExploreResult.FAILED)
        self.assertIn("'mars'", result.message)
        self.assertIn("'world'", result.message)

    def test_5_what_no_exploration_can_do_is_refused(self):
        for values, said in (({"policy": "greedy"}, "frontier_void"), ({"max_seconds": float("nan")}, "nan")):
            result, _ = self.send(goal(**values), 30)
            self.assertEqual(result.status, ExploreResult.FAILED)
            self.assertIn(said, result.message)

    def test_6_bounds_in_the_frame_of_a_link_are_those_of_the_map_there(self):
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)
        base = buffer.lookup_transform("world", "base_link", rospy.Time(0), rospy.Duration(10.0))
        listener.unregister()
        at, message = base.transform.translation, goal()
        message.header.frame_id = "/base_link"
        sought = np.array([[-0.8, -0.8, 0.0], [1.4, 0.8, 2.0]])
        low, high = sought - [at.x, at.y, at.z]
        message.bounds.min, message.bounds.max = Point(*low), Point(*high)
        volumes = []
        subscriber = rospy.Subscriber("/fv_exploration/volume", ExplorationVolume, volumes.append)
        wait_for(lambda: subscriber.get_num_connections() > 0, 10)
        seen = len(volumes)
        self.client.send_goal(message)
        self.assertTrue(wait_for(lambda: len(volumes) > seen, 60))
        self.client.cancel_goal()
        self.assertTrue(wait_for(lambda: self.client.get_state() >= GoalStatus.PREEMPTED, 60))
        box = volumes[-1].bounds
        got = [[box.min.x, box.min.y, box.min.z], [box.max.x, box.max.y, box.max.z]]
        self.assertTrue(np.allclose(got, sought, atol=1e-9), got)
        subscriber.unregister()

    def test_7_a_goal_that_takes_the_place_of_another_is_said_and_one_cancelled_at_once_does_not_move(self):
        other = actionlib.SimpleActionClient("/explore", ExploreAction)
        self.assertTrue(wait_for(lambda: other.wait_for_server(rospy.Duration(0.1)), 30))
        self.client.send_goal(goal())
        self.assertTrue(wait_for(lambda: self.client.get_state() == GoalStatus.ACTIVE, 30))
        other.send_goal(goal())
        self.assertTrue(wait_for(lambda: self.client.get_state() >= GoalStatus.PREEMPTED, 60))
        self.assertEqual(self.client.get_result().status, ExploreResult.CANCELLED)
        other.cancel_goal()
        self.assertTrue(wait_for(lambda: other.get_state() >= GoalStatus.PREEMPTED, 60))
        self.assertEqual(other.get_result().status, ExploreResult.CANCELLED)
        self.assertEqual(other.get_result().views, 0)

    def test_8_bounds_that_leave_the_arm_outside_are_a_failure_that_names_links_and_better_bounds(self):
        message = goal()
        message.bounds.min = Point(0.6, -0.8, 0.1)
        result, _ = self.send(message, 60)
        self.assertEqual((result.status, result.views), (ExploreResult.FAILED, 0))
        self.assertIn("the robot cannot move: start: link '", result.message)
        self.assertIn("bounds that hold the arm", result.message)
        self.assertTrue(any("bounds that hold the arm" in line for line in result.warnings), result.warnings)


if __name__ == "__main__":
    rospy.init_node("explore_rostest")
    rostest.rosrun("fv_exploration", "explore", ExploreTest, sys.argv)
