"""The screenshot node: the service /fv_viz/screenshot."""

from __future__ import annotations

import dataclasses
import os
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import rospkg
import rospy
from fv_msgs.msg import ExplorationVolume, Views
from fv_msgs.srv import Screenshot, ScreenshotRequest, ScreenshotResponse
from PIL import Image as Picture
from std_msgs.msg import String

from fv_common.ros_master import wait_for_master
from fv_common.schema import from_mapping
from fv_viz.config import ScreenshotConfig, VizConfig
from fv_viz.drawing import decisions, framing, legend
from fv_viz.offscreen.camera import Camera
from fv_viz.presence import State


class ScreenshotNode:
    """Serves one picture at a time."""

    def __init__(self) -> None:
        config = from_mapping(ScreenshotConfig, rospy.get_param("~", {}), "parameters")
        if not config.config:
            folder = rospkg.RosPack().get_path("fv_viz")
            config = dataclasses.replace(config, config=os.path.join(folder, "rviz", "exploration.rviz"))
        if not os.path.isfile(config.config):
            raise ValueError(f"no RViz configuration {config.config}")
        self._config = config
        self._camera = Camera(config)
        self._lock = threading.Lock()
        self._state: State | None = None  # None: no marker node has said anything yet
        self._views: Views | None = None
        self._volume: ExplorationVolume | None = None
        self._subscribers = [
            rospy.Subscriber("/fv_viz/state", String, self._on_state, queue_size=1),
            rospy.Subscriber("/fv_exploration/views", Views, self._on_views, queue_size=1),
            rospy.Subscriber("/fv_exploration/volume", ExplorationVolume, self._on_volume, queue_size=1),
        ]
        self._start()
        self._service = rospy.Service("/fv_viz/screenshot", Screenshot, self._serve)

    def close(self) -> None:
        """End RViz and its display."""
        with self._lock:
            self._camera.close()

    def _start(self) -> None:
        try:
            self._camera.start()
        except RuntimeError as error:
            rospy.logwarn("%s; the first picture tries again", error)

    def _on_state(self, msg: String) -> None:
        self._state = State.from_text(msg.data)

    def _on_views(self, msg: Views) -> None:
        self._views = msg

    def _on_volume(self, msg: ExplorationVolume) -> None:
        self._volume = msg

    def _look(self, request: ScreenshotRequest) -> list[float]:
        """The camera asked for; without any, one that sees the exploration volume cut open."""
        if request.camera or request.preset or self._volume is None:
            return list(request.camera)
        low, high = decisions.corners(self._volume.bounds)
        config, turn = self._config, np.deg2rad([self._config.view_yaw_deg, self._config.view_pitch_deg])
        cut_m = config.view_cut * float(np.linalg.norm(high - low))
        return framing.orbit(framing.corners(low, high), *turn, config.width / config.height, cut_m)

    def _heading(self, request: ScreenshotRequest) -> tuple[str, list[str]]:
        """Title and facts of the request, and what is expected of the view that is taken next while there is one."""
        views, facts = self._views, list(request.facts)
        asked = bool(request.title or facts)
        if views is None or (self._state and "chosen_view" not in self._state.filled):
            return request.title, facts
        if not asked:
            facts.append(f"{len(views.views)} candidates")
        if 0 <= views.chosen < len(views.views):
            facts.append(f"next: {decisions.expectation(views.views[views.chosen])}")
        return request.title if asked else f"View {views.view_number}", facts

    def _serve(self, request: ScreenshotRequest) -> ScreenshotResponse:
        with self._lock:
            try:
                reply, path = self._picture(request)
            except (ValueError, OSError, RuntimeError) as error:
                rospy.logwarn("no picture: %s", error)
                return ScreenshotResponse(success=False, message=str(error))
        return ScreenshotResponse(True, path, reply["errors"])

    def _picture(self, request: ScreenshotRequest) -> tuple[dict, str]:
        if not request.path:
            raise ValueError("no path for the picture")
        path = Path(self._config.out_dir) / request.path
        path.parent.mkdir(parents=True, exist_ok=True)
        self._wait_for_map(request.map_sequence)
        with tempfile.TemporaryDirectory() as folder:
            raw = os.path.join(folder, "raw.png")
            expect = self._state.topics() if self._state else []
            order = {"grab": raw, "preset": request.preset, "camera": self._look(request), "expect": expect}
            reply = self._camera.take({**order, "show": list(request.show), "hide": list(request.hide)})
            for line in reply["absent"]:
                rospy.logwarn("the picture lacks a layer: %s", line)
            layers = [] if request.no_legend else [t.rsplit("/", 1)[-1] for t in reply["topics"]]
            marking = from_mapping(VizConfig, rospy.get_param("/fv_viz", {}), "parameters of /fv_viz")
            lines = legend.lines(marking, layers, self._state.filled if self._state else None)
            picture = legend.framed(Picture.open(raw).convert("RGB"), *self._heading(request), lines)
        picture.save(path, "PNG")
        return reply, str(path)

    def _wait_for_map(self, sequence: int) -> None:
        """Wait for the markers of a map and of the newest decision; after the time a picture shows what there is."""
        started = time.monotonic()
        while not self._is_drawn(sequence) and not rospy.is_shutdown():
            # A marker node that has never said anything is probably not there.
            limit_s = self._config.settle_s if self._state is None else self._config.timeout_s
            if time.monotonic() > started + limit_s:
                rospy.logwarn(
                    "the picture shows %s, not map %d as asked", self._state or "no markers", sequence
                )
                return
            time.sleep(0.05)

    def _is_drawn(self, sequence: int) -> bool:
        views_ns = self._views.header.stamp.to_nsec() if self._views else 0
        if self._state is None:
            return sequence == 0
        return self._state.map_sequence >= sequence and self._state.views_ns >= views_ns


def main() -> int:
    """Run the node; returns the exit code."""
    wait_for_master("screenshot_node")
    rospy.init_node("fv_screenshot")
    try:
        node = ScreenshotNode()
    except (ValueError, RuntimeError) as error:
        rospy.logfatal("%s", error)
        return 1
    rospy.spin()
    node.close()
    return 0
