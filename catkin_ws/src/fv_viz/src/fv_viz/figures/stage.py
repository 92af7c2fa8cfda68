"""The stage for figures: a ROS master of its own, the marker node, and RViz with a camera; all end with it."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rospkg
import rospy
from fv_msgs.msg import Evaluation, ExplorationVolume, PlannedPath
from PIL import Image as Picture
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header, UInt64
from visualization_msgs.msg import MarkerArray

from fv_viz import packing, shapes
from fv_viz.config import ScreenshotConfig
from fv_viz.offscreen import processes
from fv_viz.offscreen.camera import Camera

FRAME = Header(frame_id="world")


def free_port() -> int:
    """A TCP port that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


class Stage:
    """Use as a context. Raises RuntimeError when a node or the display does not come up."""

    def __init__(self, width: int = 960, height: int = 720) -> None:
        self._size = width, height
        self._children: list[subprocess.Popen] = []
        self._publishers: dict[str, rospy.Publisher] = {}
        self._folder = tempfile.TemporaryDirectory()
        self._drawn = self._sequence = 0
        self.errors: list[str] = []

    def __enter__(self) -> Stage:
        try:
            self._open()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_) -> None:
        if hasattr(self, "_camera"):
            self._camera.close()
        for child in reversed(self._children):
            processes.stop(child)
        self._folder.cleanup()

    def run(self, package: str, program: str, *arguments: str) -> subprocess.Popen:
        """Start a node of this stage."""
        return self._start("rosrun", package, program, *arguments)

    def evaluation(self, msg: Evaluation) -> None:
        """Have an evaluation drawn."""
        self._sequence += 1
        msg.map_sequence = self._sequence
        self.publish("/fv_exploration/evaluation", msg)
        deadline = time.monotonic() + 20.0
        while self._drawn != self._sequence and time.monotonic() < deadline:
            time.sleep(0.02)
        if self._drawn != self._sequence:
            raise RuntimeError("the marker node does not draw")

    def volume(self, msg: ExplorationVolume) -> None:
        """Set the exploration volume."""
        self.publish("/fv_exploration/volume", msg)

    def path(self, msg: PlannedPath) -> None:
        """Show a planned path."""
        self.publish("/ompl_planner/path", msg)

    def joints(self, positions: dict[str, float]) -> None:
        """Move the robot of the robot model; robot_state_publisher turns it into frames."""
        stamp = rospy.Time.now()
        for _ in range(3):
            names, values = list(positions), list(positions.values())
            self.publish("/joint_states", JointState(header=Header(stamp=stamp), name=names, position=values))
            time.sleep(0.1)
            stamp = rospy.Time.now()

    def cloud(self, msg: PointCloud2) -> None:
        """Show a cloud of points."""
        self.publish("/fv_viz/figure_cloud", msg)

    def publish(self, topic: str, msg) -> None:
        """Publish a message, latched."""
        self._publisher(topic, type(msg)).publish(msg)

    def draw(self, blobs: list[bytes], topic: str = "/fv_viz/figure") -> None:
        """Show serialised markers and nothing else on a topic."""
        self._publisher(topic, MarkerArray).publish(packing.PackedMarkers([shapes.clear(FRAME), *blobs]))

    def take(self, show: list[str], camera: list[float]) -> Picture.Image:
        """A picture with only these displays, from a camera as in fv_msgs/Screenshot."""
        path = os.path.join(self._folder.name, "shot.png")
        reply = self._camera.take(
            {"grab": path, "show": show, "hide": ["*"], "camera": camera, "settle_s": 8.0}
        )
        self.errors += reply["errors"]
        return Picture.open(path).convert("RGB")

    def _open(self) -> None:
        port = free_port()
        os.environ["ROS_MASTER_URI"], os.environ["ROS_HOSTNAME"] = f"http://localhost:{port}", "localhost"
        os.environ.setdefault("ROS_HOME", os.path.join(self._folder.name, "ros"))
        os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")
        self._start("roscore", "-p", str(port))
        _wait_for_master(port)
        rospy.init_node("figures", anonymous=True, disable_signals=True)
        rviz = Path(rospkg.RosPack().get_path("fv_viz")) / "rviz" / "figures.rviz"
        self._start("rosrun", "fv_viz", "viz_node", "_frontier_alpha:=1.0", "_max_dots:=200000", "_ghosts:=6")
        self._subscriber = rospy.Subscriber("/fv_viz/drawn", UInt64, self._on_drawn, queue_size=1)
        width, height = self._size
        self._camera = Camera(ScreenshotConfig(config=str(rviz), width=width, height=height))
        self._camera.start()

    def _start(self, *command: str) -> subprocess.Popen:
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        if os.environ.get("FV_FIGURES_VERBOSE"):
            quiet = {"stdout": sys.stderr, "stderr": sys.stderr}
        self._children.append(subprocess.Popen(command, preexec_fn=processes.die_with_parent, **quiet))
        return self._children[-1]

    def _on_drawn(self, msg: UInt64) -> None:
        self._drawn = msg.data

    def _publisher(self, topic: str, kind: type) -> rospy.Publisher:
        if topic not in self._publishers:
            self._publishers[topic] = rospy.Publisher(topic, kind, latch=True, queue_size=2)
        return self._publishers[topic]


def _wait_for_master(port: int, timeout_s: float = 20.0) -> None:
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        with socket.socket() as probe:
            if probe.connect_ex(("localhost", port)) == 0:
                return
        time.sleep(0.1)
    raise RuntimeError(f"no ROS master within {timeout_s:g} s")
