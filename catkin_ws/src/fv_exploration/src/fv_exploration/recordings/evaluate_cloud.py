"""The command ``evaluate_cloud``: recorded clouds in, pictures, maps and JSON out."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from fv_common.command import Parser
from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    FilterConfig,
    InputError,
    MapConfig,
    OccupancyMap,
    OutsideKeysError,
    PinholeCamera,
    ScanConfig,
    best_views,
    filter_cloud,
    view_gain,
    write_color_tree,
    write_utility_tree,
)
from fv_exploration.recordings import RecordingError, read_scans
from fv_exploration.recordings.errors import Warn
from fv_exploration.recordings.evaluation_files import result_names, whole_files
from fv_exploration.recordings.evaluation_picture import draw_evaluation
from fv_exploration.returns import Returns

MAX_RAYS = 10_000_000
"""Of Algorithm 1: a whole building has more frontier and more voids than are worth each other's rays."""


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line; numbers in metres."""
    parser = Parser(prog="evaluate_cloud", description=__doc__)
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
    parser.add_argument(
        "--shift",
        type=float,
        nargs=3,
        default=(0.0, 0.0, 0.0),
        metavar=("X", "Y", "Z"),
        help="added to all sensor positions [m], for recordings far from their origin (map coordinates)",
    )
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Evaluate each file; 0, or 1 after one line for each file that cannot be evaluated."""
    options = parse(arguments)
    if not np.isfinite(options.shift).all():
        print(f"evaluate_cloud: --shift is {options.shift}; valid: three finite numbers", file=sys.stderr)
        return 1
    paths = list(dict.fromkeys(Path(os.path.abspath(path)) for path in options.files))
    failed = 0
    for path, name in zip(paths, result_names(paths, options.out), strict=True):
        try:
            evaluate(path, name, options)
        except (RecordingError, InputError, OSError, MemoryError) as error:
            print(f"evaluate_cloud: {error or 'out of memory'}", file=sys.stderr)
            failed += 1
    if failed < len(paths):
        print(f"results: {options.out.resolve()}")
    return 1 if failed else 0


def evaluate(path: Path, name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Map and evaluate one file; writes <out>/<name>.{json,png,ot} and two trees with utility. Returns the JSON."""
    start = time.perf_counter()
    warnings: list[str] = []

    def warn(text: str) -> None:
        warnings.append(text)
        print(f"evaluate_cloud: warning: {text}", file=sys.stderr)

    if name != path.stem:
        print(f"{path}: its results are named {name}, so that those of other files stay")
    occupancy_map = OccupancyMap(MapConfig(resolution_m=options.resolution))
    returns, scans, T_map_sensor = _insert(path, options, occupancy_map, warn)
    evaluator = Evaluator(occupancy_map, EvaluationConfig(min_fit=options.min_fit))
    evaluation = evaluator.update()
    utility = evaluator.utility(options.utility_range, max_rays=MAX_RAYS)
    views = _views(occupancy_map, evaluator, utility, options)
    counts = occupancy_map.counts()  # its map has no bounds: unknown space has no number of voxels
    report = {
        "file": path.name,
        "path": str(path),
        "warnings": warnings,
        "scans": scans,
        "points": returns.counts(),
        "resolution_m": options.resolution,
        "shift_m": list(options.shift),
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
    with whole_files(options.out, name) as beginning:
        occupancy_map.write_ot(f"{beginning}.ot")
        write_utility_tree(occupancy_map, utility, f"{beginning}_utility.ot")
        write_color_tree(occupancy_map, utility, f"{beginning}_utility_colors.ot")
        draw_evaluation(occupancy_map, evaluation, views, T_map_sensor, f"{beginning}.png")
        Path(f"{beginning}.json").write_text(json.dumps(report, indent=1) + "\n")
    print(
        f"{path.name}: {scans} scans, {report['voxels']}, {len(evaluation.ellipsoids)} void clusters, "
        f"{report['frontier_clusters']} frontier clusters, {report['seconds']['total']:.2f} s"
    )
    return report


def _insert(
    path: Path, options: argparse.Namespace, occupancy_map: OccupancyMap, warn: Warn
) -> tuple[Returns, int, np.ndarray]:
    """Insert all scans of a file; returns what became of their points, their number and the last sensor pose.

    :raises RecordingError: when none of the points can be used, saying why.
    """
    limits = ScanConfig(max_range_m=options.max_range)
    returns, scans, pose = Returns(limits), 0, np.eye(4)
    for scan in read_scans(path, options.topic, options.map_frame, warn):
        pose = scan.T_map_sensor.copy()
        pose[:3, 3] += options.shift
        try:
            counts = _inserted(scan.points_sensor, pose, limits, options.outliers, occupancy_map)
        except OutsideKeysError as error:
            raise RecordingError(f"{path}: {error} (--shift X Y Z)") from error
        returns.add(scan.points_sensor, counts)
        scans += 1
    if returns.problem():
        raise RecordingError(f"{path}: {returns.problem()}")
    for text in (*returns.warnings(), *returns.clipped()):
        warn(f"{path}: {text}")
    return returns, scans, pose


def _inserted(
    points: np.ndarray, pose: np.ndarray, limits: ScanConfig, neighbours: int, occupancy_map: OccupancyMap
) -> dict[str, int]:
    """Insert a scan; what became of its points."""
    if not neighbours:
        return occupancy_map.insert_scan(points, pose, limits).counts
    kept = filter_cloud(points, FilterConfig(outlier_neighbours=neighbours))
    finite = int(np.isfinite(points).all(axis=1).sum())
    counts = occupancy_map.insert_scan(kept, pose, limits).counts
    own = {"points": len(points), "no_return": len(points) - finite, "filtered": finite - len(kept)}
    return {**counts, **own}


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
