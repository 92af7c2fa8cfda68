"""Markers of a million-voxel map: whole, and after one more scan; against one Python object for each voxel."""

from __future__ import annotations

import io
import time
from collections.abc import Callable

import numpy as np
from fv_msgs.msg import Evaluation
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from fv_viz.config import VizConfig
from fv_viz.drawing import packing
from fv_viz.drawing.evaluation import EvaluationDrawing

HEADER = Header(frame_id="world")
LAYERS = ("occupied", "free", "frontier")
NAIVE = "one Point and ColorRGBA object a voxel, CUBE_LIST"
LOW, SIZE = np.array([-2.0, -2.0, -0.8]), np.array([4.0, 4.0, 2.6])


def run(quick: bool) -> list[dict]:
    """Rows for scripts/bench: seconds for all markers of a map (target 1.5), and for those of one scan (target 0.1)."""
    resolution, runs = (0.04, 3) if quick else (0.0185, 5)
    before, after = scene(resolution, 0.0), scene(resolution, 0.12)
    count = sum(len(getattr(before, name)) // 3 for name in LAYERS)
    naive = timed(lambda: one_object_each(before), 1 if quick else 2)
    whole = timed(lambda: draw(EvaluationDrawing(VizConfig()), before), runs)
    drawing = EvaluationDrawing(VizConfig())
    draw(drawing, before)
    scans = [after, before] * runs
    update = [timed(lambda scan=scan: draw(drawing, scan), 1)[0] for scan in scans]
    return [
        row(f"all markers of {count} voxels", whole, naive, None if quick else 1.5, NAIVE),
        row("markers of one more scan", update, naive, None if quick else 0.1, NAIVE),
    ]


def row(case: str, ours: list[float], reference: list[float], target_s: float | None, against: str) -> dict:
    """One row; all in seconds."""
    middle, other = float(np.median(ours)), float(np.median(reference))
    spread = float(max(ours) - min(ours))
    out = {
        "bench": "markers",
        "case": case,
        "ours": middle,
        "reference": other,
        "unit": "s",
        "ratio": other / middle,
    }
    out |= {"reference_name": against, "spread": spread, "runs": len(ours)}
    return out | {"target": target_s, "met": None if target_s is None else middle <= target_s}


def timed(work: Callable[[], object], runs: int) -> list[float]:
    """Seconds of each run."""
    out = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        out.append(time.perf_counter() - start)
    return out


def draw(drawing: EvaluationDrawing, msg: Evaluation) -> None:
    """Everything between the message and the bytes on the wire."""
    for name in LAYERS:
        packing.PackedMarkers(getattr(drawing, name)(HEADER, msg, False)).serialize(io.BytesIO())


def one_object_each(msg: Evaluation) -> None:
    """The plain way, as the reference."""
    for number, name in enumerate(LAYERS):
        marker = Marker(header=HEADER, ns=name, id=number, type=Marker.CUBE_LIST)
        points = np.reshape(getattr(msg, name), (-1, 3)).tolist()
        marker.points = [Point(*p) for p in points]
        marker.colors = [ColorRGBA(0.1, 0.2, min(max(p[2], 0.0), 1.0), 1.0) for p in points]
        MarkerArray([marker]).serialize(io.BytesIO())


def scene(resolution: float, extra_m: float) -> Evaluation:
    """A cluttered room seen from its middle; extra_m: how much further one more scan sees in one sector."""
    axes = [np.arange(round(s / resolution)) for s in SIZE]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    x, y, z = np.moveaxis((cells + 0.5) * resolution + LOW, -1, 0)
    turn, reach = np.arctan2(y, x), np.sqrt(x**2 + y**2 + z**2)
    seen = reach < 1.3 + 0.25 * np.sin(3 * turn) + extra_m * ((turn > 0.2) & (turn < 0.5))
    solid = (z < -0.76) | (np.sin(7 * x) + np.sin(6 * y) + np.sin(8 * z) > 2.2)
    free, hit = seen & ~solid, seen & solid & beside(~solid)
    frontier = free & beside(~(free | hit))
    msg = Evaluation(header=HEADER, resolution=resolution)
    for name, mask in (("occupied", hit), ("free", free), ("frontier", frontier)):
        setattr(msg, name, (((cells[mask] + 0.5) * resolution) + LOW).astype(np.float32).ravel())
    return msg


def beside(mask: np.ndarray) -> np.ndarray:
    """Cells with a 6-neighbour in the mask."""
    out = np.zeros_like(mask)
    for axis in range(3):
        lead, rest = [slice(None)] * 3, [slice(None)] * 3
        lead[axis], rest[axis] = slice(1, None), slice(None, -1)
        out[tuple(lead)] |= mask[tuple(rest)]
        out[tuple(rest)] |= mask[tuple(lead)]
    return out
