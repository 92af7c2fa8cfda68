"""The marker node: listens to the exploration's messages and publishes one topic for each layer.

A layer is computed only while somebody looks at it; who comes later gets the whole layer, the others what changed.
"""

from __future__ import annotations

import threading
import time

import numpy as np
import rospy
from fv_msgs.msg import Contacts, Evaluation, ExplorationVolume, PlannedPath, Views
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import Image, JointState, PointCloud2
from std_msgs.msg import Header, String
from visualization_msgs.msg import MarkerArray

from fv_common.ros_master import wait_for_master
from fv_common.schema import from_mapping
from fv_viz import presence
from fv_viz.config import VizConfig
from fv_viz.drawing import decisions, legend, packing, shapes
from fv_viz.drawing.evaluation import EvaluationDrawing
from fv_viz.drawing.robot import RobotShapes

EVALUATION_LAYERS = (
    "occupied",
    "free",
    "unknown",
    "frontier",
    "frontier_clusters",
    "void",
    "initial_ellipsoids",
    "ellipsoids",
    "frontier_voids",
    "utility",
)
SOURCES = {
    "views": "views",
    "chosen_view": "views",
    "path": "path",
    "volume": "volume",
    "contacts": "contacts",
}


class _Audience(rospy.SubscribeListener):
    """Notes that a topic has a new subscriber, or one less."""

    def __init__(self, came, left) -> None:
        super().__init__()
        self._came, self._left = came, left

    def peer_subscribe(self, topic_name, topic_publish, peer_publish) -> None:
        self._came()

    def peer_unsubscribe(self, topic_name, num_peers) -> None:
        self._left()


