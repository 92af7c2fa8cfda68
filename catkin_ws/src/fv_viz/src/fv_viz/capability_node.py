"""The command `capability_markers`: shows a capability map in RViz (rviz/capability.rviz)."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import rospy
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from fv_viz import capability, colors, packing, shapes
from fv_viz.figures import sources


def main(arguments: list[str] | None = None) -> int:
    """Publish until shutdown; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="rosrun fv_viz capability_markers", description="Show a capability map."
    )
    parser.add_argument("map", type=Path, help="file that rosrun capability_map build made")
    parser.add_argument(
        "--every", type=int, default=1, metavar="K", help="spikes of every K-th sphere only (%(default)s)"
    )
    options = parser.parse_args(rospy.myargv(arguments or sys.argv)[1:])
    try:
        spheres = sources.capability(options.map)
    except (sources.NoData, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    rospy.init_node("fv_capability_markers")
    keep = [_latched(name, blobs) for name, blobs in layers(spheres, max(options.every, 1)).items()]
    rospy.loginfo("%d spheres on %d topics below /fv_viz/capability", len(spheres.centers), len(keep))
    rospy.spin()
    return 0


def layers(s: sources.Spheres, every: int) -> dict[str, list[bytes]]:
    """Markers of each topic: spikes, the two cuts of the index, and the structure of each sphere in the cuts."""
    header = Header(frame_id=s.base_frame)
    cut = capability.near_planes(s.centers, s.shoulder, s.radius)
    some = np.arange(len(s.centers)) % every == 0
    return {
        "spheres": capability.spikes(header, s.centers[some], s.valid[some], s.directions, s.radius),
        "index": capability.balls(header, s.centers[cut], s.valid[cut], s.radius),
        "shapes": structures(s, np.flatnonzero(cut)),
    }


def structures(s: sources.Spheres, rows: np.ndarray) -> list[bytes]:
    """Cones, double cones and rings of some spheres, one colour for each kind; none for a map without."""
    header, tones = (
        Header(frame_id=s.base_frame),
        {"cone": "views", "double cone": "clearance", "ring": "void"},
    )
    out = []
    for number, row in enumerate(rows if len(s.kinds) else ()):
        kind = sources.KINDS[s.kinds[row]]
        if kind in tones:
            form = (s.centers[row], s.axes[row], s.openings[row], kind, 0.7 * s.radius)
            out.append(capability.structure(header, *form, colors.rgb(tones[kind]), number))
    return out


def _latched(name: str, blobs: list[bytes]) -> rospy.Publisher:
    publisher = rospy.Publisher(f"/fv_viz/capability/{name}", MarkerArray, latch=True, queue_size=1)
    publisher.publish(packing.PackedMarkers([shapes.clear(Header()), *blobs]))
    return publisher
