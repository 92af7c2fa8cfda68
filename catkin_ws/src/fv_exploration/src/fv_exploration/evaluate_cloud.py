"""The command ``evaluate_cloud``: recorded clouds in, pictures, maps and JSON out."""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    FilterConfig,
    InputError,
    MapConfig,
    OccupancyMap,
    PinholeCamera,
    ScanConfig,
    best_views,
    filter_cloud,
    view_gain,
    write_color_tree,
    write_utility_tree,
)
from fv_exploration.evaluation_picture import draw_evaluation
from fv_exploration.recordings import RecordingError, read_scans

MAX_RAYS = 10_000_000
"""Of Algorithm 1: a whole building has more frontier and more voids than are worth each other's rays."""


def parse(arguments: list[str]) -> argparse.Namespace:
    """The command line; numbers in metres."""
    parser = argparse.ArgumentParser(prog="evaluate_cloud", description=__doc__)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="PCD, OctoMap .graph, rosbag")
    parser.add_argument("--out", type=Path, default=Path("evaluation"), help="folder for the results")
    parser.add_argument(
        "--resolution", type=float, default=0.05, help="edge of a voxel [m] (default: %(default)s)"
    )
    parser.add_argument("--max-range", type=float, default=5.0, help="farther returns clear only [m]")
    parser.add_argument("--utility-range", type=float, default=3.0, help="s_r of Algorithm 1 [m]")
    parser.add_argument("--min-fit", type=float, default=0.5, help="S that void ellipsoids keep, (0, 1]")
    parser.add_argument("--views", type=int, default=10, help="number of best views (default: %(default)s)")
    parser.add_argument("--outliers", type=int, default=0, help="neighbours of the outlier filter; 0: off")
    parser.add_argument("--topic", default="", help="cloud topic of a bag (default: its only one)")
    parser.add_argument("--map-frame", default="", help="frame of the map in a bag (default: root of its TF)")
    return parser.parse_args(arguments)


def main(arguments: list[str]) -> int:
    """Run; 0, or 1 after one line that says what is wrong."""
    options = parse(arguments)
    try:
        for path in options.files:
            evaluate(path, options)
    except (RecordingError, InputError, OSError) as error:
        print(f"evaluate_cloud: {error}", file=sys.stderr)
        return 1
    print(f"results: {options.out.resolve()}")
    return 0


def evaluate(path: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Map and evaluate one file; writes <out>/<name>.{json,png,ot} and two trees with utility. Returns the JSON."""
    start = time.perf_counter()
    occupancy_map = OccupancyMap(MapConfig(resolution_m=options.resolution))
    scans, T_map_sensor = _insert(path, options, occupancy_map)
    evaluator = Evaluator(occupancy_map, EvaluationConfig(min_fit=options.min_fit))
    evaluation = evaluator.update()
    utility = evaluator.utility(options.utility_range, max_rays=MAX_RAYS)
    views = _views(occupancy_map, evaluator, utility, options)
    counts = occupancy_map.counts()  # its map has no bounds: unknown space has no number of voxels
    report = {
        "file": path.name,
        "scans": scans,
        "resolution_m": options.resolution,
        "voxels": {
            "occupied": counts["occupied"],
            "free": counts["free"],
            "frontier": len(evaluation.frontier),
            "void": len(evaluation.void),
        },
        "frontier_clusters": evaluation.frontier_clusters,
        "frontier_voids": len(evaluation.frontier_voids),
        "ellipsoids": [_ellipsoid(e) for e in evaluation.ellipsoids[:100]],
        "views": views,
        "seconds": {"total": time.perf_counter() - start, **evaluation.timings},
    }
    options.out.mkdir(parents=True, exist_ok=True)
    stem = options.out / path.stem
    occupancy_map.write_ot(f"{stem}.ot")
    write_utility_tree(occupancy_map, utility, f"{stem}_utility.ot")
    write_color_tree(occupancy_map, utility, f"{stem}_utility_colors.ot")
    draw_evaluation(occupancy_map, evaluation, views, T_map_sensor, f"{stem}.png")
    Path(f"{stem}.json").write_text(json.dumps(report, indent=1) + "\n")
    print(
        f"{path.name}: {scans} scans, {report['voxels']}, {len(evaluation.ellipsoids)} void clusters, "
        f"{report['frontier_clusters']} frontier clusters, {report['seconds']['total']:.2f} s"
    )
    return report


def _insert(path: Path, options: argparse.Namespace, occupancy_map: OccupancyMap) -> tuple[int, np.ndarray]:
    """Insert all scans of a file; returns their number and the last sensor pose."""
    scan_config = ScanConfig(max_range_m=options.max_range)
    filters = FilterConfig(outlier_neighbours=options.outliers)
    count, returns, pose = 0, 0, np.eye(4)
    for scan in read_scans(path, options.topic, options.map_frame):
        points = filter_cloud(scan.points_sensor, filters) if options.outliers else scan.points_sensor
        occupancy_map.insert_scan(points, scan.T_map_sensor, scan_config)
        count, pose = count + 1, scan.T_map_sensor
        returns += int(np.isfinite(points).all(axis=1).sum())
    if returns == 0:
        raise RecordingError(f"{path}: has no scan with a point in it ({count} scans)")
    return count, pose


def _views(
    occupancy_map: OccupancyMap, evaluator: Evaluator, utility: Any, options: argparse.Namespace
) -> list[dict[str, Any]]:
    """The best views: utility after non-maximum suppression, and what ray casting expects of each."""
    best = best_views(utility, options.views, 4 * options.resolution)
    poses = [looking_along(utility.points[i], utility.direction[i]) for i in best]
    camera = PinholeCamera(width=64, height=48, min_range_m=0.0, max_range_m=options.utility_range)
    gain = view_gain(occupancy_map, evaluator, np.array(poses).reshape(-1, 4, 4), camera)
    return [
        {
            "position_m": utility.points[i].tolist(),
            "direction": utility.direction[i].tolist(),
            "utility_m3": float(utility.utility[i]),
            "void_gain_m3": float(gain.void_volume_m3[k]),
            "unknown_gain_m3": float(gain.unknown_volume_m3[k]),
            "frontier_gain_m2": float(gain.frontier_area_m2[k]),
        }
        for k, i in enumerate(best)
    ]


def looking_along(position: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(4, 4) optical pose whose z axis is the direction; some roll, also for vertical directions."""
    z = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    other = np.eye(3)[np.argmin(np.abs(z))]
    x = np.cross(other, z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    pose[:3, 3] = position
    return pose


def _ellipsoid(row: np.void) -> dict[str, Any]:
    return {name: row[name].tolist() for name in ("center", "semi_axes", "axes", "count", "fit", "volume")}
