"""The stage for figures: a ROS master of its own, the marker node, and RViz with a camera; all end with it."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import rospkg
import rospy
from fv_msgs.msg import Evaluation, ExplorationVolume, PlannedPath
from PIL import Image as Picture
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from fv_common.ros_session import Node, RosSession
from fv_viz.config import ScreenshotConfig
from fv_viz.drawing import packing, shapes
from fv_viz.offscreen.camera import Camera
from fv_viz.presence import State

FRAME = Header(frame_id="world")
PATIENCE_S = 120.0  # for a node to do what it was told: only a node that is dead needs as long
SETTLE_S = 20.0  # for a picture to come to rest; as short as it can be where nothing is late
# Of the marker node: solid frontiers and a visible skin of free space on paper, every void voxel, and the roof too.
SETTINGS = {"frontier_alpha": 1.0, "free_alpha": 0.45, "max_dots": 200_000, "ghosts": 6, "roof_m": 0.0}


class Stage:
    """Use as a context, one in a process. RViz starts with the first picture.

    Raises RuntimeError when the master does not come up.
    """

    def __init__(self, width: int = 960, height: int = 720) -> None:
        self._size = width, height
        self._session = RosSession(verbose="FV_FIGURES_VERBOSE" in os.environ)
        self._publishers: dict[str, rospy.Publisher] = {}
        self._folder = tempfile.TemporaryDirectory()
        self._sequence, self._state = 0, State()
        self._others: dict[str, bool] = {}  # topic that is not the marker node's -> something is shown on it
        self._joint_timer: rospy.Timer | None = None
        self.errors: list[str] = []

    def __enter__(self) -> Stage:
        try:
            self._open()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_) -> None:
        if self._joint_timer:
            self._joint_timer.shutdown()
        if hasattr(self, "_camera"):
            self._camera.close()
        self._session.__exit__()
        self._folder.cleanup()

    @property
    def aspect(self) -> float:
        """Width over height of its pictures."""
        return self._size[0] / self._size[1]

    def run(self, package: str, program: str, *arguments: str) -> Node:
        """Start a node of this stage."""
        return self._session.rosrun(package, program, *arguments)

    def wait_for(self, topic: str, timeout_s: float = PATIENCE_S) -> None:
        """Wait until a node publishes markers on a topic. Raises RuntimeError when none does."""
        try:
            rospy.wait_for_message(topic, MarkerArray, timeout=timeout_s)
        except rospy.ROSException as error:
            raise RuntimeError(f"no markers on {topic} within {timeout_s:g} s") from error

    def wait_for_frames(self, timeout_s: float = PATIENCE_S) -> None:
        """Wait until the robot's moving frames are published: RViz drops markers that come before their frame.

        Raises RuntimeError when they are not.
        """
        try:
            rospy.wait_for_message("/tf", TFMessage, timeout=timeout_s)
        except rospy.ROSException as error:
            raise RuntimeError(f"no frames of the robot within {timeout_s:g} s") from error

    def evaluation(self, msg: Evaluation) -> None:
        """Have an evaluation drawn."""
        self._sequence += 1
        msg.map_sequence = self._sequence
        self.publish("/fv_exploration/evaluation", msg)
        self._wait_until(lambda: self._state.map_sequence == self._sequence, "a map")

    def volume(self, msg: ExplorationVolume) -> None:
        """Set the exploration volume."""
        self.publish("/fv_exploration/volume", msg)
        self._wait_until(lambda: "volume" in self._state.filled, "the exploration volume")

    def path(self, msg: PlannedPath) -> None:
        """Show a planned path."""
        self.publish("/ompl_planner/path", msg)
        self._wait_until(lambda: "path" in self._state.filled, "a path")

    def joints(self, positions: dict[str, float]) -> None:
        """Move the robot of the robot model; robot_state_publisher turns it into frames, again and again."""
        names, values = list(positions), list(positions.values())

        def tell(_) -> None:
            header = Header(stamp=rospy.Time.now())
            self.publish("/joint_states", JointState(header=header, name=names, position=values))

        if self._joint_timer:
            self._joint_timer.shutdown()
        self._joint_timer = rospy.Timer(rospy.Duration(0.1), tell)

    def cloud(self, msg: PointCloud2) -> None:
        """Show a cloud of points."""
        self.publish("/fv_viz/figure_cloud", msg)
        self._others["/fv_viz/figure_cloud"] = msg.width > 0

    def publish(self, topic: str, msg) -> None:
        """Publish a message, latched."""
        self._publisher(topic, type(msg)).publish(msg)

    def draw(self, blobs: list[bytes], topic: str = "/fv_viz/figure") -> None:
        """Show serialised markers and nothing else on a topic."""
        self._publisher(topic, MarkerArray).publish(packing.PackedMarkers([shapes.clear(FRAME), *blobs]))
        self._others[topic] = bool(blobs)

    def expected(self) -> list[str]:
        """Topics on which RViz must have got something before a picture is taken."""
        return self._state.topics() + [topic for topic, is_filled in self._others.items() if is_filled]

    def take(self, show: list[str], camera: list[float]) -> Picture.Image:
        """A picture with only these displays, from a camera as in fv_msgs/Screenshot."""
        path = os.path.join(self._folder.name, "shot.png")
        order = {"grab": path, "show": show, "hide": ["*"], "camera": camera, "expect": self.expected()}
        reply = self._camera.take({**order, "settle_s": SETTLE_S})
        self.errors += reply["errors"] + reply["absent"]
        return Picture.open(path).convert("RGB")

    def _open(self) -> None:
        os.environ.setdefault("ROS_HOME", os.path.join(self._folder.name, "ros"))
        os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")
        self._session.__enter__()
        rospy.init_node("figures", anonymous=True, disable_signals=True)
        rviz = Path(rospkg.RosPack().get_path("fv_figures")) / "rviz" / "figures.rviz"
        self._session.rosrun("fv_viz", "viz_node", *(f"_{name}:={value}" for name, value in SETTINGS.items()))
        self._subscriber = rospy.Subscriber("/fv_viz/state", String, self._on_state, queue_size=1)
        width, height = self._size
        self._camera = Camera(ScreenshotConfig(config=str(rviz), width=width, height=height))

    def _on_state(self, msg: String) -> None:
        self._state = State.from_text(msg.data)

    def _wait_until(self, is_drawn: Callable[[], bool], what: str) -> None:
        """Wait for the marker node. Raises RuntimeError when it does not draw what was published."""
        deadline = time.monotonic() + PATIENCE_S
        while not is_drawn():
            if time.monotonic() > deadline:
                raise RuntimeError(f"the marker node has not drawn {what} within {PATIENCE_S:g} s")
            time.sleep(0.02)

    def _publisher(self, topic: str, kind: type) -> rospy.Publisher:
        if topic not in self._publishers:
            self._publishers[topic] = rospy.Publisher(topic, kind, latch=True, queue_size=2)
        return self._publishers[topic]
