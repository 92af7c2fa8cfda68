"""How fast RViz draws a million-voxel map: software GL, exploration.rviz; against a cube for each voxel."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import rospkg
import rospy
from fv_msgs.msg import Box, Evaluation, ExplorationVolume
from geometry_msgs.msg import Point
from visualization_msgs.msg import Marker, MarkerArray

from fv_bench.viz import markers
from fv_common.ros_session import RosSession
from fv_viz.config import ScreenshotConfig
from fv_viz.drawing import packing, shapes
from fv_viz.offscreen.camera import Camera

TARGET_S = 0.2  # a frame: 5 frames/s
SHOWN = {"as it opens": [], "and free space": ["Free"], "and free and unknown space": ["Free", "Unknown"]}
LOOK = [6.5, -2.45, 0.55, 0.0, 0.0, 0.3]  # the whole map in the window
CUBES = "/fv_viz/contacts"  # a topic that exploration.rviz shows


def run(quick: bool) -> list[dict]:
    """Rows for scripts/bench: seconds a frame, target 0.2."""
    seconds, runs = (1.0, 1) if quick else (4.0, 3)
    msg = markers.scene(0.04 if quick else 0.0185, 0.0)
    count = sum(len(getattr(msg, name)) // 3 for name in markers.LAYERS)
    with RosSession(verbose="FV_BENCH_VERBOSE" in os.environ) as session:
        rospy.init_node("bench_rviz", anonymous=True, disable_signals=True)
        session.rosrun("fv_viz", "viz_node")
        keep = [_latched("/fv_exploration/volume", _volume()), _latched("/fv_exploration/evaluation", msg)]
        config = Path(rospkg.RosPack().get_path("fv_viz")) / "rviz" / "exploration.rviz"
        camera = Camera(ScreenshotConfig(config=str(config), timeout_s=200.0, settle_s=60.0))
        try:
            frames = {words: _frames(camera, seconds, runs, show=show) for words, show in SHOWN.items()}
            keep.append(_latched(CUBES, packing.PackedMarkers(_cubes(msg)), MarkerArray))
            plain = _frames(camera, 2.0 * seconds, 1, show=["Contacts"], hide=["*"])
        finally:
            camera.close()
    return [
        markers.row(
            f"a frame of {count} voxels, exploration.rviz {words}",
            frames[words],
            plain,
            None if quick else TARGET_S,
            "CUBE_LIST, one cube a voxel",
        )
        | {"bench": "rviz"}
        for words in frames
    ]


def _latched(topic: str, msg, kind: type | None = None) -> rospy.Publisher:
    publisher = rospy.Publisher(topic, kind or type(msg), latch=True, queue_size=1)
    publisher.publish(msg)
    return publisher


def _volume() -> ExplorationVolume:
    high = markers.LOW + markers.SIZE
    return ExplorationVolume(header=markers.HEADER, bounds=Box(Point(*markers.LOW), Point(*high)))


def _frames(camera: Camera, seconds: float, runs: int, **displays: list[str]) -> list[float]:
    """Seconds a frame, once for each run, after the picture has settled."""
    order = {"camera": LOOK, "measure_s": seconds, **displays}
    return [1.0 / max(camera.take(order)["frames_per_s"], 1e-3) for _ in range(runs)]


def _cubes(msg: Evaluation) -> list[bytes]:
    out = []
    for number, name in enumerate(markers.LAYERS):
        points = np.reshape(getattr(msg, name), (-1, 3))
        cubes = shapes.marker(markers.HEADER, name, Marker.CUBE_LIST, (0.2, 0.4, 0.8), 1.0, number)
        cubes.scale.x = cubes.scale.y = cubes.scale.z = msg.resolution
        out.append(packing.pack_marker(cubes, points))
    return out