class VizNode:
    """Holds the newest message of each source and which layers must be drawn; one thread draws."""

    def __init__(self) -> None:
        self._config = from_mapping(VizConfig, rospy.get_param("~", {}), "parameters")
        self._drawing = EvaluationDrawing(self._config)
        self._messages: dict[str, object] = {}
        self._joints: dict[str, float] = {}
        self._robot: RobotShapes | None = None
        self._due: dict[str, bool] = {}  # layer -> whole?
        self._held: dict[str, float] = {}  # layer -> resolution of the voxels that RViz holds
        self._audience_changed, self._in_legend = True, None
        self._wake = threading.Condition()
        self._publishers = {name: self._advertise(name) for name in (*EVALUATION_LAYERS, *SOURCES)}
        self._legend = rospy.Publisher("/fv_viz/legend", Image, latch=True, queue_size=1)
        self._state = rospy.Publisher("/fv_viz/state", String, latch=True, queue_size=1)
        self._subscribe()

    def spin(self) -> None:
        """Draw what is due until shutdown."""
        while not rospy.is_shutdown():
            with self._wake:
                if not self._due and not self._audience_changed:
                    self._wake.wait(0.5)
                due, self._due = self._due, {}
                changed, self._audience_changed = bool(due) or self._audience_changed, False
                messages = dict(self._messages)
            if changed:
                self._draw_legend(presence.filled(messages))
            if due:
                self._draw_all(due, messages)

    def _advertise(self, name: str) -> rospy.Publisher:
        kind = PointCloud2 if name == "void" else MarkerArray
        listener = _Audience(lambda: self._request((name,), whole=True), lambda: self._request(()))
        return rospy.Publisher(f"/fv_viz/{name}", kind, listener, queue_size=10)

    def _subscribe(self) -> None:
        subscribe = rospy.Subscriber
        self._subscribers = [
            subscribe("/joint_states", JointState, self._on_joints, queue_size=1),
            subscribe("/fv_exploration/volume", ExplorationVolume, self._on_message, "volume", queue_size=1),
            subscribe("/fv_exploration/views", Views, self._on_message, "views", queue_size=1),
            subscribe("/ompl_planner/path", PlannedPath, self._on_message, "path", queue_size=1),
            subscribe("/hubo_sim/contacts", Contacts, self._on_contacts, queue_size=1),
            subscribe("/fv_exploration/evaluation", numpy_msg(Evaluation), self._on_evaluation, queue_size=1),
        ]

    def _request(self, names, whole: bool = False) -> None:
        with self._wake:
            for name in names:
                self._due[name] = whole or self._due.get(name, False)
            self._audience_changed |= whole or not names
            self._wake.notify()

    def _on_evaluation(self, msg) -> None:
        self._messages["evaluation"] = msg
        self._request(
            (*EVALUATION_LAYERS, "views", "chosen_view", "path")
        )  # the last three may be old news now

    def _on_message(self, msg, source: str) -> None:
        self._messages[source] = msg
        if source == "volume":
            self._drawing.set_bounds(*decisions.corners(msg.bounds))
            self._request(("occupied", "unknown"), whole=True)
        self._request([name for name, wanted in SOURCES.items() if wanted == source])

    def _on_contacts(self, msg) -> None:
        old = self._messages.get("contacts")
        if old is None or list(old.pairs) != list(msg.pairs):
            self._on_message(msg, "contacts")

    def _on_joints(self, msg) -> None:
        if len(msg.name) != len(msg.position):
            rospy.logwarn_throttle(
                30.0,
                "%d names with %d positions on /joint_states: left out",
                len(msg.name),
                len(msg.position),
            )
            return
        self._joints.update(zip(msg.name, msg.position, strict=True))

    def _draw_legend(self, filled: set[str]) -> None:
        """The legend of what somebody looks at and is not empty, when it is other than before."""
        looked_at = {name for name, out in self._publishers.items() if out.get_num_connections()}
        if (looked_at, filled) != self._in_legend:
            self._in_legend = looked_at, filled
            self._legend.publish(legend.image_message(self._config, looked_at, filled))

    def _draw_all(self, due: dict[str, bool], messages: dict[str, object]) -> None:
        started = time.monotonic()
        for name, whole in due.items():
            source = SOURCES.get(name, "evaluation")
            if source in messages and self._publishers[name].get_num_connections():
                try:
                    stale = presence.is_stale(messages, source)
                    self._draw(name, messages[source], whole, stale)
                except (ValueError, IndexError) as error:
                    rospy.logerr("layer %s not drawn, and emptied: %s", name, error)
                    self._empty(name, messages[source].header.frame_id)
        self._state.publish(presence.State.of(messages).to_text())
        rospy.logdebug("%d layers in %.3f s", len(due), time.monotonic() - started)

    def _draw(self, name: str, msg, whole: bool, stale: bool) -> None:
        header = Header(frame_id=msg.header.frame_id or "world")
        if stale:
            out = [shapes.clear(header)]
        elif name in EVALUATION_LAYERS:
            whole = whole or self._held.get(name) != msg.resolution
            out = getattr(self._drawing, name)(header, msg, whole)
            self._held[name] = msg.resolution
        elif name == "path":
            out = decisions.path(header, msg, self._config, self._robot_shapes(), self._joints)
        elif name in ("views", "chosen_view"):
            out = getattr(decisions, name)(header, msg, self._config)
        else:
            out = getattr(decisions, name)(header, msg)
        if isinstance(out, list):
            if whole and name in EVALUATION_LAYERS:
                out = [shapes.clear(header), *out]
            out = packing.PackedMarkers(out)
        self._publishers[name].publish(out)

    def _empty(self, name: str, frame: str) -> None:
        """Take a layer away that cannot be drawn: what is left of an older one would be taken for it."""
        self._held.pop(name, None)  # the next one is sent whole
        header = Header(frame_id=frame or "world")
        if name == "void":
            self._publishers[name].publish(packing.cloud(header, np.empty((0, 3)), np.zeros(3)))
        else:
            self._publishers[name].publish(packing.PackedMarkers([shapes.clear(header)]))

    def _robot_shapes(self) -> RobotShapes | None:
        if self._robot is None and rospy.has_param("/robot_description"):
            try:
                self._robot = RobotShapes(rospy.get_param("/robot_description"))
            except ValueError as error:
                rospy.logwarn_throttle(30.0, "no ghosts: %s", error)
        return self._robot


def main() -> int:
    """Run the node; returns the exit code."""
    wait_for_master("viz_node")
    rospy.init_node("fv_viz")
    try:
        node = VizNode()
    except ValueError as error:
        rospy.logfatal("%s", error)
        return 1
    node.spin()
    return 0
