"""Insertion of scans against OctoMap's insertPointCloud (lazy_eval=false, discretize=false)."""

from __future__ import annotations

from typing import Any

import numpy as np

from fv_bench.exploration.scene import Room, camera_rays, look, row, scan, timed
from fv_exploration import MapConfig, OccupancyMap
from fv_exploration.reference import ReferenceMap


def kinect_scene() -> tuple[np.ndarray, np.ndarray]:
    """A 640x480 frame of a table top with objects, 0.6-1.5 m away: points and pose."""
    room = Room((1.6, 1.6, 1.2), seed=4, furniture=10)
    pose = look(np.array([0.1, 0.8, 1.05]), 0.0, -0.5)
    return scan(room, pose, camera_rays(640, 480), 0.002), pose


def lidar_scene() -> tuple[np.ndarray, np.ndarray]:
    """A 64-ring scan of a hall of 24 x 16 x 5 m: 115 200 points."""
    room = Room((24.0, 16.0, 5.0), seed=2, furniture=30)
    angle, tilt = np.meshgrid(np.linspace(0, 2 * np.pi, 1800, False), np.linspace(-0.4, 0.4, 64))
    rays = np.stack([np.cos(tilt) * np.cos(angle), np.cos(tilt) * np.sin(angle), np.sin(tilt)], -1).reshape(
        -1, 3
    )
    pose = np.eye(4)
    pose[:3, 3] = [12.3, 8.1, 1.6]
    return scan(room, pose, rays, 0.01), pose


def compare(
    case: str, points: np.ndarray, pose: np.ndarray, config: dict[str, Any], **how: Any
) -> list[dict]:
    """Rows of time and of differing voxels; `repeated`: into a map that already has the scan."""
    ours, reference, differing = [], [], 0
    map_points = (points @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)
    grid = plain = None
    for run in range(how["runs"] + how["repeated"]):
        if grid is None or not how["repeated"]:
            grid, plain = OccupancyMap(MapConfig(**config)), ReferenceMap(MapConfig(**config))
        seconds, _ = timed(lambda grid=grid: grid.insert_scan(points, pose))
        other = plain.insert(map_points, pose[:3, 3].astype(np.float32))
        if how["repeated"] and run == 0:
            continue
        ours.append(seconds)
        reference.append(other)
    differing = plain.differing(grid)
    name = "OctoMap insertPointCloud"
    return [
        row("insertion", case, ours, reference, reference_name=name, target=how["target"]),
        row("insertion", f"{case}: differing voxels", [differing], unit="voxels", target=0, at_most=True),
    ]


def run(quick: bool) -> list[dict]:
    """Rows; the first rows of a case are times, the second the voxels that differ."""
    runs = 3 if quick else 7
    points, pose = kinect_scene()
    rows = []
    for threads, target in ((2, 10), (1, 5)):
        config = {"resolution_m": 0.02, "threads": threads}
        case = f"640x480 frame, 2 cm, {threads} threads"
        rows += compare(case, points, pose, config, runs=runs, repeated=False, target=target)
    points, pose = lidar_scene()
    config = {"resolution_m": 0.05, "threads": 2}
    rows += compare("hall scan, 5 cm, repeated", points, pose, config, runs=runs, repeated=True, target=10)
    return rows
